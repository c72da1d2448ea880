"""How far the scatter of the gaps lets moduli be known: covariance of an M-estimator."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from palpate.estimate.direct.deviations import error_clusters
from palpate.solid.laws import reduced_modulus
from scipy.spatial.distance import pdist, squareform

from thesis.minimise.objective import Objective

FORCE_TERM, AT_BOUND, ALIKE = "force term", "at a bound", "gaps agree over the surface"
# Lengths are rounded off at this part of their mean, where they have no derivative.
ROUNDING = 1e-3
# Directions of gaps that agree by less than this are taken as independent.
INDEPENDENT = 0.1
PAIRS_PER_BIN = 30
# Fewer independent patches say too little of their own scatter.
FEWEST_PATCHES = 15
STEP = 1e-4
# Gaps this small beside the largest displacement are rounding.
EXACT = 1e-6


@dataclass(frozen=True)
class Best:
    """Moduli at the bottom of the valley of the error, without Nelder and Mead.

    Standard errors are None where scatter says nothing of the moduli: with the force term, since
    noise of the displacement goes through K into it as a bias; at a bound; and where gaps agree
    over so much of the surface that too few patches are independent.

    Attributes
    ----------
    youngs_modulus_pa, poisson_ratio, reduced_modulus_pa : float
    youngs_modulus_std_pa, poisson_ratio_std : float or None
    error_m : float
        The study's objective there [m].
    error_rise_m : float or None
        By how much one standard error of nu raises that objective at the best E for it [m]; None
        for squares, which are another sum.
    at_bound : bool
    patches : int
        Parts of the surface whose gaps are taken as independent of each other.
    patch_m : float
        Their size [m].
    unknown : str or None
        Why there are no standard errors.
    """

    youngs_modulus_pa: float
    youngs_modulus_std_pa: float | None
    poisson_ratio: float
    poisson_ratio_std: float | None
    reduced_modulus_pa: float
    error_m: float
    error_rise_m: float | None
    at_bound: bool
    patches: int
    patch_m: float
    unknown: str | None


def moduli_with_errors(
    objective: Objective,
    E: float,
    nu: float,
    *,
    norm: str,
    at_bound: bool,
    least_patch_m: float,
) -> Best:
    """Cluster-robust sandwich: inverse curvature, scores summed by patch, inverse curvature.

    Patches are twice as large as the distance over which the gaps' directions agree, at least as
    stated. What all gaps have in common, and errors of the model, are not in it.

    Parameters
    ----------
    objective : Objective
    E, nu : float
        Where the sum is least; E in Pa.
    norm : {"length", "square"}
    at_bound : bool
    least_patch_m : float
    """
    surface, nodes_m = objective.terms[0], objective.nodes_m
    gaps = surface.gaps(E, nu)
    moving = surface.slopes(E, nu).any(axis=(1, 2))
    gaps, nodes = gaps[moving], surface.nodes[moving]
    patch_m = least_patch_m
    if np.linalg.norm(gaps, axis=1).mean() > EXACT * objective.largest_m:
        patch_m = max(patch_m, 2 * correlation_length(nodes_m[nodes], gaps, bin_m=least_patch_m))
    patches = error_clusters(nodes_m, size_m=patch_m)
    count = len(np.unique(patches[nodes]))
    curvature = _curvature(objective, E, nu, norm)
    alike = count < FEWEST_PATCHES or np.linalg.eigvalsh(curvature).min() <= 0
    reasons = {FORCE_TERM: objective.option != "displacement", AT_BOUND: at_bound, ALIKE: alike}
    unknown = next((reason for reason, holds in reasons.items() if holds), None)
    E_std = nu_std = rise = None
    if unknown is None:
        sums = np.zeros((patches.max() + 1, 2))
        np.add.at(sums, patches[surface.nodes], _scores(objective, E, nu, norm)[0])
        inverse = np.linalg.inv(curvature)
        covariance = inverse @ (sums.T @ sums) @ inverse * count / (count - 2)
        log_std, nu_std = np.sqrt(np.diag(covariance)).tolist()
        E_std, rise = E * log_std, float(covariance[1, 1] / (2 * inverse[1, 1]))
    return Best(
        youngs_modulus_pa=E,
        youngs_modulus_std_pa=E_std,
        poisson_ratio=nu,
        poisson_ratio_std=nu_std,
        reduced_modulus_pa=reduced_modulus(E, nu),
        error_m=objective(E, nu),
        error_rise_m=rise if norm == "length" else None,
        at_bound=at_bound,
        patches=count,
        patch_m=patch_m,
        unknown=unknown,
    )


def correlation_length(points_m: NDArray, gaps: NDArray, *, bin_m: float) -> float:
    """Distance up to which directions of gaps agree [m].

    Parameters
    ----------
    points_m, gaps : (n, 3) arrays
        Places [m] and gaps of any unit.
    bin_m : float
        Width of the bins of distance [m].

    Returns
    -------
    float
        End of the last of the bins, from zero on, whose pairs agree by 0.1 or more in the mean
        cosine; bins with few pairs don't count. 0 where neighbours already differ.
    """
    units = gaps / np.maximum(np.linalg.norm(gaps, axis=1, keepdims=True), 1e-300)
    number = (pdist(points_m) / bin_m).astype(int)
    counts = np.bincount(number)
    cosine = np.bincount(number, squareform(units @ units.T, checks=False))
    length = 0.0
    for k in np.flatnonzero(counts >= PAIRS_PER_BIN):
        if cosine[k] < INDEPENDENT * counts[k]:
            break
        length = (k + 1) * bin_m
    return float(length)


def gradient(
    objective: Objective, E: float, nu: float, norm: str, rounding: float = 0.0
) -> NDArray:
    """Derivatives of the error, or half those of the squares, with respect to log E and nu."""
    return sum(scores.sum(axis=0) for scores in _scores(objective, E, nu, norm, rounding))


def _scores(
    objective: Objective, E: float, nu: float, norm: str, rounding: float = ROUNDING
) -> list[NDArray]:
    """What each node of each term adds to the gradient, (k, 2)."""
    found = []
    for term in objective.terms:
        gaps = term.gaps(E, nu)
        scores = np.einsum("ki,kij->kj", gaps, term.slopes(E, nu))
        if norm == "length":
            lengths = np.linalg.norm(gaps, axis=1)
            rounded = np.hypot(lengths, rounding * lengths.mean() + 1e-150)
            found.append(term.weight * scores / rounded[:, None])
        else:
            found.append(term.weight**2 * scores)
    return found


def _curvature(objective: Objective, E: float, nu: float, norm: str) -> NDArray:
    """Second derivatives by (log E, nu), as differences of the exact first ones."""
    columns = [
        (
            gradient(objective, E * np.exp(x), nu + y, norm, ROUNDING)
            - gradient(objective, E * np.exp(-x), nu - y, norm, ROUNDING)
        )
        / (2 * STEP)
        for x, y in STEP * np.eye(2)
    ]
    return (np.column_stack(columns) + np.vstack(columns)) / 2
