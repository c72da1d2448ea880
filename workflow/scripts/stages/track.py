"""Track the template through a capture."""

import logging

from palpate.capture.files import write_json
from palpate.solid.mesh import read_solid
from palpate.surface.alignment import load_alignment
from palpate.surface.checks import require_cloud, require_contact, require_template
from palpate.surface.series import save_series
from palpate.surface.tracked import Recorded, describe, save_tracked
from palpate.vision.clouds import read_clouds
from palpate.workflow.capture_inputs import read_probe
from palpate.workflow.job import naming, run
from palpate.workflow.object_inputs import read_object
from thesis.tracker.capture import track_capture
from thesis.tracker.options import tracking_options


def main(snakemake):
    """Write tracked-<tracker>.npz, its time series for ParaView, and how it was made."""
    inputs, tracker = snakemake.input, snakemake.wildcards.tracker
    options = tracking_options(snakemake.params.options)
    recorded, times = recording(inputs, snakemake.params.probe["indenter"]["radius_m"])
    with naming(inputs.clouds, "cloud", "frame"), naming(inputs.pose, "tips"):
        tracked = track_capture(recorded, options)
    for k, residual in enumerate(tracked.residual_m):
        logging.info("frame %d: residual %.3f mm", k, residual * 1e3)
    output = snakemake.output
    save_series(output.series, tracked, time_s=times, tips_m=recorded.tips_m)
    save_tracked(output.tracked, tracked)
    write_json(output.description, describe(tracked, tracker=tracker, options=options))


def recording(inputs, radius_m):
    """Read and check what is tracked, and the frames' times [s]."""
    _, support, template = read_object(inputs)
    clouds = read_clouds(inputs.clouds)
    with naming(inputs.clouds):
        for k, (points, _) in enumerate(clouds):
            require_cloud(points, frame=k)
    with naming(inputs.template):
        require_template(template)
    _, columns, forces = read_probe(inputs.pose, inputs.force, "time_s", frames=len(clouds))
    tips, times = columns[:, :3], columns[:, 3]
    alignment = load_alignment(inputs.alignment)
    with naming(inputs.pose, "tip"), naming(inputs.alignment, "contact"):
        require_contact(alignment, template, tips, largest_gap_m=2 * radius_m)
    solid = read_solid(inputs.solid)
    return Recorded(template, solid, support, clouds, tips, forces, radius_m, alignment), times


run(main, snakemake)
