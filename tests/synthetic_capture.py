"""A capture of which everything is known: a block that the study's probe presses."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd
from floor import floor
from numpy.typing import NDArray
from palpate.solid.indentation_table import IndentationModel
from palpate.solid.laws import LAW_NAMES
from palpate.solid.support import Support
from palpate.surface.alignment import Alignment
from palpate.surface.template import Template
from palpate.vision.force import WRENCH
from palpate.vision.probe import ALONG_STD, AXIS, MARKER, QUATERNION, TIP, marker_from_tip
from scipy.interpolate import PchipInterpolator
from scipy.spatial.transform import Rotation
from trimesh.creation import box

E, NU = 1e5, 0.3
TOP_M = 0.05
POINT_M = np.array([0.02, -0.04, TOP_M])
UP, DOWN = np.array([0.0, 0, 1]), np.array([0.0, 0, -1])
# Half a metre in front of the block and above it.
EYE_M = np.array([0.0, -0.35, 0.42])
# Force clock minus camera clock, and what the sensor says unloaded.
CLOCK_S, BIAS = 0.012, np.array([0.3, -0.2, 0.5, 0.01, 0.02, -0.01])
TIP_STD_M, FORCE_STD_N, CLOUD_STD_M, STEP_M = 5e-5, 0.01, 1e-4, 0.0025
TIME_S = np.arange(54) / 15


def depth_m(time_s: NDArray) -> NDArray:
    """Rest 25 mm above the block, down to 5 mm deep in half a second, a hold, and up again."""
    knots = [-1.0, 0.7, 1.3, 1.8, 2.8, 3.3, 4.0], 1e-3 * np.array([-25, -25, -3, 5, 5, -10, -10])
    return PchipInterpolator(*knots)(time_s)


def force_n(depth: NDArray, radius_m: float) -> NDArray:
    """Hertz's."""
    return 4 / 3 * E / (1 - NU**2) * np.sqrt(radius_m) * np.maximum(depth, 0) ** 1.5


def sunk_m(places_m: NDArray, depth: NDArray, radius_m: float, nu: float = NU) -> NDArray:
    """How far the top moves, (depths, places): less far off, and less with nu."""
    r = np.hypot(np.linalg.norm((places_m - POINT_M)[:, :2], axis=1), radius_m)
    part = radius_m * (1 / r - (5 + 20 * nu**2))
    return -np.outer(np.maximum(depth, 0), part)


@dataclass(frozen=True)
class Synthetic:
    """What stages make of the capture, and what they are to find.

    Attributes
    ----------
    probe : mapping
        The probe's file.
    camera_from_object : (4, 4) array
    plane : (4,) array
        The table, camera frame.
    poses, record : DataFrame
        probe_pose.csv, and force.csv of the capture.
    forces_n : (f, 3) array
        True force on the object at the frames, camera frame [N].
    clouds : list of (points (n, 3) [m], normals (n, 3))
        Camera frame.
    """

    probe: Mapping
    camera_from_object: NDArray
    plane: NDArray
    poses: pd.DataFrame
    record: pd.DataFrame
    forces_n: NDArray
    clouds: list

    @property
    def radius_m(self) -> float:
        return self.probe["indenter"]["radius_m"]

    @property
    def support(self) -> Support:
        return floor(1e-3)

    @property
    def template(self) -> Template:
        block = box((0.30, 0.20, TOP_M))
        return Template(np.asarray(block.vertices) + TOP_M / 2 * UP, np.asarray(block.faces))

    @property
    def alignment(self) -> Alignment:
        """The true one."""
        first = int(np.argmax(depth_m(TIME_S) > 0))
        return Alignment(self.camera_from_object, POINT_M, first, 0.0)

    @property
    def tips_m(self) -> NDArray:
        return self.poses[TIP].to_numpy()

    def table(self, point_m: NDArray = POINT_M) -> IndentationModel:
        """The block's answer, as if it were that at the point."""
        mesh = box((0.30, 0.20, TOP_M)).subdivide_to_size(0.012)
        rest = np.asarray(mesh.vertices) + TOP_M / 2 * UP
        ratios, depth = np.array([0.0, 0.25, 0.45]), np.linspace(0, 0.006, 5)
        unit = 4 / 3 * np.sqrt(self.radius_m) * depth**1.5 / (1 - ratios[:, None] ** 2)
        harder = np.exp(0.3 * (1 - ratios[:, None]) * np.sqrt(depth / depth[-1]))
        field = np.zeros((len(LAW_NAMES), len(ratios), len(depth), len(rest), 3))
        top = rest[:, 2] > TOP_M - 1e-9
        places = rest[top] - point_m + POINT_M
        for k, nu in enumerate(ratios):
            down = sunk_m(places, depth, self.radius_m, nu)
            field[0, k][:, top, 2], field[1, k][:, top, 2] = down, 1.2 * down
        return IndentationModel(
            point_m=point_m,
            direction=DOWN,
            radius_m=self.radius_m,
            laws=LAW_NAMES,
            poisson_ratios=ratios,
            depth_m=depth,
            force_per_modulus_m2=np.stack([unit, unit * harder]),
            surface_rest_m=rest,
            surface_faces=np.asarray(mesh.faces),
            surface_displacement_m=field.astype(np.float32),
        )


def synthetic_capture(probe: Mapping) -> Synthetic:
    """Make it."""
    rng, radius = np.random.default_rng(20261124), probe["indenter"]["radius_m"]
    pose, depth = camera_from_object(EYE_M, np.array([0, 0, TOP_M])), depth_m(TIME_S)
    turn = pose[:3, :3]
    plane = np.append(turn @ UP, -(turn @ UP) @ pose[:3, 3])
    poses = _poses(probe, pose, POINT_M + np.outer(radius - depth, UP), rng)
    time_s = np.arange(-0.1, TIME_S[-1] + 0.1, 0.002)
    wrench = BIAS + rng.normal(0, FORCE_STD_N, (len(time_s), 6)) * [1, 1, 1, 0.01, 0.01, 0.01]
    # The sensor reports the load on the tip, by its own clock.
    wrench[:, 2] -= force_n(depth_m(time_s - CLOCK_S), radius)
    record = pd.DataFrame(wrench, columns=WRENCH)
    record.insert(0, "time_s", time_s)
    clouds = [_cloud(one, radius, pose, rng) for one in depth]
    forces = np.outer(force_n(depth, radius), turn @ DOWN)
    return Synthetic(probe, pose, plane, poses, record, forces, clouds)


def camera_from_object(eye_m: NDArray, target_m: NDArray) -> NDArray:
    """Pose of a camera at a place that looks at another, its x along the object's."""
    forward = (target_m - eye_m) / np.linalg.norm(target_m - eye_m)
    x = np.array([1.0, 0, 0])
    found = np.eye(4)
    found[:3, :3] = np.stack([x, np.cross(forward, x), forward])
    found[:3, 3] = -found[:3, :3] @ eye_m
    return found


def _cloud(depth: float, radius_m: float, pose: NDArray, rng) -> tuple[NDArray, NDArray]:
    """Top, and the front that the camera sees under it."""
    half = 0.4 * STEP_M
    x, y = (one.ravel() for one in np.mgrid[-0.1:0.12:STEP_M, -0.1 + half : 0.09 : STEP_M])
    top = np.column_stack([x, y, np.full(x.size, TOP_M)])
    x, z = (one.ravel() for one in np.mgrid[-0.1:0.12:STEP_M, 0.005 : TOP_M - half : STEP_M])
    front = np.column_stack([x, np.full(x.size, -0.1), z])
    top += rng.uniform(-half, half, top.shape) * [1, 1, 0]
    top[:, 2] += sunk_m(top, depth, radius_m)[0]
    normals = np.repeat([UP, [0.0, -1, 0]], [len(top), len(front)], axis=0)
    points = np.concatenate([top, front])
    points += normals * rng.normal(0, CLOUD_STD_M, (len(points), 1))
    return points @ pose[:3, :3].T + pose[:3, 3], normals @ pose[:3, :3].T


def _poses(probe: Mapping, pose: NDArray, tips_m: NDArray, rng) -> pd.DataFrame:
    """An upright probe, whose board looks at the camera."""
    object_from_tip = np.tile(np.diag([1.0, -1, -1, 1]), (len(tips_m), 1, 1))
    object_from_tip[:, :3, 3] = tips_m + np.outer(rng.normal(0, TIP_STD_M, len(tips_m)), UP)
    tips = pose @ object_from_tip
    markers = tips @ np.linalg.inv(marker_from_tip(probe))
    table = pd.DataFrame({"frame": range(len(tips_m)), "time_s": TIME_S})
    table[QUATERNION] = Rotation.from_matrix(markers[:, :3, :3]).as_quat(canonical=True)
    table[MARKER], table[TIP], table[AXIS] = markers[:, :3, 3], tips[:, :3, 3], tips[:, :3, 2]
    table[ALONG_STD] = TIP_STD_M
    return table
