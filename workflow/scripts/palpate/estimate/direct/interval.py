"""Intervals of the moduli from their budget, and verdicts: how far an estimate can be trusted."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri, stdtrit

from palpate.estimate.direct.budget import Budget
from palpate.estimate.direct.doubts import FAR_ZERO, at_end, farthest_zero
from palpate.estimate.direct.fit import Solution
from palpate.estimate.direct.options import Fit
from palpate.estimate.direct.quantities import (
    BULK,
    NAMES,
    POISSON,
    SHEAR,
    STAR,
    Quantities,
    over_star,
    over_star_by_nu,
)
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
NU_STEPS = 41


def intervals(
    best: Solution, covariance: NDArray, quantities: Quantities, budget: Budget, options: Fit
) -> dict[str, Modulus]:
    """Moduli with their intervals and verdicts.

    Poisson's ratio ends at the range's bounds; of a modulus, what goes with Poisson's ratio ends
    where that does, and E is E* (1 - nu^2) at each. G and K follow the stated interval of nu, have
    no verdict where nu has none, and K has no upper end where nu reaches the range's.

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
    # Of moduli what goes with nu beside what E* and nu give exactly, linearly.
    beside = by_nu - over_star_by_nu(nu)
    # What the fit contradicts is no better for its interval.
    contradicted = not best.converged or farthest_zero(best)[1] > FAR_ZERO
    found = {}
    for k, name in enumerate(LABELS):
        if k == POISSON:
            found[name] = _ratio(nu, ends, nu_std, contradicted, options)
            continue
        told = bounds if few else np.clip(nu + quantile[k] * nu_std * np.array([-1, 1]), *bounds)
        ratios = np.linspace(*told, NU_STEPS)
        with_nu = beside[k] * (ratios - nu) + over_star(ratios)[k] - over_star(nu)[k]
        # The budget holds the covariance: what is left of it does not go with nu.
        rest = np.sqrt(max(budget.std[k] ** 2 - (by_nu[k] * nu_std) ** 2, 0.0)) * quantile[k]
        low = quantities.values[k] - np.hypot(rest, min(with_nu.min(), 0.0))
        high = quantities.values[k] + np.hypot(rest, max(with_nu.max(), 0.0))
        modulus = Modulus.of_pascals(*map(float, np.exp([quantities.values[k], low, high])))
        found[name] = replace(modulus, verdict=NOT_JUDGED) if contradicted else modulus
    ratio = found[NAMES[POISSON]]
    found |= _of_both(quantities, budget, ratio, quantile[STAR])
    if ratio.high >= bounds[1] - AT_BOUND:
        found[BULK] = replace(found[BULK], high=None, verdict=BOUNDED)
    if ratio.verdict in (NOT_IDENTIFIED, NOT_JUDGED):
        found |= {name: replace(found[name], verdict=ratio.verdict) for name in (SHEAR, BULK)}
    return bounded_at_best(found) if few or at_end(best, options) else found


def _of_both(
    quantities: Quantities, budget: Budget, ratio: Modulus, quantile: float
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
    ratios = np.linspace(ratio.low, ratio.high, NU_STEPS)
    found = {}
    for name in (SHEAR, BULK):
        k = NAMES.index(name)
        moved = slope * (ratios - nu) + over_star(ratios)[k] - over_star(nu)[k]
        low = quantities.values[k] - np.hypot(rest, min(moved.min(), 0.0))
        high = quantities.values[k] + np.hypot(rest, max(moved.max(), 0.0))
        found[name] = Modulus.of_pascals(*map(float, np.exp([quantities.values[k], low, high])))
    return found


def _ratio(nu: float, ends: NDArray, std: float, contradicted: bool, options: Fit) -> Modulus:
    """Poisson's ratio with its interval's ends."""
    bounds = options.poisson_ratio_bounds
    verdict = verdict_of_nu(*ends, bounds)
    if _is_assumed(std, options):
        ends = np.clip(options.poisson_ratio + _ends(options.poisson_ratio_std), *bounds)
        verdict = ASSUMED
    return Modulus(nu, *map(float, ends), NOT_JUDGED if contradicted else verdict, "1")


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
