"""The camera in a robot's or a tracker's base frame, by a target on what is tracked: AX = ZB."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from functools import lru_cache
from math import degrees
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

from palpate.config.sensor import said_of_base
from palpate.units import MILLIMETRES
from palpate.vision.board import FlatBoard
from palpate.vision.board_pictures import Views, tracked_views
from palpate.vision.calibration_problem import matrix_of
from palpate.vision.camera import PinholeCamera, camera_from_spec
from palpate.vision.marker import board_of
from palpate.vision.pivot import LEAST_SHARED, alike, largest_std, optics_covariance, require_turn
from palpate.vision.pose import CORNER_NOISE_PX, by_turn, point_covariance, projected

# Three poses about two axes determine the unknowns; so many show whether one of them is off.
FEWEST_POSES, WANTED_POSES = 3, 12
# Below, root mean square, turns are about one axis; above, the deviations judge.
LEAST_TURN_DEG = 2.0
# The start is the best of closed forms of so many views, and most views are within so many medians.
START_VIEWS, TRIES, START_OUT = 4, 20, 6.0
# Deviations of what is known of the frames before any pose [rad, m].
VAGUE = np.repeat([3.0, 1.0, 3.0, 1.0], 3)
# A pose as stated is left out, or poses as stated are called worse, so seldom; and so many at most.
UNLIKELY, MOST_LEFT_OUT, MOST_ROUNDS = 1e-5, 1 / 3, 20
# Deviations of a correlation of neighbours that are no chance.
CHANCE = 3.0
# A target of another size, or poses in another unit or of another frame, are farther off.
LARGEST_OFF_M = 0.01
# Up to which the camera is determined: a place where the poses were, and its turn.
LARGEST_STD_M, LARGEST_STD_RAD = 0.002, 0.003
# Where a step of each frame is among the unknowns, and the poses' clock.
CAMERA, TARGET, CLOCK = slice(0, 6), slice(6, 12), 12
# camera_from_base, tracked_from_target, and the poses' clock minus the camera's [s].
Frames = tuple[NDArray, NDArray, float]


@dataclass(frozen=True)
class HandEye:
    """Where the camera is in the base frame, and how well the poses determine it."""

    camera_from_base: NDArray  # (4, 4)
    tracked_from_target: NDArray  # (4, 4)
    # (6, 6), of a rotation vector applied in the camera frame and of the shift of
    # `camera_from_base` [rad, m]; what the optics are wrong by is in it
    covariance: NDArray
    # of the poses' clock minus the camera's [s]
    clock_offset_s: float
    clock_offset_std_s: float
    # deviations of a place where the poses were and of the camera's turn, the worst ways
    std_m: float
    turn_std_rad: float
    residual_px: float  # root mean square distance of corners from where these frames have them
    worse: float  # how many times farther off poses are than stated; 1 where they may be as stated
    poses: int
    # poses that were left out, and how far the target is from where the others have it
    left_out_m: dict[str, float]
    # (3,), root mean square by which the base's directions turned, the least first
    turn_deg: NDArray

    @property
    def verdict(self) -> str:
        """Whether the camera's place is determined, and else what would determine it."""
        how = f"{self.std_m * MILLIMETRES:.2g} mm where the poses were"
        how = f"determined, to {how}, and {degrees(self.turn_std_rad):.2g} degrees"
        if self.std_m <= LARGEST_STD_M and self.turn_std_rad <= LARGEST_STD_RAD:
            return f"camera: {how}"
        return f"camera: not {how}: more poses that tilt farther, or calibrated optics"

    @property
    def warnings(self) -> list[str]:
        """What else is to be looked at."""
        found, worse = self.poses - len(self.left_out_m), f"{self.worse:.1f} times what is stated"
        few = f"{found} poses count: {WANTED_POSES} or more show whether one is off"
        off = f"poses are off by {worse} of them (an arm's accuracy, or the size of the target?)"
        return [few] * (found < WANTED_POSES) + [off] * (self.worse > 1)

    def fields(self, sensor: str) -> dict:
        """What hand_eye.json says, of a sensor by its name."""
        every = asdict(self) | {"warnings": self.warnings, "verdict": self.verdict}
        plain = {k: v.tolist() if isinstance(v, np.ndarray) else v for k, v in every.items()}
        return {"sensor": sensor, **plain}


def recorded_hand_eye(folder: Path, sensor: Mapping, marker: Mapping) -> HandEye:
    """`find_hand_eye` of a recording with images and probe_poses.csv.

    Parameters
    ----------
    folder : path
    sensor, marker : mapping
        The sensor's file, and the target's block.

    Raises
    ------
    ValueError
        As `find_hand_eye` and `palpate.vision.board_pictures.tracked_views` do.
    """
    board, color = board_of(marker), sensor["color"]
    views = tracked_views(folder, sensor, board)
    clock_std_s = said_of_base(sensor, "clock_offset_std_s")
    known = {"clock_std_s": clock_std_s, "optics": optics_covariance(color)}
    return find_hand_eye(views, board, camera_from_spec(color), **known)


def find_hand_eye(
    views: Views,
    board: FlatBoard,
    camera: PinholeCamera,
    *,
    clock_std_s: float,
    optics: NDArray | None = None,
) -> HandEye:
    """Camera in the base frame, and target in the tracked frame, by least squares of all corners.

    Parameters
    ----------
    views : Views
    board : FlatBoard
    camera : PinholeCamera
        Its optics stay as they are.
    clock_std_s : float
        How well the poses' clock is the camera's, before views of a moving target tell more.
    optics : (9, 9) array, optional
        Covariance of the optics, as `palpate.vision.pivot.optics_covariance` has it.

    Raises
    ------
    ValueError
        If there are fewer than three views, they hardly turn or about one axis alone, or too many
        are elsewhere.

    Notes
    -----
    Corners are those of X E_i B_i T: camera from base, error and record of a pose, tracked from
    target. Each error is a normal unknown that enters linearly, and is eliminated: a view then
    counts by the pose that its corners fit, with the covariance of their noise and of its error.
    """
    if (count := len(views.names)) < FEWEST_POSES:
        raise ValueError(f"poses: expected at least {FEWEST_POSES} with the target, found {count}")
    turns = views.base_from_tracked[:, :3, :3].transpose(0, 2, 1)
    place = "the camera's place along {} of the base"
    turn_deg = require_turn(turns, LEAST_TURN_DEG, "target", place)
    frames, kept = _first_frames(views, board.points_m)
    weak = np.append(VAGUE, clock_std_s)
    for _ in range(MOST_ROUNDS):
        frames, before = _fitted(views.some(kept), board, camera, frames, weak), kept
        part = _linear(views, board, camera, frames)
        squares = (part.off * np.linalg.solve(part.spread, part.off[..., None])[..., 0]).sum(axis=1)
        scale = max(1.0, float(np.median(squares)) / chi2.median(6))
        kept = squares <= scale * chi2.isf(UNLIKELY, 6)
        if np.array_equal(kept, before) or kept.sum() < FEWEST_POSES:
            break
    off_m, found = np.linalg.norm(part.off[:, 3:], axis=1), ""
    if kept.sum() < max(FEWEST_POSES, (1 - MOST_LEFT_OUT) * count):
        found = f"{count - kept.sum()} of {count} elsewhere"
    elif (rms_m := float(np.sqrt((off_m[kept] ** 2).mean()))) > LARGEST_OFF_M:
        found = f"them {rms_m * MILLIMETRES:.2g} mm apart"
    if found:
        raise ValueError(
            f"poses: expected camera and target at rest in their frames, found {found} (a loose"
            " target, a camera that moved, clocks apart, poses in another unit, quaternions in"
            " another order, another base?)"
        )
    free = 6 * kept.sum() - 12
    worse = squares[kept].sum() / free
    worse = worse if worse > chi2.isf(UNLIKELY, free) / free else 1.0
    by = part.by[kept].reshape(-1, len(weak))
    weighted = np.linalg.solve(part.spread[kept], part.by[kept]).reshape(by.shape).T
    own = np.linalg.inv(weighted @ by + np.diag(weak**-2.0))
    by_optics = own @ weighted @ part.by_optics[kept].reshape(len(by), -1)
    chance = CHANCE / np.sqrt(3 * kept.sum())
    own = own * worse * alike(part.off[kept, 3:], max(LEAST_SHARED, chance))
    if optics is not None:
        own += by_optics @ optics @ by_optics.T
    covariance, pixels = (own + own.T)[CAMERA, CAMERA] / 2, part.residuals[kept].reshape(-1, 2)
    place_m = (_tracked(views, frames[2]) @ frames[1])[kept, :3, 3].mean(axis=0)
    return HandEye(
        *frames[:2],
        covariance,
        clock_offset_s=frames[2],
        clock_offset_std_s=float(np.sqrt(own[CLOCK, CLOCK])),
        std_m=largest_std(point_covariance(frames[0], covariance, place_m)),
        turn_std_rad=largest_std(covariance[:3, :3]),
        residual_px=float(np.sqrt((pixels**2).sum() / pixels.any(axis=1).sum())),
        worse=float(np.sqrt(worse)),
        poses=count,
        left_out_m={str(views.names[k]): float(off_m[k]) for k in np.flatnonzero(~kept)},
        turn_deg=turn_deg,
    )


class _Linear(NamedTuple):
    """What views are off by at some frames, and what that depends on."""

    off: NDArray  # turn and shift of the target, camera frame, (n, 6) [rad, m]
    spread: NDArray  # covariance of that, (n, 6, 6)
    by: NDArray  # its derivatives by steps of the frames and the clock, (n, 6, 13)
    by_optics: NDArray  # and by the optics, (n, 6, 9)
    residuals: NDArray  # of the corners, 0 where one is not seen, (n, 2 k) [px]


def _linear(views: Views, board: FlatBoard, camera: PinholeCamera, frames: Frames) -> _Linear:
    """Compare views with where some frames have the target."""
    camera_from_base, tracked_from_target, delay_s = frames
    bases, count = _tracked(views, delay_s), len(views.names)
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
    return _Linear(off, spread, by, back @ by_optics, residuals)


def _tracked(views: Views, delay_s: float) -> NDArray:
    """Poses base_from_tracked a delay later, (n, 4, 4)."""
    found = views.base_from_tracked.copy()
    turn = Rotation.from_rotvec(delay_s * views.speed[:, :3]).as_matrix()
    found[:, :3, :3] = turn @ found[:, :3, :3]
    found[:, :3, 3] += delay_s * views.speed[:, 3:]
    return found


def _fitted(
    views: Views, board: FlatBoard, camera: PinholeCamera, frames: Frames, weak: NDArray
) -> Frames:
    """Frames that fit best, each view counting as it does at those given."""
    # The deviations (13,) of what is known without views keep steps finite that none determines.
    white = np.linalg.inv(np.linalg.cholesky(_linear(views, board, camera, frames).spread))

    def stepped(x: NDArray) -> Frames:
        found = []
        for frame, step in zip(frames[:2], (x[CAMERA], x[TARGET]), strict=True):
            found.append(matrix_of(np.append(step[:3], np.zeros(3))) @ frame)
            found[-1][:3, 3] = frame[:3, 3] + step[3:]
        return *found, float(x[CLOCK])

    @lru_cache(maxsize=1)
    def at(*x: float) -> _Linear:
        return _linear(views, board, camera, stepped(np.array(x)))

    def off(x: NDArray) -> NDArray:
        return np.append(white @ at(*x).off[..., None], x / weak)

    def by(x: NDArray) -> NDArray:
        return np.vstack([(white @ at(*x).by).reshape(-1, len(x)), np.diag(1 / weak)])

    start = np.append(np.zeros(CLOCK), frames[2])
    return stepped(least_squares(off, start, by, method="lm").x)


def _first_frames(views: Views, points_m: NDArray) -> tuple[Frames, NDArray]:
    """Frames by which most views are near, and which are, (n,) bool."""
    # The best of closed forms of few views, so that one that is off does not count: M. Shah,
    # Solving the robot-world/hand-eye calibration problem using the Kronecker product, J.
    # Mechanisms Robotics 5 (2013), Section 3.
    B, C = views.base_from_tracked, views.camera_from_target
    rng, count, found = np.random.default_rng(0), len(B), []
    corners = np.column_stack([points_m, np.ones(len(points_m))]).T
    for trial in range(TRIES if count > START_VIEWS else 1):
        few = rng.choice(count, START_VIEWS, replace=False) if trial else np.arange(count)
        pairs = zip(B[few, :3, :3], C[few, :3, :3], strict=True)
        left, _, right = np.linalg.svd(sum(np.kron(b, c) for b, c in pairs))
        left, _, right = np.linalg.svd(left[:, 0].reshape(3, 3).T)
        frames = _closed(B[few], C[few], left @ right * np.linalg.det(left @ right))
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
