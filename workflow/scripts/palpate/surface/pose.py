"""Rigid alignment of the template with the first frame (Eq. 4.24), without help by hand."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from palpate.open3d_core import ClosestPoints
from palpate.solid.mesh import doubled_normals
from palpate.solid.support import Support
from palpate.surface.options import Aligning
from palpate.surface.template import Template, vertex_normals
from palpate.units import FROM_MEDIAN

YAW_STEPS = 72
SAMPLE = 1500
TRIM = 0.9
ALIGNMENT_STEPS = 40
POLISHING_STEPS = 40
CONVERGED_M = 1e-7
CROWDED = 2.0
FEWEST_PAIRS = 6
# Neighbouring points of a cloud share their errors: windows of stereo or of dots span about thirty.
SHARED_ERRORS = 30
# How well a hand meets the declared point, and table and support are flat and known.
TOUCH_STD_M, TILT_STD_RAD, HEIGHT_STD_M = 0.001, np.deg2rad(0.2), 0.0005
# Clouds nearer by less than the first do not tell turns apart [m]; a press the other way costs the
# second [m].
ALIKE_M, WAY_M = 0.0003, 0.002


@dataclass(frozen=True)
class RestingPrior:
    """What is known of an object's place without its cloud.

    Attributes
    ----------
    plane : (4,) array
        Table, camera frame; normal to the camera's side.
    support : Support
        Object frame.
    point_m : (3,) array
        Declared point, object frame [m].
    centre_m, tip_m : (3,) arrays
        Sphere's centre at the first touch, object frame, and where it was then, camera frame [m].
    radius_m : float
        Of the sphere.
    direction, way : (3,) arrays
        Declared direction of the press, object frame, and where the tip went, camera frame, of
        length 1; 0 where nothing is known.
    """

    plane: NDArray
    support: Support
    point_m: NDArray
    centre_m: NDArray
    tip_m: NDArray
    radius_m: float
    direction: NDArray = field(default_factory=lambda: np.zeros(3))
    way: NDArray = field(default_factory=lambda: np.zeros(3))

    def pose(self, yaw: float) -> NDArray:
        """Camera_from_object that stands on the table with the touching tip, turned by a yaw."""
        upright, _ = Rotation.align_vectors([self.plane[:3]], [self.support.up])
        pose = np.eye(4)
        pose[:3, :3] = upright.as_matrix() @ Rotation.from_rotvec(yaw * self.support.up).as_matrix()
        pose[:3, 3] = self.tip_m - pose[:3, :3] @ self.centre_m
        pose[:3, 3] -= self.height_m(pose) * self.plane[:3]
        return pose

    def height_m(self, pose: NDArray) -> float:
        """Height of the support above the table in a pose [m]."""
        return float(to_camera(pose, self.support.plane_point_m) @ self.plane[:3] + self.plane[3])

    def equations(self, pose: NDArray) -> tuple[NDArray, NDArray]:
        """Weighted rows (7, 6) and right side of a step, by each one's standard deviation.

        The step, rotation vector and shift, moves points of the camera in the object frame.
        """
        normal, point = pose[:3, :3].T @ self.plane[:3], to_object(pose, self.tip_m)
        support, none = self.support.plane_point_m, np.zeros((3, 3))
        rows = np.vstack(
            [
                np.hstack([-_cross(point), np.eye(3)]) / TOUCH_STD_M,
                np.hstack([-_cross(normal), none]) / TILT_STD_RAD,
                np.append(np.cross(support, normal), normal)[None] / HEIGHT_STD_M,
            ]
        )
        right = np.concatenate(
            [
                (self.centre_m - point) / TOUCH_STD_M,
                (self.support.up - normal) / TILT_STD_RAD,
                [self.height_m(pose) / HEIGHT_STD_M],
            ]
        )
        return rows, right


def initial_pose(template: Template, cloud_m: NDArray, resting: RestingPrior) -> NDArray:
    """Find the template's pose from the table, the touched point and the cloud.

    The support lies on the table and the tip where the press first touches; what is left, the
    turn about the table's normal, is the one that brings the cloud nearest to the surface; of
    turns that do so alike, as a block's do, the one whose press goes the way that the tip went.

    Parameters
    ----------
    template : Template
    cloud_m : (n, 3) array
        First frame's cloud, camera frame [m].
    resting : RestingPrior

    Returns
    -------
    (4, 4) array
        camera_from_object.
    """
    sample = cloud_m[:: max(1, len(cloud_m) // SAMPLE)]
    closest = ClosestPoints(template.vertices_m, template.faces)
    turns = np.linspace(0, 2 * np.pi, YAW_STEPS, endpoint=False)
    candidates = [resting.pose(yaw) for yaw in turns]
    away = [np.sort(closest.distance(to_object(pose, sample))) for pose in candidates]
    costs = np.array([distance[: int(TRIM * len(distance))].mean() for distance in away])
    ways = [1 - (pose[:3, :3] @ resting.direction) @ resting.way for pose in candidates]
    found = np.where(costs < costs.min() + ALIKE_M, costs + WAY_M * np.array(ways), np.inf)
    return candidates[int(np.argmin(found))]


def align_rigidly(
    template: Template,
    cloud_m: NDArray,
    normals: NDArray,
    pose: NDArray,
    options: Aligning,
    *,
    resting: RestingPrior | None = None,
) -> NDArray:
    """Minimise Eq. 4.24 from a first pose, then the same from the cloud to the template.

    Eq. 4.24 pairs template vertices with the cloud; where the object is seen in part it may slide
    (Fig. 5.6). The template covers all of the object, so every point of the cloud has its place on
    it, and the second step, along the template's normals, takes the sliding out. What no normal
    shows, as turns of a ball, follows table and touched point.

    Parameters
    ----------
    template : Template
    cloud_m, normals : (n, 3) arrays
        First frame's cloud [m] and unit normals, camera frame.
    pose : (4, 4) array
        First camera_from_object.
    options : Aligning
    resting : RestingPrior, optional

    Returns
    -------
    (4, 4) array
        camera_from_object.
    """
    largest_m = options.largest_distance_m
    limits = largest_m, float(np.cos(np.deg2rad(options.largest_normal_deg)))
    tree, moved_m = cKDTree(cloud_m), np.inf
    for _ in range(ALIGNMENT_STEPS):
        # Without pairs the way is not a number, and there is nothing to go on with.
        if not moved_m >= CONVERGED_M:
            break
        pose, moved_m = nearest_step(template, pose, tree, normals, *limits)
    return _polished(template, cloud_m, pose, largest_m, resting)


def nearest_step(
    template: Template,
    pose: NDArray,
    tree: cKDTree,
    normals: NDArray,
    largest_distance_m: float,
    least_cosine: float,
) -> tuple[NDArray, float]:
    """One step of Eq. 4.24: pair template vertices with their nearest points, and move onto them.

    Parameters
    ----------
    template : Template
    pose : (4, 4) array
        camera_from_object before the step.
    tree : cKDTree
        Of the data points, camera frame.
    normals : (k, 3) array
        Their unit normals.
    largest_distance_m, least_cosine : float
        dr and the cosine of the angle threshold.

    Returns
    -------
    pose : (4, 4) array
        As it was where fewer than six pairs count.
    moved_m : float
        Largest way of a vertex; not a number where fewer than six pairs count [m].
    """
    placed = to_camera(pose, template.vertices_m)
    directions = vertex_normals(placed, template.faces)
    weights, nearest, _ = data_weights(
        placed, directions, tree, normals, largest_distance_m, least_cosine
    )
    if weights.sum() < FEWEST_PAIRS:
        return pose, float("nan")
    step = _kabsch(placed[weights], tree.data[nearest[weights]])
    return step @ pose, _moved(step, placed)


def data_weights(
    vertices: NDArray,
    directions: NDArray,
    tree: cKDTree,
    normals: NDArray,
    largest_distance_m: float,
    least_cosine: float,
) -> tuple[NDArray, NDArray, NDArray]:
    """Nearest data points and which of them count (weights of Eq. 4.24).

    A data point on the boundary of the cloud is chosen by many vertices, and counts for none.

    Parameters
    ----------
    vertices, directions : (n, 3) arrays
        Template vertices [m] and unit normals, camera frame.
    tree : cKDTree
        Of the data points.
    normals : (k, 3) array
        Unit normals of the data points.
    largest_distance_m, least_cosine : float

    Returns
    -------
    weights : (n,) bool array
    nearest : (n,) int array
    crowded : (n,) bool array
        Vertices whose data point was chosen by many (B_i >= 2 B_ave).
    """
    distance, nearest = tree.query(vertices)
    alike = (directions * normals[nearest]).sum(axis=1) > least_cosine
    weights = alike & (distance < largest_distance_m)
    chosen, counts = np.unique(nearest, return_counts=True)
    crowded = counts[np.searchsorted(chosen, nearest)] >= CROWDED * counts.mean()
    return weights & ~crowded, nearest, crowded


def to_camera(pose: NDArray, points_m: NDArray) -> NDArray:
    """Points of the object frame in the camera frame."""
    return points_m @ pose[:3, :3].T + pose[:3, 3]


def to_object(pose: NDArray, points_m: NDArray) -> NDArray:
    """Points of the camera frame in the object frame."""
    return (points_m - pose[:3, 3]) @ pose[:3, :3]


def _kabsch(source: NDArray, target: NDArray) -> NDArray:
    """Rigid step that brings source points nearest to target points."""
    turn, _ = Rotation.align_vectors(target - target.mean(axis=0), source - source.mean(axis=0))
    step = np.eye(4)
    step[:3, :3] = turn.as_matrix()
    step[:3, 3] = target.mean(axis=0) - step[:3, :3] @ source.mean(axis=0)
    return step


def _polished(
    template: Template, cloud: NDArray, pose: NDArray, largest: float, resting: RestingPrior | None
) -> NDArray:
    """Gauss-Newton on distances of the cloud along the template's normals, and on the standing."""
    closest = ClosestPoints(template.vertices_m, template.faces)
    face_normals = doubled_normals(template.vertices_m, template.faces)
    face_normals /= np.linalg.norm(face_normals, axis=1, keepdims=True)
    for _ in range(POLISHING_STEPS):
        points = to_object(pose, cloud)
        foot, triangle, _ = closest(points)
        residual = ((points - foot) * face_normals[triangle]).sum(axis=1)
        gap = np.linalg.norm(points - foot, axis=1)
        kept = gap < min(largest, 3 * np.median(gap) + 1e-4)
        if kept.sum() < FEWEST_PAIRS:
            break
        n, x = face_normals[triangle][kept], points[kept]
        weight = 1 / (np.sqrt(SHARED_ERRORS) * (FROM_MEDIAN * np.median(gap[kept]) + 1e-6))
        rows, right = weight * np.hstack([np.cross(x, n), n]), -weight * residual[kept]
        if resting is not None:
            more, known = resting.equations(pose)
            rows, right = np.vstack([rows, more]), np.concatenate([right, known])
        solution, *_ = np.linalg.lstsq(rows, right, rcond=1e-6)
        step = np.eye(4)
        step[:3, :3] = Rotation.from_rotvec(solution[:3]).as_matrix()
        step[:3, 3] = solution[3:]
        pose = pose @ np.linalg.inv(step)
        if _moved(step, x) < CONVERGED_M:
            break
    return pose


def _cross(vector: NDArray) -> NDArray:
    """Matrix of the cross product with a vector, (3, 3)."""
    x, y, z = vector
    return np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])


def _moved(step: NDArray, points: NDArray) -> float:
    return float(np.linalg.norm(to_camera(step, points) - points, axis=1).max())
