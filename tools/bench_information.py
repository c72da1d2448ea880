"""Rows of the bench about the information limit: presses drawn from the model, and fitted anew.

A press of the made-up solid gives times, forces, samples and their deviations; what it saw is put
in by the model, with nuisances from their priors and noise as the fit states it.
"""

import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from palpate.estimate.direct.blocks import Scales
from palpate.estimate.direct.estimate import DirectEstimate, best_of_starts, estimate_direct
from palpate.estimate.direct.fit import Solution
from palpate.estimate.direct.indentation import DirectIndentation, Parameters, residuals
from palpate.estimate.direct.information import bound_of
from palpate.estimate.direct.options import Fit
from palpate.estimate.direct.prior import FREE, parameter_bounds, prior_of, scaled_inverse
from palpate.estimate.direct.quantities import NAMES, quantities_of
from palpate.estimate.relaxation import relaxed_share

sys.path.append(str(Path(__file__).resolve().parents[1] / "tests/estimate"))
from made_up_press import OPTIONS, RADIUS_M, press_of

JUDGED = ("youngs_modulus_pa", "poisson_ratio", "effective_reduced_modulus_pa")
PLACES = [NAMES.index(name) for name in JUDGED]
DRAWS = 50
# Motions that err together as they do in the sample's captures, and motions that do not.
SHARINGS = (1.0, 6.0)


def information_rows() -> list[tuple]:
    """Scatter of estimates over the bound, root mean square."""
    rows = []
    for sharing in SHARINGS:
        spread = np.sqrt((errors_over_bound(made_up(sharing), draws=DRAWS) ** 2).mean(axis=0))
        for name, ratio in zip(JUDGED, spread, strict=True):
            label = f"scatter of {name.removesuffix('_pa')}, {sharing:g} motions err together"
            rows.append((label, ratio, "times", f"information limit, {DRAWS} presses"))
    return rows


def made_up(sharing: float) -> DirectEstimate:
    """Estimate of a press of the made-up solid; so many of its motions err together."""
    found = estimate_direct([press_of(25e3, 0.3, 1)], OPTIONS, radius_m=RADIUS_M)
    return replace(
        found, solution=replace(found.solution, scales=(Scales(sharing=(sharing, 1.0)),))
    )


def drawn(truth: Solution, options: Fit, rng: np.random.Generator) -> tuple[Parameters, list]:
    """Nuisances from their priors, and the one press of a solution as the model sees it with them.

    log E and nu are the solution's, relaxing shares within what is allowed.
    """
    (press,), (scale,) = truth.indentations, truth.scales
    prior = prior_of([press], options)
    covariance = scaled_inverse(prior.information[FREE:, FREE:])
    mean = covariance @ (prior.rows.T @ prior.values)[FREE:]
    low, high = (end[FREE:] for end in parameter_bounds(1, options))
    nuisances = np.full(len(mean), np.nan)
    while not ((low <= nuisances) & (nuisances <= high)).all():
        nuisances = rng.multivariate_normal(mean, covariance)
    p = Parameters.of(np.concatenate([truth.vector[:FREE], nuisances]))
    return p, [seen(press, p, scale, options, rng)]


def seen(press: DirectIndentation, p: Parameters, scale: Scales, options: Fit, rng):
    """A press as the model sees it: prediction and noise as stated."""
    left = residuals(press, p, times_s=np.array(options.relaxation_times_s))
    depth = press.depth_m + press.depth_root_m @ (left.depth + rng.normal(size=len(press.frames)))
    moved, std = press.moved_m.copy(), press.moved_std_m[press.seen]
    noise = scale.of(press.kind)[0] * together(press, scale.sharing, rng)
    moved[press.seen] += std * (noise - left.motion)
    return replace(press, depth_m=depth, moved_m=moved)


def together(press: DirectIndentation, sharing: Sequence[float], rng) -> NDArray:
    """Noise of deviation 1 of each seen motion; of a patch, groups of them err together.

    In groups of n a part (sharing - 1) / (n - 1) of the variance is common, so that the mean of a
    patch scatters by the root of `sharing`, of each kind of motion, more than it would without.
    """
    frame, sample = np.nonzero(press.seen)
    found = np.empty(len(frame))
    for kind in np.unique(press.kind):
        of = np.flatnonzero(press.kind == kind)
        order = of[np.lexsort((sample[of], frame[of], press.cluster[sample[of]]))]
        size = int(np.ceil(sharing[kind])) + 1
        common = (sharing[kind] - 1) / (size - 1)
        alike = rng.normal(size=len(order) // size + 1)[np.arange(len(order)) // size]
        own = rng.normal(size=len(order))
        found[order] = np.sqrt(1 - common) * own + np.sqrt(common) * alike
    return found


def errors_over_bound(found: DirectEstimate, *, draws: int) -> NDArray:
    """Errors of log E, nu and effective log E* over their bounds at the truth, (draws, 3)."""
    options, truth, told = found.options, found.solution, []
    for seed in range(draws):
        p, presses = drawn(truth, options, np.random.default_rng(seed))
        here = replace(truth, parameters=(p,), indentations=tuple(presses))
        best = best_of_starts(presses, options)
        quantities = quantities_of(best, options, radius_m=RADIUS_M)
        true = true_values(quantities.depth_m, p, presses[0])
        told.append(
            (quantities.values[PLACES] - true) / bound_of(here, quantities, options)[PLACES]
        )
    return np.array(told)


def true_values(depth_m: float, p: Parameters, press: DirectIndentation) -> NDArray:
    """Of log E, nu and the effective log E* at a depth, (3,)."""
    log_E, nu = np.log(p.youngs_modulus_pa), p.poisson_ratio
    harder = press.table.stiffening_at(np.array([depth_m]), nu)[0][0]
    times = np.array(OPTIONS.relaxation_times_s)
    left = 1 - float(relaxed_share(1.0, fractions=p.fractions, times_s=times))
    return np.array([log_E, nu, log_E - np.log1p(-(nu**2)) + p.force_law * harder + np.log(left)])
