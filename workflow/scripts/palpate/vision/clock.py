"""Offset between the clocks of force sensor and camera, from the indentation itself."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import stats
from scipy.interpolate import Akima1DInterpolator, make_interp_spline
from scipy.linalg import solve_banded
from scipy.optimize import OptimizeResult, least_squares, nnls
from scipy.signal import lfilter

from palpate.vision.force import block_mean
from palpate.yaml_files import mismatch

# A soft object's force is F = k x^1.5 (1 + c x), Hertz's law and its first departure, relaxing with
# two times [s]; what the departures may be [1/m], [-], [N].
CURVATURE_STD_PER_M = 50.0
RELAXATION_S, RELAXED, RELAXED_STD = (0.3, 3.0), 0.15, 0.15
BASELINE_STD_N = 0.05
# The refinement of a pose has errors beyond its noise [m].
DEPTH_STD_M = 1e-4
NEAR_FRAME_S = 0.03
FEWEST_SAMPLES = 10
# Each frame's depth is an unknown: the work goes with the square of their number.
MOST_FRAMES, MOST_SAMPLES = 120, 20_000
SMALLEST_NOISE_N, SMALLEST_FORCE_N = 1e-3, 0.05
# Exposure and the way through USB take 20 to 100 ms, where a stamp is of the picture's coming.
USB_CLOCK_STD_S = 0.05
# Fits after each of which is known what a path that turns between frames makes of the force.
ROUNDS = 2
# Of the peak, from which force on a frame depends on the clocks.
INFORMATIVE = 0.1
# Where the contact may be, as parts of the path of the tip, to start from.
CONTACT_GUESSES = (0.4, 0.6, 0.8)
# Parameters are of order one: offset, log stiffness, contact, curvature, relaxation, baseline,
# and the errors of the frames' depths. The first three have no deviation from 0.
SCALE_S, SCALE_M = 0.01, 1e-3
SHARED, FREE = 6, 3
# Of a parameter, for a slope: the root of what a double tells apart.
STEP = float(np.sqrt(np.finfo(float).eps))

# Before the fit offsets are searched for an indentation at quite another time. A depth by the
# force: Hertz's law, and F ~ x^2 of a thin object; elastic, or with the most that relaxes.
SEARCHED_S, SEARCH_STEP_S = 1.0, 0.02
POWERS, MOST_RELAXED = (2 / 3, 1 / 2), 0.6
# Deviations of what is known of the clocks that an offset may be.
LIKELY = 2.5
# Chance of a misfit that rejects an indentation at its right time. Where more offsets than these
# fit alike by the second chance, a fit from zero stays near zero.
CHANCE, ALIKE_CHANCE, LONGEST_ALIKE_S = 1e-3, 0.05, 0.3
# Least correlation of the depths with what a force makes of them.
LEAST_ALIKE = 0.8
# Deviations of its noise at which a force is one, and frames with it that an offset needs.
PRESSED_DEVIATIONS, FEWEST_PRESSED = 3, 4
# Frames that the stated deviations of depths count as much as.
STATED = 10
# Fits after each of which is known which frames are in contact, and the force's noise as a depth.
SEARCH_ROUNDS = 5


def stated_clock_std_s(sensor: Mapping) -> float:
    """How well a sensor's clock is the force's by its file [s]."""
    return sensor.get("clock_offset_std_s", USB_CLOCK_STD_S)


@dataclass(frozen=True)
class ClockOffset:
    """Force clock minus camera clock, its standard deviation, and its prior one [s].

    An offset that the indentation does not determine is 0, with the prior deviation.
    """

    offset_s: float
    std_s: float
    prior_std_s: float
    determined: bool = True


def clock_offset(
    force_time_s: NDArray,
    force_n: NDArray,
    frame_time_s: NDArray,
    depth_m: NDArray,
    depth_std_m: NDArray,
    *,
    prior_std_s: float,
) -> ClockOffset:
    """Find the offset at which the force follows the tip's depth best.

    The force's samples are explained by a relaxing Hertz contact along the path through the
    frames' depths; the depths' errors and the contact's parameters are fitted with the offset. A
    soft contact says little of it, so the offset starts from zero with the stated deviation, and
    the result's deviation says what was learnt.

    Parameters
    ----------
    force_time_s, force_n : (m,) arrays
        Evenly spaced times [s] and force along the pressing direction [N].
    frame_time_s, depth_m, depth_std_m : (n,) arrays
        Times [s], tip's place along the pressing direction and its standard deviation [m].
    prior_std_s : float
        Standard deviation of the offset before anything is known [s].

    Returns
    -------
    ClockOffset
        Not determined where nothing is pressed, or offsets that are far apart fit alike.

    Raises
    ------
    ValueError
        If the force follows the depth at quite another time, or at none.
    """
    # A step of the offset vanishes beside times that count from 1970.
    force_time_s, frame_time_s = force_time_s - frame_time_s[0], frame_time_s - frame_time_s[0]
    unknown = ClockOffset(0.0, prior_std_s, prior_std_s, determined=False)
    path = (frame_time_s, depth_m, np.hypot(depth_std_m, DEPTH_STD_M))
    record = _Record(force_time_s, force_n, *path)
    between, at_frames = record.between_frames(), np.interp(frame_time_s, force_time_s, force_n)
    few = (at_frames > INFORMATIVE * at_frames.max()).sum() < FEWEST_PRESSED
    if few or between.force_n.size < FEWEST_SAMPLES or at_frames.max() < SMALLEST_FORCE_N:
        return unknown
    if not _determined(replace(record, noise_n=between.noise_n), prior_std_s):
        return unknown
    used = _informative(at_frames)
    record = _Record(force_time_s, force_n, *(each[used] for each in path)).between_frames()
    best = min((record.fit(start, prior_std_s) for start in record.starts()), key=lambda f: f.cost)
    for _ in range(ROUNDS):
        record = replace(record, unsure_n=record.unsure_of(best.x))
        best = record.fit(best.x, prior_std_s)
    # What the model of the contact leaves is counted as noise.
    misfit = best.fun[: record.force_n.size]
    left = np.sqrt((misfit**2).sum() / max(np.count_nonzero(record.weights), 1))
    if left > 1:
        record = replace(record, noise_n=record.noise_n * left)
        best = record.fit(best.x, prior_std_s)
    covariance = np.linalg.pinv(best.jac.T @ best.jac)
    offset_s, std_s = best.x[0] * SCALE_S, np.sqrt(covariance[0, 0]) * SCALE_S
    return ClockOffset(float(offset_s), float(std_s), prior_std_s)


def _determined(record: "_Record", prior_std_s: float) -> bool:
    """Whether offsets that fit alike are 0.3 s at most, a likely one among them."""
    # The right offset is between two steps.
    moved_m = SEARCH_STEP_S / np.sqrt(12) * np.gradient(record.depth_m, record.frame_time_s)
    record = replace(record, depth_std_m=np.hypot(record.depth_std_m, moved_m))
    shifts = np.arange(-SEARCHED_S, SEARCHED_S + SEARCH_STEP_S / 2, SEARCH_STEP_S)
    shapes = _depth_shapes(record)
    found = [_followed(record, record.frame_time_s + shift, shapes) for shift in shifts]
    squares, free, alike = np.array(found).T
    # Variance of the depths' errors, as multiple of the stated; infinite if no frame determines it.
    misfits = np.where(free > 0, (squares + STATED) / (free + STATED), np.inf)
    limit_s = max(LIKELY * prior_std_s, SEARCH_STEP_S)
    likely = (np.abs(shifts) < limit_s + SEARCH_STEP_S / 2) & np.isfinite(misfits)
    if not likely.any():
        return False
    best, near = np.argmin(misfits), np.argmin(np.where(likely, misfits, np.inf))
    most_alike = max(alike[best], alike[near])
    if squares[best] > stats.chi2.isf(CHANCE, free[best]) and most_alike < LEAST_ALIKE:
        expected = "a force that follows the tip's depth, with a correlation of at least"
        hint = "another capture's record, or frames in another order?"
        raise mismatch("force.csv", f"{expected} {LEAST_ALIKE:g}", f"{most_alike:.2f} ({hint})")
    # Compared with what the best offset makes of the stated deviations.
    frames = np.maximum(free, 1)
    ratios = squares / frames / max(misfits[best], 1.0)
    wrong, unlike = (
        ratios > stats.f.isf(chance, frames, free[best] + STATED)
        for chance in (CHANCE, ALIKE_CHANCE)
    )
    if not likely[best] and wrong[near]:
        within = f"within {limit_s:g} s, as the sensor's clock_offset_std_s says"
        found = f"the press about {shifts[best]:+.2f} s away"
        raise mismatch("force.csv: time_s", f"the clock of frames.csv {within}", found)
    alike_s = SEARCH_STEP_S * np.count_nonzero((free > 0) & ~unlike)
    return bool(alike_s <= LONGEST_ALIKE_S and not unlike[near])


def _followed(record: "_Record", time_s: NDArray, shapes: NDArray) -> tuple[float, int, float]:
    """Squares of what the force at some times (n,) leaves of the depths, freedom, correlation."""
    force_n = np.interp(time_s, record.time_s, record.force_n, left=np.nan, right=np.nan)
    least_n = PRESSED_DEVIATIONS * record.noise_n
    pressed = force_n > least_n
    if pressed.sum() < FEWEST_PRESSED:
        return 0.0, 0, 0.0
    # The contact is a shape too, from above all depths.
    shapes = [np.ones(len(time_s)), *(np.interp(time_s, record.time_s, shape) for shape in shapes)]
    shapes = np.column_stack(shapes)
    depth = record.depth_m - record.depth_m.min() + np.ptp(record.depth_m)
    std, used = record.depth_std_m, pressed
    for _ in range(SEARCH_ROUNDS):
        parts, _ = nnls(shapes[used] / std[used, None], depth[used] / std[used])
        left = depth - shapes @ parts
        # In the air a tip is above the contact, anywhere.
        used = pressed | ((left > 0) & (force_n <= least_n))
        # What the force's noise is as a depth, by Hertz's law.
        noise_m = 2 / 3 * (shapes[:, 1:] @ parts[1:]) * record.noise_n / np.fmax(force_n, least_n)
        std = np.hypot(record.depth_std_m, noise_m)
    squares = ((left / std)[used] ** 2).sum()
    free = max(int(pressed.sum() - np.count_nonzero(parts)), 0)
    seen, made = (part - part.mean() for part in (depth[used], (shapes @ parts)[used]))
    size = max(np.linalg.norm(seen) * np.linalg.norm(made), np.finfo(float).tiny)
    return squares, free, seen @ made / size


def _depth_shapes(record: "_Record") -> NDArray:
    """Depths that the force may make of a soft object, each up to one, (k, m)."""
    # Relaxation, in equal parts with each of two times, is a filter, undone by its inverse.
    decays, rates = _decays(record.time_s)
    kept = (1 - MOST_RELAXED) * np.poly(decays)
    for rate, other in zip(rates, decays[::-1], strict=True):
        kept = kept + MOST_RELAXED / len(decays) * rate * np.poly([1.0, other])
    unrelaxed = lfilter(np.poly(decays), kept, record.force_n)
    forces = np.maximum([record.force_n, unrelaxed], PRESSED_DEVIATIONS * record.noise_n)
    shapes = np.concatenate([forces**power for power in POWERS])
    return shapes / shapes.max(axis=1, keepdims=True)


def _decays(time_s: NDArray) -> tuple[NDArray, NDArray]:
    """What each Maxwell element holds of its force from sample to sample, and takes of a rise."""
    step, times = (time_s[-1] - time_s[0]) / (len(time_s) - 1), np.array(RELAXATION_S)
    decays = np.exp(-step / times)
    return decays, times / step * (1 - decays)


def _informative(force_n: NDArray) -> NDArray:
    """Frames of a long recording that determine the offset: an indentation, or its rise."""
    if len(force_n) <= MOST_FRAMES:
        return np.arange(len(force_n))
    margin, pressed = MOST_FRAMES // 10, np.flatnonzero(force_n > INFORMATIVE * force_n.max())
    first, last = pressed[0] - margin, pressed[-1] + margin
    if last - first >= MOST_FRAMES:
        last = int(np.argmax(force_n)) + margin
    chosen = np.arange(max(first, 0), min(last + 1, len(force_n)))
    return chosen[:: -(-len(chosen) // MOST_FRAMES)]


@dataclass(frozen=True)
class _Record:
    """The force's record and the tip's path, and how far a model is from them."""

    time_s: NDArray
    force_n: NDArray
    frame_time_s: NDArray
    depth_m: NDArray
    depth_std_m: NDArray
    noise_n: float = SMALLEST_NOISE_N
    unsure_n: NDArray | float = 0.0

    @cached_property
    def weights(self) -> NDArray:
        """Of the forces, (m,) [1/N]; between frames nobody knows the path."""
        gap = np.abs(self.time_s[:, None] - self.frame_time_s).min(axis=1)
        return (gap < NEAR_FRAME_S) / np.hypot(self.noise_n, self.unsure_n)

    def between_frames(self) -> "_Record":
        """Samples between the first and the last frame: of many, means of a few each."""
        between = (self.time_s > self.frame_time_s[0]) & (self.time_s < self.frame_time_s[-1])
        few = max(1, -(-np.count_nonzero(between) // MOST_SAMPLES))
        time_s, force_n = (block_mean(of[between], few) for of in (self.time_s, self.force_n))
        noise_n = np.diff(force_n).std() / np.sqrt(2) if force_n.size > 1 else 0.0
        return replace(self, time_s=time_s, force_n=force_n, noise_n=max(noise_n, SMALLEST_NOISE_N))

    def unsure_of(self, parameters: NDArray) -> NDArray:
        """By how much a path of straight lines between the frames makes other forces, (m,) [N]."""
        # Where a loading begins or ends between two frames the smooth path is wrong by as much.
        shared, errors = parameters[:SHARED], parameters[SHARED:]
        return np.abs(self._force(shared, errors, smooth=False) - self._force(shared, errors))

    def starts(self) -> NDArray:
        """Parameters for guesses of the contact's place, a row each."""
        starts = np.zeros((len(CONTACT_GUESSES), SHARED + len(self.depth_m)))
        for start, part in zip(starts, CONTACT_GUESSES, strict=True):
            contact_m = self.depth_m.min() + part * np.ptp(self.depth_m)
            deepest = max(self.depth_m.max() - contact_m, SCALE_M)
            stiffness = np.log(max(self.force_n.max(), SMALLEST_FORCE_N) / deepest**1.5)
            start[[1, 2]] = stiffness, contact_m / SCALE_M
        return starts

    def fit(self, start: NDArray, prior_std_s: float) -> OptimizeResult:
        return least_squares(self.residual, start, jac=self.slope, args=(prior_std_s,))

    def residual(self, parameters: NDArray, prior_std_s: float) -> NDArray:
        """Misfit of the force, and departures from what is known beforehand, in deviations."""
        force = self._force(parameters[:SHARED], parameters[SHARED:])
        misfit = (force - self.force_n) * self.weights
        prior = parameters[0] * SCALE_S / prior_std_s
        return np.concatenate([misfit, [prior], parameters[FREE:]])

    def slope(self, parameters: NDArray, prior_std_s: float) -> NDArray:
        """Slope of the residual by the parameters, the depths' all at once."""
        shared, errors = parameters[:SHARED], parameters[SHARED:]
        steps = STEP * np.maximum(1, np.abs(parameters))
        # Each slope is between forces of one interpolation, whose limits depend on all its paths.
        moved = errors + np.vstack([np.zeros(len(errors)), np.diag(steps[SHARED:])])
        of_errors = self._force(shared, moved)
        apart = shared + np.vstack([np.zeros(SHARED), np.diag(steps[:SHARED])])
        of_shared = np.array([self._force(one, errors) for one in apart])
        rises = np.concatenate([each[1:] - each[0] for each in (of_shared, of_errors)])
        by_force = rises / steps[:, None] * self.weights
        prior = np.eye(len(steps))[[0, *range(FREE, len(steps))]]
        prior[0] *= SCALE_S / prior_std_s
        return np.concatenate([by_force.T, prior])

    def _force(self, shared: NDArray, errors: NDArray, *, smooth: bool = True) -> NDArray:
        """Force at its times, (m,) or (k, m), for errors of the depths, (n,) or (k, n)."""
        offset, stiffness, contact, curvature, relaxed, baseline = shared
        depth = self.depth_m + errors * self.depth_std_m
        if smooth:
            path = Akima1DInterpolator(self.frame_time_s, depth, method="makima", axis=-1)
        else:
            path = make_interp_spline(self.frame_time_s, depth, k=1, axis=-1)
        time_s = np.clip(self.time_s - offset * SCALE_S, *self.frame_time_s[[0, -1]])
        x = np.maximum(path(time_s) - contact * SCALE_M, 0)
        elastic = np.exp(stiffness) * x**1.5 * (1 + curvature * CURVATURE_STD_PER_M * x)
        share = (RELAXED + relaxed * RELAXED_STD) / len(RELAXATION_S)
        force = elastic + baseline * BASELINE_STD_N
        for decay, rate in zip(*_decays(self.time_s), strict=True):
            # held[n] - decay held[n - 1] = rate (elastic[n] - elastic[n - 1])
            bands = np.stack([np.ones(len(self.time_s)), np.full(len(self.time_s), -decay)])
            entered = rate * np.diff(elastic, prepend=elastic[..., :1])
            force = force - share * (elastic - solve_banded((1, 0), bands, entered.T).T)
        return force
