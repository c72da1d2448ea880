"""Motion of the surface's samples in each frame of a capture, against the frames at rest."""

import logging

import numpy as np
from palpate.estimate.direct.motion import observed_motion, rest_frames, save_motion
from palpate.estimate.direct.options import Observation
from palpate.surface.alignment import load_alignment
from palpate.vision.camera import sensor_with_optics
from palpate.vision.clouds import read_clouds
from palpate.vision.probe import AXIS
from palpate.workflow.capture_inputs import read_probe
from palpate.workflow.job import naming, run
from palpate.workflow.object_inputs import read_object


def main(snakemake):
    """Write motion.npz."""
    inputs, params = snakemake.input, snakemake.params
    known = read_object(inputs)[2], load_alignment(inputs.alignment)
    radius = params.probe["indenter"]["radius_m"]
    _, columns, forces = read_probe(inputs.pose, inputs.force, *AXIS)
    tips, axes = np.split(columns, 2, axis=1)
    with naming(inputs.force):
        rest = rest_frames(
            *known, tips, forces, radius_m=radius, onset_force_n=params.onset_force_n
        )
    options = Observation.read(params.options)
    sensor = sensor_with_optics(params.sensor, inputs.get("optics"))
    with naming(inputs.clouds, "clouds", "frames"):
        motion = observed_motion(
            *known,
            read_clouds(inputs.clouds),
            (tips, axes),
            rest,
            sensor,
            options,
            radius_m=radius,
        )
    logging.info("%d samples, %d frames at rest", motion.moved_m.shape[1], len(rest))
    save_motion(snakemake.output.motion, motion)


run(main, snakemake)
