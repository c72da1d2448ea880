"""Fits of the reduced modulus to an indentation (Section 5.1)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import OptimizeResult, least_squares
from scipy.special import ndtri, stdtrit

from palpate.estimate.hertz.laws import Law
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
class ContactFit:
    """Fit of E* and of the depth at which contact begins, which is 0 where it is known.

    Attributes
    ----------
    reduced_modulus_pa, reduced_modulus_std_pa : float
        E* and its standard error [Pa].
    reduced_modulus_interval_pa : (float, float)
        Confidence interval of 95 %; of scatter alone where the contact is free [Pa].
    effective_samples : float
        Number of independent residuals that the serial correlation leaves.
    rms_n : float
        Root mean square of the force residual [N].
    contact_depth_m, contact_depth_std_m : float
        Depth at which contact begins [m].
    baseline_n : float
        Constant force before contact [N].
    """

    reduced_modulus_pa: float
    reduced_modulus_std_pa: float
    reduced_modulus_interval_pa: tuple[float, float]
    effective_samples: float
    rms_n: float
    contact_depth_m: float = 0.0
    contact_depth_std_m: float = 0.0
    baseline_n: float = 0.0


def fit_known_contact(
    depth_m: NDArray, force_n: NDArray, law: Law, *, depth_std_m: float
) -> ContactFit:
    """Fit E* by least squares, contact point taken as known.

    With the paraboloid on a half-space it is the study's fit, which Nelder and Mead's method does
    there: the problem is linear, and its minimum exact. Of depths below the undeformed surface (n,)
    [m] and forces (n,) [N] of the samples in range, a law of force per reduced modulus over depth
    (`contact_law`), and the standard deviation of an error that all depths share [m].

    Raises
    ------
    ValueError
        If there are fewer than two samples in contact.
    """
    count = int((depth_m > 0).sum())
    if count < 2:
        raise ValueError(f"depth: expected at least 2 samples in contact, found {count}")
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
    return ContactFit(
        reduced_modulus_pa=E_star,
        reduced_modulus_std_pa=float(np.hypot(scatter, of_depth)),
        reduced_modulus_interval_pa=tuple((E_star * np.exp([-width, width])).tolist()),
        effective_samples=effective_samples(residual),
        rms_n=float(np.sqrt(np.mean(residual**2))),
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
    Depths, forces and law are as of `fit_known_contact`, from any depth; samples before contact
    help. With a ``baseline`` a constant force is fitted too. ``residual`` of `RESIDUALS` says what
    is compared: the force, or its power 2/3, in which Eq. 5.1 is straight. ``depth_std_m`` is that
    of an expected contact at depth 0 [m]; any depth is as likely by default. Weights (n,) are of
    the squared residuals, relative to each other.

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

    def gaps(x: NDArray, weight: float) -> NDArray:
        gap = [np.sign(one) * np.abs(one) ** power for one in (force(x), measured)]
        return np.r_[roots * (gap[0] - gap[1]), weight * x[1]]

    def least(weight: float) -> OptimizeResult:
        precise = dict.fromkeys(("xtol", "ftol", "gtol"), TOLERANCE) | {"x_scale": "jac"}
        fits = [least_squares(gaps, one, args=(weight,), **precise) for one in starts]
        return min(fits, key=lambda fit: fit.cost)

    starts = _starts(lambda depth: modulus * law(depth) / force_scale, depth_m, measured, baseline)
    found = least(0.0)
    if depth_std_m is not None:
        found = least(deviation(found.fun[:-1], count) * length / max(depth_std_m, TINY * length))
    # The last residual is the contact's own.
    left, x = found.fun[:-1], found.x
    std = deviation(left, count) * np.sqrt(np.diag(np.linalg.pinv(found.jac.T @ found.jac)))
    E_star, width = float(np.exp(x[0])) * modulus, stdtrit(freedom(left, count), LEVEL) * std[0]
    return ContactFit(
        reduced_modulus_pa=E_star,
        reduced_modulus_std_pa=E_star * float(std[0]),
        reduced_modulus_interval_pa=tuple((E_star * np.exp([-width, width])).tolist()),
        effective_samples=effective_samples(left),
        rms_n=float(np.sqrt(np.mean((force(x) * force_scale - force_n) ** 2))),
        contact_depth_m=float(x[1]) * length,
        contact_depth_std_m=float(std[1]) * length,
        baseline_n=float(x[2]) * force_scale if baseline else 0.0,
    )


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
    """Degrees of freedom that residuals of a fit of so many parameters leave.

    Of few samples, which hardly determine their correlation, those of five are left, or all.
    """
    n = len(residual)
    return max(effective_samples(residual), min(n, FEWEST_LEFT)) * (1 - parameters / n)


def deviation(residual: NDArray, parameters: int) -> float:
    """Standard deviation of a fit's residuals, as large as their serial correlation asks.

    Divided by the root of a sum of squared slopes it gives the standard error of a parameter.
    """
    left = effective_samples(residual) * (1 - parameters / len(residual))
    return float(np.sqrt(residual @ residual / left))


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


def _slope(unit: NDArray, force: NDArray) -> float:
    """Of the straight line through 0."""
    return float(unit @ force / (unit @ unit))
