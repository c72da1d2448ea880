"""Moduli as functions of an estimate's unknowns, and their intervals and verdicts.

E* and E at small strain depend on the first millimetre, and carry the whole uncertainty of the
material law; E right at the touch carries that of the relaxation. The effective reduced modulus is
that of the neo-Hookean solid with the same force at a depth that was reached and after a second.
"""

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import ndtri, stdtrit

from palpate.estimate.direct.fit import Solution
from palpate.estimate.direct.indentation import FORCE_LAW, LOG_E, NU, SHARED
from palpate.estimate.direct.options import Fit
from palpate.estimate.direct.warnings import FAR_ZERO, at_end, farthest_zero
from palpate.estimate.relaxation import relaxed_share
from palpate.modulus import (
    ASSUMED,
    AT_BOUND,
    BOUNDED,
    CONFIDENCE,
    LABELS,
    NOT_IDENTIFIED,
    NOT_JUDGED,
    Modulus,
    bounded_at_best,
    verdict_of_nu,
)

if TYPE_CHECKING:
    from palpate.estimate.direct.budget import Budget

ONE_SECOND_S = 1.0
# Depth of the effective modulus where no other is asked for, as part of the maximum depth.
EFFECTIVE_PART = 0.7
# Mean strain of a contact over its radius divided by the sphere's (D. Tabor, The hardness of
# metals, 1951).
TABOR = 0.2
# An indentation that leaves more of the deviation that was known beforehand says nothing of nu.
TOLD_PART = 0.8
NU_STEPS = 41
SHEAR, BULK = "shear_modulus_pa", "bulk_modulus_pa"
NAMES = (*LABELS, SHEAR, BULK)
EFFECTIVE, E, E_1S, POISSON, STAR = range(len(LABELS))
LOG_MODULI = np.array([name.endswith("_pa") for name in NAMES])


@dataclass(frozen=True)
class Quantities:
    """Logarithms of moduli and Poisson's ratio, in the order of `NAMES`, by an estimate's unknowns.

    Attributes
    ----------
    values : (7,) array
    slopes : (7, size) array
        Derivatives by `Solution.vector`.
    depth_m : float
        Of the effective modulus [m].
    depth_radii : float
        The depth over the sphere's radius.
    strain : float
        Mean strain under the sphere there.
    """

    values: NDArray
    slopes: NDArray
    depth_m: float
    depth_radii: float
    strain: float


def quantities_of(best: Solution, *, radius_m: float) -> Quantities:
    """Moduli of an estimate and their slopes.

    Parameters
    ----------
    best : Solution
    radius_m : float
        Of the sphere.
    """
    vector, times = best.vector, best.parameters[0].times_s
    log_E, nu, q = vector[[LOG_E, NU, FORCE_LAW]]
    unit = np.eye(len(vector))
    by_star = unit[LOG_E] + 2 * nu / (1 - nu**2) * unit[NU]
    values = LOG_MODULI * (log_E - np.log1p(-(nu**2))) + over_star(nu)
    slopes = np.outer(LOG_MODULI, by_star) + np.outer(over_star_by_nu(nu), unit[NU])
    values[POISSON], slopes[POISSON] = nu, unit[NU]
    fractions = slice(SHARED, SHARED + len(times))
    left = 1 - float(relaxed_share(ONE_SECOND_S, fractions=vector[fractions], times_s=times))
    values[[EFFECTIVE, E_1S]] += np.log(left)
    slopes[[EFFECTIVE, E_1S], fractions] += np.expm1(-ONE_SECOND_S / times) / left
    depth = best.options.effective_depth_m
    if depth is None:
        pairs = zip(best.indentations, best.parameters, strict=True)
        deepest = [one.depth_m.max() + p.offset_m for one, p in pairs]
        depth = EFFECTIVE_PART * float(np.median(deepest))
    each = [one.table.stiffening_at(np.array([depth]), nu) for one in best.indentations]
    harder, by_nu = np.mean(each, axis=0)[:, 0]
    values[EFFECTIVE] += q * harder
    slopes[EFFECTIVE] += harder * unit[FORCE_LAW] + q * by_nu * unit[NU]
    strain = float(TABOR * np.sqrt(depth / radius_m))
    return Quantities(values, slopes, depth, depth / radius_m, strain)


def over_star(nu: ArrayLike) -> NDArray:
    """Logarithms of moduli over E* at a Poisson's ratio, in the order of `NAMES`, (7, ...).

    E = E*(1 - nu^2), G = E*(1 - nu)/2 and K = E/(3(1 - 2 nu)); 0 for E* and for nu itself.
    """
    nu = np.asarray(nu, dtype=float)
    none, young = np.zeros_like(nu), np.log1p(-(nu**2))
    bulk = young - np.log(3 * (1 - 2 * nu))
    return np.stack([none, young, young, none, none, np.log((1 - nu) / 2), bulk])


def over_star_by_nu(nu: float) -> NDArray:
    """Derivatives of `over_star` by nu, (7,)."""
    young = -2 * nu / (1 - nu**2)
    return np.array([0.0, young, young, 0.0, 0.0, -1 / (1 - nu), young + 2 / (1 - 2 * nu)])


def intervals(best: Solution, quantities: Quantities, budget: "Budget") -> dict[str, Modulus]:
    """Moduli with their intervals and verdicts.

    Poisson's ratio ends at the range's bounds; of a modulus, what goes with Poisson's ratio ends
    where that does, and E is E* (1 - nu^2) at each. G and K follow the stated interval of nu, have
    no verdict where nu has none, and K has no upper end where nu reaches the range's.

    Parameters
    ----------
    best : Solution
    quantities : Quantities
    budget : Budget
    """
    options, values, slopes = best.options, quantities.values, quantities.slopes
    quantile = stdtrit(budget.freedom, (1 + CONFIDENCE) / 2)
    bounds, nu = options.poisson_ratio_bounds, float(values[POISSON])
    # What fewer frames than moduli and relaxation amplitudes say of nu is the priors'.
    frames = sum(len(one.frames) for one in best.indentations)
    few = frames < 2 + len(options.relaxation_times_s) and options.poisson_ratio is None
    moved = slopes @ best.covariance @ slopes[POISSON]
    by_nu, nu_std = moved / moved[POISSON], np.sqrt(moved[POISSON])
    # Of moduli what goes with nu beside what E* and nu give exactly, linearly.
    beside = by_nu - over_star_by_nu(nu)
    # What the fit contradicts is no better for its interval.
    contradicted = not best.converged or farthest_zero(best)[1] > FAR_ZERO

    def ends(half: float) -> NDArray:
        return np.array(bounds) if few else np.clip([nu - half, nu + half], *bounds)

    found = {}
    for k, name in enumerate(LABELS):
        if k == POISSON:
            half = quantile[k] * budget.std[k]
            found[name] = _ratio(nu, ends(half), nu_std, contradicted, options)
            continue
        # The budget holds the covariance: what is left of it does not go with nu.
        rest = quantile[k] * np.sqrt(max(budget.std[k] ** 2 - (by_nu[k] * nu_std) ** 2, 0.0))
        modulus = _following(quantities, k, ends(quantile[k] * nu_std), beside[k], rest)
        found[name] = replace(modulus, verdict=NOT_JUDGED) if contradicted else modulus
    ratio = found[NAMES[POISSON]]
    found |= _of_both(quantities, budget, ratio, quantile[STAR])
    if ratio.high >= bounds[1] - AT_BOUND:
        found[BULK] = replace(found[BULK], high=None, verdict=BOUNDED)
    if ratio.verdict in (NOT_IDENTIFIED, NOT_JUDGED):
        found |= {name: replace(found[name], verdict=ratio.verdict) for name in (SHEAR, BULK)}
    return bounded_at_best(found) if few or at_end(best) else found


def _following(quantities: Quantities, k: int, ends: NDArray, slope: float, rest: float) -> Modulus:
    """Modulus that follows nu between ends, E* by a slope; the rest of it adds in squares."""
    nu, value, ratios = (
        float(quantities.values[POISSON]),
        quantities.values[k],
        np.linspace(*ends, NU_STEPS),
    )
    moved = slope * (ratios - nu) + over_star(ratios)[k] - over_star(nu)[k]
    low = value - np.hypot(rest, min(moved.min(), 0.0))
    high = value + np.hypot(rest, max(moved.max(), 0.0))
    return Modulus.of_pascals(*map(float, np.exp([value, low, high])))


def _of_both(
    quantities: Quantities, budget: "Budget", ratio: Modulus, quantile: float
) -> dict[str, Modulus]:
    """G and K: E* follows the interval of nu as it does in the budget, the rest adds in squares.

    Of G = E* (1 - nu)/2 the variances of three give the covariance of two.
    """
    nu = float(quantities.values[POISSON])
    of_star, of_nu, of_G = budget.std[[STAR, POISSON, NAMES.index(SHEAR)]] ** 2
    by_nu = over_star_by_nu(nu)[NAMES.index(SHEAR)]
    most = np.sqrt(of_star / max(of_nu, 1e-300))
    slope = (of_G - of_star - by_nu**2 * of_nu) / (2 * by_nu * max(of_nu, 1e-300))
    slope = np.clip(slope, -most, most)
    rest = quantile * np.sqrt(max(of_star - slope**2 * of_nu, 0.0))
    ends = np.array([ratio.low, ratio.high])
    both = {name: NAMES.index(name) for name in (SHEAR, BULK)}
    return {name: _following(quantities, k, ends, slope, rest) for name, k in both.items()}


def _ratio(nu: float, ends: NDArray, std: float, contradicted: bool, options: Fit) -> Modulus:
    """Poisson's ratio with its interval's ends: what was known of it where little is added."""
    bounds, known_std = options.poisson_ratio_bounds, options.poisson_ratio_std
    verdict = verdict_of_nu(*ends, bounds)
    if options.poisson_ratio is not None and std > TOLD_PART * known_std:
        half = float(ndtri((1 + CONFIDENCE) / 2)) * known_std * np.array([-1.0, 1.0])
        ends, verdict = np.clip(options.poisson_ratio + half, *bounds), ASSUMED
    return Modulus(nu, *map(float, ends), NOT_JUDGED if contradicted else verdict, "1")
