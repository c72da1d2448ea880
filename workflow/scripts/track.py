"""Track the template through a capture."""

import json
import logging
from pathlib import Path

import numpy as np
from job import run
from palpate.capture.files import whole_file
from palpate.capture.schema import load_yaml
from palpate.capture.tables import read_table
from palpate.solid.mesh import read_solid
from palpate.surface.alignment import load_alignment
from palpate.surface.capture import Recorded, track_capture
from palpate.surface.series import save_series
from palpate.surface.template import read_template
from palpate.surface.tracked import describe, save_tracked
from palpate.vision.clouds import unpack_clouds
from palpate.vision.force import FORCE
from palpate.vision.probe import TIP


def main(snakemake):
    """Write tracked-<tracker>.npz, its time series for ParaView, and how it was made."""
    inputs, spec = snakemake.input, load_yaml(snakemake.input.object)
    poses = read_table(inputs.pose)
    with np.load(inputs.clouds, allow_pickle=False) as data:
        clouds = [(cloud.points_m, cloud.normals) for cloud in unpack_clouds(data)]
    recorded = Recorded(
        template=read_template(inputs.template, unit=spec["template"]["unit"]),
        solid=read_solid(inputs.solid),
        support=spec["support"],
        clouds=clouds,
        tips_m=poses[TIP].to_numpy(float),
        forces_n=read_table(inputs.force)[FORCE].to_numpy(float),
        indenter_radius_m=snakemake.params.probe["indenter"]["radius_m"],
        alignment=load_alignment(inputs.alignment),
    )
    tracked = track_capture(recorded, snakemake.params.options)
    for k, residual in enumerate(tracked.residual_m):
        logging.info("frame %d: residual %.3f mm", k, residual * 1e3)
    options, tracker = snakemake.params.options, snakemake.wildcards.tracker
    described = json.dumps(describe(tracked, tracker=tracker, options=options), indent=2) + "\n"
    times = poses["time_s"].to_numpy(float)
    output = snakemake.output
    with (
        whole_file(output.description) as description,
        whole_file(output.series) as series,
        whole_file(output.tracked) as part,
    ):
        save_tracked(part, tracked)
        save_series(series, tracked, time_s=times, tips_m=recorded.tips_m)
        Path(description).write_text(described, encoding="utf-8")


run(main, snakemake)
