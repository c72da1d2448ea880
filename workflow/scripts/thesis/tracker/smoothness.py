"""Transforms of vertices (Eq. 4.23), E_sm of one mesh (Eq. 4.25), its minima and matrices."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from palpate.solid.solve import factorise
from palpate.surface.template import Template, neighbourhoods
from scipy import sparse
from scipy.sparse.linalg import splu
from scipy.spatial.transform import Rotation

# Eq. 4.25 adds squares of lengths and of angles without a unit; read in millimetres, a radian
# counts as much as one of them.
RADIAN_M = 1e-3
# Vertices that nothing pulls stay where they were.
HOLD = 1e-9


@dataclass(frozen=True)
class Transforms:
    """Parameters of Eq. 4.23.

    Attributes
    ----------
    shift_m : (n, 3) array
        Translations t_i [m].
    axes : (n, 3) array
        Unit rotation axes r_i.
    angle : (n,) array
        phi_i [rad].
    """

    shift_m: NDArray
    axes: NDArray
    angle: NDArray

    @property
    def displacement_m(self) -> NDArray:
        """R(r_i, phi_i) t_i, shape (n, 3) [m]."""
        return turned(self, self.shift_m)

    def of(self, vertices: NDArray) -> "Transforms":
        """Those of some vertices."""
        return Transforms(*(values[vertices] for values in vars(self).values()))


def turned(transforms: Transforms, vectors: NDArray, *, back: bool = False) -> NDArray:
    """R(r_i, phi_i) v_i, or its inverse."""
    if not transforms.angle.any():
        return vectors
    angle = -transforms.angle if back else transforms.angle
    return Rotation.from_rotvec(transforms.axes * angle[:, None]).apply(vectors)


class Smoothness:
    """E_sm = sum over axes of t' L t + sum over pairs of the squared difference of angles.

    Parameters
    ----------
    template : Template
    reach : float
        s_sm.
    measure : {"rings", "geodesic"}
        As of `neighbourhoods`.
    """

    def __init__(self, template: Template, *, reach: float, measure: str) -> None:
        near = neighbourhoods(template, reach=reach, measure=measure)
        counts = np.maximum(np.asarray(near.sum(axis=1)).ravel(), 1)
        weights = sparse.diags(1.0 / counts) @ near.astype(float)
        weights = sparse.csr_matrix(weights + weights.T)
        degree = np.asarray(weights.sum(axis=1)).ravel()
        self.L = sparse.csr_matrix(sparse.diags(degree) - weights)
        self._pairs = sparse.coo_matrix(sparse.triu(weights, k=1))
        self._systems: dict[int, _System] = {}

    def energy(self, transforms: Transforms) -> float:
        """E_sm [m2]."""
        shift, angle = transforms.shift_m, transforms.angle
        energy = float((shift * (self.L @ shift)).sum())
        if not angle.any():
            return energy
        return energy + RADIAN_M**2 * float(self._pairs.data @ self._differences(angle) ** 2)

    def angle_slope(self, angle: NDArray) -> NDArray:
        """Half the derivative of the angles' part by each angle."""
        pull = self._pairs.data * self._differences(angle)
        size = len(angle)
        slope = np.bincount(self._pairs.row, pull, size) - np.bincount(self._pairs.col, pull, size)
        return RADIAN_M**2 * slope

    def system(self, width: int) -> "_System":
        """Solver of w_sm L + blocks of the given width on the diagonal."""
        if width not in self._systems:
            self._systems[width] = _System(self.L, width)
        return self._systems[width]

    def fill(self, transforms: Transforms, known: NDArray) -> Transforms:
        """Minimise E_sm for the vertices that are not known, angles and translations.

        Parameters
        ----------
        transforms : Transforms
        known : (n,) bool array
        """
        values = np.column_stack([transforms.shift_m, transforms.angle])
        values[~known] = self.extended(values, known)
        return replace(transforms, shift_m=values[:, :3], angle=values[:, 3])

    def draw(
        self, transforms: Transforms, goal_m: NDArray, chosen: NDArray, w_data: float, w_sm: float
    ) -> Transforms:
        """Minimise E_def (Eq. 4.28) over the translations of some vertices.

        Their angles come back to the smoothest ones.

        Parameters
        ----------
        transforms : Transforms
        goal_m : (k, 3) array
            Displacement of the chosen vertices to where they are drawn [m].
        chosen : (n,) bool array
        w_data, w_sm : float
        """
        if not chosen.any():
            return transforms
        angle = transforms.angle.copy()
        angle[chosen] = self.extended(angle[:, None], ~chosen)[:, 0]
        transforms = replace(transforms, angle=angle)
        rows = self.L[chosen]
        A = w_sm * rows[:, chosen] + w_data * sparse.eye(int(chosen.sum()))
        right = w_data * turned(transforms.of(chosen), goal_m, back=True)
        right -= w_sm * (rows[:, ~chosen] @ transforms.shift_m[~chosen])
        shift = transforms.shift_m.copy()
        shift[chosen] = splu(sparse.csc_matrix(A)).solve(right)
        return replace(transforms, shift_m=shift)

    def extended(self, values: NDArray, known: NDArray) -> NDArray:
        """Smoothest values (k, c) of the vertices that are not known."""
        if known.all():
            return values[~known]
        rows = self.L[~known]
        inner = rows[:, ~known] + HOLD * sparse.eye(int((~known).sum()))
        right = HOLD * values[~known] - rows[:, known] @ values[known]
        return splu(sparse.csc_matrix(inner)).solve(right)

    def _differences(self, angle: NDArray) -> NDArray:
        """phi_i - phi_j the short way round, which is the smaller term of Eq. 4.25."""
        apart = angle[self._pairs.row] - angle[self._pairs.col]
        return (apart + np.pi) % (2 * np.pi) - np.pi


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
