"""Profile of the error over Poisson's ratio, which tells whether nu is identifiable at all."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from palpate.modulus import CONFIDENCE, NOT_IDENTIFIED, NOT_JUDGED, verdict_of_nu
from palpate.solid.laws import lame_from_engineering
from scipy.optimize import brentq, minimize_scalar
from scipy.special import stdtrit

from thesis.minimise.least_squares import FORCE_TERM, LeastSquaresFit
from thesis.minimise.search import Cost

Profile = Callable[[float], tuple[float, float]]


@dataclass(frozen=True)
class PoissonProfile:
    """Smallest error for each Poisson's ratio.

    Attributes
    ----------
    poisson_ratios : tuple of float
    youngs_moduli_pa : tuple of float
        E that minimises the error at each [Pa].
    errors_m : tuple of float
        That error [m].
    interval : (float, float) or None
        Poisson's ratios that the error does not tell from the best, at 95 %.
    verdict : {"identified", "bounded", "not identified", "not judged"}
        Inside the range and narrow; reaching one end of it, or wide; reaching both, or nothing but
        gaps that agree over the surface or a minimum at a bound; with the force term, which is
        biased.
    """

    poisson_ratios: tuple[float, ...]
    youngs_moduli_pa: tuple[float, ...]
    errors_m: tuple[float, ...]
    interval: tuple[float, float] | None
    verdict: str


def poisson_profile(
    cost: Cost,
    poisson_ratios: Sequence[float],
    *,
    youngs_modulus_bounds_pa: tuple[float, float],
    fit: LeastSquaresFit,
) -> PoissonProfile:
    """Minimise the error over E for each Poisson's ratio, and judge what that says of nu.

    The interval ends where the error has risen by as much as the quantile of Student's t times
    the standard error of nu raises it where it is quadratic (a likelihood ratio, scaled to the
    gaps' own scatter). Without a standard error there is no interval.

    Parameters
    ----------
    cost : callable
        Objective of (lam, mu) [m].
    poisson_ratios : sequence of float
        Increasing.
    youngs_modulus_bounds_pa : (float, float)
    fit : LeastSquaresFit
        Of the same cost, ``norm="length"``.

    Raises
    ------
    ValueError
        If the ratios do not increase within (-1, 0.5), or there are fewer than three.
    """
    nus = np.asarray(poisson_ratios, dtype=float)
    if len(nus) < 3 or (np.diff(nus) <= 0).any() or nus[0] <= -1 or nus[-1] >= 0.5:
        raise ValueError(
            f"poisson_ratios: expected three or more, increasing in (-1, 0.5), found {nus.tolist()}"
        )

    def profile(nu: float) -> tuple[float, float]:
        return _best_modulus(cost, float(nu), youngs_modulus_bounds_pa)

    nus, found = _with_minimum(nus, [profile(nu) for nu in nus], profile)
    interval = None
    if fit.error_rise_m is not None:
        quantile = stdtrit(fit.patches - 2, (1 + CONFIDENCE) / 2)
        rise_m = float(quantile**2) * fit.error_rise_m
        interval = _interval(nus, [error for _, error in found], profile, rise_m)
    return PoissonProfile(
        poisson_ratios=tuple(map(float, nus)),
        youngs_moduli_pa=tuple(E for E, _ in found),
        errors_m=tuple(error for _, error in found),
        interval=interval,
        verdict=_verdict(interval, (nus[0], nus[-1]), fit.unknown),
    )


def _best_modulus(cost: Cost, nu: float, bounds: tuple[float, float]) -> tuple[float, float]:
    def of_log(x: float) -> float:
        return cost(*lame_from_engineering(float(np.exp(x)), float(nu)))

    # The error is unimodal in E, but flat far from its minimum: a grid finds the right part.
    grid = np.linspace(*np.log(bounds), 60)
    best = int(np.argmin([of_log(x) for x in grid]))
    ends = grid[max(best - 1, 0)], grid[min(best + 1, len(grid) - 1)]
    found = minimize_scalar(of_log, bounds=ends, method="bounded", options={"xatol": 1e-10})
    return float(np.exp(found.x)), float(found.fun)


def _with_minimum(nus: NDArray, found: list, profile: Profile) -> tuple[NDArray, list]:
    """Grid and profile with the minimum between the grid's points put in."""
    best = int(np.argmin([error for _, error in found]))
    ends = nus[max(best - 1, 0)], nus[min(best + 1, len(nus) - 1)]
    options = {"xatol": 1e-7}
    minimum = minimize_scalar(
        lambda nu: profile(nu)[1], bounds=ends, method="bounded", options=options
    )
    if minimum.fun >= found[best][1]:
        return nus, found
    place = int(np.searchsorted(nus, minimum.x))
    found = [*found[:place], profile(minimum.x), *found[place:]]
    return np.insert(nus, place, minimum.x), found


def _interval(
    nus: NDArray, errors: list[float], profile: Profile, rise_m: float
) -> tuple[float, float]:
    """Ends of the part around the minimum where the error has risen by less than stated."""
    best = int(np.argmin(errors))
    limit = errors[best] + rise_m
    ends = []
    for step, last in ((-1, 0), (1, len(nus) - 1)):
        k = best
        while k != last and errors[k + step] <= limit:
            k += step
        if k == last:
            ends.append(float(nus[last]))
            continue
        ends.append(brentq(lambda nu: profile(nu)[1] - limit, nus[k], nus[k + step], xtol=1e-7))
    return ends[0], ends[1]


def _verdict(
    interval: tuple[float, float] | None, limits: tuple[float, float], unknown: str | None
) -> str:
    if interval is None:
        return NOT_JUDGED if unknown == FORCE_TERM else NOT_IDENTIFIED
    return verdict_of_nu(*interval, limits)
