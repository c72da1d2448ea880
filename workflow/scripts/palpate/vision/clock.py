"""Offset between the clocks of force sensor and camera, from the press itself."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import Akima1DInterpolator, make_interp_spline
from scipy.linalg import solve_banded
from scipy.optimize import OptimizeResult, least_squares

from palpate.vision.press_time import FEWEST_PRESSED, RELAXATION_S, check_time

# A soft object's force is F = k x^1.5 (1 + c x), Hertz's law and its first departure, relaxing with
# two times; what the departures may be [1/m], [-], [N].
CURVATURE_STD_PER_M = 50.0
RELAXED, RELAXED_STD = 0.15, 0.15
BASELINE_STD_N = 0.05
# The refinement of a pose has errors beyond its noise [m].
DEPTH_STD_M = 1e-4
NEAR_FRAME_S = 0.03
FEWEST_SAMPLES = 10
# Each frame's depth is an unknown: the work goes with the square of their number.
MOST_FRAMES, MOST_SAMPLES = 120, 20_000
SMALLEST_NOISE_N = 1e-3
# Exposure and the way through USB take 20 to 100 ms, where a stamp is of the picture's coming.
USB_CLOCK_STD_S = 0.05
# Fits after each of which is known what a path that turns between frames makes of the force.
ROUNDS = 2
# Of the peak, from which force on a frame tells of the clocks.
TELLING = 0.1
SMALLEST_FORCE_N = 0.05
# Where the contact may be, as parts of the way that the tip takes, to start from.
CONTACT_GUESSES = (0.4, 0.6, 0.8)


@dataclass(frozen=True)
class ClockOffset:
    """Force clock minus camera clock, its standard deviation, and that of before the press [s].

    An offset that the press does not determine is 0, with the deviation of before.
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
    soft press says little of it, so the offset starts from zero with the stated deviation, and the
    result's deviation says what was learnt.

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
        If the force follows the depth at quite another time.
    """
    # A step of the offset vanishes beside times that count from 1970.
    force_time_s, frame_time_s = force_time_s - frame_time_s[0], frame_time_s - frame_time_s[0]
    unknown = ClockOffset(0.0, prior_std_s, prior_std_s, determined=False)
    time_s, force = _between(force_time_s, force_n, frame_time_s)
    at_frames = np.interp(frame_time_s, force_time_s, force_n)
    few = (at_frames > TELLING * at_frames.max()).sum() < FEWEST_PRESSED
    if few or force.size < FEWEST_SAMPLES or at_frames.max() < SMALLEST_FORCE_N:
        return unknown
    depth_std_m = np.hypot(depth_std_m, DEPTH_STD_M)
    path = (frame_time_s, depth_m, depth_std_m)
    noise, record = _noise(force), (force_time_s, force_n)
    if not check_time(*record, *path, noise_n=noise, prior_std_s=prior_std_s):
        return unknown
    told = _telling(at_frames)
    frame_time_s, depth_m, depth_std_m = (each[told] for each in path)
    time_s, force = _between(force_time_s, force_n, frame_time_s)
    noise = _noise(force)
    press = _Press(time_s, force, noise, frame_time_s, depth_m, depth_std_m)
    span = depth_m.max() - depth_m.min()
    starts = [press.start(depth_m.min() + part * span) for part in CONTACT_GUESSES]
    fits = [press.fit(start, prior_std_s) for start in starts]
    best = min(fits, key=lambda fit: fit.cost)
    for _ in range(ROUNDS):
        press = replace(press, unsure_n=press.unsure_of(best.x))
        best = press.fit(best.x, prior_std_s)
    # What the model of the contact leaves is counted as noise.
    left = np.sqrt((best.fun[: force.size] ** 2).sum() / max(np.count_nonzero(press.weights), 1))
    if left > 1:
        press = replace(press, noise_n=noise * left)
        best = press.fit(best.x, prior_std_s)
    covariance = np.linalg.pinv(best.jac.T @ best.jac)
    offset_s, std_s = best.x[0] * SCALE_S, np.sqrt(covariance[0, 0]) * SCALE_S
    return ClockOffset(float(offset_s), float(std_s), prior_std_s)


def _between(
    force_time_s: NDArray, force_n: NDArray, frame_time_s: NDArray
) -> tuple[NDArray, NDArray]:
    """Samples between the first and the last frame: of many, means of a few each."""
    between = (force_time_s > frame_time_s[0]) & (force_time_s < frame_time_s[-1])
    few = -(-np.count_nonzero(between) // MOST_SAMPLES)
    samples = np.stack([force_time_s[between], force_n[between]])
    if few > 1:
        samples = samples[:, : samples.shape[1] // few * few].reshape(2, -1, few).mean(axis=2)
    return samples[0], samples[1]


def _noise(force_n: NDArray) -> float:
    return max(np.diff(force_n).std() / np.sqrt(2), SMALLEST_NOISE_N)


def _telling(force_n: NDArray) -> NDArray:
    """Frames of a long film that tell of the clocks: the press, or its rise, evenly."""
    if len(force_n) <= MOST_FRAMES:
        return np.arange(len(force_n))
    margin, pressed = MOST_FRAMES // 10, np.flatnonzero(force_n > TELLING * force_n.max())
    first, last = pressed[0] - margin, pressed[-1] + margin
    if last - first >= MOST_FRAMES:
        last = int(np.argmax(force_n)) + margin
    chosen = np.arange(max(first, 0), min(last + 1, len(force_n)))
    return chosen[:: -(-len(chosen) // MOST_FRAMES)]


# Parameters are of order one: offset, log stiffness, contact, curvature, relaxation, baseline.
SCALE_S, SCALE_M = 0.01, 1e-3
# Parameters before those of the frames' depths; of them, those that have no deviation from 0.
SHARED, FREE = 6, 3
# Of a parameter, for a slope: the root of what a double tells apart.
STEP = float(np.sqrt(np.finfo(float).eps))


@dataclass(frozen=True)
class _Press:
    """The force's record and the tip's path, and how far a model is from them."""

    time_s: NDArray
    force_n: NDArray
    noise_n: float
    frame_time_s: NDArray
    depth_m: NDArray
    depth_std_m: NDArray
    unsure_n: NDArray | float = 0.0

    @cached_property
    def weights(self) -> NDArray:
        """Of the forces, (m,) [1/N]; between frames nobody knows the path."""
        gap = np.abs(self.time_s[:, None] - self.frame_time_s).min(axis=1)
        return (gap < NEAR_FRAME_S) / np.hypot(self.noise_n, self.unsure_n)

    def unsure_of(self, parameters: NDArray) -> NDArray:
        """By how much a path of straight lines between the frames makes other forces, (m,) [N].

        Where a loading begins or ends between two frames the smooth path is wrong by as much.
        """
        shared, errors = parameters[:SHARED], parameters[SHARED:]
        return np.abs(self._force(shared, errors, smooth=False) - self._force(shared, errors))

    def start(self, contact_m: float) -> NDArray:
        """Parameters for a guess of the contact's place."""
        deepest = max(self.depth_m.max() - contact_m, SCALE_M)
        stiffness = np.log(max(self.force_n.max(), SMALLEST_FORCE_N) / deepest**1.5)
        shared = [0.0, stiffness, contact_m / SCALE_M, 0.0, 0.0, 0.0]
        return np.concatenate([shared, np.zeros(len(self.depth_m))])

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
        # Each slope is between forces of one interpolation, whose limits hang on all its paths.
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
        share = RELAXED + relaxed * RELAXED_STD
        force = elastic + baseline * BASELINE_STD_N
        for time in RELAXATION_S:
            force = force - share / len(RELAXATION_S) * (elastic - self._held(elastic, time))
        return force

    def _held(self, elastic: NDArray, relaxation_s: float) -> NDArray:
        """Part of an elastic force that has not yet relaxed (one Maxwell element)."""
        step = (self.time_s[-1] - self.time_s[0]) / (len(self.time_s) - 1)
        decay = np.exp(-step / relaxation_s)
        rate = relaxation_s / step * (1 - decay)
        # held[n] - decay held[n - 1] = rate (elastic[n] - elastic[n - 1])
        bands = np.ones((2, elastic.shape[-1]))
        bands[1] = -decay
        entered = rate * np.diff(elastic, prepend=elastic[..., :1])
        return solve_banded((1, 0), bands, entered.T).T
