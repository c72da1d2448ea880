"""How far the direct estimate can be trusted: block bootstrap, profile over nu, verdicts."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit

from palpate.estimate.direct.blocks import bounded_solution
from palpate.estimate.direct.fit import (
    Solution,
    fit_direct,
    parameter_bounds,
    prior_of,
)
from palpate.estimate.direct.indentation import OWN
from palpate.estimate.direct.options import Fit
from palpate.estimate.direct.relaxation import relaxed_share

CONFIDENCE = 0.95
# An interval of nu narrower than this tells materials apart: cork, foam, rubber.
NARROW_NU = 0.2
# And one of E that is not wider than by this factor from end to end.
NARROW_E = 1.5
# Ends of an interval this close to the range's are at its bound.
AT_BOUND = 0.005
ONE_SECOND_S = 1.0
# Of the normal distribution, at the same confidence.
NORMAL_QUANTILE = 1.96
# Fewer patches don't tell their own scatter.
FEWEST_CLUSTERS = 4.0
# Fewer captures don't tell how much they scatter.
FEWEST_CAPTURES = 6


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


@dataclass(frozen=True)
class Profile:
    """Least cost and best moduli for each Poisson's ratio, instantaneous and after a second."""

    poisson_ratios: tuple[float, ...]
    costs: tuple[float, ...]
    youngs_moduli_pa: tuple[float, ...]
    youngs_moduli_1s_pa: tuple[float, ...]


def profile_over_nu(best: Solution, options: Fit, poisson_ratios: Sequence) -> Profile:
    """Fit all else at each Poisson's ratio, with the scales of the best fit."""
    inside = [nu for nu in poisson_ratios if _within(nu, options.poisson_ratio_bounds)]
    best_nu = best.parameters[0].poisson_ratio
    order = sorted(inside, key=lambda nu: abs(nu - best_nu))
    starts, rows = {best_nu: best.parameters[0]}, {}
    for nu in order:
        start = starts[min(starts, key=lambda known: abs(known - nu))]
        found = fit_direct(
            best.indentations, best.law, options, start, scales=best.scales, fixed_poisson_ratio=nu
        )
        starts[nu] = found.parameters[0]
        rows[nu] = (found.cost, *_both_moduli(found, options))
    rows[best_nu] = (best.cost, *_both_moduli(best, options))
    nus = sorted(rows)
    return Profile(tuple(nus), *(tuple(rows[nu][k] for nu in nus) for k in range(3)))


def bootstrap(best: Solution, options: Fit, *, draws: int, seed: int) -> NDArray:
    """Unknowns that other patches and frames of the same kind would have given, (draws, size).

    Patches of the surface, with all their frames, and frames of the depth are drawn with
    replacement, of captures that are not few the captures too, and the nuisances' priors are moved
    by their deviations; the normal equations, linear about the minimum, are solved within the
    bounds.
    """
    rng, indentations = np.random.default_rng(seed), best.indentations
    vector, low, high = best.vector, *parameter_bounds(len(indentations), options)
    prior = prior_of(indentations, options)
    shared = len(vector) - OWN * len(indentations)
    samples = np.empty((draws, len(vector)))
    for draw in range(draws):
        matrix = prior.information.copy()
        slope = prior.rows.T @ (prior.gaps(vector) + rng.normal(size=len(prior.rows)))
        often = _drawn(rng, len(indentations)) if len(indentations) >= FEWEST_CAPTURES else None
        for k, block in enumerate(best.blocks):
            at = np.concatenate([np.arange(shared), shared + OWN * k + np.arange(OWN)])
            for A, c in _parts(block):
                counts = _drawn(rng, len(A)) * (1.0 if often is None else often[k])
                matrix[np.ix_(at, at)] += np.tensordot(counts, A, 1)
                slope[at] += counts @ c
        matrix[0, 0] += 1e-9
        matrix[1, 1] += 1e-9
        samples[draw] = vector + bounded_solution(matrix, -slope, low - vector, high - vector)
    return samples


def effective_clusters(best: Solution, options: Fit) -> float:
    """How many patches tell nu, as the inverse of their shares' sum of squares.

    A patch's share is what it adds to the information along the direction in which nu moves with
    all else following: far from the contact there are many patches that say next to nothing.
    """
    size = len(best.vector)
    matrix = prior_of(best.indentations, options).information.copy()
    shared, places = size - OWN * len(best.indentations), []
    for k, block in enumerate(best.blocks):
        places.append(np.concatenate([np.arange(shared), shared + OWN * k + np.arange(OWN)]))
        part = block.motion_matrix.sum(axis=0) + block.depth_matrix.sum(axis=0)
        matrix[np.ix_(places[-1], places[-1])] += part
    # Deviations differ by many orders, which an inverse by eigenvalues would not survive.
    scale = 1 / np.sqrt(np.diag(matrix))
    scaled = matrix * scale * scale[:, None] + 1e-12 * np.eye(len(matrix))
    along = scale * np.linalg.solve(scaled, scale * (np.arange(len(matrix)) == 1))
    shares = np.concatenate(
        [
            np.einsum("i,bij,j->b", along[at], block.motion_matrix, along[at])
            for at, block in zip(places, best.blocks, strict=True)
        ]
    )
    return float(shares.sum() ** 2 / max(float((shares**2).sum()), 1e-300))


def intervals(
    best: Solution, samples: NDArray, profile: Profile, options: Fit
) -> dict[str, Interval]:
    """Moduli with their intervals and verdicts.

    An interval holds what the bootstrap gives, widened for few patches and by the model's own
    error, and for Poisson's ratio also all that the profile does not tell from the best.

    Parameters
    ----------
    best : Solution
    samples : (n, size) array
        Of `bootstrap`.
    profile : Profile
    options : Fit
    """
    clusters = max(effective_clusters(best, options), FEWEST_CLUSTERS)
    quantile = float(stdtrit(clusters - 1, (1 + CONFIDENCE) / 2))
    # Patches drawn with replacement scatter too little by this.
    widen = quantile / NORMAL_QUANTILE * np.sqrt(clusters / (clusters - 1))
    told = _not_told(profile, quantile**2)
    nu = _nu_interval(best, samples, told, widen, quantile, options)
    spread = {
        "youngs_modulus_pa": samples[:, 0],
        "reduced_modulus_pa": samples[:, 0] - np.log1p(-(samples[:, 1] ** 2)),
        "youngs_modulus_1s_pa": samples[:, 0] + _log_left(samples, options),
    }
    model = quantile * np.hypot(options.model_std.log_youngs_modulus, options.force_std)
    accepted = _accepted(profile, told)
    found = {name: _of_log(logs, accepted[name], widen, model) for name, logs in spread.items()}
    return found | {"poisson_ratio": nu}


def few_frames(best: Solution, options: Fit) -> bool:
    """Whether there are fewer compared frames than moduli and relaxing shares."""
    frames = sum(len(indentation.frames) for indentation in best.indentations)
    return frames < 2 + len(options.relaxation_times_s)


def _nu_interval(
    best: Solution, samples: NDArray, told, widen: float, quantile: float, options: Fit
) -> Interval:
    bounds, value = options.poisson_ratio_bounds, best.parameters[0].poisson_ratio
    low, high = _spread(samples[:, 1], value, widen, quantile * options.model_std.nu)
    low, high = min(low, told[0]), max(high, told[1])
    # What so few frames say of nu is the priors'.
    if few_frames(best, options):
        low, high = bounds
    low, high = np.clip([low, high], *bounds)
    return Interval(value, float(low), float(high), verdict_of_nu(low, high, bounds))


def _accepted(profile: Profile, told: tuple[float, float]) -> dict[str, NDArray]:
    """Logarithms of moduli of the best nu and of those that the profile does not tell from it."""
    nus = np.array(profile.poisson_ratios)
    best = int(np.argmin(profile.costs))
    at = np.array([nus[best], *told, *nus[(nus >= told[0]) & (nus <= told[1])]])
    log_E, log_later = (
        np.interp(at, nus, np.log(moduli))
        for moduli in (profile.youngs_moduli_pa, profile.youngs_moduli_1s_pa)
    )
    star = log_E - np.log1p(-(at**2))
    return {
        "youngs_modulus_pa": log_E,
        "reduced_modulus_pa": star,
        "youngs_modulus_1s_pa": log_later,
    }


def _both_moduli(solution: Solution, options: Fit) -> tuple[float, float]:
    """E at once and after a second [Pa]."""
    p = solution.parameters[0]
    share = relaxed_share(ONE_SECOND_S, fractions=p.fractions, times_s=options.relaxation_times_s)
    return p.youngs_modulus_pa, float(p.youngs_modulus_pa * (1 - share))


def _log_left(samples: NDArray, options: Fit) -> NDArray:
    """Logarithm of what a second leaves of the modulus, for each draw."""
    times = options.relaxation_times_s
    fractions = samples[:, 3 : 3 + len(times)]
    share = [relaxed_share(ONE_SECOND_S, fractions=row, times_s=times) for row in fractions]
    return np.log1p(-np.array(share))


def _within(nu: float, bounds: Sequence[float]) -> bool:
    return bounds[0] <= nu <= bounds[1]


def _parts(block) -> list[tuple[NDArray, NDArray]]:
    seen = block.motion_matrix.any(axis=(1, 2))
    return [
        (block.motion_matrix[seen], block.motion_slope[seen]),
        (block.depth_matrix, block.depth_slope),
    ]


def _drawn(rng: np.random.Generator, count: int) -> NDArray:
    """How often each of so many blocks is drawn."""
    return rng.multinomial(count, np.full(count, 1 / count)).astype(float) if count else np.zeros(0)


def _spread(values: NDArray, best: float, widen: float, model: float) -> tuple[float, float]:
    tail = 100 * (1 - CONFIDENCE) / 2
    low, high = np.percentile(values, [tail, 100 - tail])
    below = np.hypot(max(best - low, 0) * widen, model)
    return best - below, best + np.hypot(max(high - best, 0) * widen, model)


def _of_log(logs: NDArray, accepted: NDArray, widen: float, model: float) -> Interval:
    """Interval of a modulus: what is drawn, and what belongs to the accepted Poisson's ratios."""
    low, high = _spread(logs, accepted[0], widen, model)
    low, high = np.exp([min(low, accepted.min()), max(high, accepted.max())])
    return Interval.of_modulus(float(np.exp(accepted[0])), float(low), float(high))


def _not_told(profile: Profile, rise: float) -> tuple[float, float]:
    """Ends of the Poisson's ratios whose cost is within a rise of the least, linear between."""
    nus, costs = np.array(profile.poisson_ratios), np.array(profile.costs)
    over = costs - costs.min() - rise
    inside = np.flatnonzero(over <= 0)
    ends = []
    for first, step in ((inside[0], -1), (inside[-1], 1)):
        other = first + step
        if not 0 <= other < len(nus):
            ends.append(float(nus[first]))
            continue
        # The cost is about quadratic: its root is about linear.
        inner, outer = np.sqrt(max(over[first] + rise, 0)), np.sqrt(over[other] + rise)
        part = (np.sqrt(rise) - inner) / (outer - inner)
        ends.append(float(nus[first] + part * (nus[other] - nus[first])))
    return ends[0], ends[1]


def verdict_of_nu(low: float, high: float, bounds: Sequence[float]) -> str:
    """Inside the range and narrow; reaching one end of it, or wide; reaching both."""
    at_low, at_high = low <= bounds[0] + AT_BOUND, high >= bounds[1] - AT_BOUND
    if at_low and at_high:
        return "not identified"
    if at_low or at_high or high - low > NARROW_NU:
        return "bounded"
    return "identified"
