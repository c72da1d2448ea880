"""Offset between the clocks of force sensor and camera, from the press itself."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import Akima1DInterpolator
from scipy.optimize import least_squares
from scipy.signal import lfilter

# A soft object's force is F = k x^1.5 (1 + c x), Hertz's law and its first departure, relaxing with
# two times; what the departures may be [1/m], [-], [N].
CURVATURE_STD_PER_M = 50.0
RELAXED, RELAXED_STD, RELAXATION_S = 0.15, 0.15, (0.3, 3.0)
BASELINE_STD_N = 0.05
# The refinement of a pose has errors beyond its noise [m].
DEPTH_STD_M = 1e-4
NEAR_FRAME_S = 0.03
FEWEST_PRESSED, FEWEST_SAMPLES = 4, 10
SMALLEST_NOISE_N = 1e-3
# Offsets that are searched for a press at quite another time, what of them is told, and how much
# less alike force and depth must then be as recorded.
SEARCHED_S, SEARCH_STEP_S, FARTHEST_S, MUCH_WORSE = 1.0, 0.02, 0.1, 0.98
# Correlation of a press's force with its depth. The study's captures have 0.997 and more, a hold
# that relaxes by half about 0.9; another capture's force or frames in another order have less.
LEAST_ALIKE = 0.8
PRESSED = 0.1
SMALLEST_FORCE_N = 0.05
# Guesses of the contact, as parts of the way that the tip takes.
CONTACT_GUESSES = (0.4, 0.6, 0.8)


@dataclass(frozen=True)
class ClockOffset:
    """Force clock minus camera clock, and its standard deviation [s]."""

    offset_s: float
    std_s: float


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
        Zero with the prior's deviation where nothing is pressed.

    Raises
    ------
    ValueError
        If the force follows the depth at quite another time, or not at all.
    """
    between = (force_time_s > frame_time_s[0]) & (force_time_s < frame_time_s[-1])
    time_s, force = force_time_s[between], force_n[between]
    at_frames = np.interp(frame_time_s, force_time_s, force_n)
    if force.size < FEWEST_SAMPLES or at_frames.max() < SMALLEST_FORCE_N:
        return ClockOffset(0.0, prior_std_s)
    if (at_frames > PRESSED * at_frames.max()).sum() < FEWEST_PRESSED:
        return ClockOffset(0.0, prior_std_s)
    _check_near(force_time_s, force_n, frame_time_s, depth_m)
    noise = max(np.diff(force).std() / np.sqrt(2), SMALLEST_NOISE_N)
    depth_std_m = np.hypot(depth_std_m, DEPTH_STD_M)
    press = _Press(time_s, force, noise, frame_time_s, depth_m, depth_std_m)
    span = depth_m.max() - depth_m.min()
    starts = [press.start(depth_m.min() + part * span) for part in CONTACT_GUESSES]
    fits = [least_squares(press.residual, start, args=(prior_std_s,)) for start in starts]
    best = min(fits, key=lambda fit: fit.cost)
    # What the model of the contact leaves is counted as noise.
    left = np.sqrt((best.fun[: force.size] ** 2).sum() / max(press.near.sum(), 1))
    if left > 1:
        press = replace(press, noise_n=noise * left)
        best = least_squares(press.residual, best.x, args=(prior_std_s,))
    covariance = np.linalg.pinv(best.jac.T @ best.jac)
    return ClockOffset(float(best.x[0] * SCALE_S), float(np.sqrt(covariance[0, 0]) * SCALE_S))


def _check_near(
    force_time_s: NDArray, force_n: NDArray, frame_time_s: NDArray, depth_m: NDArray
) -> None:
    """Refuse records whose force rises at another time than the tip goes down, or unlike it."""
    span = np.ptp(depth_m)
    contacts = [depth_m.min() + part * span for part in CONTACT_GUESSES]
    shifts = np.arange(-SEARCHED_S, SEARCHED_S + SEARCH_STEP_S / 2, SEARCH_STEP_S)
    likeness = []
    for shift in shifts:
        force = np.interp(frame_time_s + shift, force_time_s, force_n)
        likeness.append(
            max(
                np.corrcoef(force, np.maximum(depth_m - contact, 0) ** 1.5)[0, 1]
                for contact in contacts
            )
        )
    best = int(np.nanargmax(likeness))
    still = likeness[int(np.argmin(np.abs(shifts)))]
    if not likeness[best] >= LEAST_ALIKE:
        raise ValueError(
            "force.csv: expected a force that follows the tip's depth, with a correlation of at"
            f" least {LEAST_ALIKE:g}, found {likeness[best]:.2f} (another capture's record, or"
            " frames in another order?)"
        )
    if abs(shifts[best]) > FARTHEST_S and still < MUCH_WORSE * likeness[best]:
        raise ValueError(
            f"force.csv: time_s: expected the clock of frames.csv within {FARTHEST_S:g} s,"
            f" found the press about {shifts[best]:+.2f} s away"
        )


# Parameters are of order one: offset, log stiffness, contact, curvature, relaxation, baseline.
SCALE_S, SCALE_M = 0.01, 1e-3


@dataclass(frozen=True)
class _Press:
    """The force's record and the tip's path, and how far a model is from them."""

    time_s: NDArray
    force_n: NDArray
    noise_n: float
    frame_time_s: NDArray
    depth_m: NDArray
    depth_std_m: NDArray

    @cached_property
    def near(self) -> NDArray:
        """Weights: between frames nobody knows the path."""
        gap = np.abs(self.time_s[:, None] - self.frame_time_s).min(axis=1)
        return (gap < NEAR_FRAME_S).astype(float)

    def start(self, contact_m: float) -> NDArray:
        """Parameters for a guess of the contact's place."""
        deepest = max(self.depth_m.max() - contact_m, SCALE_M)
        stiffness = np.log(max(self.force_n.max(), SMALLEST_FORCE_N) / deepest**1.5)
        shared = [0.0, stiffness, contact_m / SCALE_M, 0.0, 0.0, 0.0]
        return np.concatenate([shared, np.zeros(len(self.depth_m))])

    def residual(self, parameters: NDArray, prior_std_s: float) -> NDArray:
        """Misfit of the force, and departures from what is known beforehand, in deviations."""
        misfit = (self._force(parameters) - self.force_n) / self.noise_n * self.near
        prior = parameters[0] * SCALE_S / prior_std_s
        return np.concatenate([misfit, [prior], parameters[3:]])

    def _force(self, parameters: NDArray) -> NDArray:
        offset, stiffness, contact, curvature, relaxed, baseline = parameters[:6]
        depth = self.depth_m + parameters[6:] * self.depth_std_m
        path = Akima1DInterpolator(self.frame_time_s, depth, method="makima")
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
        return lfilter([rate], [1, -decay], np.diff(elastic, prepend=elastic[0]))
