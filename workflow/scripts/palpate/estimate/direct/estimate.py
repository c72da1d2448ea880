"""E and nu straight from clouds and forces, by the law that the press itself prefers."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from palpate.estimate.direct.choices import other_choices
from palpate.estimate.direct.fit import Solution, check_count, fit_direct
from palpate.estimate.direct.indentation import DirectIndentation, Parameters, predicted
from palpate.estimate.direct.interval import (
    Interval,
    Profile,
    bootstrap,
    few_frames,
    intervals,
    profile_over_nu,
    verdict_of_nu,
)
from palpate.estimate.direct.options import Fit
from palpate.estimate.direct.relaxation import elastic_force
from palpate.estimate.direct.support_motion import MOTIONS

LINEAR = "linear"
START_POISSON_RATIOS = (0.1, 0.3, 0.45)
# Deviations from which on a slope of E over the depth is not chance.
CERTAIN = 2.0


@dataclass(frozen=True)
class LawEvidence:
    """What the captures say of one law.

    Attributes
    ----------
    law : str
    youngs_modulus_pa, poisson_ratio : float
    cost : float
        Twice the negative logarithm of the posterior density at the minimum.
    modulus_slope, modulus_slope_std : float
        Of log E, frame by frame, over the depth in radii: 0 for the right law.
    depth_spread : float
        Standard deviation of the depths in radii.
    """

    law: str
    youngs_modulus_pa: float
    poisson_ratio: float
    cost: float
    modulus_slope: float
    modulus_slope_std: float
    depth_spread: float

    @property
    def misfit(self) -> float:
        """What the slope makes of log E over the depths, if it is not 0 by chance; else 0."""
        certain = abs(self.modulus_slope) > CERTAIN * self.modulus_slope_std
        return abs(self.modulus_slope) * self.depth_spread if certain else 0.0


@dataclass(frozen=True)
class DirectEstimate:
    """Moduli of captures of one object, with what they rest on.

    Attributes
    ----------
    solution : Solution
        Of the best law.
    moduli : dict of str to Interval
    profile : Profile
    laws : tuple of LawEvidence
    choices : dict of str to (float, float)
        E [Pa] and nu of other choices of what is compared.
    criterion : str
        Why these laws were tried.
    """

    solution: Solution
    moduli: dict[str, Interval]
    profile: Profile
    laws: tuple[LawEvidence, ...]
    choices: dict[str, tuple[float, float]]
    criterion: str


def estimate_direct(
    indentations: Sequence[DirectIndentation], options: Fit, *, radius_m: float, seed: int
) -> DirectEstimate:
    """Estimate the moduli of an object from one or more of its captures.

    Parameters
    ----------
    indentations : sequence of DirectIndentation
        With the same laws.
    options : Fit
    radius_m : float
        Of the sphere.
    seed : int
        Of the bootstrap.

    Raises
    ------
    ValueError
        If a record has fewer frames than unknowns.
    """
    check_count(indentations, options)
    laws, criterion = laws_to_try(indentations, options, radius_m=radius_m)
    found = compared(indentations, laws, options)
    order = sorted(found, key=lambda law: found[law].cost)
    best = found[order[0]]
    close = [law for law in order if found[law].cost - best.cost <= options.law_margin]
    results = [_judged(found[law], options, seed) for law in close]
    choices = other_choices(best, options, radius_m=radius_m)
    evidence = tuple(law_evidence(found[law], options, radius_m) for law in order)
    moduli = _joined_moduli([moduli for moduli, _ in results], choices, evidence[0], options)
    if few_frames(best, options):
        moduli = {name: _at_best_bounded(found) for name, found in moduli.items()}
    return DirectEstimate(best, moduli, results[0][1], evidence, choices, criterion)


def laws_to_try(
    indentations: Sequence[DirectIndentation], options: Fit, *, radius_m: float
) -> tuple[list[str], str]:
    """Linear solid for shallow presses, finite strain for others, with the reason in words.

    Beyond ``linear_depth`` radii the contact's own strain is no longer small; below it the linear
    solid is as right, and the laws can't be told apart. The depth is that of the linear solid's
    own fit, as the measured one may be off by more than the limit.

    Raises
    ------
    ValueError
        If the press is deep and no law of finite strain is known.
    """
    finite = [law for law in indentations[0].models if law != LINEAR]
    limit = options.linear_depth
    if LINEAR not in indentations[0].models:
        return finite, "finite strain, as there is no linear solid of this object"
    found = best_of_starts(indentations, LINEAR, options)
    deepest = max(_deepest(*of, options) for of in zip(indentations, found.parameters, strict=True))
    shallow = deepest / radius_m <= limit
    if not (shallow or finite):
        raise ValueError(f"laws: expected one of finite strain for deep presses, found {LINEAR}")
    kind = "linear solid" if shallow else "finite strain"
    reason = f"depth over radius {deepest / radius_m:.2f}; {kind}, as linear_depth is {limit:g}"
    return [LINEAR] if shallow else finite, reason


def _deepest(indentation: DirectIndentation, of: Parameters, options: Fit) -> float:
    times = np.array(options.relaxation_times_s, dtype=float)
    return float(predicted(indentation, LINEAR, of, times_s=times).depth_m.max())


def compared(
    indentations: Sequence[DirectIndentation], laws: Sequence[str], options: Fit
) -> dict[str, Solution]:
    """Each law's least cost, with the deviations that the tightest law leaves.

    Costs of fits that were each divided by deviations of their own can't be compared.
    """
    found = {law: best_of_starts(indentations, law, options) for law in laws}
    tightest = min(found.values(), key=lambda solution: solution.spread)
    return {
        law: fit_direct(
            tightest.indentations, law, options, solution.parameters[0], scales=tightest.scales
        )
        for law, solution in found.items()
    }


def best_of_starts(indentations: Sequence[DirectIndentation], law: str, options: Fit) -> Solution:
    """Least cost from starts over the range of Poisson's ratios."""
    found = []
    for nu in START_POISSON_RATIOS:
        start = _start(indentations[0], law, nu, len(options.relaxation_times_s))
        found.append(fit_direct(indentations, law, options, start))
    first = min(found, key=lambda solution: solution.cost)
    # Costs of fits with scales of their own can't be compared.
    again = [
        fit_direct(first.indentations, law, options, solution.parameters[0], scales=first.scales)
        for solution in found
    ]
    return min(again, key=lambda solution: solution.cost)


def law_evidence(solution: Solution, options: Fit, radius_m: float) -> LawEvidence:
    """How constant E is over the depth under a law (weighted line through all frames)."""
    depths, logs, stds = [], [], []
    for indentation, p in zip(solution.indentations, solution.parameters, strict=True):
        model = indentation.models[solution.law]
        force = elastic_force(
            indentation.time_s,
            indentation.force_n,
            fractions=p.fractions,
            times_s=options.relaxation_times_s,
        )[indentation.frames]
        depth = indentation.depth_m + p.offset_m + p.clock_s * indentation.speed_m_s
        depth = depth - indentation.load * (indentation.support_axes.tip_m @ p.support_motion)
        inside = (depth > 0) & (force > 0)
        unit = model.force(depth[inside], p.poisson_ratio)
        depths.append(depth[inside] / radius_m)
        logs.append(np.log(force[inside] / unit))
        # Force goes with the depth's power 3/2.
        stds.append(1.5 * indentation.depth_std_m / depth[inside])
    x, y, std = map(np.concatenate, (depths, logs, stds))
    slope, slope_std = _line(x, y, std)
    first = solution.parameters[0]
    E, nu = first.youngs_modulus_pa, first.poisson_ratio
    return LawEvidence(solution.law, E, nu, solution.cost, slope, slope_std, float(np.std(x)))


def _start(indentation: DirectIndentation, law: str, nu: float, terms: int) -> Parameters:
    unit = indentation.models[law].force(np.maximum(indentation.depth_m, 0), nu)
    force = indentation.force_n[indentation.frames]
    E = float((force @ unit) / max(float(unit @ unit), 1e-300))
    return Parameters(max(E, 1.0), nu, 0.0, np.full(terms, 0.02), 0.0, 0.0, 0.0, np.zeros(MOTIONS))


def _judged(solution: Solution, options: Fit, seed: int) -> tuple[dict, Profile]:
    samples = bootstrap(solution, options, draws=options.draws, seed=seed)
    profile = profile_over_nu(solution, options, options.profile_poisson_ratios)
    return intervals(solution, samples, profile, options), profile


def _joined_moduli(
    results: list[dict], choices: Mapping, best: LawEvidence, options: Fit
) -> dict[str, Interval]:
    """Intervals that hold those of all laws that the captures don't tell from the best.

    The largest change among the other choices, and what E drifts by over the depth under the best
    law, are added in quadrature.
    """
    E, nu = np.array(list(choices.values())).T
    here = results[0]
    log_E = np.log(E / here["youngs_modulus_pa"].value)
    log_star = log_E - np.log((1 - nu**2) / (1 - here["poisson_ratio"].value ** 2))
    changes = {
        "poisson_ratio": np.abs(nu - here["poisson_ratio"].value).max(),
        "youngs_modulus_pa": np.hypot(np.abs(log_E).max(), 2 * best.misfit),
        "youngs_modulus_1s_pa": np.hypot(np.abs(log_E).max(), 2 * best.misfit),
        "reduced_modulus_pa": np.hypot(np.abs(log_star).max(), 2 * best.misfit),
    }
    return {name: _wider(name, results, float(changes[name]), options) for name in here}


def _wider(name: str, results: list[dict], change: float, options: Fit) -> Interval:
    first = results[0][name]
    low = min(result[name].low for result in results)
    high = max(result[name].high for result in results)
    if name == "poisson_ratio":
        low = first.value - np.hypot(first.value - low, change)
        high = first.value + np.hypot(high - first.value, change)
        low, high = np.clip([low, high], *options.poisson_ratio_bounds)
        verdict = verdict_of_nu(low, high, options.poisson_ratio_bounds)
        return Interval(first.value, float(low), float(high), verdict)
    low = first.value * np.exp(-np.hypot(np.log(first.value / low), change))
    high = first.value * np.exp(np.hypot(np.log(high / first.value), change))
    return Interval.of_modulus(first.value, float(low), float(high))


def _at_best_bounded(found: Interval) -> Interval:
    return replace(found, verdict="bounded") if found.verdict == "identified" else found


def _line(x: NDArray, y: NDArray, std: NDArray) -> tuple[float, float]:
    """Slope of a weighted line and its deviation, from the scatter where that is larger."""
    if len(x) < 3 or np.ptp(x) == 0:
        return 0.0, float("inf")
    weight = std**-2
    mean = np.average(x, weights=weight)
    spread = float(weight @ (x - mean) ** 2)
    slope = float(weight @ ((x - mean) * (y - np.average(y, weights=weight)))) / spread
    rest = y - np.average(y, weights=weight) - slope * (x - mean)
    scatter = max(1.0, float(weight @ rest**2) / (len(x) - 2))
    return slope, float(np.sqrt(scatter / spread))
