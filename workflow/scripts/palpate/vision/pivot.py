"""Where the ball is in the board's frame, from a handle that turned about its resting tip."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from palpate.units import MILLIMETRES

# Two poses tell the tip of a handle that turns freely; noise and slides want to be told too.
FEWEST_POSES = 10
# Root mean square by which a direction of the board must turn: a handle that leans by 30 degrees to
# all sides has 20, and noise of half a degree passes for one of 5.
LEAST_TURN_DEG = 5.0
WANTED_LEAN_DEG = 30
# Huber's loss leaves the parabola at so many medians of the residuals' lengths; a frame beyond
# so many is left out. A board that is seen square on tells its turn several times worse than one
# that leans: poses that are right lie up to five medians off.
BENT_FROM, OUT_FROM = 1.5, 6.0
MOST_ROUNDS = 100
SETTLED_M = 1e-9
# A tip that is off in more of the frames did not rest; two of a few may be off.
MOST_LEFT_OUT, FEW_OUT = 0.1, 2
# A while is of one or more of so many stretches of the film, of so many frames at least.
MOST_STRETCHES, SHORTEST = 6, 5
# Correlation of two frames' errors from which they are taken for independent.
LEAST_SHARED = 0.1
# Poses in another unit, or turns read wrongly, have a tip that no handle has, or none: real ones
# leave 3 mm at most.
FARTHEST_TIP_M, LARGEST_OFF_M = 1.0, 0.005
# A slide has the halves of its film apart by half its length. Where ten frames err as one a tip
# that rests has a while more deviations off in one film of 50; where each errs alone in none.
LEAST_APART, SURE = 0.5, 3.3


@dataclass(frozen=True)
class Pivot:
    """A tip, and how well the poses tell it.

    Attributes
    ----------
    tip_m : (3,) array
        In the board's frame.
    covariance : (3, 3) array
        Of the tip, for frames whose errors are independent, and for the optics' [m^2].
    pivot_m : (3,) array
        Where it rested, camera frame.
    residuals_m : (n, 3) array
        Of each frame, how far from there its pose puts the tip, camera frame.
    kept : (n,) bool array
        Frames that count.
    turn_deg : (3,) array
        Root mean square by which the board's directions turned, the least first.
    optics_covariance : (3, 3) array or None, optional
        What of the covariance is the optics', where the poses' camera is known.
    """

    tip_m: NDArray
    covariance: NDArray
    pivot_m: NDArray
    residuals_m: NDArray
    kept: NDArray
    turn_deg: NDArray
    optics_covariance: NDArray | None = None

    @property
    def rms_m(self) -> float:
        """Root mean square of the residuals' coordinates, frames that count."""
        return float(np.sqrt((self.residuals_m[self.kept] ** 2).mean()))

    @property
    def std_m(self) -> NDArray:
        """Standard deviations of the tip along the board's axes, (3,)."""
        return np.sqrt(np.diag(self.covariance))


def plain_pivot(camera_from_marker: NDArray) -> Pivot:
    """The tip by linear least squares, all frames alike.

    Parameters
    ----------
    camera_from_marker : (n, 4, 4) array
        Poses of the board.

    Notes
    -----
    R_i tip - pivot = -d_i for the rotations R_i and shifts d_i of all poses (Z. Yaniv, Which pivot
    calibration?, Proc. SPIE 9415, 2015: the algebraic one-step method).
    """
    everyone = np.ones(len(camera_from_marker))
    return _described(camera_from_marker, everyone, everyone > 0)


def find_pivot(camera_from_marker: NDArray, names: Sequence[str]) -> Pivot:
    """The tip by Huber's loss, then least squares of the frames that are within it.

    A frame is left out whose residual is longer than six times the median.

    Parameters
    ----------
    camera_from_marker : (n, 4, 4) array
        Poses of the board in the order of time.
    names : sequence of str
        What errors call the frames.

    Raises
    ------
    ValueError
        If there are few poses, the handle hardly turned or about one axis alone, the tip did not
        rest at one place, or it is farther from the board than a handle is long or than the camera.
    """
    if len(camera_from_marker) < FEWEST_POSES:
        found = len(camera_from_marker)
        raise ValueError(f"poses: expected at least {FEWEST_POSES}, found {found}")
    _check_turn(camera_from_marker[:, :3, :3])
    kept = _inliers(camera_from_marker)
    _check_left_out(kept, names)
    found = _described(camera_from_marker, kept.astype(float), kept)
    _check_turn(camera_from_marker[kept, :3, :3])
    _check_place(found)
    _check_rest(camera_from_marker[kept], [names[k] for k in np.flatnonzero(kept)])
    _check_residual(found.rms_m)
    return found


def _solved(poses: NDArray, weights: NDArray, group: NDArray) -> tuple[NDArray, NDArray, NDArray]:
    """Tip, pivot of each group, and what each frame tells of the tip (n, 3, 3).

    The pivots are eliminated: what counts is each pose less its group's mean.
    """
    members = weights * (np.arange(group.max() + 1)[:, None] == group)
    means = np.tensordot(members / members.sum(axis=1, keepdims=True), poses[:, :3], axes=1)
    turns, shifts = np.split(poses[:, :3] - means[group], [3], axis=2)
    normal = np.einsum("n,nji,njk->ik", weights, turns, turns)
    by_frame = np.linalg.solve(normal, weights[:, None, None] * turns.transpose(0, 2, 1))
    tip = -np.einsum("nij,njk->i", by_frame, shifts)
    return tip, means[:, :, :3] @ tip + means[:, :, 3], by_frame


def _described(poses: NDArray, weights: NDArray, kept: NDArray) -> Pivot:
    tip, (pivot,), by_frame = _solved(poses, weights, np.zeros(len(poses), dtype=int))
    off = _placed(poses, tip) - pivot
    turn = _turns(poses[kept, :3, :3])[0]
    return Pivot(tip, _covariance(by_frame, off, kept), pivot, off, kept, np.degrees(turn))


def _placed(poses: NDArray, tip: NDArray) -> NDArray:
    """The tip by each pose, camera frame, (n, 3)."""
    return poses[:, :3, :3] @ tip + poses[:, :3, 3]


def _covariance(by_frame: NDArray, off: NDArray, kept: NDArray) -> NDArray:
    """Of the tip, whatever shape each frame's error has (White 1980).

    Errors of a board's turn are across the lever to the tip and are not those of its place. Six
    unknowns take what two frames have, and neighbours that err alike tell no more than one.
    """
    parts = np.einsum("nij,nj->ni", by_frame[kept], off[kept])
    return parts.T @ parts * _alike(off[kept]) * kept.sum() / (kept.sum() - 2)


def _inliers(poses: NDArray) -> NDArray:
    """Frames that Huber's loss finds within six medians."""
    group = np.zeros(len(poses), dtype=int)
    weights, before = np.ones(len(poses)), np.inf
    for _ in range(MOST_ROUNDS):
        tip, (pivot,), _ = _solved(poses, weights, group)
        length = np.linalg.norm(_placed(poses, tip) - pivot, axis=1)
        # Poses without noise leave rounding alone.
        median = max(float(np.median(length)), SETTLED_M)
        if np.linalg.norm(tip - before) < SETTLED_M:
            break
        weights, before = np.minimum(1, BENT_FROM * median / np.maximum(length, SETTLED_M)), tip
    return length <= OUT_FROM * median


def _turns(rotations: NDArray) -> tuple[NDArray, NDArray]:
    """Root mean square turn of the board's directions [rad], the least first, and those as columns.

    A direction about which the handle alone turned stays where it is, and the tip's place along it
    is not told.
    """
    centred = rotations - rotations.mean(axis=0)
    square, directions = np.linalg.eigh(np.einsum("nji,njk->ik", centred, centred))
    return np.sqrt(np.maximum(square, 0) / len(rotations)), directions


def _check_turn(rotations: NDArray) -> None:
    turn, directions = _turns(rotations)
    least, middle, _ = np.degrees(turn)
    if least >= LEAST_TURN_DEG:
        return
    if middle < LEAST_TURN_DEG:
        found = f"{middle:.1f} (root mean square)"
    else:
        axis = directions[:, 0] * np.sign(directions[np.abs(directions[:, 0]).argmax(), 0])
        along = ", ".join(f"{value:.2f}" for value in axis)
        found = (
            f"{middle:.1f} about one axis and {least:.1f} about others (root mean square): the"
            f" tip's place along ({along}) of the board is not told"
        )
    raise ValueError(
        f"poses: expected the handle to turn by {LEAST_TURN_DEG:g} degrees or more, found {found};"
        f" lean it by {WANTED_LEAN_DEG} degrees to all sides"
    )


def _check_left_out(kept: NDArray, names: Sequence[str]) -> None:
    out = np.flatnonzero(~kept)
    if len(out) > max(FEW_OUT, MOST_LEFT_OUT * len(kept)):
        runs = np.split(out, np.flatnonzero(np.diff(out) > 1) + 1)
        longest = max(runs, key=len)
        raise ValueError(
            f"poses: expected the tip to rest at one place, found it elsewhere in {len(out)} of"
            f" {len(kept)} frames ({names[longest[0]]} to {names[longest[-1]]} most at a time)"
        )


def _check_place(found: Pivot) -> None:
    """Refuse a tip that no handle has; of inverted poses tip and pivot change places."""
    away_m, camera_m = float(np.linalg.norm(found.tip_m)), float(np.linalg.norm(found.pivot_m))
    if away_m > FARTHEST_TIP_M:
        raise ValueError(
            f"poses: expected the tip within {FARTHEST_TIP_M:g} m of the board, found it"
            f" {away_m:.3g} m away (unit of the poses?)"
        )
    if away_m > camera_m:
        raise ValueError(
            f"poses: expected the tip nearer to the board than to the camera, found it"
            f" {away_m * MILLIMETRES:.0f} and {camera_m * MILLIMETRES:.0f} mm away (camera from"
            " board, or the other way?)"
        )


def _check_residual(off_m: float) -> None:
    if off_m > LARGEST_OFF_M:
        raise ValueError(
            f"poses: expected the tip to rest at one place, found it {_mm(off_m)} mm apart (root"
            " mean square of all frames; unit of the poses? order of the quaternion?)"
        )


def _check_rest(poses: NDArray, names: Sequence[str]) -> None:
    """Refuse a pivot that is elsewhere for a while, by more than a frame's noise, and surely."""
    found = [(_moved(poses, inside), inside) for inside in _whiles(poses[:, :3, :3])]
    if not found:
        return
    (apart, noise, limit), inside = max(found, key=lambda one: one[0][0] / one[0][2])
    _check_residual(noise)
    if apart <= limit:
        return
    first, *_, last = np.flatnonzero(inside)
    raise ValueError(
        f"poses: expected the tip to rest at one place, found it {_mm(apart)} mm apart in"
        f" {names[first]} to {names[last]} and in the rest, where a frame is off by {_mm(noise)} mm"
    )


def _whiles(rotations: NDArray) -> Iterator[NDArray]:
    """Frames of a while, (n,) bool, where in it and in the rest the handle turned enough."""
    count, stretches = len(rotations), min(MOST_STRETCHES, len(rotations) // SHORTEST)
    edges = np.arange(stretches + 1) * count // stretches
    for first, last in combinations(edges, 2):
        # What comes before a while at the film's end is a while too.
        if last < count:
            inside = (np.arange(count) >= first) & (np.arange(count) < last)
            means = np.array([rotations[~inside].mean(axis=0), rotations[inside].mean(axis=0)])
            turn = _turns(rotations - means[inside.astype(int)])[0]
            if np.degrees(turn[0]) >= LEAST_TURN_DEG:
                yield inside


def _moved(poses: NDArray, inside: NDArray) -> tuple[float, float, float]:
    """How far apart a while and the rest have the pivot, a frame's noise, and how far they may."""
    group, count = inside.astype(int), len(poses)
    tip, pivots, by_frame = _solved(poses, np.ones(count), group)
    off = _placed(poses, tip) - pivots[group]
    noise = max(float(np.sqrt((off**2).sum() / (count - 3))), SETTLED_M)
    turn = poses[inside, :3, :3].mean(axis=0) - poses[~inside, :3, :3].mean(axis=0)
    own = np.where(inside, 1 / inside.sum(), -1 / (~inside).sum())
    by_frame = own[:, None, None] * np.eye(3) - turn @ by_frame
    std = noise * np.sqrt(_alike(off) * (by_frame**2).sum() / 3)
    apart = float(np.linalg.norm(pivots[1] - pivots[0]))
    return apart, noise, max(noise * LEAST_APART, SURE * float(std))


def _alike(off: NDArray) -> float:
    """How many neighbouring frames err as one: of a camera that errs as the board leans, many."""
    count, square = len(off), max((off**2).mean(), SETTLED_M**2)
    total = 1.0
    for lag in range(1, count // 3):
        shared = (off[lag:] * off[:-lag]).mean() / square
        if shared < LEAST_SHARED:
            break
        total += 2 * shared
    return min(total, count / MOST_STRETCHES)


def _mm(length_m: float) -> str:
    return f"{length_m * MILLIMETRES:.2g}"
