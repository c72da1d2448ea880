"""The camera in a robot's or a tracker's base frame, by a target on what is tracked: AX = ZB."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from math import degrees
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from palpate.config.sensor import said_of_base
from palpate.units import MILLIMETRES
from palpate.vision.board import FlatBoard
from palpate.vision.board_pictures import tracked_views
from palpate.vision.camera import PinholeCamera, camera_from_spec
from palpate.vision.hand_eye_problem import (
    CAMERA,
    CLOCK,
    Views,
    first_frames,
    fitted,
    linear,
    tracked,
)
from palpate.vision.marker import board_of
from palpate.vision.pivot import (
    LEAST_SHARED,
    LEAST_TURN_DEG,
    alike,
    largest_std,
    optics_covariance,
    turned,
)
from palpate.vision.pose import point_covariance

# Three poses about two axes determine the unknowns; so many show whether one of them is off.
FEWEST_POSES, WANTED_POSES = 3, 12
# Turns of the start about the axis of poses that turn about one alone.
ANGLES = np.radians(np.arange(0, 360, 30))
# Deviations of what no pose determines [rad, m].
VAGUE = np.repeat([3.0, 1.0, 3.0, 1.0], 3)
# A pose as stated is left out, or poses as stated are called worse, so seldom; and so many at most.
UNLIKELY, MOST_LEFT_OUT, MOST_ROUNDS = 1e-5, 1 / 3, 20
# Deviations of a correlation of neighbours that are no chance.
CHANCE = 3.0
# A target of another size, or poses in another unit or of another frame, are farther off.
LARGEST_OFF_M = 0.01
# Up to which the camera is determined: a place where the poses were, and its turn.
LARGEST_STD_M, LARGEST_STD_RAD = 0.002, 0.003


@dataclass(frozen=True)
class HandEye:
    """Where the camera is in the base frame, and how well the poses determine it.

    Attributes
    ----------
    camera_from_base, tracked_from_target : (4, 4) arrays
    covariance : (6, 6) array
        Of a rotation vector applied in the camera frame and of the shift of `camera_from_base`
        [rad, m]; what the optics are wrong by is in it.
    clock_offset_s, clock_offset_std_s : float
        Of the poses' clock minus the camera's.
    std_m, turn_std_rad : float
        Deviations of a place where the poses were and of the camera's turn, the worst ways.
    residual_px : float
        Root mean square distance of corners from where these frames have them.
    worse : float
        How many times farther off poses are than stated; 1 where they may be as stated.
    poses : int
    left_out_m : dict
        Poses that were left out, and how far the target is from where the others have it.
    turn_deg, axis : (3,) arrays
        Root mean square by which the base's directions turned, the least first, and that one.
    """

    camera_from_base: NDArray
    tracked_from_target: NDArray
    covariance: NDArray
    clock_offset_s: float
    clock_offset_std_s: float
    std_m: float
    turn_std_rad: float
    residual_px: float
    worse: float
    poses: int
    left_out_m: dict[str, float]
    turn_deg: NDArray
    axis: NDArray

    @property
    def verdict(self) -> str:
        """Whether the camera's place is determined, and else what would determine it."""
        how = f"{self.std_m * MILLIMETRES:.2g} mm where the poses were"
        how = f"determined, to {how}, and {degrees(self.turn_std_rad):.2g} degrees"
        if self.std_m <= LARGEST_STD_M and self.turn_std_rad <= LARGEST_STD_RAD:
            return f"camera: {how}"
        if self.turn_deg[0] < LEAST_TURN_DEG:
            along = ", ".join(f"{value:.2f}" for value in self.axis)
            how = f"determined: all turns are about ({along}) of the base, and the shift along it"
            return f"camera: not {how} may be any: tilt the target to all sides"
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
        If there are fewer than three views, they hardly turn, or too many are elsewhere.

    Notes
    -----
    Corners are those of X E_i B_i T: camera from base, error and record of a pose, tracked from
    target. Each error is a normal unknown that enters linearly, and is eliminated: a view then
    counts by the pose that its corners fit, with the covariance of their noise and of its error.
    """
    if (count := len(views.names)) < FEWEST_POSES:
        raise ValueError(f"poses: expected at least {FEWEST_POSES} with the target, found {count}")
    turn_deg, axes = turned(views.base_from_tracked[:, :3, :3].transpose(0, 2, 1))
    turn_deg = np.degrees(turn_deg)
    if turn_deg[1] < LEAST_TURN_DEG:
        expected = f"expected the target to turn by {LEAST_TURN_DEG:g} degrees or more"
        raise ValueError(f"poses: {expected}, found {turn_deg[1]:.1f} (root mean square)")
    angles = ANGLES if turn_deg[0] < LEAST_TURN_DEG else ANGLES[:1]
    frames, kept = first_frames(views, board.points_m, axes[0] * angles[:, None])
    weak = np.append(VAGUE, clock_std_s)
    for _ in range(MOST_ROUNDS):
        frames, before = fitted(views.some(kept), board, camera, frames, weak), kept
        part = linear(views, board, camera, frames)
        squares = (part.off * np.linalg.solve(part.spread, part.off[..., None])[..., 0]).sum(axis=1)
        scale = max(1.0, float(np.median(squares)) / chi2.median(6))
        kept = squares <= scale * chi2.isf(UNLIKELY, 6)
        if np.array_equal(kept, before) or kept.sum() < FEWEST_POSES:
            break
    off_m = np.linalg.norm(part.off[:, 3:], axis=1)
    _check(off_m, kept)
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
    place_m = (tracked(views, frames[2]) @ frames[1])[kept, :3, 3].mean(axis=0)
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
        axis=axes[0],
    )


def _check(off_m: NDArray, kept: NDArray) -> None:
    """Reject views that no camera and no target at rest in their frames explain."""
    count, found = len(kept), ""
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
