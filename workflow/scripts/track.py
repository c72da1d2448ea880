"""Track the template through a capture."""

import logging

import numpy as np
from job import run
from palpate.capture.files import whole_file
from palpate.capture.schema import load_yaml
from palpate.capture.tables import read_table
from palpate.surface.alignment import load_alignment
from palpate.surface.capture import track_capture
from palpate.surface.template import read_template
from palpate.surface.track import TrackerOptions, save_tracked
from palpate.vision.clouds import unpack_clouds
from palpate.vision.probe import TIP


def main(snakemake):
    """Write tracked.npz."""
    spec = load_yaml(snakemake.input.object)
    options = dict(snakemake.params.options)
    refine = {key: options.pop(key) for key in ("refine_radius_m", "refine_edge_m")}
    added_points = options.pop("added_points")
    with np.load(snakemake.input.clouds, allow_pickle=False) as data:
        clouds = [(cloud.points_m, cloud.normals) for cloud in unpack_clouds(data)]
    tracked = track_capture(
        read_template(snakemake.input.template, unit=spec["template"]["unit"]),
        clouds,
        read_table(snakemake.input.pose)[TIP].to_numpy(float),
        load_alignment(snakemake.input.alignment),
        indenter_radius_m=snakemake.params.probe["indenter"]["radius_m"],
        added_points=added_points,
        options=TrackerOptions(**options),
        **refine,
    )
    for k, residual in enumerate(tracked.residual_m):
        logging.info("frame %d: residual %.3f mm", k, residual * 1e3)
    with whole_file(snakemake.output.tracked) as part:
        save_tracked(part, tracked)


run(main, snakemake)
