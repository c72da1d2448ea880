"""Connected pieces of a cloud."""

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree


def largest_piece(points_m: NDArray, gap_m: float) -> NDArray:
    """Points of the largest piece, where points within a gap of each other are one piece.

    Most of a surface hangs together at half the gap already, which leaves an eighth of the pairs;
    the whole gap is then looked at around the few other points alone.

    Parameters
    ----------
    points_m : (n, 3) array
        Points of a cloud [m].
    gap_m : float
        Points no farther apart than this belong together [m].

    Returns
    -------
    (k,) int array
        Their rising indices; of pieces as large as each other those of the one that comes first.

    Raises
    ------
    ValueError
        If there are no points, or the gap is not positive.
    """
    if not len(points_m):
        raise ValueError("points_m: expected points of a cloud, found none")
    if not gap_m > 0:
        raise ValueError(f"gap_m: expected a length above 0 m, found {gap_m:g}")
    tree = cKDTree(points_m)
    near = tree.query_pairs(gap_m / 2, output_type="ndarray")
    part = _joined(near[:, 0], near[:, 1], len(points_m))
    others = np.flatnonzero(part != np.bincount(part).argmax())
    if len(others):
        reached = tree.query_ball_point(points_m[others], gap_m)
        counts = [len(found) for found in reached]
        first, second = part[np.repeat(others, counts)], part[np.concatenate(reached).astype(int)]
        part = _joined(first, second, part.max() + 1)[part]
    return np.flatnonzero(part == np.bincount(part).argmax())


def _joined(first: NDArray, second: NDArray, count: int) -> NDArray:
    """Number of the component of each of ``count`` nodes, in order of their first nodes."""
    links = sparse.coo_matrix((np.ones(len(first), dtype=bool), (first, second)), (count, count))
    return connected_components(links, directed=False)[1]
