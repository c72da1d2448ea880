"""Whether a force's record is of the press that the camera filmed, and of its time."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import stats
from scipy.optimize import nnls
from scipy.signal import lfilter

# A sphere's depth by the elastic force: Hertz's law, and F ~ x^2 of a thin object.
POWERS = (2 / 3, 1 / 2)
# The most of a force that relaxes, and its times [s].
MOST_RELAXED, RELAXATION_S = 0.6, (0.3, 3.0)
# Offsets that are searched for a press at quite another time, and what of them is told.
SEARCHED_S, SEARCH_STEP_S = 1.0, 0.02
# Deviations of what is known of the clocks that an offset may be.
LIKELY = 2.5
# Chance of a misfit that refuses a press at its right time.
CHANCE = 1e-3
# Where more offsets than these fit alike by this chance, a search from zero stays near zero.
ALIKE_CHANCE, LONGEST_ALIKE_S = 0.05, 0.3
# Least correlation of the depths with what a force makes of them.
LEAST_ALIKE = 0.8
# Deviations of its noise at which a force is one, and frames with it that tell of an offset.
PRESSED_DEVIATIONS, FEWEST_PRESSED = 3, 4
# Frames that the stated deviations of depths count as much as.
STATED = 10
# Which frames are in contact, and what the force's noise is as a depth, are told by fits before.
ROUNDS = 5


def check_time(
    force_time_s: NDArray,
    force_n: NDArray,
    frame_time_s: NDArray,
    depth_m: NDArray,
    depth_std_m: NDArray,
    *,
    noise_n: float,
    prior_std_s: float,
) -> bool:
    """Refuse records whose force rises at another time than the tip goes down.

    The depths of frames in contact are explained by the force that the record has at their times,
    elastic or relaxing; those in the air are anywhere above the contact.

    Parameters
    ----------
    force_time_s, force_n : (m,) arrays
        Evenly spaced times [s] and force along the pressing direction [N].
    frame_time_s, depth_m, depth_std_m : (n,) arrays
        Times [s], tip's place along the pressing direction and its standard deviation [m].
    noise_n : float
        Standard deviation of a force [N].
    prior_std_s : float
        Standard deviation of the offset before anything is known [s].

    Returns
    -------
    bool
        Whether the offset is determined: those that fit alike are 0.3 s at most, a likely one
        among them.

    Raises
    ------
    ValueError
        If the force follows the depth at quite another time, or at none.
    """
    ways = force_ways(force_time_s, force_n, least_n=PRESSED_DEVIATIONS * noise_n)
    # The right offset is between two steps.
    moved_m = SEARCH_STEP_S / np.sqrt(12) * np.gradient(depth_m, frame_time_s)
    frames = _Frames(depth_m, np.hypot(depth_std_m, moved_m), noise_n)
    shifts = np.arange(-SEARCHED_S, SEARCHED_S + SEARCH_STEP_S / 2, SEARCH_STEP_S)
    found = [frames.followed(*_at(frame_time_s + x, force_time_s, force_n, ways)) for x in shifts]
    misfits = np.array([each.misfit for each in found])
    limit_s = max(LIKELY * prior_std_s, SEARCH_STEP_S)
    likely = (np.abs(shifts) < limit_s + SEARCH_STEP_S / 2) & np.isfinite(misfits)
    if not likely.any():
        return False
    best = int(np.argmin(misfits))
    near = found[int(np.argmin(np.where(likely, misfits, np.inf)))]
    alike = max(found[best].alike, near.alike)
    if found[best].beyond_chance() and alike < LEAST_ALIKE:
        raise ValueError(
            "force.csv: expected a force that follows the tip's depth, with a correlation of at"
            f" least {LEAST_ALIKE:g}, found {alike:.2f} (another capture's record, or frames in"
            " another order?)"
        )
    if not likely[best] and near.beyond_chance(found[best]):
        raise ValueError(
            f"force.csv: time_s: expected the clock of frames.csv within {limit_s:g} s, as the"
            f" sensor's clock_offset_std_s says, found the press about {shifts[best]:+.2f} s away"
        )
    away = [not each.free or each.beyond_chance(found[best], ALIKE_CHANCE) for each in found]
    alike_s = SEARCH_STEP_S * (len(found) - sum(away))
    return alike_s <= LONGEST_ALIKE_S and not near.beyond_chance(found[best], ALIKE_CHANCE)


def force_ways(time_s: NDArray, force_n: NDArray, *, least_n: float) -> NDArray:
    """Depths that a force may make of a soft object, each up to one, (k, m).

    Parameters
    ----------
    time_s, force_n : (m,) arrays
        Evenly spaced times [s] and a force that begins unloaded [N].
    least_n : float
        What smaller forces are taken for [N].
    """
    unrelaxed = elastic_force(time_s, force_n, share=MOST_RELAXED)
    forces = np.maximum([force_n, unrelaxed], least_n)
    ways = np.concatenate([forces**power for power in POWERS])
    return ways / ways.max(axis=1, keepdims=True)


def elastic_force(time_s: NDArray, force_n: NDArray, *, share: float) -> NDArray:
    """Force as it would be had no part of it relaxed, (m,) [N].

    Each Maxwell element holds ``decay`` of its force from sample to sample, and takes up ``rate``
    of a rise: the whole is a filter of the elastic force, and is undone by its inverse.

    Parameters
    ----------
    time_s, force_n : (m,) arrays
        Evenly spaced times [s] and force [N].
    share : float
        Part that relaxes, in equal parts with each of `RELAXATION_S`.
    """
    step = (time_s[-1] - time_s[0]) / (len(time_s) - 1) / np.array(RELAXATION_S)
    decays, rates = np.exp(-step), -np.expm1(-step) / step
    all_decay = np.poly(decays)
    kept = (1 - share) * all_decay
    for decay, rate in zip(decays, rates, strict=True):
        others = np.poly(decays[decays != decay])
        kept = kept + share / len(decays) * rate * np.polymul([1, -1], others)
    return lfilter(all_decay, kept, force_n)


def _at(time_s: NDArray, force_time_s: NDArray, force_n: NDArray, ways: NDArray) -> tuple:
    """Force (n,) [N], NaN outside its record, and its ways (n, k) at some times."""
    force = np.interp(time_s, force_time_s, force_n, left=np.nan, right=np.nan)
    return force, np.column_stack([np.interp(time_s, force_time_s, way) for way in ways])


@dataclass(frozen=True)
class _Followed:
    """Squares of what a force leaves of depths, in deviations; frames that tell; correlation."""

    squares: float
    free: int
    alike: float

    @property
    def misfit(self) -> float:
        """Variance of the depths' errors, as multiple of the stated; infinite if none tells it."""
        if not self.free:
            return np.inf
        return (self.squares + STATED) / (self.free + STATED)

    def beyond_chance(self, best: "_Followed | None" = None, chance: float = CHANCE) -> bool:
        """Held to the stated deviations, or to those that the best offset makes of them."""
        if not self.free:
            return False
        most, variance = stats.chi2.isf(chance, self.free) / self.free, 1.0
        if best is not None:
            most, variance = (
                stats.f.isf(chance, self.free, best.free + STATED),
                max(best.misfit, 1.0),
            )
        return bool(self.squares / self.free > most * variance)


@dataclass(frozen=True)
class _Frames:
    """Depths (n,) with their deviations [m], and the noise of a force [N]."""

    depth_m: NDArray
    depth_std_m: NDArray
    noise_n: float

    def followed(self, force_n: NDArray, ways: NDArray) -> _Followed:
        """How well the depths follow a force (n,) that is NaN where it isn't known."""
        pressed = force_n > PRESSED_DEVIATIONS * self.noise_n
        if pressed.sum() < FEWEST_PRESSED:
            return _Followed(0.0, 0, 0.0)
        # The contact is a way too, from above all depths.
        ways = np.column_stack([np.ones(len(ways)), ways])
        depth = self.depth_m - self.depth_m.min() + np.ptp(self.depth_m)
        std, told = self.depth_std_m, pressed
        for _ in range(ROUNDS):
            parts, _ = nnls(ways[told] / std[told, None], depth[told] / std[told])
            left = depth - ways @ parts
            # In the air a tip is above the contact, anywhere.
            told = pressed | ((left > 0) & (force_n <= PRESSED_DEVIATIONS * self.noise_n))
            std = np.hypot(self.depth_std_m, self._noise_m(force_n, ways[:, 1:] @ parts[1:]))
        squares = float(((left / std)[told] ** 2).sum())
        free = max(int(pressed.sum() - np.count_nonzero(parts)), 0)
        return _Followed(squares, free, _correlation(depth[told], (ways @ parts)[told]))

    def _noise_m(self, force_n: NDArray, way_m: NDArray) -> NDArray:
        """What the force's noise is as a depth, by Hertz's law."""
        force = np.fmax(force_n, PRESSED_DEVIATIONS * self.noise_n)
        return 2 / 3 * way_m * self.noise_n / force


def _correlation(a: NDArray, b: NDArray) -> float:
    """Of two rows of numbers; 0 where one of them is constant."""
    a, b = a - a.mean(), b - b.mean()
    return float(a @ b / max(np.linalg.norm(a) * np.linalg.norm(b), np.finfo(float).tiny))
