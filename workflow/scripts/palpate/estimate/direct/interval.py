"""Intervals of the moduli from their budget, and verdicts: how far an estimate can be trusted."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri, stdtrit

from palpate.estimate.direct.budget import Budget
from palpate.estimate.direct.doubts import FAR_ZERO, at_end, farthest_zero
from palpate.estimate.direct.fit import Solution
from palpate.estimate.direct.options import Fit
from palpate.estimate.direct.quantities import BULK, NAMES, SHEAR, Quantities, by_ratio, over
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

# A press that leaves more of the deviation that was known beforehand tells nothing of nu.
TOLD_PART = 0.8
POISSON, STAR, NU_STEPS = NAMES.index("poisson_ratio"), NAMES.index("reduced_modulus_pa"), 41


def intervals(
    best: Solution, covariance: NDArray, quantities: Quantities, budget: Budget, options: Fit
) -> dict[str, Modulus]:
    """Moduli with their intervals and verdicts.

    Poisson's ratio ends at the range's bounds; of a modulus, what goes with Poisson's ratio ends
    where that does, and E is E* (1 - nu^2) at each. G and K follow the interval of Poisson's ratio;
    K has no upper end where that reaches the range's.

    Parameters
    ----------
    best : Solution
    covariance : (size, size) array
        Of its unknowns.
    quantities : Quantities
    budget : Budget
    options : Fit
    """
    quantile = stdtrit(budget.freedom, (1 + CONFIDENCE) / 2)
    half = quantile * budget.std
    bounds, nu = options.poisson_ratio_bounds, float(quantities.values[POISSON])
    few = few_frames(best, options) and options.poisson_ratio is None
    # What so few frames say of nu is the priors'.
    ends = bounds if few else np.clip([nu - half[POISSON], nu + half[POISSON]], *bounds)
    moved = quantities.slopes @ covariance @ quantities.slopes[POISSON]
    by_nu, nu_std = moved / moved[POISSON], np.sqrt(moved[POISSON])
    # What the fit contradicts is no better for its interval.
    contradicted = not best.converged or farthest_zero(best)[1] > FAR_ZERO
    found = {}
    for k, name in enumerate(LABELS):
        if k == POISSON:
            verdict = verdict_of_nu(*ends, bounds)
            if _is_assumed(nu_std, options):
                known = options.poisson_ratio + _ends(options.poisson_ratio_std)
                ends, verdict = np.clip(known, *bounds), ASSUMED
            verdict = NOT_JUDGED if contradicted else verdict
            found[name] = Modulus(nu, *map(float, ends), verdict, "1")
            continue
        told = bounds if few else np.clip(nu + quantile[k] * nu_std * np.array([-1, 1]), *bounds)
        with_nu = _with_nu(name, by_nu, nu, np.linspace(*told, NU_STEPS))
        # The budget holds the covariance: what is left of it does not go with nu.
        rest = np.sqrt(max(budget.std[k] ** 2 - (by_nu[k] * nu_std) ** 2, 0.0)) * quantile[k]
        low = quantities.values[k] - np.hypot(rest, min(with_nu.min(), 0.0))
        high = quantities.values[k] + np.hypot(rest, max(with_nu.max(), 0.0))
        value, low, high = np.exp([quantities.values[k], low, high])
        modulus = Modulus.of_pascals(float(value), float(low), float(high))
        found[name] = replace(modulus, verdict=NOT_JUDGED) if contradicted else modulus
    ratio = found[NAMES[POISSON]]
    for name, modulus in _of_both(quantities, budget, ratio, quantile[STAR]).items():
        if name == BULK and ratio.high >= bounds[1] - AT_BOUND:
            modulus = replace(modulus, high=None, verdict=BOUNDED)
        through = ratio.verdict in (NOT_IDENTIFIED, NOT_JUDGED)
        found[name] = replace(modulus, verdict=ratio.verdict) if through else modulus
    return bounded_at_best(found) if few or at_end(best, options) else found


def _of_both(
    quantities: Quantities, budget: Budget, ratio: Modulus, quantile: float
) -> dict[str, Modulus]:
    """G and K: E* follows the interval of nu as it does in the budget, the rest adds in squares.

    Of G = E* (1 - nu)/2 the variances of three tell the covariance of two.
    """
    star, nu = (float(quantities.values[k]) for k in (STAR, POISSON))
    of_star, of_nu, of_G = budget.std[[STAR, POISSON, NAMES.index(SHEAR)]] ** 2
    by_nu = by_ratio(nu)[0]
    most = np.sqrt(of_star / max(of_nu, 1e-300))
    slope = (of_G - of_star - by_nu**2 * of_nu) / (2 * by_nu * max(of_nu, 1e-300))
    slope = np.clip(slope, -most, most)
    rest = quantile * np.sqrt(max(of_star - slope**2 * of_nu, 0.0))
    ratios = np.linspace(ratio.low, ratio.high, NU_STEPS)
    moved = slope * (ratios - nu) + over(ratios) - over(nu)[:, None]
    found = {}
    for name, value, way in zip((SHEAR, BULK), star + over(nu), moved, strict=True):
        low = value - np.hypot(rest, min(way.min(), 0.0))
        high = value + np.hypot(rest, max(way.max(), 0.0))
        found[name] = Modulus.of_pascals(*(float(np.exp(end)) for end in (value, low, high)))
    return found


def _with_nu(name: str, by_nu: NDArray, nu: float, ratios: NDArray) -> NDArray:
    """How the logarithm of a modulus goes with nu: E* about linearly, E as E* (1 - nu^2)."""
    k = NAMES.index(name)
    if name.endswith("reduced_modulus_pa"):
        return by_nu[k] * (ratios - nu)
    later = by_nu[k] - by_nu[NAMES.index("youngs_modulus_pa")]
    exact = np.log((1 - ratios**2) / (1 - nu**2))
    return (by_nu[STAR] + later) * (ratios - nu) + exact


def _ends(std: float) -> NDArray:
    """Ends of a normal distribution's interval about its mean, (2,)."""
    return float(ndtri((1 + CONFIDENCE) / 2)) * std * np.array([-1.0, 1.0])


def _is_assumed(std: float, options: Fit) -> bool:
    """Whether what is said of nu is what was known beforehand, and hardly more."""
    return options.poisson_ratio is not None and std > TOLD_PART * options.poisson_ratio_std


def few_frames(best: Solution, options: Fit) -> bool:
    """Whether there are fewer compared frames than moduli and relaxing shares."""
    frames = sum(len(indentation.frames) for indentation in best.indentations)
    return frames < 2 + len(options.relaxation_times_s)
