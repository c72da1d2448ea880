"""Align the template with the first frame of a capture."""

import logging

import numpy as np
from palpate.estimate.hertz.indentation import force_onset
from palpate.surface.alignment import align_first, resting_prior, save_alignment
from palpate.surface.checks import require_cloud, require_template
from palpate.surface.options import Aligning
from palpate.vision.clouds import read_clouds
from palpate.vision.support_plane import read_plane
from palpate.workflow.capture_inputs import read_probe
from palpate.workflow.job import naming, run
from palpate.workflow.object_inputs import read_object


def main(snakemake):
    """Write alignment.json."""
    inputs, params = snakemake.input, snakemake.params
    spec, support, template = read_object(inputs)
    point = spec["points"][snakemake.wildcards.capture.partition("-")[0]]
    _, tips, forces = read_probe(inputs.pose, inputs.force)
    size = np.linalg.norm(forces, axis=1)
    with naming(inputs.force):
        onset = force_onset(size, onset_force_n=params.onset_force_n)
    plane = read_plane(inputs.plane)
    cloud = read_clouds(inputs.cloud)[0]
    with naming(inputs.cloud):
        require_cloud(cloud.points_m, frame=0)
    with naming(inputs.template):
        require_template(template)
    radius, press = params.probe["indenter"]["radius_m"], (tips, onset, int(np.argmax(size)))
    with (
        naming(inputs.cloud, "cloud", "residual"),
        naming(inputs.object, "support", "points"),
        naming(inputs.pose, "tip"),
    ):
        resting = resting_prior(template, support, point, plane, *press, indenter_radius_m=radius)
        alignment = align_first(template, cloud, resting, onset, Aligning.read(params.options))
    logging.info("contact in frame %d", alignment.contact_frame)
    logging.info("cloud to template: %.3f mm rms", alignment.rms_m * 1e3)
    save_alignment(snakemake.output.alignment, alignment)


run(main, snakemake)
