"""Pivot calibration: the tip in the target's frame, from a handle that turned about it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations, takewhile
from math import ceil

import numpy as np
from numpy.typing import NDArray

from palpate.units import MILLIMETRES
from palpate.vision.board import FlatBoard
from palpate.vision.camera import PinholeCamera, camera_from_spec
from palpate.vision.pose import by_turn, projected
from palpate.yaml_files import mismatch

# Two poses determine the tip of a handle that turns freely; noise and slides need more.
FEWEST_POSES = 10
# Root mean square by which a direction of the target must turn: a handle that tilts by 30 degrees
# to all sides has 20, and noise of half a degree passes for one of 5.
LEAST_TURN_DEG = 5.0
WANTED_TILT_DEG = 30
# Huber's loss leaves the parabola at so many medians of the residuals' lengths; a frame beyond
# so many is left out. A target that is seen square on has its turn several times worse than one
# that tilts: poses that are right lie up to five medians off.
BENT_FROM, OUT_FROM = 1.5, 6.0
MOST_ROUNDS = 100
SETTLED_M = 1e-9
# A tip that is off in more of the frames did not rest; two of a few may be off.
MOST_LEFT_OUT, FEW_OUT = 0.1, 2
# A while is of one or more of so many stretches of the recording, of so many frames at least.
MOST_STRETCHES, SHORTEST = 6, 5
# Correlation of two frames' errors from which they are taken for independent.
LEAST_SHARED = 0.1
# Poses in another unit, or turns read wrongly, have a tip that no handle has, or none: real ones
# leave 3 mm at most.
FARTHEST_TIP_M, LARGEST_OFF_M = 1.0, 0.005
# A slide has the halves of its recording apart by half its length. Where ten frames err as one a
# tip that rests has a while more deviations off in one of 50; where each errs alone in none.
LEAST_APART, SURE = 0.5, 3.3
# What stated optics are taken to be wrong by: of the focal length, of the principal point, and of
# each of k1, p1 and p2 at the picture's corners. Of calibrated ones the covariance is known.
FOCAL_STD, CENTRE_STD_PX, BENT_STD_PX = 0.001, 0.5, 0.3
# Standard deviation up to which a tip is determined: what a Kinect's 200 frames give.
LARGEST_STD_M = 0.0002
# As far as an operator tilts a probe whose target is still seen, root mean square; and the longest
# recording that anyone makes.
FARTHEST_DEG, MOST_FRAMES = 25.0, 1000
RESTED = "poses: expected the tip to rest at one place, found it"


@dataclass(frozen=True)
class Pivot:
    """A tip, and how well the poses determine it."""

    tip_m: NDArray  # (3,), in the target's frame
    # (3, 3), of the tip, for frames whose errors are independent, and for the optics' [m^2]
    covariance: NDArray
    pivot_m: NDArray  # (3,), where it rested, camera frame
    # (n, 3), of each frame, how far from there its pose puts the tip, camera frame
    residuals_m: NDArray
    kept: NDArray  # (n,) bool, frames that count
    # (3,), root mean square by which the target's directions turned, the least first
    turn_deg: NDArray
    # (3, 3), what of the covariance is the optics', where the poses' camera is known
    optics_covariance: NDArray | None = None

    @property
    def rms_m(self) -> float:
        """Root mean square of the residuals' coordinates, frames that count."""
        return float(np.sqrt((self.residuals_m[self.kept] ** 2).mean()))

    @property
    def std_m(self) -> NDArray:
        """Standard deviations of the tip along the target's axes, (3,)."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def optics_std_m(self) -> float:
        """What the optics are in the largest deviation; 0 if nothing is known of them."""
        part = self.optics_covariance
        return 0.0 if part is None else largest_std(part)

    @property
    def verdict(self) -> str:
        """Whether the tip is determined, and else what would determine it."""
        std_m, optics_m = largest_std(self.covariance), self.optics_std_m
        how = f"determined, to {std_m * MILLIMETRES:.2g} mm in the worst direction"
        if std_m <= LARGEST_STD_M:
            return f"tip: {how}"
        how = f"tip: not {how}"
        if optics_m >= LARGEST_STD_M:
            only = f"{optics_m * MILLIMETRES:.2g} mm are the optics' alone"
            return f"{how}: {only}: calibrate the camera"
        # A deviation goes down with the turn, and with the square root of the number of frames.
        factor = np.sqrt((std_m**2 - optics_m**2) / (LARGEST_STD_M**2 - optics_m**2))
        tilt = min(factor, max(1, FARTHEST_DEG / self.turn_deg[0]))
        frames = ceil(self.kept.sum() * (factor / tilt) ** 2)
        if frames > MOST_FRAMES:
            return f"{how}: {MOST_FRAMES} frames would not determine it: bring the board nearer"
        todo = f"tilt it {tilt:.1f} times as far" if tilt > 1.05 else "tilt it as far"
        return f"{how}: {todo}, in {frames} frames"

    def left_out(self, names: Sequence[str]) -> dict[str, float]:
        """Frames that were left out, and how far off they are [m]."""
        away_m = np.linalg.norm(self.residuals_m, axis=1)
        return {names[k]: float(away_m[k]) for k in np.flatnonzero(~self.kept)}

    def fields(self, names: Sequence[str], probe: str | None) -> dict:
        """What tip.json says, of a probe by its name where that is known."""
        optics = self.optics_covariance
        return {
            "probe": probe,
            "tip_m": self.tip_m.tolist(),
            "tip_covariance_m2": self.covariance.tolist(),
            "tip_std_m": self.std_m.tolist(),
            "optics_covariance_m2": None if optics is None else optics.tolist(),
            "pivot_m": self.pivot_m.tolist(),
            "rms_m": self.rms_m,
            "turn_deg": self.turn_deg.tolist(),
            "poses": len(names),
            "left_out_m": self.left_out(names),
            "verdict": self.verdict,
        }


def largest_std(covariance: NDArray) -> float:
    """Standard deviation in the direction that is determined worst."""
    return float(np.sqrt(np.linalg.eigvalsh(covariance)[-1]))


def fit_pivot(camera_from_marker: NDArray, kept: NDArray | None = None) -> Pivot:
    """The tip by linear least squares of all poses (n, 4, 4), or those that are kept (n,).

    Notes
    -----
    R_i tip - pivot = -d_i for the rotations R_i and shifts d_i of all poses (Z. Yaniv, Which pivot
    calibration?, Proc. SPIE 9415, 2015: the algebraic one-step method). The covariance holds
    whatever shape each frame's error has (White 1980): errors of a target's turn are across the
    lever to the tip. Six unknowns take what two frames have, and neighbours that err alike count
    as one.
    """
    kept = np.ones(len(camera_from_marker), dtype=bool) if kept is None else kept
    (tip, pivot), off, (by_tip, _) = _fit(camera_from_marker, kept)
    parts, count = np.einsum("inj,nj->ni", by_tip, off), kept.sum()
    covariance = parts.T @ parts * alike(off[kept]) * count / (count - 2)
    turn_deg = np.degrees(turned(camera_from_marker[kept, :3, :3])[0])
    return Pivot(tip, covariance, pivot, off, kept, turn_deg)


def find_pivot(
    camera_from_marker: NDArray,
    names: Sequence[str],
    board: FlatBoard | None = None,
    spec: Mapping | None = None,
    *,
    by_camera: bool = True,
) -> Pivot:
    """The tip by Huber's loss, then least squares of the frames that are within it.

    A frame is left out whose residual is longer than six times the median.

    Parameters
    ----------
    camera_from_marker : (n, 4, 4) array
        Poses of the target in the order of time.
    names : sequence of str
        What errors call the frames.
    board, spec : FlatBoard and mapping, optional
        Both or none: the target, and the ``color`` block of the file of the sensor that saw it. The
        covariance then includes that of the optics, whose error is the same in all frames.
    by_camera : bool, optional
        Whether the poses' frame is a camera's, which is farther from the target than the tip.

    Raises
    ------
    ValueError
        If there are few poses, the handle hardly turned or about one axis alone, the tip did not
        rest at one place, or it is farther from the target than a handle is long or than the
        camera.
    """
    if (count := len(camera_from_marker)) < FEWEST_POSES:
        raise ValueError(f"poses: expected at least {FEWEST_POSES}, found {count}")
    require_turn(camera_from_marker[:, :3, :3])
    kept = _inliers(camera_from_marker, names)
    poses, found = camera_from_marker[kept], fit_pivot(camera_from_marker, kept)
    require_turn(poses[:, :3, :3])
    _check_place(found, by_camera=by_camera)
    _check_rest(poses, [names[k] for k in np.flatnonzero(kept)])
    _check_residual(found.rms_m)
    if board is None:
        return found
    # Corners stay where they are seen: each pose is off as the optics are, (6, 9), and the tip is
    # the least squares' of all poses.
    pairs = (projected(board.points_m, pose, camera_from_spec(spec))[1:] for pose in poses)
    each = np.stack([np.linalg.lstsq(*pair, rcond=None)[0] for pair in pairs])
    placed = by_turn(poses[:, :3, :3] @ found.tip_m) @ each[:, :3] + each[:, 3:]
    moved = np.einsum("inj,njk->ik", _fit(poses, np.ones(len(poses)))[2][0], placed)
    part = moved @ optics_covariance(spec) @ moved.T
    return replace(found, covariance=found.covariance + part, optics_covariance=part)


def optics_covariance(spec: Mapping) -> NDArray:
    """Covariance of fx_px, fy_px, cx_px, cy_px, k1, k2, p1, p2, k3, calibrated or stated, (9, 9).

    Of a sensor's ``color`` block, with the ``covariance`` of a calibration where there is one.
    """
    known = spec.get("covariance")
    return stated_covariance(camera_from_spec(spec)) if known is None else np.array(known, float)


def stated_covariance(camera: PinholeCamera) -> NDArray:
    """Covariance of optics that nobody calibrated, as `optics_covariance` has it, (9, 9)."""
    corner = float(np.hypot(camera.width_px, camera.height_px)) / (2 * camera.fx_px)
    k1, p1 = BENT_STD_PX / camera.fx_px / np.array([corner**3, 3 * corner**2])
    focal = FOCAL_STD * np.array([camera.fx_px, camera.fy_px])
    found = np.diag(np.square([*focal, CENTRE_STD_PX, CENTRE_STD_PX, k1, 0, p1, p1, 0]))
    # The focal lengths are wrong by one share.
    found[:2, :2] = np.outer(focal, focal)
    return found


def _fit(
    poses: NDArray, weights: NDArray, inside: NDArray | None = None
) -> tuple[NDArray, NDArray, NDArray]:
    """Tip and pivots (k, 3), residuals (n, 3), and their effect on each point (k, 3, n, 3)."""
    # One pivot; or two, the second of the frames that are inside.
    groups = np.ones((len(poses), 1)) if inside is None else np.column_stack([~inside, inside])
    shifts = poses[:, :3, 3].ravel()
    rows = np.hstack([poses[:, :3, :3].reshape(-1, 3), -np.kron(groups, np.eye(3))])
    weighted = np.repeat(weights, 3)[:, None] * rows
    inverse = np.linalg.solve(weighted.T @ rows, weighted.T)
    found = -inverse @ shifts
    off = (rows @ found + shifts).reshape(-1, 3)
    return found.reshape(-1, 3), off, inverse.reshape(-1, 3, *off.shape)


def _inliers(poses: NDArray, names: Sequence[str]) -> NDArray:
    """Frames that Huber's loss finds within six medians, (n,) bool."""
    weights, before = np.ones(len(poses)), np.inf
    for _ in range(MOST_ROUNDS):
        (tip, _), off, _ = _fit(poses, weights)
        length = np.linalg.norm(off, axis=1)
        # Poses without noise leave rounding alone.
        median = max(float(np.median(length)), SETTLED_M)
        if np.linalg.norm(tip - before) < SETTLED_M:
            break
        weights, before = np.minimum(1, BENT_FROM * median / np.maximum(length, SETTLED_M)), tip
    kept = length <= OUT_FROM * median
    out = np.flatnonzero(~kept)
    if len(out) > max(FEW_OUT, MOST_LEFT_OUT * len(names)):
        longest = max(np.split(out, np.flatnonzero(np.diff(out) > 1) + 1), key=len)
        raise ValueError(
            f"{RESTED} elsewhere in {len(out)} of {len(names)} frames ({names[longest[0]]} to"
            f" {names[longest[-1]]} most at a time)"
        )
    return kept


def turned(rotations: NDArray) -> tuple[NDArray, NDArray]:
    """Root mean square turns of a target's directions [rad], the least first; those as rows."""
    centred = (rotations - rotations.mean(axis=0)).reshape(-1, 3)
    _, sizes, directions = np.linalg.svd(centred, full_matrices=False)
    return sizes[::-1] / np.sqrt(len(rotations)), directions[::-1]


def alike(off: NDArray, least: float = LEAST_SHARED) -> float:
    """How many neighbouring frames err as one: of a camera that errs as the target tilts, many.

    Correlations below the least are taken for chance.
    """
    count, square = len(off), max((off**2).mean(), SETTLED_M**2)
    shared = ((off[lag:] * off[:-lag]).mean() / square for lag in range(1, count // 3))
    total = sum((2 * one for one in takewhile(lambda one: one >= least, shared)), 1.0)
    return min(total, count / MOST_STRETCHES)


def require_turn(
    rotations: NDArray,
    least_deg: float = LEAST_TURN_DEG,
    what: str = "handle",
    place: str = "the tip's place along {} of the board",
) -> NDArray:
    """Root mean square turns of a target's directions (3,) [degrees], the least first.

    Of ``rotations`` (n, 3, 3). A `ValueError` where ``what`` turned by less than ``least_deg``, or
    about one axis alone: then ``place`` says what stays open along it.
    """
    turn, directions = turned(rotations)
    least, middle, _ = turn_deg = np.degrees(turn)
    if least >= least_deg:
        return turn_deg
    found = f"{middle:.1f} (root mean square)"
    if middle >= least_deg:
        axis = directions[0] * np.sign(directions[0, np.abs(directions[0]).argmax()])
        along = ", ".join(f"{value:.2f}" for value in axis)
        found = f"{middle:.1f} about one axis and {least:.1f} about others (root mean square):"
        found += f" {place.format(f'({along})')} is not determined"
    found += f"; tilt it by {WANTED_TILT_DEG} degrees to all sides"
    raise mismatch("poses", f"the {what} to turn by {least_deg:g} degrees or more", found)


def _check_place(found: Pivot, *, by_camera: bool) -> None:
    """Reject a tip that no handle has; of inverted poses tip and pivot change places."""
    away_m, camera_m = (float(np.linalg.norm(place)) for place in (found.tip_m, found.pivot_m))
    if away_m > FARTHEST_TIP_M:
        expected = f"the tip within {FARTHEST_TIP_M:g} m of the board"
        raise mismatch("poses", expected, f"it {away_m:.3g} m away (unit of the poses?)")
    if by_camera and away_m > camera_m:
        found = f"it {away_m * MILLIMETRES:.0f} and {camera_m * MILLIMETRES:.0f} mm away"
        found += " (camera from board, or the other way?)"
        raise mismatch("poses", "the tip nearer to the board than to the camera", found)


def _check_residual(off_m: float) -> None:
    if off_m > LARGEST_OFF_M:
        hint = "root mean square of all frames; unit of the poses? order of the quaternion?"
        raise ValueError(f"{RESTED} {off_m * MILLIMETRES:.2g} mm apart ({hint})")


def _check_rest(poses: NDArray, names: Sequence[str]) -> None:
    """Reject a pivot that is elsewhere for a while, by more than a frame's noise, and surely."""
    count, stretches = len(poses), min(MOST_STRETCHES, len(poses) // SHORTEST)
    edges, whiles = np.arange(stretches + 1) * count // stretches, []
    # What comes before a while at the recording's end is a while too.
    for first, last in combinations(edges[:-1], 2):
        inside = (np.arange(count) >= first) & (np.arange(count) < last)
        rotations = poses[:, :3, :3].copy()
        for part in (inside, ~inside):
            rotations[part] -= rotations[part].mean(axis=0)
        if np.degrees(turned(rotations)[0][0]) < LEAST_TURN_DEG:
            continue
        (_, rest, here), off, by_frame = _fit(poses, np.ones(count), inside)
        apart = float(np.linalg.norm(here - rest))
        noise = max(float(np.sqrt((off**2).sum() / (count - 3))), SETTLED_M)
        std = noise * np.sqrt(alike(off) * ((by_frame[2] - by_frame[1]) ** 2).sum() / 3)
        most = max(noise * LEAST_APART, SURE * float(std))
        whiles.append((apart / most, apart, noise, names[first], names[last - 1]))
    ratio, apart, noise, first, last = max(whiles, default=(0.0,) * 5)
    _check_residual(noise)
    if ratio > 1:
        raise ValueError(
            f"{RESTED} {apart * MILLIMETRES:.2g} mm apart in {first} to {last} and in the rest,"
            f" where a frame is off by {noise * MILLIMETRES:.2g} mm"
        )
