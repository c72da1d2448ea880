"""Moduli as functions of an estimate's unknowns, and their intervals and verdicts.

E* and E at small strain depend on the first millimetre, and carry the whole uncertainty of the
material law; E right at the touch carries that of the relaxation. The effective reduced modulus is
that of the neo-Hookean solid with the same force at a depth that was reached and after a second.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import CubicSpline
from scipy.special import ndtri, stdtrit

from palpate.estimate.direct.fit import Solution, held_at
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
NU_STEPS = 201
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


@dataclass(frozen=True)
class Profile:
    """The least cost over all other unknowns, along Poisson's ratio.

    Attributes
    ----------
    nu : float
        Of the estimate.
    at : callable
        Of Poisson's ratios (n,): `Quantities.values` (n, 7), how far the cost is above the
        estimate's (n,), and standard deviations of what does not go with nu, over the estimate's
        (n, 7).
    """

    nu: float
    at: Callable[[NDArray], tuple[NDArray, NDArray, NDArray]]

    @staticmethod
    def of(best: Solution, quantities: Quantities, budget: "Budget") -> "Profile":
        """Fit again at some Poisson's ratios that are held, and interpolate."""
        nu, known = float(quantities.values[POISSON]), best.options.poisson_ratio
        std = max(best.std[NU], budget.std[POISSON])
        half = stdtrit(budget.freedom.min(), (1 + CONFIDENCE) / 2) * std
        middle = [nu, nu if known is None else known]
        low, high = _ends(best, min(middle) - half, max(middle) + half)
        nodes = np.unique([low, (low + nu) / 2, nu, (nu + high) / 2, high])
        held = [held_at(best, node) for node in nodes]
        options = best.options.changed(effective_depth_m=quantities.depth_m)
        each = [quantities_of(replace(one, options=options), radius_m=1.0) for one in held]
        slopes = np.stack([one.slopes for one in each])
        covariance = slopes @ np.stack([one.covariance for one in held]) @ slopes.swapaxes(1, 2)
        with_nu = covariance[:, POISSON]
        variance = np.diagonal(covariance, axis1=1, axis2=2) - with_nu**2 / with_nu[:, [POISSON]]
        # Moduli over E* are known exactly.
        beside = np.stack([one.values for one in each]) - over_star(nodes).T
        columns = beside, np.sqrt(np.maximum(variance, 1e-12)), [[one.cost] for one in held]
        curves, count = CubicSpline(nodes, np.hstack(columns)), len(NAMES)
        start = curves(nu)

        def at(ratios: NDArray) -> tuple[NDArray, NDArray, NDArray]:
            values, spread, cost = np.split(curves(ratios), [count, 2 * count], axis=1)
            spread = spread / start[count:-1]
            return values + over_star(ratios).T, cost[:, 0] - start[-1], spread

        return Profile(nu, at)

    def interval(self, k: int, reach: NDArray, rest: float, part: float) -> Modulus:
        """Interval of a modulus [Pa]: where the cost rises by at most 1 / part.

        Parameters
        ----------
        k : int
            Place of the modulus in `NAMES`.
        reach : (2,) array
            Least and greatest Poisson's ratio.
        rest : float
            Half-width of its logarithm at the estimate's Poisson's ratio.
        part : float
        """
        values, rise, spread = self.at(np.append(np.linspace(*reach, NU_STEPS), self.nu))
        half = rest * spread[:, k] * np.sqrt(np.clip(1 - part * rise, 0, 1))
        low, high = (values[:, k] + side * half for side in (-1, 1))
        return Modulus.of_pascals(*map(float, np.exp([values[-1, k], low.min(), high.max()])))


def intervals(
    best: Solution, quantities: Quantities, budget: "Budget", profile: Profile
) -> dict[str, Modulus]:
    """Moduli with their intervals and verdicts.

    Poisson's ratio ends at the range's bounds. Moduli have the intervals of the profile likelihood
    along it; those of G and K follow the stated interval of nu, have no verdict where nu has none,
    and K has no upper end where nu reaches the range's.

    Parameters
    ----------
    best : Solution
    quantities : Quantities
    budget : Budget
    profile : Profile
    """
    options, nu = best.options, float(quantities.values[POISSON])
    quantile = stdtrit(budget.freedom, (1 + CONFIDENCE) / 2)
    bounds, of_nu = options.poisson_ratio_bounds, budget.std[POISSON]
    moved = quantities.slopes @ best.covariance @ quantities.slopes[POISSON]
    nu_std = np.sqrt(moved[POISSON])
    few = _few_frames(best)
    # What the fit contradicts is no better for its interval.
    contradicted = not best.converged or farthest_zero(best)[1] > FAR_ZERO
    nu_half = quantile[POISSON] * of_nu
    ratio = _ratio(nu, _ends(best, nu - nu_half, nu + nu_half), nu_std, contradicted, options)
    found = {}
    for k, name in enumerate(NAMES):
        if k == POISSON:
            found[name] = ratio
            continue
        if k < len(LABELS):
            half, part = quantile[k] * nu_std, quantile[k] ** -2
            reach = _ends(best, nu - half, nu + half)
            # The budget holds the covariance: what is left of it does not go with nu.
            rest = quantile[k] * np.sqrt(max(budget.std[k] ** 2 - (moved[k] / nu_std) ** 2, 0.0))
        else:
            reach, part = np.array([ratio.low, ratio.high]), (nu_std / nu_half) ** 2
            rest = quantile[STAR] * _star_beside_nu(budget.std, nu)
        found[name] = profile.interval(k, reach, rest, 0.0 if few else part)
        if contradicted:
            found[name] = replace(found[name], verdict=NOT_JUDGED)
    if ratio.high >= bounds[1] - AT_BOUND:
        found[BULK] = replace(found[BULK], high=None, verdict=BOUNDED)
    if ratio.verdict in (NOT_IDENTIFIED, NOT_JUDGED):
        found |= {name: replace(found[name], verdict=ratio.verdict) for name in (SHEAR, BULK)}
    return bounded_at_best(found) if few or at_end(best) else found


def _few_frames(best: Solution) -> bool:
    """Whether there are fewer than moduli and amplitudes: what they say of nu is the priors'."""
    frames = sum(len(one.frames) for one in best.indentations)
    few = frames < 2 + len(best.options.relaxation_times_s)
    return few and best.options.poisson_ratio is None


def _ends(best: Solution, low: float, high: float) -> NDArray:
    """Ends of an interval of nu within its bounds; of few frames these."""
    bounds = best.options.poisson_ratio_bounds
    return np.array(bounds) if _few_frames(best) else np.clip([low, high], *bounds)


def _star_beside_nu(std: NDArray, nu: float) -> float:
    """Deviation of log E* beside what goes with nu, by those of all quantities, (7,).

    Of G = E* (1 - nu)/2 the variances of three give the covariance of two.
    """
    shear = NAMES.index(SHEAR)
    of_star, of_nu, of_G = std[[STAR, POISSON, shear]] ** 2
    by_nu = over_star_by_nu(nu)[shear]
    both = (of_G - of_star - by_nu**2 * of_nu) / (2 * by_nu)
    return float(np.sqrt(max(of_star - both**2 / max(of_nu, 1e-300), 0.0)))


def _ratio(nu: float, ends: NDArray, std: float, contradicted: bool, options: Fit) -> Modulus:
    """Poisson's ratio with its interval's ends: what was known of it where little is added."""
    bounds, known_std = options.poisson_ratio_bounds, options.poisson_ratio_std
    verdict = verdict_of_nu(*ends, bounds)
    if options.poisson_ratio is not None and std > TOLD_PART * known_std:
        half = float(ndtri((1 + CONFIDENCE) / 2)) * known_std * np.array([-1.0, 1.0])
        ends, verdict = np.clip(options.poisson_ratio + half, *bounds), ASSUMED
    return Modulus(nu, *map(float, ends), NOT_JUDGED if contradicted else verdict, "1")
