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

from palpate import modulus
from palpate.estimate.direct.fit import Solution, held_at
from palpate.estimate.direct.indentation import FORCE_LAW, LOG_E, NU, SHARED
from palpate.estimate.direct.options import Fit
from palpate.estimate.direct.warnings import FAR_ZERO, at_end, farthest_zero
from palpate.estimate.relaxation import relaxed_share
from palpate.modulus import Modulus

if TYPE_CHECKING:
    from palpate.estimate.direct.budget import Budget

ONE_SECOND_S = 1.0
# Depth of the effective modulus where no other is asked for, as part of the maximum depth.
EFFECTIVE_PART = 0.7
# An indentation that leaves more of the deviation that was known beforehand says nothing of nu.
TOLD_PART = 0.8
NU_STEPS = 201
SHEAR, BULK = "shear_modulus_pa", "bulk_modulus_pa"
NAMES = (*modulus.LABELS, SHEAR, BULK)
EFFECTIVE, E, E_1S, POISSON, STAR = range(len(modulus.LABELS))
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
    radius_m : float
        Of the sphere.
    """

    values: NDArray
    slopes: NDArray
    depth_m: float
    radius_m: float


def quantities_of(
    best: Solution, *, radius_m: float, effective_depth_m: float | None = None
) -> Quantities:
    """Moduli of an estimate and their slopes, of a sphere's radius [m].

    ``effective_depth_m`` stands in place of the options' [m].
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
    depth = best.options.effective_depth_m if effective_depth_m is None else effective_depth_m
    if depth is None:
        pairs = zip(best.indentations, best.parameters, strict=True)
        deepest = [one.depth_m.max() + p.offset_m for one, p in pairs]
        depth = EFFECTIVE_PART * float(np.median(deepest))
    each = [one.table.stiffening_at(np.array([depth]), nu) for one in best.indentations]
    harder, by_nu = np.mean(each, axis=0)[:, 0]
    values[EFFECTIVE] += q * harder
    slopes[EFFECTIVE] += harder * unit[FORCE_LAW] + q * by_nu * unit[NU]
    return Quantities(values, slopes, depth, radius_m)


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
    """Moduli, cost and deviations of fits with Poisson's ratio held, along it.

    Profile likelihood: D. J. Venzon and S. H. Moolgavkar, Applied Statistics 37, 1988, 87.

    Attributes
    ----------
    ends : (2,) array
        Least and greatest Poisson's ratio.
    at : callable
        Of Poisson's ratios (n,): `Quantities.values` (n, 7), how far the cost is above the
        estimate's (n,), and variances beside what goes with nu less the estimate's (n, 7).
    converged : bool
        Whether all fits did.
    """

    ends: NDArray
    at: Callable[[NDArray], tuple[NDArray, NDArray, NDArray]]
    converged: bool = True

    @staticmethod
    def of(best: Solution, quantities: Quantities, budget: "Budget") -> "Profile":
        """Fit again at some Poisson's ratios about an estimate's, and interpolate."""
        nu = float(quantities.values[POISSON])
        half = stdtrit(budget.freedom.min(), (1 + modulus.CONFIDENCE) / 2) * best.std[NU]
        ends = _ends(best, nu - half, nu + half)
        # No steps too short to tell fits apart; where one side has none the other has all.
        long = [end for end in ends if abs(end - nu) > modulus.AT_BOUND]
        parts = np.linspace(0, 1, 5 if len(long) == 1 else 3)[1:]
        nodes = np.sort([nu, *(nu + part * (end - nu) for end in long for part in parts)])
        held = [best if node == nu else held_at(best, node) for node in nodes]
        each = [
            quantities_of(one, radius_m=1.0, effective_depth_m=quantities.depth_m) for one in held
        ]
        slopes = np.stack([one.slopes for one in each])
        covariance = slopes @ np.stack([one.covariance for one in held]) @ slopes.swapaxes(1, 2)
        with_nu = covariance[:, POISSON]
        variance = np.diagonal(covariance, axis1=1, axis2=2) - with_nu**2 / with_nu[:, [POISSON]]
        # Moduli over E* are known exactly.
        beside = np.stack([one.values for one in each]) - over_star(nodes).T
        cost = np.array([[one.cost_at(one.vector, one.scales)] for one in held])
        columns = np.hstack([beside, variance, cost])
        curves = CubicSpline(nodes, columns) if len(nodes) > 1 else lambda ratios: columns[0]
        start, count = curves(nu), len(NAMES)

        def at(ratios: NDArray) -> tuple[NDArray, NDArray, NDArray]:
            change = np.broadcast_to(curves(ratios) - start, (len(ratios), len(start)))
            moved, wider, rise = np.split(change, [count, 2 * count], axis=1)
            values = quantities.values + moved + over_star(ratios).T - over_star(nu)
            return values, rise[:, 0], wider

        return Profile(ends, at, all(one.converged for one in held))


def intervals(
    best: Solution, quantities: Quantities, budget: "Budget", profile: Profile
) -> dict[str, Modulus]:
    """Moduli with their intervals and verdicts.

    Poisson's ratio ends at the range's bounds. Moduli have the intervals of the profile likelihood
    along it. G and K follow the stated interval of nu, have no verdict where nu has none, and K has
    no upper end where nu reaches the range's.
    """
    options, values = best.options, quantities.values
    bounds, nu = options.poisson_ratio_bounds, float(values[POISSON])
    quantile = stdtrit(budget.freedom, (1 + modulus.CONFIDENCE) / 2)
    moved = quantities.slopes @ best.covariance @ quantities.slopes[POISSON]
    few, half = _few_frames(best), quantile[POISSON] * budget.std[POISSON]
    # What the fit contradicts is no better for its interval.
    converged = best.converged and profile.converged
    contradicted = not converged or farthest_zero(best)[1] > FAR_ZERO
    nu_std, ends = np.sqrt(moved[POISSON]), _ends(best, nu - half, nu + half)
    ratio = _ratio(nu, ends, nu_std, contradicted, options)
    half = (ratio.high - ratio.low) / 2 if ratio.verdict == modulus.ASSUMED else half
    slope, star_variance = _star_by_nu(budget.std, nu)
    found = {}
    for k, name in enumerate(NAMES):
        if k == POISSON:
            found[name] = ratio
            continue
        if k < len(modulus.LABELS):
            ratios = np.append(np.linspace(*profile.ends, NU_STEPS), nu)
            each, rise, wider = profile.at(ratios)
            # The budget holds the covariance: what is left of it does not go with nu.
            rest = max(budget.std[k] ** 2 - moved[k] ** 2 / moved[POISSON], 0.0)
            variance, part = rest + wider[:, k], rise / quantile[k] ** 2
            logs, t = each[:, k], quantile[k]
        else:
            ratios = np.append(np.linspace(ratio.low, ratio.high, NU_STEPS), nu)
            logs = values[k] + slope * (ratios - nu) + over_star(ratios)[k] - over_star(nu)[k]
            variance, part = star_variance, np.minimum(((ratios - nu) / half) ** 2, 1.0)
            t = quantile[STAR]
        left = np.ones_like(ratios) if few else 1 - part
        # The ends of nu lie at the quantile itself, by which rounding may leave them out.
        inside = left >= -1e-9
        reach = t * np.sqrt(np.maximum(variance * left, 0.0))
        low, high = (logs - reach)[inside].min(), (logs + reach)[inside].max()
        found[name] = Modulus.of_pascals(*map(float, np.exp([values[k], low, high])))
        if contradicted:
            found[name] = replace(found[name], verdict=modulus.NOT_JUDGED)
    if ratio.high >= bounds[1] - modulus.AT_BOUND:
        found[BULK] = replace(found[BULK], high=None, verdict=modulus.BOUNDED)
    if ratio.verdict in (modulus.NOT_IDENTIFIED, modulus.NOT_JUDGED):
        found |= {name: replace(found[name], verdict=ratio.verdict) for name in (SHEAR, BULK)}
    return modulus.bounded_at_best(found) if few or at_end(best) else found


def _few_frames(best: Solution) -> bool:
    """Whether there are fewer than moduli and amplitudes: what they say of nu is the priors'."""
    frames = sum(len(one.frames) for one in best.indentations)
    few = frames < 2 + len(best.options.relaxation_times_s)
    return few and best.options.poisson_ratio is None


def _ends(best: Solution, low: float, high: float) -> NDArray:
    """Ends of an interval of nu within its bounds; of few frames these."""
    bounds = best.options.poisson_ratio_bounds
    return np.array(bounds) if _few_frames(best) else np.clip([low, high], *bounds)


def _star_by_nu(std: NDArray, nu: float) -> tuple[float, float]:
    """Slope of log E* by nu, and its variance beside that, by the deviations (7,) of all."""
    # Of G = E* (1 - nu)/2 the variances of three give the covariance of two.
    shear = NAMES.index(SHEAR)
    of_star, of_nu, of_G = np.maximum(std[[STAR, POISSON, shear]] ** 2, 1e-300)
    by_nu, most = over_star_by_nu(nu)[shear], np.sqrt(of_star / of_nu)
    slope = (of_G - of_star - by_nu**2 * of_nu) / (2 * by_nu * of_nu)
    slope = float(np.clip(slope, -most, most))
    return slope, max(of_star - slope**2 * of_nu, 0.0)


def _ratio(nu: float, ends: NDArray, std: float, contradicted: bool, options: Fit) -> Modulus:
    """Poisson's ratio with its interval's ends: what was known of it where little is added."""
    bounds, known_std = options.poisson_ratio_bounds, options.poisson_ratio_std
    verdict = modulus.verdict_of_nu(*ends, bounds)
    if options.poisson_ratio is not None and std > TOLD_PART * known_std:
        half = float(ndtri((1 + modulus.CONFIDENCE) / 2)) * known_std * np.array([-1.0, 1.0])
        ends, verdict = np.clip(options.poisson_ratio + half, *bounds), modulus.ASSUMED
    return Modulus(nu, *map(float, ends), modulus.NOT_JUDGED if contradicted else verdict, "1")
