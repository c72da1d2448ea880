"""Views of a target on a tracked frame as one least-squares problem: start, fit, derivatives."""

from dataclasses import dataclass, fields
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from palpate.vision.board import FlatBoard
from palpate.vision.calibration_problem import matrix_of
from palpate.vision.camera import PinholeCamera
from palpate.vision.pose import CORNER_NOISE_PX, by_turn, projected

# The start is the best of closed forms of so many views, and most views are within so many medians.
START_VIEWS, TRIES, START_OUT = 4, 20, 6.0
# Where a step of each frame is among the unknowns, and the poses' clock.
CAMERA, TARGET, CLOCK = slice(0, 6), slice(6, 12), 12
# camera_from_base, tracked_from_target, and the poses' clock minus the camera's [s].
Frames = tuple[NDArray, NDArray, float]


@dataclass(frozen=True)
class Views:
    """Poses in which a camera saw the target, in the order of time.

    Attributes
    ----------
    names : (n,) array of str
    corners_px : (n, k, 2) array
        Of the target, NaN where one is not seen [px].
    camera_from_target, base_from_tracked : (n, 4, 4) arrays
        By the corners of each view, and by the record of poses.
    std, speed : (n, 6) arrays
        Deviations of `base_from_tracked` and its changes in a second: a rotation vector applied in
        the base frame, and the shift [rad, m].
    """

    names: NDArray
    corners_px: NDArray
    camera_from_target: NDArray
    base_from_tracked: NDArray
    std: NDArray
    speed: NDArray

    def some(self, kept: NDArray) -> "Views":
        """Those of a mask."""
        return Views(*(getattr(self, field.name)[kept] for field in fields(self)))


class Linear(NamedTuple):
    """What views are off by at some frames, and what that depends on.

    Attributes
    ----------
    off, spread : (n, 6) and (n, 6, 6) arrays
        Turn and shift of the target from where its corners have it, camera frame [rad, m], and the
        covariance of that.
    by, by_optics : (n, 6, 13) and (n, 6, 9) arrays
        Derivatives by steps of the frames and the clock, and by the optics.
    residuals : (n, 2 k) array
        Of the corners, 0 where one is not seen [px].
    """

    off: NDArray
    spread: NDArray
    by: NDArray
    by_optics: NDArray
    residuals: NDArray


def linear(views: Views, board: FlatBoard, camera: PinholeCamera, frames: Frames) -> Linear:
    """Compare views with where some frames have the target."""
    camera_from_base, tracked_from_target, delay_s = frames
    bases, count = tracked(views, delay_s), len(views.names)
    poses = camera_from_base @ bases @ tracked_from_target
    each = zip(*(projected(board.points_m, pose, camera) for pose in poses), strict=True)
    pixels, by_pose, by_optics = map(np.stack, each)
    seen = np.repeat(np.isfinite(views.corners_px[..., 0]), 2, axis=1)
    residuals = np.where(seen, (pixels - views.corners_px).reshape(count, -1), 0)
    by_pose = seen[..., None] * by_pose
    back = np.linalg.pinv(by_pose)
    off = np.einsum("nij,nj->ni", back, residuals)
    # What of its corners no pose explains is their noise.
    inside = residuals - np.einsum("nij,nj->ni", by_pose, off)
    variance = np.median((inside**2).sum(axis=1) / (seen.sum(axis=1) - 6))
    zero, one = np.zeros((count, 3, 3)), np.broadcast_to(np.eye(3), (count, 3, 3))
    turn, turns = one @ camera_from_base[:3, :3], (camera_from_base @ bases)[:, :3, :3]
    lever = by_turn(bases[:, :3, :3] @ tracked_from_target[:3, 3])
    by_tracked = np.block([[turn, zero], [turn @ lever, turn]])
    by_camera = np.block([[one, zero], [by_turn(poses[:, :3, 3] - camera_from_base[:3, 3]), one]])
    by_target = np.block([[turns, zero], [zero, turns]])
    by = np.concatenate([by_camera, by_target, by_tracked @ views.speed[..., None]], axis=2)
    stated = by_tracked * views.std[:, None]
    spread = max(variance, CORNER_NOISE_PX**2) * back @ back.transpose(0, 2, 1)
    spread = spread + stated @ stated.transpose(0, 2, 1)
    return Linear(off, spread, by, back @ by_optics, residuals)


def tracked(views: Views, delay_s: float) -> NDArray:
    """Poses base_from_tracked a delay later, (n, 4, 4)."""
    found = views.base_from_tracked.copy()
    turn = Rotation.from_rotvec(delay_s * views.speed[:, :3]).as_matrix()
    found[:, :3, :3] = turn @ found[:, :3, :3]
    found[:, :3, 3] += delay_s * views.speed[:, 3:]
    return found


def fitted(
    views: Views, board: FlatBoard, camera: PinholeCamera, frames: Frames, weak: NDArray
) -> Frames:
    """Frames that fit best, each view counting as it does at those given.

    The deviations (13,) of what is known without views keep steps finite that no view determines.
    """
    white = np.linalg.inv(np.linalg.cholesky(linear(views, board, camera, frames).spread))

    def stepped(x: NDArray) -> Frames:
        return *(map(_stepped, frames[:2], (x[CAMERA], x[TARGET]))), float(x[CLOCK])

    @lru_cache(maxsize=1)
    def at(*x: float) -> Linear:
        return linear(views, board, camera, stepped(np.array(x)))

    def off(x: NDArray) -> NDArray:
        return np.append(white @ at(*x).off[..., None], x / weak)

    def by(x: NDArray) -> NDArray:
        return np.vstack([(white @ at(*x).by).reshape(-1, len(x)), np.diag(1 / weak)])

    start = np.append(np.zeros(CLOCK), frames[2])
    return stepped(least_squares(off, start, by, method="lm").x)


def _stepped(frame: NDArray, step: NDArray) -> NDArray:
    """A frame (4, 4) after a rotation vector and a shift (6,) of it."""
    turn = matrix_of(np.append(step[:3], np.zeros(3)))
    moved = turn @ frame
    moved[:3, 3] = frame[:3, 3] + step[3:]
    return moved


def first_frames(views: Views, points_m: NDArray, turns: NDArray) -> tuple[Frames, NDArray]:
    """Frames by which most views are near, and which are, (n,) bool.

    The best of closed forms of few views, so that one that is off does not count: M. Shah, Solving
    the robot-world/hand-eye calibration problem using the Kronecker product, J. Mechanisms
    Robotics 5 (2013), Section 3. Where all turns are about one axis it leaves a turn about that
    open: the best of some, rotation vectors (k, 3), counts.
    """
    B, C = views.base_from_tracked, views.camera_from_target
    rng, count, found = np.random.default_rng(0), len(B), []
    corners = np.column_stack([points_m, np.ones(len(points_m))]).T
    for trial in range(TRIES if count > START_VIEWS else 1):
        few = rng.choice(count, START_VIEWS, replace=False) if trial else np.arange(count)
        pairs = zip(B[few, :3, :3], C[few, :3, :3], strict=True)
        left, _, right = np.linalg.svd(sum(np.kron(b, c) for b, c in pairs))
        left, _, right = np.linalg.svd(left[:, 0].reshape(3, 3).T)
        for turn in Rotation.from_rotvec(turns).as_matrix():
            frames = _closed(B[few], C[few], left @ right * np.linalg.det(left @ right) @ turn)
            apart = (frames[0] @ B @ frames[1] - C) @ corners
            far = np.sqrt((apart**2).sum(axis=1).mean(axis=1))
            found.append((float(np.median(far)), frames, far))
    median, frames, far = min(found, key=lambda one: one[0])
    return (*frames, 0.0), far <= START_OUT * median


def _closed(B: NDArray, C: NDArray, turn: NDArray) -> tuple[NDArray, NDArray]:
    """Both frames of some views, by the camera's rotation."""
    X, T = np.eye(4), np.eye(4)
    X[:3, :3], turns = turn, np.swapaxes(turn @ B[:, :3, :3], 1, 2) @ C[:, :3, :3]
    T[:3, :3] = Rotation.from_matrix(turns).mean().as_matrix()
    # Shifts, the least where poses leave them open.
    rows = [np.broadcast_to(np.eye(3), turns.shape), turn @ B[:, :3, :3]]
    shifts = C[:, :3, 3] - B[:, :3, 3] @ turn.T
    rows = np.concatenate(rows, axis=2).reshape(-1, 6)
    X[:3, 3], T[:3, 3] = np.split(np.linalg.lstsq(rows, shifts.ravel(), rcond=1e-3)[0], 2)
    return X, T
