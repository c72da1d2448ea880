"""Pose of the probe's board from its corners, and filters of its tip (Sections 4.2.2, 4.2.3)."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
import pandas as pd
from numpy.typing import NDArray

from palpate.vision.board import FlatBoard
from palpate.vision.camera import PinholeCamera
from palpate.yaml_files import mismatch

REFINE_STOP = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_MAX_ITER, 50, 1e-10)
RANSAC_ITERATIONS = 200
FEWEST_INLIERS = 6
# What sub-pixel corners of a printed board are off, at least [px].
CORNER_NOISE_PX = 0.05
# How far an operator turns the probe from one frame to the next; the two solutions of a planar
# target lie several times farther apart.
OPERATOR_TURN_RAD = np.deg2rad(5.0)
# A step costs no more than this, however far it turns: past it no solution is likelier.
DEAREST_STEP = 100.0
# A threshold may be selected when it leaves a pose in at least this part of the frames.
LEAST_FOUND = 0.99
# Deviations that differ by less than this part count as the same; of them the smallest threshold
# is selected.
SAME = 0.02
# What the pose is read of.
CORNERS, REFINED = "corners", "photometric"
# Eq. 4.21: observation model, measurement variance, first covariance, process noise.
H, R, P0, Q = 1.0, 10.0, 0.0, 1.0
# Of a pose, beyond what it is stated to; and of the probe: at 6 Hz the smoother then hardly does
# more than bridge gaps.
MEASUREMENT_STD_M, ACCELERATION_STD_M_S2 = 0.0001, 0.2


@dataclass(frozen=True)
class MarkerPose:
    """Where the board is."""

    camera_from_marker: NDArray  # (4, 4), rigid transform [m]
    # (6, 6), of a rotation vector applied in the camera frame and of the origin's place [rad, m]
    covariance: NDArray
    inliers: int = 0  # corners that RANSAC kept; 0 of a pose that is not from corners
    reprojection_error_px: float = np.nan  # root mean square over the inliers [px]
    refined: bool = False  # whether it is from the picture of all that is printed


def candidate_poses(
    corners_px: NDArray, camera: PinholeCamera, board: FlatBoard, *, threshold_px: float
) -> list[MarkerPose]:
    """Both poses that a planar board's corners allow, the better fit first.

    RANSAC picks the corners whose reprojection stays below the threshold; both solutions of the
    planar problem are refined on them.

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
    seen, lens = np.isfinite(corners_px[:, 0]), (camera.matrix, np.array(camera.distortion))
    points, corners = board.points_m[seen], corners_px[seen]
    if len(points) < FEWEST_INLIERS:
        return []
    ransac = {"iterationsCount": RANSAC_ITERATIONS, "reprojectionError": threshold_px}
    done, _, _, kept = cv2.solvePnPRansac(points, corners, *lens, **ransac)
    if not done or kept is None or len(kept) < FEWEST_INLIERS:
        return []
    kept = np.sort(kept.ravel())
    points, corners = points[kept], corners[kept]
    _, *solutions, _ = cv2.solvePnPGeneric(points, corners, *lens, flags=cv2.SOLVEPNP_IPPE)
    poses = []
    for turn, shift in zip(*solutions, strict=True):
        turn, shift = cv2.solvePnPRefineLM(points, corners, *lens, turn, shift, REFINE_STOP)
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = cv2.Rodrigues(turn)[0], shift.ravel()
        pixels, by_pose, _ = projected(points, pose, camera)
        square = ((pixels - corners) ** 2).sum()
        # RANSAC leaves out the worst corners, and a few say little: never below what corners have.
        variance = max(square / (2 * len(points) - 6), CORNER_NOISE_PX**2)
        covariance = variance * np.linalg.inv(by_pose.T @ by_pose)
        error_px = float(np.sqrt(square / len(points)))
        poses.append(MarkerPose(pose, covariance, len(points), error_px))
    return sorted(poses, key=lambda pose: pose.reprojection_error_px)


def settle(candidates: Sequence[Sequence[MarkerPose]]) -> list[MarkerPose | None]:
    """Choose the candidate of each frame, None where it has none, that fit best and turn least.

    The cheapest path through the frames (Viterbi): a candidate costs its misfit in units of the
    best fits' error, a step from frame to frame the square of its turn in units of an operator's in
    the frames between, up to a limit.

    Parameters
    ----------
    candidates : sequence of sequence of MarkerPose
        Of each frame; empty where the board was not seen.
    """
    seen = [k for k, poses in enumerate(candidates) if poses]
    chosen: list[MarkerPose | None] = [None] * len(candidates)
    if not seen:
        return chosen
    scale = max(np.median([candidates[k][0].reprojection_error_px for k in seen]), 1e-6)
    turns = [np.stack([pose.camera_from_marker[:3, :3] for pose in candidates[k]]) for k in seen]
    costs, origins = [], []
    for place, k in enumerate(seen):
        misfit = np.array(
            [pose.inliers * (pose.reprojection_error_px / scale) ** 2 for pose in candidates[k]]
        )
        if place:
            cosine = (np.einsum("aij,bij->ab", *turns[place - 1 : place + 1]) - 1) / 2
            angles = np.arccos(np.clip(cosine, -1, 1)) / OPERATOR_TURN_RAD
            steps = angles**2 / (k - seen[place - 1]) ** 2
            paths = costs[-1][:, None] + np.minimum(steps, DEAREST_STEP)
            origins.append(paths.argmin(axis=0))
            misfit = misfit + paths.min(axis=0)
        costs.append(misfit)
    best = int(np.argmin(costs[-1]))
    for place in range(len(seen) - 1, -1, -1):
        chosen[seen[place]] = candidates[seen[place]][best]
        best = int(origins[place - 1][best]) if place else best
    return chosen


def point_covariance(camera_from_marker: NDArray, covariance: NDArray, point_m: NDArray) -> NDArray:
    """Covariance of a point fixed to the board, camera frame, (3, 3) [m^2].

    By the pose (4, 4), its covariance (6, 6) as of `MarkerPose`, and the point (3,), marker frame.
    """
    jacobian = np.hstack([by_turn(camera_from_marker[:3, :3] @ point_m), np.eye(3)])
    return jacobian @ covariance @ jacobian.T


def corner_cofactor(points_m: NDArray, pose: NDArray, camera: PinholeCamera) -> NDArray:
    """Covariance of a pose, as of `MarkerPose`, from corners with independent errors of one pixel.

    By the corners (n, 3), marker frame [m], and the pose camera_from_marker (4, 4).
    """
    _, by_pose, _ = projected(points_m, pose, camera)
    return np.linalg.inv(by_pose.T @ by_pose)


def projected(
    points_m: NDArray, pose: NDArray, camera: PinholeCamera
) -> tuple[NDArray, NDArray, NDArray]:
    """Corners (n, 2) [px], and their derivatives by the pose (2n, 6) and by the optics (2n, 9)."""
    lens = camera.matrix, np.array(camera.distortion)
    turn = cv2.Rodrigues(np.ascontiguousarray(pose[:3, :3]))[0]
    corners, jacobian = cv2.projectPoints(points_m, turn, pose[:3, 3], *lens)
    by_shift = jacobian[:, 3:6].reshape(-1, 2, 3)
    by_rotation = by_shift @ by_turn(points_m @ pose[:3, :3].T)
    by_pose = np.concatenate([by_rotation, by_shift], axis=-1).reshape(-1, 6)
    return corners.reshape(-1, 2), by_pose, jacobian[:, 6:]


def by_turn(places: NDArray) -> NDArray:
    """Derivatives of places (..., 3) by a rotation vector before them, (..., 3, 3)."""
    by = np.cross(np.eye(3), places[..., None, :]).swapaxes(-1, -2)
    return np.ascontiguousarray(by)


def averages(table: pd.DataFrame) -> pd.DataFrame:
    """Means of workspace.csv at each ``threshold_px`` (Eq. 4.22); ``found`` as a part of frames."""
    ours = table[table["method"] == CORNERS]
    groups = ours.groupby("threshold_px")
    means = groups[[name for name in ours if name.startswith(("std_", "inl", "repr"))]].mean()
    means["found"] = groups["found"].sum() / groups["frames"].sum()
    return means


def select_threshold(table: pd.DataFrame) -> float:
    """Reprojection threshold with the least deviation of the target's angle (Figure 4.16) [px].

    Of the thresholds that leave a pose in nearly all frames the one with the smallest mean
    deviation; among those within 2 % of it the smallest.

    Raises
    ------
    ValueError
        If no threshold leaves a pose in enough frames.
    """
    means = averages(table)
    usable = means[means["found"] >= LEAST_FOUND]["std_angle_rad"]
    if usable.empty:
        expected = f"a threshold with a pose in {LEAST_FOUND:.0%} of the frames"
        raise mismatch("workspace", expected, f"at most {means['found'].max():.0%}")
    return float(usable[usable <= (1 + SAME) * usable.min()].index[0])


def smooth_tip(
    time_s: NDArray,
    tip_m: NDArray,
    tip_std_m: NDArray,
    *,
    acceleration_std_m_s2: float = ACCELERATION_STD_M_S2,
) -> NDArray:
    """Smooth a tip's path (n, 3) [m], each axis for itself, across gaps.

    A constant-velocity Kalman filter and the smoother of Rauch, Tung and Striebel.

    Parameters
    ----------
    time_s : (n,) array
        Increasing times of the frames [s], not necessarily even.
    tip_m : (n, 3) array
        Measured positions [m], one at least; rows of NaN are gaps.
    tip_std_m : (n, 3) array
        Standard deviations of the measurements [m], finite and above 0.
    acceleration_std_m_s2 : float, optional
        Standard deviation of the tip's acceleration [m/s^2].
    """
    columns = zip(tip_m.T, tip_std_m.T, strict=True)
    return np.column_stack([_smooth(time_s, *column, acceleration_std_m_s2) for column in columns])


def study_filter(values: NDArray) -> NDArray:
    """Scalar Kalman filter of Eq. 4.21 with the study's constants, down each column of (n, k).

    Its model is a point that rests, so a moving tip is followed late: about 2.7 frames on a ramp.
    """
    estimate, covariance = values[0].astype(float), P0
    path = [estimate]
    for value in values[1:]:
        gain = covariance * H / (H * covariance * H + R)
        estimate = estimate + gain * (value - H * estimate)
        covariance = (1 - gain * H) * covariance + Q
        path.append(estimate)
    return np.array(path)


def _smooth(
    time_s: NDArray, values: NDArray, std: NDArray, acceleration_std_m_s2: float
) -> NDArray:
    """One coordinate under white acceleration; NaN among the values are gaps."""
    if not (measured := np.isfinite(values)).any():
        raise ValueError("values: expected at least one measurement, found none")
    # Nothing is known before the first measurement: a metre, and a metre a second.
    state, covariance = np.array([values[measured][0], 0.0]), np.eye(2)
    forward = []
    for step, value, deviation in zip(np.diff(time_s, prepend=time_s[0]), values, std, strict=True):
        F = np.array([[1.0, step], [0.0, 1.0]])
        W = np.array([[step**4 / 4, step**3 / 2], [step**3 / 2, step**2]])
        predicted = F @ state, F @ covariance @ F.T + acceleration_std_m_s2**2 * W
        state, covariance = predicted
        if np.isfinite(value):
            gain = covariance[:, 0] / (covariance[0, 0] + deviation**2)
            state = state + gain * (value - state[0])
            covariance = covariance - np.outer(gain, covariance[0])
        forward.append((F, *predicted, state, covariance))
    smoothed = state
    path = [smoothed[0]]
    for (*_, state, covariance), (F, ahead, ahead_covariance, *_) in zip(
        forward[-2::-1], forward[:0:-1], strict=True
    ):
        gain = np.linalg.solve(ahead_covariance.T, (covariance @ F.T).T).T
        smoothed = state + gain @ (smoothed - ahead)
        path.append(smoothed[0])
    return np.array(path[::-1])
