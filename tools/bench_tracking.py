"""Errors and times of trackers on a pressed block of known shape, for ``make bench``.

A foam block that the lab's mechanics press to 8 mm, 30,000 points of one view with 1 mm noise
(`dented`). Errors are those of the vertices' places, exact alignment, most pressed frame.
"""

import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import trimesh
from dented import Dented, dented_block
from numpy.typing import NDArray
from palpate.config.model import Model
from palpate.surface.pose import to_camera, to_object
from palpate.surface.tracked import Tracked
from scipy.spatial import Delaunay
from settings import full
from thesis.tracker.capture import track_capture
from thesis.tracker.options import options_of, tracking_options
from trimesh.registration import nricp_amberg, nricp_sumner
from validation.tracking import accuracy_row, untracked

ROOT = Path(__file__).resolve().parents[1]
DEPTHS_M = (0.0, 0.002, 0.004, 0.006, 0.008)
REGIONS = ("all", "observed", "unobserved", "dent")
SCENE = "8 mm dent, 1 mm noise"
# With trimesh's own threshold (0.1 of the block's diagonal) both are 12 mm off.
NRICP = f"{SCENE}; pairs within 12 mm, as ours"
# Triangles of a cloud with longer sides bridge what the camera does not see [m].
LONGEST_SIDE_M = 0.012
# dr of Eq. 4.24 over the block's diagonal: trimesh measures in sizes of the source.
THRESHOLD = 0.012 / 0.63


def tracking_rows() -> list[tuple]:
    """Mean errors [mm] and seconds a frame of each tracker, and the best other one over ours."""
    scene = dented_block(DEPTHS_M)
    rows, errors, first = [], {}, None
    for name, options in _trackers().items():
        start = time.perf_counter()
        tracked = track_capture(scene.recorded, options)
        seconds = (time.perf_counter() - start) / len(DEPTHS_M)
        if first is None:
            first = tracked
            rows += _rows("no tracking", scene, untracked(tracked), None)
        rows += _rows(name, scene, tracked, seconds)
        errors[name] = _error(scene, tracked)
    for function in (nricp_sumner, nricp_amberg):
        tracked, seconds = _by_trimesh(function, scene, first)
        rows += _rows(function.__name__, scene, tracked, seconds, NRICP)
        errors[function.__name__] = _error(scene, tracked)
    other = errors["nricp_sumner"]
    ours = [name for name in errors if not name.startswith("nricp")]
    return rows + [
        (f"error of nricp_sumner over {name}", other / errors[name], "", SCENE) for name in ours
    ]


def _trackers() -> dict[str, Model]:
    """Trackers of the configuration, with their options for the block."""
    tracking = full(ROOT)["tracking"]
    written = {name: options_of(tracking, name, "foam_block") for name in tracking["trackers"]}
    return {name: tracking_options(options) for name, options in written.items()}


def _by_trimesh(function: Callable, scene: Dented, first: Tracked) -> tuple[Tracked, float]:
    """Register the rest pose with a mesh of the last frame's points; seconds it took."""
    pose, middle = first.camera_from_object, first.template_m.mean(axis=0)
    # About the origin: both methods pull triangles towards the identity.
    source = trimesh.Trimesh(first.template_m - middle, first.faces, process=False)
    points, normals = scene.recorded.clouds[-1]
    target = _mesh_of(points, normals)
    target.vertices = to_object(pose, points) - middle
    start = time.perf_counter()
    found = function(source, target, distance_threshold=THRESHOLD, use_faces=False)
    seconds = time.perf_counter() - start
    vertices = first.vertices_m.copy()
    vertices[-1] = to_camera(pose, np.asarray(found) + middle)
    return replace(first, vertices_m=vertices), seconds


def _mesh_of(points_m: NDArray, normals: NDArray) -> trimesh.Trimesh:
    """Triangles of neighbours in the picture, turned to the camera."""
    faces = Delaunay(points_m[:, :2] / points_m[:, 2:]).simplices
    sides = points_m[faces] - points_m[np.roll(faces, 1, axis=1)]
    faces = faces[np.linalg.norm(sides, axis=2).max(axis=1) < LONGEST_SIDE_M]
    a, b, c = (points_m[faces[:, k]] for k in range(3))
    away = (np.cross(b - a, c - a) * normals[faces[:, 0]]).sum(axis=1) < 0
    faces[away] = faces[away, ::-1]
    return trimesh.Trimesh(points_m, faces, process=False)


def _error(scene: Dented, tracked: Tracked) -> float:
    return accuracy_row(scene.truth, tracked)["place_mean_all_mm"]


def _rows(
    name: str, scene: Dented, tracked: Tracked, seconds: float | None, against: str = SCENE
) -> list[tuple]:
    row = accuracy_row(scene.truth, tracked)
    rows = [
        (f"{name}: mean error, {region}", row[f"place_mean_{region}_mm"], "mm", against)
        for region in REGIONS
    ]
    if seconds is not None:
        rows.append((f"{name}: a frame of {len(tracked.template_m)} vertices", seconds, "s", ""))
    return rows
