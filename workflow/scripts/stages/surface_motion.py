"""Motion of the surface's samples in each frame of a capture, against the frames at rest."""

import logging

import numpy as np
from palpate.capture.files import whole_file
from palpate.capture.streams import Stream
from palpate.estimate.direct.motion import save_motion
from palpate.estimate.direct.observe import Pictures, observed_motion, rest_frames
from palpate.estimate.direct.options import Observation
from palpate.surface.alignment import load_alignment
from palpate.vision.camera import camera_from_spec, sensor_with_optics
from palpate.vision.clouds import read_clouds
from palpate.vision.flow import uncovered_share
from palpate.vision.foreground import load_masks
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
    pictures = None
    if options.pictures:
        uncovered = uncovered_share(load_masks(inputs.mask))
        images, camera = Stream(inputs.capture, sensor), camera_from_spec(sensor["color"])
        pictures = Pictures(images, camera, uncovered)
    with naming(inputs.clouds, "clouds", "frames"):
        motion = observed_motion(
            *known,
            read_clouds(inputs.clouds),
            (tips, axes),
            rest,
            sensor,
            options,
            radius_m=radius,
            pictures=pictures,
        )
    logging.info("%d samples, %d frames at rest", motion.moved_m.shape[1], len(rest))
    with whole_file(snakemake.output.motion) as part:
        save_motion(part, motion)


run(main, snakemake)
