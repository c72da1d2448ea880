"""How far the scatter of the gaps lets moduli be known: covariance of an M-estimator."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from palpate.estimate.direct.deviations import error_clusters
from palpate.solid.laws import lame_from_engineering
from scipy.spatial.distance import pdist, squareform

from thesis.minimise.reduced_objective import ReducedObjective

NORMS = ("length", "square")
# Lengths are rounded off at this part of their mean, where their root has no derivative.
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
class Scatter:
    """Spread of (log E, nu) that the gaps' scatter makes.

    Attributes
    ----------
    covariance : (2, 2) array or None
        None where there are too few patches, or no minimum inside.
    error_rise : float or None
        By how much one standard error of nu raises what is minimised, at the best E for it.
    patches : int
        Parts of the surface whose gaps are independent of each other.
    patch_m : float
        Their size [m].
    """

    covariance: NDArray | None
    error_rise: float | None
    patches: int
    patch_m: float


def moduli_scatter(
    objective: ReducedObjective,
    E: float,
    nu: float,
    *,
    norm: str,
    nodes_m: NDArray,
    least_patch_m: float,
) -> Scatter:
    """Cluster-robust sandwich: inverse curvature, scores summed by patch, inverse curvature.

    Patches are twice as large as the distance over which the gaps' directions agree, at least as
    stated. What all gaps have in common, and errors of the model, are not in it.

    Parameters
    ----------
    objective : ReducedObjective
    E, nu : float
        Where the sum is least; E in Pa.
    norm : {"length", "square"}
    nodes_m : (n, 3) array
        Nodes of the solid [m].
    least_patch_m : float
    """
    gap, nodes = _moving_gaps(objective, E, nu)
    patch_m = least_patch_m
    if np.linalg.norm(gap, axis=1).mean() > EXACT * objective.full.largest_m:
        patch_m = max(patch_m, 2 * correlation_length(nodes_m[nodes], gap, bin_m=least_patch_m))
    patches = error_clusters(nodes_m, size_m=patch_m)
    count = len(np.unique(patches[nodes]))
    curvature = _curvature(objective, E, nu, norm)
    if count < FEWEST_PATCHES or np.linalg.eigvalsh(curvature).min() <= 0:
        return Scatter(None, None, count, patch_m)
    scores = np.zeros((patches.max() + 1, 2))
    for nodes, score in _scores(objective, E, nu, norm):
        np.add.at(scores, patches[nodes], score)
    inverse = np.linalg.inv(curvature)
    covariance = inverse @ (scores.T @ scores) @ inverse * count / (count - 2)
    return Scatter(covariance, float(covariance[1, 1] / (2 * inverse[1, 1])), count, patch_m)


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


def rounding_of(gap: NDArray) -> float:
    """Length below which lengths of gaps are rounded off, of the gaps' unit."""
    return ROUNDING * float(np.linalg.norm(gap, axis=1).mean())


def _moving_gaps(objective: ReducedObjective, E: float, nu: float) -> tuple[NDArray, NDArray]:
    """Gaps of the displacement that depend on the moduli, and their nodes."""
    _, gap, slope = objective.gaps(*lame_from_engineering(E, nu))[0]
    moving = slope.any(axis=(1, 2))
    return gap[moving], objective.node_sets[0][moving]


def _scores(
    objective: ReducedObjective, E: float, nu: float, norm: str
) -> list[tuple[NDArray, NDArray]]:
    """Nodes of each term, and what each adds to the gradient by (log E, nu), shape (k, 2)."""
    chain, found = lame_derivatives(E, nu), []
    terms = objective.gaps(*lame_from_engineering(E, nu))
    for (weight, gap, by_lame), nodes in zip(terms, objective.node_sets, strict=True):
        score = np.einsum("ki,kij->kj", gap, by_lame @ chain)
        if norm == "length":
            size = np.sqrt((gap**2).sum(axis=1) + rounding_of(gap) ** 2 + 1e-300)
            found.append((nodes, weight * score / size[:, None]))
        else:
            found.append((nodes, weight**2 * score))
    return found


def _curvature(objective: ReducedObjective, E: float, nu: float, norm: str) -> NDArray:
    """Second derivatives by (log E, nu), as differences of the exact first ones."""

    def gradient(step: NDArray) -> NDArray:
        scores = _scores(objective, E * np.exp(step[0]), nu + step[1], norm)
        return sum(score.sum(axis=0) for _, score in scores)

    columns = [(gradient(e) - gradient(-e)) / (2 * STEP) for e in STEP * np.eye(2)]
    return (np.column_stack(columns) + np.vstack(columns)) / 2


def lame_derivatives(E: float, nu: float) -> NDArray:
    """Derivatives of (lam, mu) with respect to (log E, nu), shape (2, 2) [Pa].

    Rows belong to lam and mu, columns to log E and nu.
    """
    lam, mu = lame_from_engineering(E, nu)
    by_nu = E * (1 + 2 * nu**2) / ((1 + nu) * (1 - 2 * nu)) ** 2
    return np.array([[lam, by_nu], [mu, -mu / (1 + nu)]])
