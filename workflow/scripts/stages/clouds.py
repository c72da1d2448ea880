"""Clouds of the object at the chosen frames of a capture, or at all."""

import logging

import numpy as np
from palpate.capture.examine_order import wrong_order
from palpate.capture.files import whole_file
from palpate.capture.tables import read_frames, read_table
from palpate.run.frames import all_streams, sensor_with_optics
from palpate.run.job import naming, run
from palpate.vision.camera import camera_from_spec
from palpate.vision.clouds import object_cloud, pack_clouds, probe_places, scene_points
from palpate.vision.foreground import load_masks
from palpate.vision.options import Clouds
from palpate.vision.support_plane import read_plane


def main(snakemake):
    """Write the clouds with normals, camera frame."""
    params = snakemake.params
    sensor = sensor_with_optics(params.sensor, snakemake.input.get("optics"))
    camera, plane = camera_from_spec(sensor["color"]), read_plane(snakemake.input.plane)
    masks, poses = load_masks(snakemake.input.mask), read_table(snakemake.input.pose)
    require_frames(snakemake.input, masks, poses)
    if params.frames is None:
        require_order(snakemake.input.capture, sensor, params.probe)
    places, exclusion = probe_places(poses, params.probe), params.probe["exclusion"]
    frames = range(len(masks)) if params.frames is None else params.frames
    options, clouds = Clouds.read(params.options).written(), []
    streams = all_streams(snakemake.input.capture, sensor, frames)
    for k, images in zip(frames, streams, strict=True):
        points = scene_points(images, sensor, masks[k])
        if not len(points):
            nearest_m, farthest_m = sensor["range_m"]
            expected = f"points {nearest_m:g} to {farthest_m:g} m away"
            raise ValueError(f"frame {k}: depth: expected {expected}, found none")
        with naming(f"{snakemake.input.capture}: frame {k}", "cloud"):
            cloud = object_cloud(points, masks[k], camera, plane, places[k], exclusion, **options)
        logging.info("frame %d: %d points", k, len(cloud.points_m))
        clouds.append(cloud)
    with whole_file(snakemake.output.clouds) as part, part.open("wb") as stream:
        np.savez_compressed(stream, **pack_clouds(clouds))


def require_order(capture, sensor, probe):
    """Refuse depth images, or right ones of a stereo head, of other moments than their frames'."""
    problem = wrong_order(capture, sensor, probe["marker"])
    if problem:
        raise ValueError(problem)


def require_frames(inputs, masks, poses):
    """Refuse masks and poses of other frames than the capture's, and frames without foreground."""
    count = len(read_frames(inputs.capture))
    for path, field, found in ((inputs.mask, "mask", masks), (inputs.pose, "tip_x_m", poses)):
        if len(found) != count:
            raise ValueError(f"{path}: {field}: expected {count} frames, found {len(found)}")
    empty = np.flatnonzero(~masks.any(axis=(1, 2)))
    if len(empty):
        expected = f"frame {empty[0]}: mask: expected foreground"
        raise ValueError(f"{inputs.mask}: {expected}, found none ({len(empty)} such frames)")


run(main, snakemake)
