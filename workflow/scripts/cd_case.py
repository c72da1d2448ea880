"""Trace of the tip around a CD case against the case's cloud (Section 4.2.4)."""

import json
from pathlib import Path

import numpy as np
import pandas as pd
from follow import followed
from frames import all_streams, sensor_of
from job import run
from palpate.capture.files import whole_file
from palpate.capture.tables import write_table
from palpate.vision.box import outline_distance, place_box
from palpate.vision.clouds import belongs_to_probe, probe_places, scene_points
from palpate.vision.kalman import study_filter
from palpate.vision.probe import RAW_TIP, TIP
from palpate.vision.support_plane import fit_support_plane, height_above

# The cloud of the case is put together from so many frames; the probe hides another part in each.
CLOUD_FRAMES = 6
# Shown around the case [m], and so many points at most.
SHOWN_M, SHOWN_POINTS = 0.03, 20_000
LOWEST_M = 0.004


def main(snakemake):
    """Write the traced path in the case's frame, the case's place and its cloud."""
    trace, params = Path(snakemake.input.case) / "trace", snakemake.params
    sensor = sensor_of(snakemake)
    poses = followed(trace, sensor, params.probe, params.pose)
    rng = np.random.default_rng(params.seed)
    empty = next(all_streams(Path(snakemake.input.case) / "background", sensor))
    plane = fit_support_plane(scene_points(empty, sensor), rng=rng, **params.plane)
    points = scene_cloud(trace, sensor, params, poses)
    size_m = np.array(params.size_m)
    camera_from_case = place_box(points, plane, size_m)
    path = pd.DataFrame({"frame": poses["frame"], "time_s": poses["time_s"]})
    raw = poses[RAW_TIP].to_numpy(float)
    for name, tips in (("raw", raw), ("smooth", poses[TIP].to_numpy(float))) + (
        ("study", study_filter(raw)),
    ):
        placed = in_frame(tips, camera_from_case)
        path[[f"{name}_x_m", f"{name}_y_m", f"{name}_z_m"]] = placed
        path[f"{name}_offset_m"] = outline_distance(placed[:, :2], size_m)
    write_table(snakemake.output.path, path)
    cloud = in_frame(points[height_above(plane, points) > LOWEST_M], camera_from_case)
    near = (np.abs(cloud[:, :2]) < size_m[:2] / 2 + SHOWN_M).all(axis=1) & (cloud[:, 2] < SHOWN_M)
    cloud = cloud[near]
    shown = cloud[rng.choice(len(cloud), min(SHOWN_POINTS, len(cloud)), replace=False)]
    with whole_file(snakemake.output.cloud) as part, part.open("wb") as stream:
        np.savez_compressed(stream, points_m=shown.astype(np.float32))
    found = {"camera_from_case": camera_from_case.tolist(), "size_m": size_m.tolist()}
    found |= {"tip_radius_m": params.probe["indenter"]["radius_m"]}
    with whole_file(snakemake.output.place) as part:
        part.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")


def scene_cloud(folder, sensor, params, poses):
    """Points of several frames without the probe, camera frame."""
    chosen = np.linspace(0, len(poses) - 1, CLOUD_FRAMES).astype(int)
    places = probe_places(poses, params.probe)
    clouds = []
    for k, images in zip(chosen, all_streams(folder, sensor, chosen), strict=True):
        points = scene_points(images, sensor)
        clouds.append(points[~belongs_to_probe(points, places[k], params.probe["exclusion"])])
    return np.concatenate(clouds)


def in_frame(points_m, camera_from_case):
    """Points in the case's frame."""
    return (points_m - camera_from_case[:3, 3]) @ camera_from_case[:3, :3]


run(main, snakemake)
