"""How far the scatter of the gaps lets moduli be known: covariance of an M-estimator."""

import numpy as np
from numpy.typing import NDArray
from palpate.estimate.direct.deviations import error_clusters
from scipy.spatial.distance import pdist, squareform

from thesis.minimise.objective import Objective

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


def independent_patches(
    objective: Objective, E: float, nu: float, *, least_m: float
) -> tuple[NDArray, int, float]:
    """Patches of the surface whose gaps are independent of each other.

    They are twice as large as the distance over which the gaps' directions agree, or `least_m`.

    Returns
    -------
    patches : (n,) int array
        Of each node.
    count : int
        Of those whose gaps depend on the moduli.
    patch_m : float
        Their size [m].
    """
    surface, nodes_m, size_m = objective.terms[0], objective.nodes_m, least_m
    moving = surface.slopes(E, nu).any(axis=(1, 2))
    gaps, nodes = surface.gaps(E, nu)[moving], surface.nodes[moving]
    if np.linalg.norm(gaps, axis=1).mean() > EXACT * objective.largest_m:
        size_m = max(size_m, 2 * correlation_length(nodes_m[nodes], gaps, bin_m=least_m))
    patches = error_clusters(nodes_m, size_m=size_m)
    return patches, len(np.unique(patches[nodes])), size_m


def scatter(
    objective: Objective, E: float, nu: float, norm: str, patches: NDArray, count: int
) -> tuple[NDArray | None, float | None]:
    """Cluster-robust sandwich: inverse curvature, scores summed by patch, inverse curvature.

    Returns
    -------
    covariance : (2, 2) array or None
        Of (log E, nu); None with too few patches, or where the sum has no minimum.
    rise : float or None
        By how much one standard error of nu raises what is minimised, at the best E for it.
    """
    curvature = _curvature(objective, E, nu, norm)
    if count < FEWEST_PATCHES or np.linalg.eigvalsh(curvature).min() <= 0:
        return None, None
    sums = np.zeros((patches.max() + 1, 2))
    for term, scores in zip(objective.terms, _scores(objective, E, nu, norm), strict=True):
        np.add.at(sums, patches[term.nodes], scores)
    inverse = np.linalg.inv(curvature)
    covariance = inverse @ (sums.T @ sums) @ inverse * count / (count - 2)
    return covariance, float(covariance[1, 1] / (2 * inverse[1, 1]))


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
