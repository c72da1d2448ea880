"""Align the template with the first frame of a capture."""

import logging

import numpy as np
from palpate.capture.files import whole_file
from palpate.capture.tables import read_table
from palpate.estimate.hertz.range import force_onset
from palpate.run.declared import read_declared
from palpate.run.job import naming, run
from palpate.surface.alignment import align_capture, save_alignment, standing_of
from palpate.surface.checks import (
    columns_of,
    require_cloud,
    require_fit,
    require_template,
)
from palpate.surface.options import Alignment
from palpate.surface.template import read_template
from palpate.vision.clouds import read_clouds
from palpate.vision.force import FORCE
from palpate.vision.probe import TIP
from palpate.vision.support_plane import read_plane


def main(snakemake):
    """Write alignment.json."""
    inputs, params = snakemake.input, snakemake.params
    spec, support = read_declared(inputs.object)
    point = spec["points"][snakemake.wildcards.capture.partition("-")[0]]["position_m"]
    with naming(inputs.force):
        force = columns_of(read_table(inputs.force), FORCE)
        onset = force_onset(np.linalg.norm(force, axis=1), onset_force_n=params.onset_force_n)
    plane = read_plane(inputs.plane)
    cloud = read_clouds(inputs.cloud)[0]
    with naming(inputs.cloud):
        require_cloud(cloud.points_m, frame=0)
    template = read_template(inputs.template, unit=spec["template"]["unit"])
    with naming(inputs.template):
        require_template(template)
    with naming(inputs.pose):
        tips = columns_of(read_table(inputs.pose), TIP, frames=len(force))
    radius = params.probe["indenter"]["radius_m"]
    standing = standing_of(support, point, plane, tips[onset], indenter_radius_m=radius)
    options = Alignment.read(params.options)
    with (
        naming(inputs.cloud, "alignment", "cloud", "residual"),
        naming(inputs.object, "support", "points"),
        naming(inputs.pose, "tip"),
    ):
        alignment = align_capture(
            template,
            (cloud.points_m, cloud.normals),
            standing,
            tips,
            onset,
            largest_distance_m=options.largest_distance_m,
            largest_normal_deg=options.largest_normal_deg,
        )
        require_fit(
            alignment,
            template,
            cloud.points_m,
            standing,
            tips[onset],
            options.limits,
            largest_distance_m=options.largest_distance_m,
            indenter_radius_m=radius,
        )
    logging.info("contact in frame %d", alignment.contact_frame)
    logging.info("cloud to template: %.3f mm rms", alignment.residual.rms_m * 1e3)
    with whole_file(snakemake.output.alignment) as part:
        save_alignment(part, alignment)


run(main, snakemake)
