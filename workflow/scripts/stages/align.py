"""Align the template with the first frame of a capture."""

import logging

import numpy as np
from palpate.capture.files import whole_file
from palpate.capture.tables import columns_of, read_table
from palpate.estimate.hertz.range import force_onset
from palpate.surface.alignment import save_alignment
from palpate.surface.capture import align_first
from palpate.surface.checks import require_cloud, require_template
from palpate.surface.options import Aligning
from palpate.surface.template import read_template
from palpate.vision.clouds import read_clouds
from palpate.vision.force import FORCE
from palpate.vision.probe import TIP
from palpate.vision.support_plane import read_plane
from palpate.workflow.declared import read_declared
from palpate.workflow.job import naming, run


def main(snakemake):
    """Write alignment.json."""
    inputs, params = snakemake.input, snakemake.params
    spec, support = read_declared(inputs.object)
    point = spec["points"][snakemake.wildcards.capture.partition("-")[0]]
    with naming(inputs.force):
        force = columns_of(read_table(inputs.force), FORCE)
        size = np.linalg.norm(force, axis=1)
        onset = force_onset(size, onset_force_n=params.onset_force_n)
    plane = read_plane(inputs.plane)
    cloud = read_clouds(inputs.cloud)[0]
    with naming(inputs.cloud):
        require_cloud(cloud.points_m, frame=0)
    template = read_template(inputs.template, unit=spec["template"]["unit"])
    with naming(inputs.template):
        require_template(template)
    with naming(inputs.pose):
        tips = columns_of(read_table(inputs.pose), TIP, frames=len(force))
    with (
        naming(inputs.cloud, "alignment", "cloud", "residual"),
        naming(inputs.object, "support", "points"),
        naming(inputs.pose, "tip"),
    ):
        alignment = align_first(
            template,
            support,
            point,
            plane,
            cloud,
            tips,
            onset,
            int(np.argmax(size)),
            Aligning.read(params.options),
            indenter_radius_m=params.probe["indenter"]["radius_m"],
        )
    logging.info("contact in frame %d", alignment.contact_frame)
    logging.info("cloud to template: %.3f mm rms", alignment.residual.rms_m * 1e3)
    with whole_file(snakemake.output.alignment) as part:
        save_alignment(part, alignment)


run(main, snakemake)
