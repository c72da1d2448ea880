"""Motion of the surface's cells in each frame of a capture, against the frames at rest."""

import logging
from dataclasses import replace

import numpy as np
from palpate.capture.files import whole_file
from palpate.capture.schema import load_yaml
from palpate.capture.tables import read_table
from palpate.estimate.direct.correspondences import clearance, eyes_of, probe_in_view
from palpate.estimate.direct.motion import frames_at_rest, save_motion, surface_motion
from palpate.estimate.direct.options import Observation
from palpate.estimate.hertz.range import indentation_depth
from palpate.run.job import naming, run
from palpate.surface.alignment import load_alignment
from palpate.surface.checks import columns_of
from palpate.surface.pose import to_camera
from palpate.surface.template import read_template
from palpate.vision.clouds import read_clouds
from palpate.vision.force import FORCE
from palpate.vision.probe import AXIS, TIP


def main(snakemake):
    """Write motion.npz."""
    inputs, params = snakemake.input, snakemake.params
    unit = load_yaml(inputs.object)["template"]["unit"]
    template, alignment = (
        read_template(inputs.template, unit=unit),
        load_alignment(inputs.alignment),
    )
    poses = read_table(inputs.pose)
    with naming(inputs.force):
        force = np.linalg.norm(columns_of(read_table(inputs.force), FORCE), axis=1)
    with naming(inputs.pose):
        tips, axes = (columns_of(poses, names, frames=len(force)) for names in (TIP, AXIS))
    radius = params.probe["indenter"]["radius_m"]
    depth = indentation_depth(template, alignment, tips, radius_m=radius)
    with naming(inputs.force):
        rest = frames_at_rest(depth, force, onset_force_n=params.onset_force_n)
    clouds = [(cloud.points_m, cloud.normals) for cloud in read_clouds(inputs.clouds)]
    probe = probe_in_view(alignment, tips, axes, eyes_m=eyes_of(params.sensor))
    options = Observation.read(params.options)
    clear = clearance(
        params.sensor,
        float(np.linalg.norm(to_camera(alignment.camera_from_object, alignment.contact_point_m))),
        radius_m=radius,
        windows=options.clear_windows,
        otherwise_m=options.clear_m,
    )
    with naming(inputs.clouds, "clouds", "frames"):
        motion = surface_motion(
            template, alignment, clouds, probe, rest, replace(options, clear_m=clear)
        )
    logging.info("%d cells, %d frames at rest", motion.moved_m.shape[1], len(rest))
    with whole_file(snakemake.output.motion) as part:
        save_motion(part, motion)


run(main, snakemake)
