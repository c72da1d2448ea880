"""Intervals of the moduli from their budget, and verdicts: how far an estimate can be trusted."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit

from palpate.estimate.direct.budget import Budget
from palpate.estimate.direct.fit import Solution
from palpate.estimate.direct.options import Fit
from palpate.estimate.direct.quantities import NAMES, Quantities

CONFIDENCE = 0.95
# An interval of nu narrower than this tells materials apart: cork, foam, rubber.
NARROW_NU = 0.2
# And one of E that is not wider than by this factor from end to end.
NARROW_E = 1.5
# Ends of an interval this close to the range's are at its bound.
AT_BOUND = 0.005


@dataclass(frozen=True)
class Interval:
    """Estimate of one quantity with its 95 % interval and what it is worth."""

    value: float
    low: float
    high: float
    verdict: str

    @staticmethod
    def of_modulus(value: float, low: float, high: float) -> "Interval":
        """Judge the interval of a modulus [Pa]."""
        return Interval(value, low, high, "identified" if high / low <= NARROW_E else "bounded")


def intervals(
    best: Solution, covariance: NDArray, quantities: Quantities, budget: Budget, options: Fit
) -> dict[str, Interval]:
    """Moduli with their intervals and verdicts.

    Poisson's ratio ends at the range's bounds; of a modulus, what goes with Poisson's ratio ends
    where that does.

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
    at = NAMES.index("poisson_ratio")
    bounds, nu = options.poisson_ratio_bounds, float(quantities.values[at])
    few = few_frames(best, options)
    # What so few frames say of nu is the priors'.
    ends = np.array(bounds) if few else np.clip([nu - half[at], nu + half[at]], *bounds)
    moved = quantities.slopes @ covariance @ quantities.slopes[at]
    by_nu = moved / moved[at]
    found = {}
    for k, name in enumerate(NAMES):
        if k == at:
            found[name] = Interval(nu, *map(float, ends), verdict_of_nu(*ends, bounds))
            continue
        rest = max(half[k] ** 2 - (by_nu[k] * half[at]) ** 2, 0.0)
        with_nu = np.sort(by_nu[k] * (ends - nu))
        low, high = quantities.values[k] + np.sqrt(rest + with_nu**2) * [-1, 1]
        value, low, high = np.exp([quantities.values[k], low, high])
        interval = Interval.of_modulus(float(value), float(low), float(high))
        found[name] = replace(interval, verdict="bounded") if few else interval
    return found


def few_frames(best: Solution, options: Fit) -> bool:
    """Whether there are fewer compared frames than moduli and relaxing shares."""
    frames = sum(len(indentation.frames) for indentation in best.indentations)
    return frames < 2 + len(options.relaxation_times_s)


def verdict_of_nu(low: float, high: float, bounds: Sequence[float]) -> str:
    """Inside the range and narrow; reaching one end of it, or wide; reaching both."""
    at_low, at_high = low <= bounds[0] + AT_BOUND, high >= bounds[1] - AT_BOUND
    if at_low and at_high:
        return "not identified"
    if at_low or at_high or high - low > NARROW_NU:
        return "bounded"
    return "identified"
