"""A pressed foam block as one depth camera sees it, with the truth beside it.

The lab's contact mechanics press a sphere into the block; random rays of one camera, 45 degrees up
as the lab's, give points of what the sphere and its stem do not hide, with noise along the rays.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import open3d as o3d
import trimesh
import yaml
from floor import floor
from numpy.typing import NDArray
from palpate.solid.mesh import read_solid
from palpate.surface.alignment import Alignment
from palpate.surface.pose import to_camera
from palpate.surface.template import Template
from palpate.surface.tracked import Recorded
from virtual_lab.describe import box_template
from virtual_lab.indentation import indent_object
from virtual_lab.load_steps import LoadSteps
from virtual_lab.render import look_at

ROOT = Path(__file__).resolve().parents[1]
SIZE_M = np.array([0.598, 0.150, 0.0475])
POINT_M = np.array([-0.05, 0.0, 0.0475])
RADIUS_M = 0.00622
STEM_RADIUS_M = 0.0035
# Of the template before its refinement: refined around the contact it has 1,236 vertices.
EDGE_M = 0.020
TARGET_M, DISTANCE_M, ELEVATION_DEG = np.array([0.0, 0.0, 0.09]), 0.65, 45.0
# Coarser than the lab's own load steps: 18 s instead of 32 s, 0.01 mm apart on average.
STEPS = {"element_m": 0.003, "step_m": 0.001, "deepest_m": 0.008}
# Points of a cloud nearer to the tip's centre are the probe's, and neighbours in a plane's fit.
EXCLUDED_M, NEIGHBOURS = 0.0085, 30
FIRST_DEPTH_M = 1e-9
# Rays of each frame that hit the block, of which a few near the tip are left out of its cloud, and
# the standard deviation of each point along its ray [m].
POINTS, NOISE_M = 30_000, 0.001


@dataclass(frozen=True)
class Dented:
    """A capture made up of synthetic clouds, and its truth.

    Attributes
    ----------
    recorded : Recorded
        What a tracker gets; the alignment is exact.
    truth : dict
        Fields of truth.npz that trackers are measured by: ``camera_from_object``,
        ``surface_rest_m``, ``surface_faces``, ``surface_m`` (f, n, 3), ``tip_m``, ``depth_m``.
    """

    recorded: Recorded
    truth: dict


def block_steps() -> LoadSteps:
    """The lab's contact mechanics at the middle of the block's top, to 8 mm."""
    lab = yaml.safe_load((ROOT / "config/lab.yaml").read_text(encoding="utf-8"))
    block = lab["objects"]["foam_block"]
    return indent_object(block | {"contact": block["contact"] | STEPS}, POINT_M, RADIUS_M)


def dented_block(depths_m: Sequence[float]) -> Dented:
    """Frames of the block at depths of the sphere, with the truth of each.

    Parameters
    ----------
    depths_m : sequence of float
        Depth in each frame, from 0 to 0.008; the first frame's should be 0 [m].
    """
    depths, steps = np.asarray(depths_m, dtype=float), block_steps()
    pose = np.linalg.inv(look_at(TARGET_M, distance_m=DISTANCE_M, elevation_deg=ELEVATION_DEG))
    mesh = box_template(SIZE_M, EDGE_M)
    tips = steps.point_m + np.column_stack([0 * depths, 0 * depths, RADIUS_M - depths])
    surfaces = steps.surface_at(depths)
    clouds = [
        _cloud(surface, steps.surface_faces, tip, pose, seed=[0, k])
        for k, (surface, tip) in enumerate(zip(surfaces, tips, strict=True))
    ]
    recorded = Recorded(
        template=Template(np.asarray(mesh.vertices), np.asarray(mesh.faces)),
        solid=read_solid(ROOT / "config/meshes/foam_block.vtu"),
        support=floor(0.001),
        clouds=clouds,
        tips_m=to_camera(pose, tips),
        forces_n=-steps.force_at(depths)[:, None] * pose[:3, 2],
        indenter_radius_m=RADIUS_M,
        alignment=_alignment(pose, depths),
    )
    truth = {
        "camera_from_object": pose,
        "surface_rest_m": steps.surface_rest_m,
        "surface_faces": steps.surface_faces,
        "surface_m": surfaces,
        "tip_m": recorded.tips_m,
        "depth_m": depths,
    }
    return Dented(recorded, truth)


def _alignment(pose: NDArray, depths: NDArray) -> Alignment:
    pressed = np.flatnonzero(depths > FIRST_DEPTH_M)
    first = int(pressed[0]) if len(pressed) else len(depths) - 1
    return Alignment(pose, POINT_M, first, 0.0)


def _cloud(
    surface: NDArray, faces: NDArray, tip: NDArray, pose: NDArray, *, seed: list
) -> tuple[NDArray, NDArray]:
    """Points (n, 3) [m] and normals of what the camera sees, camera frame."""
    rng = np.random.default_rng(seed)
    corners = to_camera(pose, surface)
    slopes = corners[:, :2] / corners[:, 2:]
    low, high = slopes.min(axis=0), slopes.max(axis=0)
    probe, probe_faces = _probe(tip)
    scene = _scene(corners, faces, to_camera(pose, probe), probe_faces)
    seen = np.zeros((0, 3))
    while len(seen) < POINTS:
        drawn = rng.uniform(low, high, (2 * POINTS, 2))
        seen = np.concatenate([seen, _hits(scene, drawn)])
    seen = seen[:POINTS]
    rays = seen / np.linalg.norm(seen, axis=1, keepdims=True)
    seen = seen + rays * rng.normal(0, NOISE_M, (POINTS, 1))
    away = np.linalg.norm(seen - to_camera(pose, tip), axis=1) > EXCLUDED_M
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(seen[away]))
    cloud.estimate_normals(o3d.geometry.KDTreeSearchParamKNN(NEIGHBOURS))
    cloud.orient_normals_towards_camera_location(np.zeros(3))
    return np.asarray(cloud.points), np.asarray(cloud.normals)


def _scene(vertices: NDArray, faces: NDArray, probe: NDArray, probe_faces: NDArray):
    """The block (geometry 0) and the probe before the rays."""
    scene = o3d.t.geometry.RaycastingScene(nthreads=1)
    for corners, triangles in ((vertices, faces), (probe, probe_faces)):
        scene.add_triangles(
            o3d.core.Tensor(corners.astype(np.float32)),
            o3d.core.Tensor(triangles.astype(np.uint32)),
        )
    return scene


def _hits(scene, slopes: NDArray) -> NDArray:
    """Where rays through the image plane hit the block first, (k, 3) [m]."""
    rays = np.zeros((len(slopes), 6), dtype=np.float32)
    rays[:, 3:5], rays[:, 5] = slopes, 1.0
    answer = scene.cast_rays(o3d.core.Tensor(rays), nthreads=1)
    block = answer["geometry_ids"].numpy() == 0
    return rays[block, 3:].astype(float) * answer["t_hit"].numpy()[block, None]


def _probe(tip: NDArray) -> tuple[NDArray, NDArray]:
    """Sphere and stem over a tip, object frame [m]."""
    sphere = trimesh.creation.icosphere(subdivisions=3, radius=RADIUS_M)
    stem = trimesh.creation.cylinder(radius=STEM_RADIUS_M, segment=[[0, 0, 0], [0, 0, 0.08]])
    whole = trimesh.util.concatenate([sphere, stem])
    return np.asarray(whole.vertices) + tip, np.asarray(whole.faces)
