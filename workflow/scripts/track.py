"""Track the template through a capture."""

import logging

import numpy as np
from job import run
from palpate.capture.files import whole_file
from palpate.capture.schema import load_yaml
from palpate.capture.tables import read_table
from palpate.solid.mesh import read_solid
from palpate.surface.alignment import load_alignment
from palpate.surface.capture import Recorded, track_capture
from palpate.surface.template import read_template
from palpate.surface.track import save_tracked
from palpate.vision.clouds import unpack_clouds
from palpate.vision.force import FORCE
from palpate.vision.probe import TIP


def main(snakemake):
    """Write tracked-<tracker>.npz."""
    inputs, spec = snakemake.input, load_yaml(snakemake.input.object)
    with np.load(inputs.clouds, allow_pickle=False) as data:
        clouds = [(cloud.points_m, cloud.normals) for cloud in unpack_clouds(data)]
    recorded = Recorded(
        template=read_template(inputs.template, unit=spec["template"]["unit"]),
        solid=read_solid(inputs.solid),
        support=spec["support"],
        clouds=clouds,
        tips_m=read_table(inputs.pose)[TIP].to_numpy(float),
        forces_n=read_table(inputs.force)[FORCE].to_numpy(float),
        indenter_radius_m=snakemake.params.probe["indenter"]["radius_m"],
        alignment=load_alignment(inputs.alignment),
    )
    tracked = track_capture(recorded, snakemake.params.options)
    for k, residual in enumerate(tracked.residual_m):
        logging.info("frame %d: residual %.3f mm", k, residual * 1e3)
    with whole_file(snakemake.output.tracked) as part:
        save_tracked(part, tracked)


run(main, snakemake)
