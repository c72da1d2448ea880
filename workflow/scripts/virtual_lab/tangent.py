"""Tangent matrices of one sparsity pattern: gathered fast, factorised by PARDISO."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from palpate.mkl import SETTINGS, PyPardisoSolver
from scipy import sparse

SYMMETRIC_INDEFINITE, STRUCTURALLY_SYMMETRIC = -2, 1
ANALYSE_FACTORISE_SOLVE, FACTORISE_SOLVE = 13, 23
# MKL's own for symmetric matrices: how small a pivot is perturbed, pivots of one and two rows.
PERTURBATION, PIVOTING = (9, 8), (20, 1)


class OnePatternSolver(PyPardisoSolver):
    """PARDISO for matrices of one sparsity pattern, which it analyses once."""

    def __init__(self, *, symmetric: bool) -> None:
        super().__init__(mtype=SYMMETRIC_INDEFINITE if symmetric else STRUCTURALLY_SYMMETRIC)
        self.iparm[: len(SETTINGS)] = SETTINGS
        for place, value in (PERTURBATION, PIVOTING) if symmetric else ():
            self.iparm[place] = value
        self.analysed = False

    def set_phase(self, phase: int) -> None:
        """Leave out the analysis when it is known."""
        if phase == ANALYSE_FACTORISE_SOLVE:
            phase = FACTORISE_SOLVE if self.analysed else phase
            self.analysed = True
        super().set_phase(phase)


class TangentSolver:
    """Assembles element matrices into that of the free unknowns and solves.

    Parameters
    ----------
    elements : (m, a) int array
        Nodes of each element.
    fixed : (3 n,) bool array
        Unknowns that are zero.
    symmetric : bool
        Whether matrices are: of such the upper triangle is taken.
    """

    def __init__(self, elements: NDArray, fixed: NDArray, *, symmetric: bool) -> None:
        self.dofs = (3 * elements[:, :, None] + np.arange(3)).reshape(len(elements), -1)
        self.size = fixed.size
        place = np.full(fixed.size, -1)
        place[~fixed] = np.arange(np.count_nonzero(~fixed))
        self.count = int(place.max()) + 1
        local = place[self.dofs]
        local = local.reshape(*elements.shape, 3)
        rows = local[:, :, :, None, None]
        columns = local.swapaxes(1, 2)[:, None, None]
        # Entries of element matrices that the free unknowns' matrix takes.
        self.taken = (rows >= 0) & (columns >= (rows if symmetric else 0))
        key = (rows * self.count + columns)[self.taken]
        keys, places = np.unique(key, return_inverse=True)
        self.places = np.full(self.taken.shape, -1, dtype=np.int32)
        self.places[self.taken] = places
        starts = np.searchsorted(keys // self.count, np.arange(self.count + 1))
        self.pattern = (keys % self.count, starts)
        self.solver = OnePatternSolver(symmetric=symmetric)

    def gathered(self, forces: NDArray, elements: NDArray | None = None) -> NDArray:
        """Sum element forces (e, a, 3) into nodal ones, shape (3 n,) [N]."""
        dofs = self.dofs if elements is None else self.dofs[elements]
        return np.bincount(dofs.ravel(), forces.ravel(), minlength=self.size)

    def matrix(self, parts: Sequence[tuple[NDArray, NDArray]]) -> sparse.csr_matrix:
        """Sum of element matrices, of symmetric ones its upper triangle.

        Parts are elements (e,) and their matrices (e, a, 3, 3, a): node and component of the row,
        component and node of the column.
        """
        data = np.zeros(len(self.pattern[0]))
        for elements, blocks in parts:
            taken = self.taken[elements]
            data += np.bincount(self.places[elements][taken], blocks[taken], minlength=len(data))
        # PARDISO wants an entry on every diagonal, and each row has one.
        return sparse.csr_matrix((data, *self.pattern), shape=(self.count, self.count))

    def solve(self, parts: Sequence[tuple[NDArray, NDArray]], load: NDArray) -> NDArray:
        """Solve for the free unknowns."""
        return self.solver.solve(self.matrix(parts), load)
