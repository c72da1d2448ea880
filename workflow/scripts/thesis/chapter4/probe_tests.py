"""Recordings of the probe: around a CD case (Section 4.2.4), and loading and holding (Fig. 4.6)."""

import json
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

import cv2
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
from palpate.vision.options import Force, ProbePose
from palpate.vision.pose import study_filter
from palpate.vision.probe import RAW_TIP, TIP
from palpate.vision.support_plane import fit_support_plane, height_above
from scipy.optimize import least_squares, minimize

from thesis.chapter4.workspace import by_sensor

# The cloud of the case is put together from so many frames; the probe hides another part in each.
CLOUD_FRAMES = 6
# Shown around the case [m], and so many points at most.
SHOWN_M, SHOWN_POINTS = 0.03, 20_000
SHOWN_LOWEST_M = 0.004
# Cells of the plan on which the top is drawn, and how holes in it are closed [m].
PLAN_CELL_M, PLAN_CLOSED_M, PLAN_MARGIN_M = 0.001, 0.008, 0.06
# Units of the last step's unknowns, a shift and an angle [m, rad].
STEP_UNITS = np.array([1e-3, 1e-3, 1e-3])
# Points lower than this are the table's; those farther than this from the box are something else.
BOX_LOWEST_M, BOX_REACH_M = 0.003, 0.012
# So many points of the top, within this of its height [m].
FEWEST_TOP_POINTS, TOP_BAND_M = 200, 0.004
# First steps of the search [m, m, rad]; part of the top's area that may be missing or too much.
FIRST_STEPS, MOST_TOP_APART = (0.004, 0.004, 0.03), 0.2


def make_cd_case(inputs: Any, params: Any) -> dict:
    """The traced path in the case's frame, the case's place and its cloud."""
    folder, sensor = Path(inputs.case), sensor_with_optics(params.sensor, inputs.optics)
    poses = followed(folder / "trace", sensor, params.probe, ProbePose.read(params.pose))
    rng = np.random.default_rng(params.seed)
    plane = _table_plane(folder / "background", sensor, params, rng)
    points, size_m = case_points(folder / "trace", sensor, params, poses), np.array(params.size_m)
    camera_from_case = place_box(points, plane, size_m)
    above = in_frame(points[height_above(plane, points) > SHOWN_LOWEST_M], camera_from_case)
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


def place_box(points_m: NDArray, plane: NDArray, size_m: NDArray) -> NDArray:
    """Find where a box stands on a table from points of its top.

    The top's points are drawn on a plan of the table, and the rectangle is laid so that what it
    covers and what is drawn differ least, each cell weighted by its distance from the outline.
    From there the points' distances from the box, the sides that are seen too, are made least.

    Parameters
    ----------
    points_m : (n, 3) array
        Cloud of the scene, camera frame [m].
    plane : (4,) array
        The table (`fit_support_plane`).
    size_m : (3,) array
        Length, width and height of the box; length >= width.

    Returns
    -------
    (4, 4) array
        camera_from_box; the box's frame has x along its length, z up, its origin amid its base.

    Raises
    ------
    ValueError
        If too few points lie at the box's height, or they do not fill its top.
    """
    size_m, height = np.asarray(size_m, dtype=float), height_above(plane, points_m)
    top = points_m[np.abs(height - size_m[2]) < TOP_BAND_M]
    if len(top) < FEWEST_TOP_POINTS:
        raise ValueError(
            f"box: expected at least {FEWEST_TOP_POINTS} points {size_m[2] * 1e3:g} mm above the"
            f" table, found {len(top)}"
        )
    if size_m[0] < size_m[1]:
        raise ValueError(f"box: expected length >= width, found {size_m[0]:g}, {size_m[1]:g} m")
    axes = _plane_axes(plane[:3])
    place, apart = _laid(*_plan(top @ axes.T), size_m)
    if apart > MOST_TOP_APART:
        raise ValueError(
            f"box: expected a top of {size_m[0] * 1e3:.0f} x {size_m[1] * 1e3:.0f} mm, found a"
            f" piece that differs from it in {apart:.0%} of its area"
        )
    scene = np.column_stack([points_m @ axes.T, height])
    place = _registered(scene[height > BOX_LOWEST_M], size_m, place)
    pose = np.eye(4)
    pose[:3, :2], pose[:3, 2] = (_turn(place[2]) @ axes).T, plane[:3]
    pose[:3, 3] = place[:2] @ axes - plane[3] * plane[:3]
    return pose


def outline_distance(places_m: NDArray, size_m: NDArray) -> NDArray:
    """Signed distance of places (n, 2) from a centred rectangle's outline, positive outside [m]."""
    return _outside(np.abs(places_m) - np.asarray(size_m)[:2] / 2)


def _outside(beyond: NDArray) -> NDArray:
    """Signed distance from a box, by how far places are beyond each of its sides (n, k)."""
    return np.linalg.norm(np.maximum(beyond, 0), axis=1) + np.minimum(beyond.max(axis=1), 0)


def _plane_axes(normal: NDArray) -> NDArray:
    """Two unit vectors in a plane, right-handed with its normal, (2, 3)."""
    start = np.eye(3)[np.argmin(np.abs(normal))]
    first = start - (start @ normal) * normal
    first /= np.linalg.norm(first)
    return np.stack([first, np.cross(normal, first)])


def _turn(angle: float) -> NDArray:
    """Axes turned by an angle, (2, 2)."""
    return np.array([[np.cos(a), np.sin(a)] for a in (angle, angle + np.pi / 2)])


def _plan(flat_m: NDArray) -> tuple[NDArray, NDArray]:
    """Cells (k, 2) [m] around the points, and whether the largest drawn piece covers each."""
    middle = np.median(flat_m, axis=0)
    reach = 2 * np.median(np.abs(flat_m - middle), axis=0) + PLAN_MARGIN_M
    low, count = middle - reach, np.ceil(2 * reach / PLAN_CELL_M).astype(int)
    places = np.floor((flat_m - low) / PLAN_CELL_M).astype(int)
    places = places[((places >= 0) & (places < count)).all(axis=1)]
    plan = np.zeros(count[::-1], dtype=np.uint8)
    plan[places[:, 1], places[:, 0]] = 1
    size = int(PLAN_CLOSED_M / PLAN_CELL_M) | 1
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size))
    plan = cv2.morphologyEx(cv2.morphologyEx(plan, cv2.MORPH_CLOSE, disc), cv2.MORPH_OPEN, disc)
    _, labels, stats, _ = cv2.connectedComponentsWithStats(plan)
    largest = 1 + np.argmax(stats[1:, cv2.CC_STAT_AREA]) if len(stats) > 1 else 0
    y, x = np.indices(plan.shape)
    cells = low + (np.column_stack([x.ravel(), y.ravel()]) + 0.5) * PLAN_CELL_M
    return cells, (labels == largest).ravel()


def _laid(cells_m: NDArray, drawn: NDArray, size_m: NDArray) -> tuple[NDArray, float]:
    """Middle and angle (3,) [m, rad] of the rectangle on drawn cells, and the part it misses."""

    def distance(place: NDArray) -> NDArray:
        return outline_distance((cells_m - place[:2]) @ _turn(place[2]).T, size_m)

    def mismatch(place: NDArray) -> float:
        d = distance(place)
        return float(d[drawn & (d > 0)].sum() - d[~drawn & (d < 0)].sum())

    (x, y), _, degrees = cv2.minAreaRect(cells_m[drawn].astype(np.float32))
    fits = []
    for turn in (0, 90):
        start = np.array([x, y, np.deg2rad(degrees + turn)])
        simplex = np.vstack([start, start + np.diag(FIRST_STEPS)])
        options = {"initial_simplex": simplex, "xatol": 1e-6, "fatol": 1e-6, "maxiter": 600}
        fits.append(minimize(mismatch, start, method="Nelder-Mead", options=options))
    best = min(fits, key=lambda fit: fit.fun).x
    covered = distance(best) < 0
    return best, float((covered ^ drawn).sum() / max(covered.sum(), 1))


def _registered(scene_m: NDArray, size_m: NDArray, place: NDArray) -> NDArray:
    """Middle and angle (3,) [m, rad] at which points (x, y, height) lie nearest to the box."""
    half = size_m[:2] / 2
    placed = (scene_m[:, :2] - place[:2]) @ _turn(place[2]).T
    near = (np.abs(placed) < half + BOX_REACH_M).all(axis=1)
    near &= scene_m[:, 2] < size_m[2] + BOX_REACH_M
    flat, height = scene_m[near, :2], scene_m[near, 2] - size_m[2]

    def distance(step: NDArray) -> NDArray:
        there = place + step * STEP_UNITS
        beside = np.abs((flat - there[:2]) @ _turn(there[2]).T) - half
        return _outside(np.column_stack([beside, height])) / STEP_UNITS[0]

    found = least_squares(distance, np.zeros(3), loss="soft_l1", diff_step=1e-2)
    return place + found.x * STEP_UNITS
