"""Fits of the reduced modulus to a press (Section 5.1)."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import OptimizeResult, least_squares, minimize
from scipy.special import ndtri, stdtrit

from palpate.estimate.hertz.laws import parabola_force
from palpate.estimate.hertz.scatter import deviation, effective_samples, freedom
from palpate.modulus import CONFIDENCE

TOLERANCE = 1e-10
# Forces are compared as they are, or to this power, which makes Eq. 5.1 a straight line.
RESIDUALS = {"force": 1.0, "force_two_thirds": 2 / 3}
# Least deviation of the depth that a fit's scaling bears, as part of the press.
TINY = 1e-6
# Places of first contact that are tried, as parts of the depth's range from its least; a press may
# begin before its record. The fit starts from those that are better than their neighbours.
PLACES = np.linspace(-0.5, 0.95, 30)
STARTS = 3

Law = Callable[[NDArray], NDArray]


@dataclass(frozen=True)
class StudyFit:
    """Fit of the coefficient alone, as the study does it.

    Attributes
    ----------
    reduced_modulus_pa : float
        E* [Pa].
    rms_n : float
        Root mean square of the force residual [N].
    """

    reduced_modulus_pa: float
    rms_n: float


@dataclass(frozen=True)
class KnownContactFit:
    """Fit of E* alone, with its interval.

    Attributes
    ----------
    reduced_modulus_pa, reduced_modulus_std_pa : float
        E* and its standard error, of scatter and of the depth's common error [Pa].
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
class ContactFit:
    """Fit with the contact point free.

    Attributes
    ----------
    reduced_modulus_pa, reduced_modulus_std_pa : float
        E* and its standard error [Pa].
    reduced_modulus_interval_pa : (float, float)
        Confidence interval of 95 % [Pa], of scatter alone; its width allows for the lag-1
        autocorrelation of the residuals.
    contact_depth_m, contact_depth_std_m : float
        Depth at which contact begins [m].
    contact_correlation : float
        Correlation of E* and of the depth at which contact begins.
    effective_samples : float
        Number of independent residuals that the serial correlation leaves.
    baseline_n : float
        Constant force before contact [N].
    rms_n : float
        Root mean square of the force residual [N].
    """

    reduced_modulus_pa: float
    reduced_modulus_std_pa: float
    reduced_modulus_interval_pa: tuple[float, float]
    contact_depth_m: float
    contact_depth_std_m: float
    contact_correlation: float
    effective_samples: float
    baseline_n: float
    rms_n: float


def hertz_force(depth_m: NDArray, E_star: float, radius_m: float) -> NDArray:
    """Force of Eq. 5.1, F = 4/3 E* R^(1/2) u^(3/2), zero before contact [N]."""
    return E_star * parabola_force(depth_m, radius_m)


def fit_study(depth_m: NDArray, force_n: NDArray, radius_m: float) -> StudyFit:
    """Fit E* by Nelder-Mead on the squared force residuals, contact point taken as known.

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
    start = float(unit @ force_n / (unit @ unit))
    scale = float(force_n @ force_n)

    def cost(x: NDArray) -> float:
        residual = x[0] * start * unit - force_n
        return float(residual @ residual) / scale

    options = {"xatol": TOLERANCE, "fatol": TOLERANCE**2}
    found = minimize(cost, [1.1], method="Nelder-Mead", options=options)
    E_star = float(found.x[0]) * start
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

    def modulus(shift_m: float) -> float:
        unit = law(depth_m + shift_m)
        return float(unit @ force_n / (unit @ unit))

    E_star, unit = modulus(0.0), law(depth_m)
    residual = E_star * unit - force_n
    count = effective_samples(residual)
    scatter = deviation(residual, 1) / np.sqrt(unit @ unit)
    # A shift that would lift the press out of the object tells no slope.
    shift = min(depth_std_m, 0.1 * float(depth_m.max()))
    slope = (modulus(shift) - modulus(-shift)) / (2 * shift) if shift > 0 else 0.0
    std = float(np.hypot(scatter, slope * depth_std_m))
    level = (1 + CONFIDENCE) / 2
    of_scatter = stdtrit(freedom(residual, 1), level) * scatter
    width = float(np.hypot(of_scatter, ndtri(level) * slope * depth_std_m)) / E_star
    interval = (E_star * float(np.exp(-width)), E_star * float(np.exp(width)))
    return KnownContactFit(E_star, std, interval, count, _rms(residual))


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

    def force(x: NDArray) -> NDArray:
        level = x[2] if baseline else 0.0
        return np.exp(x[0]) * modulus * law(depth_m - x[1] * length) / force_scale + level

    wanted, exponent = force_n / force_scale, RESIDUALS[residual]
    roots = 1.0 if weights is None else np.sqrt(weights / np.mean(weights))
    starts = _starts(lambda depth: modulus * law(depth) / force_scale, depth_m, wanted, baseline)
    best = _least(force, wanted, exponent, starts, roots)
    if depth_std_m is not None:
        weight = deviation(best.fun[:-1], len(best.x)) * length / max(depth_std_m, TINY * length)
        best = _least(force, wanted, exponent, starts, roots, weight=weight)
    return _contact_fit(best, force(best.x) * force_scale - force_n, modulus, length, force_scale)


def _least(
    force: Law,
    measured: NDArray,
    power: float,
    starts: list[NDArray],
    roots: NDArray | float,
    *,
    weight: float = 0.0,
) -> OptimizeResult:
    """Least squares of powers of the force and of the weighted contact, from several places.

    ``roots`` are those of the samples' weights.
    """
    wanted = _power(measured, power)
    fits = [
        least_squares(
            lambda x: np.r_[roots * (_power(force(x), power) - wanted), weight * x[1]],
            start,
            x_scale="jac",
            xtol=1e-14,
            ftol=1e-14,
            gtol=1e-14,
        )
        for start in starts
    ]
    return min(fits, key=lambda fit: fit.cost)


def _contact_fit(
    best: OptimizeResult, left: NDArray, modulus: float, length: float, force_scale: float
) -> ContactFit:
    """What a fit in (log E*, contact, baseline), each in its own unit, comes to."""
    # The last row is the contact's own weight.
    residual, parameters = best.fun[:-1], len(best.x)
    variance = deviation(residual, parameters) ** 2
    covariance = np.linalg.pinv(best.jac.T @ best.jac) * variance
    std = np.sqrt(np.diag(covariance))
    width = stdtrit(freedom(residual, parameters), (1 + CONFIDENCE) / 2) * std[0]
    E_star = float(np.exp(best.x[0])) * modulus
    # Exact data leave no residual, and then no correlation.
    product = float(std[0] * std[1])
    return ContactFit(
        reduced_modulus_pa=E_star,
        reduced_modulus_std_pa=E_star * float(std[0]),
        reduced_modulus_interval_pa=(
            E_star * float(np.exp(-width)),
            E_star * float(np.exp(width)),
        ),
        contact_depth_m=float(best.x[1]) * length,
        contact_depth_std_m=float(std[1]) * length,
        contact_correlation=float(covariance[0, 1]) / product if product > 0 else 0.0,
        effective_samples=effective_samples(residual),
        baseline_n=float(best.x[2]) * force_scale if len(best.x) > 2 else 0.0,
        rms_n=_rms(left),
    )


def _check_in_contact(depth_m: NDArray) -> None:
    found = int((depth_m > 0).sum())
    if found < 2:
        raise ValueError(f"depth: expected at least 2 samples in contact, found {found}")


def _starts(unit: Law, depth_m: NDArray, force: NDArray, baseline: bool) -> list[NDArray]:
    """Unknowns to start from: places of contact better than those beside them, the rest fitted.

    Parameters
    ----------
    unit : callable
        Force over depth of the first unknown at 0.
    depth_m, force : (n,) arrays
    baseline : bool
        Whether a constant force is an unknown too.
    """
    length = float(np.ptp(depth_m))
    found = []
    for part in PLACES:
        place = float(depth_m.min()) + part * length
        columns = np.stack([unit(depth_m - place), np.ones(len(depth_m))][: 1 + baseline], axis=1)
        best, *_ = np.linalg.lstsq(columns, force, rcond=None)
        cost = float(np.sum((columns @ best - force) ** 2)) if best[0] > 0 else np.inf
        found.append((cost, np.r_[np.log(max(best[0], TINY)), place / length, best[1:]]))
    costs = np.array([np.inf, *(cost for cost, _ in found), np.inf])
    least = (costs[1:-1] <= np.minimum(costs[:-2], costs[2:])) & np.isfinite(costs[1:-1])
    chosen = sorted((found[k] for k in np.flatnonzero(least)), key=lambda one: one[0])
    return [start for _, start in chosen[:STARTS]] or [np.zeros(2 + baseline)]


def _power(values: NDArray, exponent: float) -> NDArray:
    """Signed power."""
    return np.sign(values) * np.abs(values) ** exponent


def _rms(residual: NDArray) -> float:
    return float(np.sqrt(np.mean(np.square(residual))))
