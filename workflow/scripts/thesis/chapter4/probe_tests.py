"""Recordings of the probe: around a CD case (Section 4.2.4), and loading and holding (Fig. 4.6)."""

import json
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from palpate.capture.images import all_streams
from palpate.capture.tables import read_force
from palpate.json_fields import read_one
from palpate.npz import write_npz
from palpate.report import outputs
from palpate.units import MILLIMETRES
from palpate.vision.camera import sensor_with_optics
from palpate.vision.clouds import probe_places, scene_cloud
from palpate.vision.follow import followed
from palpate.vision.force import FORCE, zeroed
from palpate.vision.indentation import capture_wrenches, depth_along, force_along
from palpate.vision.kalman import study_filter
from palpate.vision.options import Force, ProbePose
from palpate.vision.probe import RAW_TIP, TIP
from palpate.vision.support_plane import fit_support_plane, height_above

from thesis.chapter4.box import outline_distance, place_box
from thesis.chapter4.workspace import by_sensor

# The cloud of the case is put together from so many frames; the probe hides another part in each.
CLOUD_FRAMES = 6
# Shown around the case [m], and so many points at most.
SHOWN_M, SHOWN_POINTS = 0.03, 20_000
LOWEST_M = 0.004


def make_cd_case(inputs: Any, params: Any) -> dict:
    """The traced path in the case's frame, the case's place and its cloud."""
    folder, sensor = Path(inputs.case), sensor_with_optics(params.sensor, inputs.optics)
    poses = followed(folder / "trace", sensor, params.probe, ProbePose.read(params.pose))
    rng = np.random.default_rng(params.seed)
    plane = _table_plane(folder / "background", sensor, params, rng)
    points, size_m = case_points(folder / "trace", sensor, params, poses), np.array(params.size_m)
    camera_from_case = place_box(points, plane, size_m)
    above = in_frame(points[height_above(plane, points) > LOWEST_M], camera_from_case)
    cloud = shown_points(above, size_m, rng)
    place = {"camera_from_case": camera_from_case.tolist(), "size_m": size_m.tolist()}
    place |= {"tip_radius_m": params.probe["indenter"]["radius_m"]}
    return {
        "path": outputs.exact(case_path(poses, camera_from_case, size_m)),
        "place": json.dumps(place, indent=1) + "\n",
        "cloud": partial(write_npz, arrays={"points_m": cloud.astype(np.float32)}),
    }


def case_path(poses: pd.DataFrame, camera_from_case: NDArray, size_m: NDArray) -> pd.DataFrame:
    """The tip in the case's frame and its distance from the outline: raw and filtered."""
    path = pd.DataFrame({"frame": poses["frame"], "time_s": poses["time_s"]})
    raw, smooth = (poses[columns].to_numpy(float) for columns in (RAW_TIP, TIP))
    for name, tips in {"raw": raw, "smooth": smooth, "study": study_filter(raw)}.items():
        placed = in_frame(tips, camera_from_case)
        path[[f"{name}_x_m", f"{name}_y_m", f"{name}_z_m"]] = placed
        path[f"{name}_offset_m"] = outline_distance(placed[:, :2], size_m)
    return path


def case_points(folder: Path, sensor: Mapping, params: Any, poses: pd.DataFrame) -> NDArray:
    """Points of several frames without the probe, camera frame."""
    chosen = np.linspace(0, len(poses) - 1, CLOUD_FRAMES).astype(int)
    places = probe_places(poses, params.probe)
    clouds = []
    for k, images in zip(chosen, all_streams(folder, sensor, chosen), strict=True):
        points = scene_cloud(images, sensor).points_m
        clouds.append(points[~places[k].holds(points)])
    return np.concatenate(clouds)


def in_frame(points_m: NDArray, camera_from_case: NDArray) -> NDArray:
    """Points in the case's frame."""
    return (points_m - camera_from_case[:3, 3]) @ camera_from_case[:3, :3]


def shown_points(cloud_m: NDArray, size_m: NDArray, rng: np.random.Generator) -> NDArray:
    """Points near the case, a random choice where there are many, in the case's frame."""
    near = (np.abs(cloud_m[:, :2]) < size_m[:2] / 2 + SHOWN_M).all(axis=1)
    cloud = cloud_m[near & (cloud_m[:, 2] < SHOWN_M)]
    return cloud[rng.choice(len(cloud), min(SHOWN_POINTS, len(cloud)), replace=False)]


def make_cd_case_table(inputs: Any, params: Any) -> pd.DataFrame:
    """Offsets of each sensor's path."""
    paths = by_sensor(params.names, inputs.paths)
    places = by_sensor(params.names, inputs.places, read_one)
    table = pd.DataFrame([case_row(name, paths[name], places[name]) for name in params.names])
    return table.assign(provenance=table["sensor"].map(params.provenance))


def case_row(name: str, path: pd.DataFrame, place: Mapping) -> dict:
    """Offsets of one sensor's path; an operator leaves the edge at times."""
    found = {"sensor": name, "frames": len(path)}
    for kind in ("raw", "smooth", "study"):
        offset = path[f"{kind}_offset_m"] * MILLIMETRES
        found |= {f"{kind}_offset_mm": offset.mean(), f"{kind}_offset_std_mm": offset.std()}
    return found | {"tip_radius_mm": place["tip_radius_m"] * MILLIMETRES}


def make_loading_test(inputs: Any, params: Any) -> dict:
    """Force and displacement at every frame, and the force's averaged record."""
    folder, sensor = inputs.loading, sensor_with_optics(params.sensor, inputs.optics)
    options, record = Force.read(params.options), read_force(folder)
    poses = followed(folder, sensor, params.probe, ProbePose.read(params.pose))
    up = _table_plane(folder, sensor, params, np.random.default_rng(params.seed))[:3]
    wrench, clock = capture_wrenches(record, poses, sensor, params.probe, options, up=up)
    frames = _loading_frames(poses, np.linalg.norm(wrench[FORCE], axis=1), params.onset_force_n)
    frames["clock_offset_s"], frames["clock_offset_std_s"] = clock.offset_s, clock.std_s
    known = zeroed(record, params.probe, options.bias_window_s, poses["time_s"].iloc[0])
    time_s, along_n = force_along(known, params.probe)
    force = pd.DataFrame({"time_s": time_s - clock.offset_s, "force_n": along_n})
    return {"frames": outputs.exact(frames), "force": outputs.exact(force)}


def _loading_frames(poses: pd.DataFrame, force_n: NDArray, onset_force_n: float) -> pd.DataFrame:
    """Force and displacement at each frame, the displacement from the first contact on."""
    depth_m = depth_along(poses)[0]
    if force_n.max() <= onset_force_n or force_n[0] > onset_force_n:
        raise ValueError(
            f"loading: expected an indentation from below to above {onset_force_n:g} N, found"
            f" {force_n[0]:.2f} N at first and at most {force_n.max():.2f} N"
        )
    onset = int(np.argmax(force_n > onset_force_n))
    frames = pd.DataFrame({"time_s": poses["time_s"], "force_n": force_n})
    return frames.assign(displacement_m=depth_m - depth_m[onset])


def _table_plane(
    folder: str | Path, sensor: Mapping, params: Any, rng: np.random.Generator
) -> NDArray:
    """Plane (4,) of the table in the first frame, its normal upward."""
    points = scene_cloud(next(all_streams(folder, sensor)), sensor).points_m
    return fit_support_plane(points, rng=rng, inlier_distance_m=params.inlier_distance_m)
