"""Fits of the reduced modulus to an indentation (Section 5.1)."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import OptimizeResult, least_squares
from scipy.special import ndtri, stdtrit

from palpate.estimate.hertz.laws import Law, parabola_force
from palpate.modulus import CONFIDENCE

# Forces are compared as they are, or to this power, which makes Eq. 5.1 a straight line.
RESIDUALS = {"force": 1.0, "force_two_thirds": 2 / 3}
# Least deviation of the depth that a fit's scaling bears, as part of the indentation.
TINY = 1e-6
TOLERANCE = 1e-14
# Depths of first contact that are tried, as parts of the depth's range from its least; contact may
# begin before the record. The fit starts from those that are better than their neighbours.
CONTACTS = np.linspace(-0.5, 0.95, 30)
STARTS = 3
# Any more would leave an indentation no sample at all; of a long record so many are left.
LARGEST_AUTOCORRELATION, FEWEST_LEFT = 0.9, 5.0
LEVEL = (1 + CONFIDENCE) / 2


@dataclass(frozen=True)
class StudyFit:
    """Fit of the coefficient alone, as the study does it: E* [Pa], rms of the residuals [N]."""

    reduced_modulus_pa: float
    rms_n: float


@dataclass(frozen=True)
class KnownContactFit:
    """Fit of E* alone, with its interval.

    Attributes
    ----------
    reduced_modulus_pa, reduced_modulus_std_pa : float
        E* and its standard error [Pa].
    reduced_modulus_interval_pa : (float, float)
        Confidence interval of 95 % [Pa].
    effective_samples : float
        Number of independent residuals that the serial correlation leaves.
    rms_n : float
        Root mean square of the force residual [N].
    """

    reduced_modulus_pa: float
    reduced_modulus_std_pa: float
    reduced_modulus_interval_pa: tuple[float, float]
    effective_samples: float
    rms_n: float


@dataclass(frozen=True)
class ContactFit(KnownContactFit):
    """Fit with the contact point free; its standard error and interval are of scatter alone.

    Attributes
    ----------
    contact_depth_m, contact_depth_std_m : float
        Depth at which contact begins [m].
    contact_correlation : float
        Correlation of E* and of the depth at which contact begins.
    baseline_n : float
        Constant force before contact [N].
    """

    contact_depth_m: float
    contact_depth_std_m: float
    contact_correlation: float
    baseline_n: float


def hertz_force(depth_m: NDArray, E_star: float, radius_m: float) -> NDArray:
    """Force of Eq. 5.1, F = 4/3 E* R^(1/2) u^(3/2), zero before contact [N]."""
    return E_star * parabola_force(depth_m, radius_m)


def fit_study(depth_m: NDArray, force_n: NDArray, radius_m: float) -> StudyFit:
    """Fit E* to the squared force residuals, contact point taken as known.

    The study does it by Nelder and Mead's method; the problem is linear, and its minimum exact.

    Parameters
    ----------
    depth_m, force_n : (n,) arrays
        Depth below the undeformed surface [m] and force [N] of the samples in range.
    radius_m : float

    Raises
    ------
    ValueError
        If there are fewer than two samples in contact.
    """
    _check_in_contact(depth_m)
    unit = hertz_force(depth_m, 1.0, radius_m)
    E_star = _slope(unit, force_n)
    return StudyFit(E_star, _rms(E_star * unit - force_n))


def fit_known_contact(
    depth_m: NDArray, force_n: NDArray, law: Law, *, depth_std_m: float
) -> KnownContactFit:
    """Fit E* by least squares, contact point taken as known.

    Parameters
    ----------
    depth_m, force_n : (n,) arrays
        Depth below the undeformed surface [m] and force [N] of the samples in range.
    law : callable
        Force per reduced modulus over depth (`contact_law`).
    depth_std_m : float
        Standard deviation of an error that all depths share [m].

    Raises
    ------
    ValueError
        If there are fewer than two samples in contact.
    """
    _check_in_contact(depth_m)
    unit = law(depth_m)
    E_star = _slope(unit, force_n)
    residual = E_star * unit - force_n
    scatter = deviation(residual, 1) / np.sqrt(unit @ unit)
    # A shift that would lift the sphere out of the object has no slope.
    shift = min(depth_std_m, 0.1 * float(depth_m.max()))
    ends = [_slope(law(depth_m + sign * shift), force_n) for sign in (1, -1)]
    of_depth = (ends[0] - ends[1]) / (2 * shift) * depth_std_m if shift > 0 else 0.0
    of_scatter = stdtrit(freedom(residual, 1), LEVEL) * scatter
    width = float(np.hypot(of_scatter, ndtri(LEVEL) * of_depth)) / E_star
    return KnownContactFit(
        reduced_modulus_pa=E_star,
        reduced_modulus_std_pa=float(np.hypot(scatter, of_depth)),
        reduced_modulus_interval_pa=_interval(E_star, width),
        effective_samples=effective_samples(residual),
        rms_n=_rms(residual),
    )


def fit_free_contact(
    depth_m: NDArray,
    force_n: NDArray,
    law: Law,
    *,
    baseline: bool = False,
    residual: str = "force",
    depth_std_m: float | None = None,
    weights: NDArray | None = None,
) -> ContactFit:
    """Fit E* and the depth of first contact by least squares.

    Assumes residuals of equal variance whose correlation falls off as a first-order process.

    Parameters
    ----------
    depth_m, force_n : (n,) arrays
        Depth along the approach [m] and force [N]; samples before contact help.
    law : callable
        Force per reduced modulus over depth (`contact_law`).
    baseline : bool
        Fit a constant force too.
    residual : {"force", "force_two_thirds"}
        What of the force is compared: itself, or its power 2/3, in which Eq. 5.1 is straight.
    depth_std_m : float, optional
        Standard deviation of an error that all depths share [m]: contact is then expected at depth
        0 with this deviation, and weighs as much as that says beside the residuals.
    weights : (n,) array, optional
        Of the squared residuals, beside each other; all alike by default.

    Raises
    ------
    ValueError
        If there are no more samples than parameters, or the residual is none of these.
    """
    count = 3 if baseline else 2
    if len(force_n) <= count:
        raise ValueError(f"samples: expected more than {count}, found {len(force_n)}")
    if residual not in RESIDUALS:
        raise ValueError(f"residual: expected one of {', '.join(RESIDUALS)}, found {residual}")
    length, force_scale = float(np.ptp(depth_m)), float(np.ptp(force_n))
    modulus = force_scale / float(law(np.array(length)))
    measured, power = force_n / force_scale, RESIDUALS[residual]
    roots = 1.0 if weights is None else np.sqrt(weights / np.mean(weights))

    def force(x: NDArray) -> NDArray:
        level = x[2] if baseline else 0.0
        return np.exp(x[0]) * modulus * law(depth_m - x[1] * length) / force_scale + level

    def gaps(x: NDArray, weight: float = 0.0) -> NDArray:
        return np.r_[roots * (_power(force(x), power) - _power(measured, power)), weight * x[1]]

    starts = _starts(lambda depth: modulus * law(depth) / force_scale, depth_m, measured, baseline)
    found = _least(gaps, starts)
    if depth_std_m is not None:
        weight = deviation(found.fun[:-1], count) * length / max(depth_std_m, TINY * length)
        found = _least(gaps, starts, weight=weight)
    rms_n = _rms(force(found.x) * force_scale - force_n)
    return _contact_fit(found, modulus, length, force_scale, rms_n)


def effective_samples(residual: NDArray) -> float:
    """Number of independent samples with as much to say as serially correlated ones.

    n (1 - r)/(1 + r) for a first-order process of lag-1 autocorrelation r, whose estimate falls
    short by (1 + 4 r)/n in a short series (Marriott and Pope, Biometrika 41, 1954, 390). Negative
    autocorrelation is taken for none.
    """
    centred, n = residual - residual.mean(), len(residual)
    power = float(centred @ centred)
    lag = float(centred[1:] @ centred[:-1]) / power if power > 0 else 0.0
    most = max(LARGEST_AUTOCORRELATION, (n - FEWEST_LEFT) / (n + FEWEST_LEFT))
    lag = float(np.clip(lag + (1 + 4 * lag) / n, 0, most))
    return n * (1 - lag) / (1 + lag)


def freedom(residual: NDArray, parameters: int) -> float:
    """Degrees of freedom that serially correlated residuals of a fit leave to Student's quantile.

    Of few samples, which hardly determine their correlation, those of five are left, or all.

    Parameters
    ----------
    residual : (n,) array
    parameters : int
        Number of parameters fitted.
    """
    n = len(residual)
    return max(effective_samples(residual), min(n, FEWEST_LEFT)) * (1 - parameters / n)


def deviation(residual: NDArray, parameters: int) -> float:
    """Standard deviation of a fit's residuals, as large as their serial correlation asks.

    Divided by the root of a sum of squared slopes it gives the standard error of a parameter.
    Parameters are those of `freedom`.
    """
    left = effective_samples(residual) * (1 - parameters / len(residual))
    return float(np.sqrt(residual @ residual / left))


def _least(gaps: Callable, starts: list[NDArray], **known: float) -> OptimizeResult:
    """Least squares from several starts."""
    precise = dict.fromkeys(("xtol", "ftol", "gtol"), TOLERANCE)
    fits = [least_squares(gaps, one, x_scale="jac", kwargs=known, **precise) for one in starts]
    return min(fits, key=lambda fit: fit.cost)


def _contact_fit(
    found: OptimizeResult, modulus: float, length: float, force_scale: float, rms_n: float
) -> ContactFit:
    """What a fit in (log E*, contact, baseline), each in its own unit, comes to."""
    # The last row is the contact's own weight.
    left, x = found.fun[:-1], found.x
    covariance = np.linalg.pinv(found.jac.T @ found.jac) * deviation(left, len(x)) ** 2
    std = np.sqrt(np.diag(covariance))
    E_star, width = float(np.exp(x[0])) * modulus, stdtrit(freedom(left, len(x)), LEVEL) * std[0]
    # Exact data leave no residual, and then no correlation.
    product = float(std[0] * std[1])
    return ContactFit(
        reduced_modulus_pa=E_star,
        reduced_modulus_std_pa=E_star * float(std[0]),
        reduced_modulus_interval_pa=_interval(E_star, width),
        contact_depth_m=float(x[1]) * length,
        contact_depth_std_m=float(std[1]) * length,
        contact_correlation=float(covariance[0, 1]) / product if product > 0 else 0.0,
        effective_samples=effective_samples(left),
        baseline_n=float(x[2]) * force_scale if len(x) > 2 else 0.0,
        rms_n=rms_n,
    )


def _starts(unit: Law, depth_m: NDArray, force: NDArray, baseline: bool) -> list[NDArray]:
    """Unknowns to start from: contacts better than those beside them, the rest fitted."""
    length = float(np.ptp(depth_m))
    found = []
    for part in CONTACTS:
        contact = float(depth_m.min()) + part * length
        columns = np.stack([unit(depth_m - contact), np.ones(len(depth_m))][: 1 + baseline], axis=1)
        best, *_ = np.linalg.lstsq(columns, force, rcond=None)
        cost = float(np.sum((columns @ best - force) ** 2)) if best[0] > 0 else np.inf
        found.append((cost, np.r_[np.log(max(best[0], TINY)), contact / length, best[1:]]))
    costs = np.array([np.inf, *(cost for cost, _ in found), np.inf])
    least = (costs[1:-1] <= np.minimum(costs[:-2], costs[2:])) & np.isfinite(costs[1:-1])
    chosen = sorted((found[k] for k in np.flatnonzero(least)), key=lambda one: one[0])
    return [start for _, start in chosen[:STARTS]] or [np.zeros(2 + baseline)]


def _check_in_contact(depth_m: NDArray) -> None:
    found = int((depth_m > 0).sum())
    if found < 2:
        raise ValueError(f"depth: expected at least 2 samples in contact, found {found}")


def _slope(unit: NDArray, force: NDArray) -> float:
    """Of the straight line through 0."""
    return float(unit @ force / (unit @ unit))


def _interval(E_star: float, width: float) -> tuple[float, float]:
    return E_star * float(np.exp(-width)), E_star * float(np.exp(width))


def _power(values: NDArray, exponent: float) -> NDArray:
    """Signed power."""
    return np.sign(values) * np.abs(values) ** exponent


def _rms(residual: NDArray) -> float:
    return float(np.sqrt(np.mean(np.square(residual))))
