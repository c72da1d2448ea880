"""Motion of the surface's samples in each frame of a capture, against the frames at rest."""

import logging

from palpate.capture.files import whole_file
from palpate.capture.streams import Stream
from palpate.capture.tables import columns_of, read_table
from palpate.estimate.direct.motion import save_motion
from palpate.estimate.direct.observe import observed_motion, rest_frames
from palpate.estimate.direct.options import Observation
from palpate.estimate.direct.picture_motion import Pictures
from palpate.surface.alignment import load_alignment
from palpate.surface.template import read_template
from palpate.vision.camera import camera_from_spec, sensor_with_optics
from palpate.vision.clouds import read_clouds
from palpate.vision.flow import uncovered_share
from palpate.vision.force import FORCE
from palpate.vision.foreground import load_masks
from palpate.vision.probe import AXIS, TIP
from palpate.workflow.job import naming, run
from palpate.yaml_files import load_yaml


def main(snakemake):
    """Write motion.npz."""
    inputs, params = snakemake.input, snakemake.params
    unit = load_yaml(inputs.object)["template"]["unit"]
    known = read_template(inputs.template, unit=unit), load_alignment(inputs.alignment)
    poses, radius = read_table(inputs.pose), params.probe["indenter"]["radius_m"]
    with naming(inputs.force):
        forces = columns_of(read_table(inputs.force), FORCE)
    with naming(inputs.pose):
        tips, axes = (columns_of(poses, names, frames=len(forces)) for names in (TIP, AXIS))
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
