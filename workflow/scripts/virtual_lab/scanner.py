"""Laser scanner on a turntable: range views of an object from all sides (Section 4.1.1)."""

from collections.abc import Mapping, Sequence
from itertools import product
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from palpate.open3d_core import o3d
from scipy.spatial.transform import Rotation

from virtual_lab.render import look_at

# Konica Minolta VIVID 910: points of a view, and accuracy in x, y and z of the scanner. The maker
# states limits; they are taken as standard deviations, which is no better than the device.
POINTS = (640, 480)
NOISE_M = np.array([0.00022, 0.00016, 0.00010])
LEAST_COSINE = 0.25
MARGIN = 1.1
# Coordinates are written in whole micrometres and normals to a part of 10^5: far below the noise
# and far above rounding, so that processors that round otherwise write the same files.
DECIMALS = 6, 5
# Neighbourhood of a normal: range image steps, at least so far, at most so many points.
NORMAL_REACH, NORMAL_LEAST_M, NORMAL_NEIGHBOURS = 3.0, 0.0012, 30
# Points and normals of one view, (n, 3) each.
Scan = tuple[NDArray, NDArray]


def scan_views(
    vertices_m: NDArray, faces: NDArray, laser: Mapping, rng: np.random.Generator
) -> list[Scan]:
    """Scan a closed surface.

    Parameters
    ----------
    vertices_m, faces : (n, 3), (m, 3) arrays
        The object on z = 0, object frame.
    laser : mapping
        ``elevations_deg`` and ``turns_deg``: where the scanner stands around the object; below the
        table stands for an object that lies on its other side. ``distance_m``: from the object's
        middle. ``turn_error_deg``, ``shift_error_m``: standard deviations of each view against the
        nominal one; the first view defines the frame and has none.
    rng : numpy.random.Generator

    Returns
    -------
    list of pairs of (n, 3) arrays
        Points of each view in the turntable's nominal frame [m], and unit normals towards the
        scanner.
    """
    caster = o3d.t.geometry.RaycastingScene(nthreads=1)
    caster.add_triangles(
        o3d.core.Tensor(np.ascontiguousarray(vertices_m, dtype=np.float32)),
        o3d.core.Tensor(np.ascontiguousarray(faces, dtype=np.uint32)),
    )
    middle = (vertices_m.min(axis=0) + vertices_m.max(axis=0)) / 2
    size = np.linalg.norm(vertices_m.max(axis=0) - vertices_m.min(axis=0))
    distance_m, pose_error = laser["distance_m"], (laser["turn_error_deg"], laser["shift_error_m"])
    views = product(laser["elevations_deg"], laser["turns_deg"])
    found = []
    for number, (elevation, turn) in enumerate(views):
        place = {"distance_m": distance_m, "elevation_deg": elevation, "turn_deg": turn}
        pose = look_at(middle, **place)
        view = _scan(caster, vertices_m[faces], pose, size * MARGIN / distance_m, rng)
        error = (0.0, 0.0) if number == 0 else pose_error
        found.append(_misplaced(view, middle, error, rng))
    return found


def write_scans(folder: Path, views: Sequence[Scan]) -> None:
    """Write each view as binary PLY: ``01.ply`` and so on [m]."""
    for number, view in enumerate(views, start=1):
        cloud = o3d.t.geometry.PointCloud()
        written = map(np.round, view, DECIMALS)
        positions, normals = (o3d.core.Tensor(one.astype(np.float32)) for one in written)
        cloud.point.positions, cloud.point.normals = positions, normals
        o3d.t.io.write_point_cloud(str(folder / f"{number:02d}.ply"), cloud)


def _scan(
    caster: o3d.t.geometry.RaycastingScene,
    triangles_m: NDArray,
    pose: NDArray,
    width: float,
    rng: np.random.Generator,
) -> Scan:
    columns, rows = POINTS
    step = width / columns
    x, y = np.meshgrid((np.arange(columns) - columns / 2), (np.arange(rows) - rows / 2))
    local = np.stack([x * step, y * step, np.ones_like(x)], axis=-1).reshape(-1, 3)
    # Of every ray: which of them graze the surface may not change the others' noise.
    noise = NOISE_M * rng.standard_normal(local.shape)
    directions = local @ pose[:3, :3].T
    rays = np.concatenate([np.broadcast_to(pose[:3, 3], directions.shape), directions], axis=1)
    answer = caster.cast_rays(o3d.core.Tensor(rays.astype(np.float32)), nthreads=1)
    hit = np.flatnonzero(np.isfinite(answer["t_hit"].numpy()))
    # The caster finds the triangle, in single precision; where it is met is worked out in double.
    a, b, c = np.moveaxis(triangles_m[answer["primitive_ids"].numpy()[hit]], 1, 0)
    normals, unit = (
        one / np.linalg.norm(one, axis=1, keepdims=True)
        for one in (np.cross(b - a, c - a), directions[hit])
    )
    cosine = -(normals * unit).sum(axis=1)
    kept = np.abs(cosine) > LEAST_COSINE
    hit, a, normals = hit[kept], a[kept], normals[kept]
    along = (normals * directions[hit]).sum(axis=1)
    depth = ((a - pose[:3, 3]) * normals).sum(axis=1) / along
    points = (local[hit] * depth[:, None] + noise[hit]) @ pose[:3, :3].T + pose[:3, 3]
    return points, _range_normals(points, step * np.median(depth), pose[:3, 3])


def _range_normals(points: NDArray, step: float, scanner: NDArray) -> NDArray:
    """Normals of planes through each point's neighbours, towards the scanner, (n, 3)."""
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points))
    radius = max(NORMAL_REACH * step, NORMAL_LEAST_M)
    cloud.estimate_normals(o3d.geometry.KDTreeSearchParamHybrid(radius, NORMAL_NEIGHBOURS))
    cloud.orient_normals_towards_camera_location(scanner)
    return np.asarray(cloud.normals)


def _misplaced(
    view: Scan, middle: NDArray, error: tuple[float, float], rng: np.random.Generator
) -> Scan:
    """A view as it lies in the nominal frame when the turntable was a little off."""
    turn = Rotation.from_rotvec(np.deg2rad(error[0]) * rng.standard_normal(3))
    shift = error[1] * rng.standard_normal(3)
    return turn.apply(view[0] - middle) + middle + shift, turn.apply(view[1])
