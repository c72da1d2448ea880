"""E_track and E_sm of one mesh (Eq. 4.25), their minima, and the matrices that hold them.

A vertex moves to A_i p_i = p_i + t_i (Eq. 4.23 without its turn): the energy is quadratic.
"""

import numpy as np
from numpy.typing import NDArray
from palpate.solid.solve import factorise
from palpate.surface.template import Template, unique_edges
from scipy import sparse
from scipy.sparse.linalg import splu

from thesis.tracker.data_points import Data

# Vertices that nothing pulls stay where they were.
HOLD = 1e-9


class Smoothness:
    """E_sm = sum over axes of t' L t of a mesh's translations.

    Parameters
    ----------
    template : Template
    reach : float
        s_sm: neighbours are the vertices within so many edges.
    """

    def __init__(self, template: Template, *, reach: float) -> None:
        near = _neighbourhoods(template, reach)
        counts = np.maximum(np.asarray(near.sum(axis=1)).ravel(), 1)
        weights = sparse.diags(1.0 / counts) @ near
        weights = sparse.csr_matrix(weights + weights.T)
        degree = np.asarray(weights.sum(axis=1)).ravel()
        self.L = sparse.csr_matrix(sparse.diags(degree) - weights)
        self._systems: dict[int, _System] = {}

    def energy(self, shift_m: NDArray) -> float:
        """E_sm of translations (n, 3) [m2]."""
        return float((shift_m * (self.L @ shift_m)).sum())

    def descend(self, shift_m: NDArray, data: Data, w_sm: float) -> tuple[NDArray, float]:
        """Translations that minimise E_track for given nearest neighbours.

        Parameters
        ----------
        shift_m : (n, 3) array
            Where to start; vertices that nothing pulls stay there [m].
        data : Data
        w_sm : float

        Returns
        -------
        shift_m : (n, 3) array
        energy : float
            E_track after the descent; never above that of the start [m2].
        """
        weights, hold = data.weights[:, None], HOLD * max(data.weights.max(initial=0.0), w_sm)
        right = weights * data.counted(data.target_m - data.rest_m) + hold * shift_m
        if data.along.any():
            counted = data.normals[:, :, None] * data.normals[:, None, :]
            counted = np.where(data.along[:, None, None], counted, np.eye(3))
            blocks = weights[:, :, None] * counted + hold * np.eye(3)
            shift_m = self._system(3).solve(blocks, w_sm, right.reshape(-1, 1)).reshape(-1, 3)
        else:
            shift_m = self._system(1).solve((weights + hold)[:, :, None], w_sm, right)
        return shift_m, float(data.weights @ data.gaps(shift_m) ** 2) + w_sm * self.energy(shift_m)

    def _system(self, width: int) -> "_System":
        """Solver of w_sm L + blocks of the given width on the diagonal."""
        if width not in self._systems:
            self._systems[width] = _System(self.L, width)
        return self._systems[width]

    def fill(self, shift_m: NDArray, known: NDArray) -> NDArray:
        """Smoothest translations (n, 3) [m] of the vertices that are not known (n,)."""
        if known.all():
            return shift_m
        rows = self.L[~known]
        inner = rows[:, ~known] + HOLD * sparse.eye(int((~known).sum()))
        right = HOLD * shift_m[~known] - rows[:, known] @ shift_m[known]
        return _replaced(shift_m, ~known, inner, right)

    def draw(
        self, shift_m: NDArray, goal_m: NDArray, chosen: NDArray, w_data: float, w_sm: float
    ) -> NDArray:
        """Minimise E_def (Eq. 4.28) over the translations of some vertices.

        Parameters
        ----------
        shift_m : (n, 3) array
            Translations [m].
        goal_m : (k, 3) array
            Those that the chosen vertices are drawn to [m].
        chosen : (n,) bool array
        w_data, w_sm : float

        Returns
        -------
        (n, 3) array
        """
        if not chosen.any():
            return shift_m
        rows = self.L[chosen]
        A = w_sm * rows[:, chosen] + w_data * sparse.eye(int(chosen.sum()))
        right = w_data * goal_m - w_sm * (rows[:, ~chosen] @ shift_m[~chosen])
        return _replaced(shift_m, chosen, A, right)


def _replaced(values: NDArray, chosen: NDArray, A: sparse.spmatrix, right: NDArray) -> NDArray:
    """Values of which the chosen solve A x = right."""
    result = values.copy()
    result[chosen] = splu(sparse.csc_matrix(A)).solve(right)
    return result


def _neighbourhoods(template: Template, reach: float) -> sparse.csr_matrix:
    """R_sm of Eq. 4.25: 1 for vertices at most ``reach`` edges apart, shape (n, n)."""
    edges, size = unique_edges(template.faces), len(template.vertices_m)
    step = sparse.csr_matrix((np.ones(len(edges)), edges.T), shape=(size, size))
    step = step + step.T + sparse.eye(size)
    near = sparse.eye(size, format="csr")
    for _ in range(int(reach)):
        near = sparse.csr_matrix(near @ step)
    near.setdiag(0.0)
    near.eliminate_zeros()
    near.sort_indices()
    near.data[:] = 1.0
    return near


class _System:
    """Matrices w_sm L (x) 1 + diagonal blocks, all with the same entries."""

    def __init__(self, L: sparse.csr_matrix, width: int) -> None:
        size, self.width = L.shape[0], width
        ones = np.ones((size, width, width))
        place = (np.arange(size), np.arange(size + 1))
        blocks = sparse.bsr_matrix((ones, *place), shape=(size * width,) * 2).tocsr()
        spread = sparse.csr_matrix(sparse.kron(L, sparse.eye(width)))
        # All entries are there: those of the pattern are numbered and never cancel.
        pattern = sparse.csr_matrix(abs(spread) + blocks)
        pattern.sort_indices()
        self._shape, self._places = pattern.shape, (pattern.indices, pattern.indptr)
        rows = np.repeat(np.arange(size * width), np.diff(pattern.indptr))
        self._diagonal = np.flatnonzero(rows // width == pattern.indices // width)
        self._smooth = np.asarray(spread[rows, pattern.indices]).ravel()
        self._factors = None

    def solve(self, blocks: NDArray, w_sm: float, right: NDArray) -> NDArray:
        """Solution for blocks (n, width, width) and right-hand sides (n * width, k)."""
        data = w_sm * self._smooth
        data[self._diagonal] += blocks.ravel()
        A = sparse.csr_matrix((data, *self._places), shape=self._shape)
        self._factors = self._factors.refactorise(A) if self._factors else factorise(A)
        return self._factors(right)
