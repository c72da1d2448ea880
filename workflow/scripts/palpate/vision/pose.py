"""Pose of the probe's board from its corners (Section 4.2.2)."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from palpate.vision.board import FlatBoard
from palpate.vision.camera import PinholeCamera

REFINE_STOP = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_MAX_ITER, 50, 1e-10)
RANSAC_ITERATIONS = 200
FEWEST_INLIERS = 6
# What sub-pixel corners of a printed board are off, at least [px].
CORNER_NOISE_PX = 0.05
# How far a hand turns the probe from one frame to the next; the two solutions of a planar board
# lie several times farther apart.
HAND_TURN_RAD = np.deg2rad(5.0)
# A step costs no more than this, however far it turns: past it no solution is likelier.
DEAREST_STEP = 100.0


@dataclass(frozen=True)
class MarkerPose:
    """Where the board is.

    Attributes
    ----------
    camera_from_marker : (4, 4) array
        Rigid transform [m].
    covariance : (6, 6) array
        Of a rotation vector applied in the camera frame and of the origin's place [rad, m].
    inliers : int
        Corners that RANSAC kept.
    reprojection_error_px : float
        Root mean square over the inliers [px].
    """

    camera_from_marker: NDArray
    covariance: NDArray
    inliers: int
    reprojection_error_px: float


def candidate_poses(
    corners_px: NDArray, camera: PinholeCamera, board: FlatBoard, *, threshold_px: float
) -> list[MarkerPose]:
    """Both poses that a planar board's corners allow, the better fit first.

    Parameters
    ----------
    corners_px : (n, 2) array
        The board's corners, NaN where one is not seen [px].
    camera : PinholeCamera
    board : FlatBoard
    threshold_px : float
        Largest reprojection error of an inlier [px] (Section 4.2.3).

    Returns
    -------
    list of MarkerPose
        Empty when too few corners agree.
    """
    return candidates_by_threshold(corners_px, camera, board, [threshold_px])[0]


def candidates_by_threshold(
    corners_px: NDArray, camera: PinholeCamera, board: FlatBoard, thresholds_px: Sequence[float]
) -> list[list[MarkerPose]]:
    """`candidate_poses` at each of several thresholds.

    RANSAC picks the corners whose reprojection stays below the threshold; both solutions of the
    planar problem are refined on them, once for all thresholds that leave the same corners.
    """
    seen, lens = np.isfinite(corners_px[:, 0]), (camera.matrix, np.array(camera.distortion))
    points, corners_px = board.points_m[seen], corners_px[seen]
    if seen.sum() < FEWEST_INLIERS:
        return [[] for _ in thresholds_px]
    known: dict[bytes, list[MarkerPose]] = {}
    found = []
    for threshold_px in thresholds_px:
        done, _, _, kept = cv2.solvePnPRansac(
            points,
            corners_px,
            *lens,
            iterationsCount=RANSAC_ITERATIONS,
            reprojectionError=threshold_px,
        )
        if not done or kept is None or len(kept) < FEWEST_INLIERS:
            found.append([])
            continue
        kept = np.sort(kept.ravel())
        key = kept.tobytes()
        if key not in known:
            known[key] = _both_poses(points[kept], corners_px[kept], lens)
        found.append(known[key])
    return found


def _both_poses(points: NDArray, corners: NDArray, lens: tuple) -> list[MarkerPose]:
    _, turns, shifts, _ = cv2.solvePnPGeneric(points, corners, *lens, flags=cv2.SOLVEPNP_IPPE)
    poses = [_refined(points, corners, lens, r, t) for r, t in zip(turns, shifts, strict=True)]
    return sorted(poses, key=lambda pose: pose.reprojection_error_px)


def settle(candidates: Sequence[Sequence[MarkerPose]]) -> list[MarkerPose | None]:
    """Choose among the candidates of all frames those that fit best and turn least.

    The cheapest way through the frames (Viterbi): a candidate costs its misfit in units of the
    best fits' error, a step from frame to frame the square of its turn in units of a hand's in the
    frames between, up to a limit.

    Parameters
    ----------
    candidates : sequence of sequence of MarkerPose
        Of each frame; empty where the board was not seen.

    Returns
    -------
    list of MarkerPose or None
        One for each frame.
    """
    seen = [k for k, poses in enumerate(candidates) if poses]
    chosen: list[MarkerPose | None] = [None] * len(candidates)
    if not seen:
        return chosen
    scale = np.median([candidates[k][0].reprojection_error_px for k in seen])
    costs, origins = [], []
    for place, k in enumerate(seen):
        misfit = np.array([_misfit(pose, scale) for pose in candidates[k]])
        if place:
            before = seen[place - 1]
            steps = _turn_costs(candidates[before], candidates[k]) / (k - before) ** 2
            ways = costs[-1][:, None] + np.minimum(steps, DEAREST_STEP)
            origins.append(ways.argmin(axis=0))
            misfit = misfit + ways.min(axis=0)
        costs.append(misfit)
    best = int(np.argmin(costs[-1]))
    for place in range(len(seen) - 1, -1, -1):
        chosen[seen[place]] = candidates[seen[place]][best]
        best = int(origins[place - 1][best]) if place else best
    return chosen


def point_covariance(camera_from_marker: NDArray, covariance: NDArray, point_m: NDArray) -> NDArray:
    """Covariance of a point fixed to the board, camera frame, shape (3, 3) [m^2].

    Parameters
    ----------
    camera_from_marker : (4, 4) array
    covariance : (6, 6) array
        Of the pose; see `MarkerPose`.
    point_m : (3,) array
        The point in the marker frame [m].
    """
    jacobian = np.hstack([by_turn(camera_from_marker[:3, :3] @ point_m), np.eye(3)])
    return jacobian @ covariance @ jacobian.T


def _refined(
    points: NDArray, corners: NDArray, lens: tuple, turn: NDArray, shift: NDArray
) -> MarkerPose:
    turn, shift = cv2.solvePnPRefineLM(points, corners, *lens, turn, shift, REFINE_STOP)
    projected, jacobian = cv2.projectPoints(points, turn, shift, *lens)
    square = ((projected.reshape(-1, 2) - corners) ** 2).sum()
    pose = np.eye(4)
    pose[:3, :3] = cv2.Rodrigues(turn)[0]
    pose[:3, 3] = shift.ravel()
    # RANSAC leaves out the worst corners, and a few say little: never below what corners have.
    variance = max(square / (2 * len(points) - 6), CORNER_NOISE_PX**2)
    covariance = variance * _cofactor(jacobian[:, 3:6], points @ pose[:3, :3].T)
    return MarkerPose(pose, covariance, len(points), float(np.sqrt(square / len(points))))


def corner_cofactor(points_m: NDArray, pose: NDArray, camera: PinholeCamera) -> NDArray:
    """Covariance of a pose from corners with independent errors of one pixel, (6, 6).

    Parameters
    ----------
    points_m : (n, 3) array
        Corners in the marker frame [m].
    pose : (4, 4) array
        camera_from_marker.
    camera : PinholeCamera
    """
    lens = camera.matrix, np.array(camera.distortion)
    turn = cv2.Rodrigues(np.ascontiguousarray(pose[:3, :3]))[0]
    _, jacobian = cv2.projectPoints(points_m, turn, pose[:3, 3], *lens)
    return _cofactor(jacobian[:, 3:6], points_m @ pose[:3, :3].T)


def pose_by_optics(points_m: NDArray, pose: NDArray, camera: PinholeCamera) -> NDArray:
    """Derivatives of a pose by the optics that its corners are read with, (6, 9).

    Of a rotation vector applied in the camera frame and of the shift, by fx_px, fy_px, cx_px,
    cy_px, k1, k2, p1, p2, k3, the corners staying where they are seen; see `corner_cofactor` for
    the parameters.
    """
    lens = camera.matrix, np.array(camera.distortion)
    turn = cv2.Rodrigues(np.ascontiguousarray(pose[:3, :3]))[0]
    _, jacobian = cv2.projectPoints(points_m, turn, pose[:3, 3], *lens)
    by_pose = _by_pose(jacobian[:, 3:6], points_m @ pose[:3, :3].T)
    return -np.linalg.lstsq(by_pose, jacobian[:, 6:], rcond=None)[0]


def _cofactor(by_shift: NDArray, turned: NDArray) -> NDArray:
    """Inverse of the normal matrix of rotation vector and shift, (6, 6)."""
    jacobian = _by_pose(by_shift, turned)
    return np.linalg.inv(jacobian.T @ jacobian)


def _by_pose(by_shift: NDArray, turned: NDArray) -> NDArray:
    """Derivatives of corners by rotation vector and shift, (2n, 6)."""
    rows = by_shift.reshape(-1, 2, 3)
    return np.concatenate([rows @ by_turn(turned), rows], axis=-1).reshape(-1, 6)


def by_turn(places: NDArray) -> NDArray:
    """Derivatives of places (..., 3) by a rotation vector before them, (..., 3, 3)."""
    x, y, z = np.moveaxis(places, -1, 0)
    zero = np.zeros_like(x)
    rows = (np.stack(row, axis=-1) for row in ((zero, z, -y), (-z, zero, x), (y, -x, zero)))
    return np.stack(list(rows), axis=-2)


def _misfit(pose: MarkerPose, scale: float) -> float:
    return pose.inliers * (pose.reprojection_error_px / max(scale, 1e-6)) ** 2


def _turn_costs(before: Sequence[MarkerPose], after: Sequence[MarkerPose]) -> NDArray:
    """Cost of each step from one frame's candidates to the next's."""
    first, second = (
        np.stack([pose.camera_from_marker[:3, :3] for pose in poses]) for poses in (before, after)
    )
    cosine = (np.einsum("aij,bij->ab", first, second) - 1) / 2
    return (np.arccos(np.clip(cosine, -1, 1)) / HAND_TURN_RAD) ** 2
