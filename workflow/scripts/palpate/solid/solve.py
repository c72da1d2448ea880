"""Sparse direct solvers behind one small interface.

PARDISO of MKL is faster than SciPy's SuperLU at all sizes that occur here; SuperLU stays for
machines without MKL. The two agree to about 1e-13.
"""

import weakref
from collections.abc import Callable
from copy import copy
from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import splu

try:
    from palpate.mkl import SETTINGS, PyPardisoError, PyPardisoSolver
except ImportError:  # no MKL on this machine
    SETTINGS, PyPardisoSolver, PyPardisoError = (), None, RuntimeError

# MKL PARDISO: real, symmetric, positive definite; what a call does.
POSITIVE_DEFINITE = 2
ANALYSE, FACTORISE, SOLVE = 11, 22, 33


def factorise(K: sparse.spmatrix) -> Callable[[NDArray], NDArray]:
    """Factorise a symmetric positive definite matrix.

    Parameters
    ----------
    K : (n, n) sparse matrix

    Returns
    -------
    SuperLUFactors or PardisoFactors
        Called with right-hand sides (n,) or (n, k), gives the solutions; ``refactorise(K)``
        factorises another matrix with the same entries in its place.

    Raises
    ------
    ValueError
        If the matrix isn't square or not positive definite.
    """
    if K.shape[0] != K.shape[1]:
        raise ValueError(f"K: expected a square matrix, found shape {K.shape}")
    return SuperLUFactors(K) if PyPardisoSolver is None else PardisoFactors(K)


@cache
def _loaded() -> "PyPardisoSolver":
    solver = PyPardisoSolver(mtype=POSITIVE_DEFINITE)
    # The same bytes need the same number of threads.
    solver.libmkl.MKL_Set_Num_Threads_Local(1)
    return solver


def _new_solver() -> "PyPardisoSolver":
    """Handle of its own on the library, which takes the wrapper most of a second to find."""
    solver = copy(_loaded())
    for name in ("pt", "iparm", "perm"):
        setattr(solver, name, np.zeros_like(getattr(solver, name)))
    solver.iparm[: len(SETTINGS)] = SETTINGS
    return solver


class SuperLUFactors:
    """Factors of SciPy's SuperLU, ordered for symmetric matrices and without pivoting.

    Parameters
    ----------
    K : (n, n) sparse matrix
        Symmetric positive definite.
    """

    def __init__(self, K: sparse.spmatrix) -> None:
        self.refactorise(K)

    def __call__(self, right: NDArray) -> NDArray:
        """Solutions of right-hand sides of shape (n,) or (n, k)."""
        return self._factors.solve(np.asarray(right, dtype=float))

    def refactorise(self, K: sparse.spmatrix) -> "SuperLUFactors":
        """Take another matrix."""
        try:
            self._factors = splu(
                sparse.csc_matrix(K),
                permc_spec="MMD_AT_PLUS_A",
                diag_pivot_thresh=0.0,
                options={"SymmetricMode": True},
            )
        except RuntimeError as error:
            raise ValueError(f"K: expected a regular matrix, found: {error}") from None
        # Pivots are the diagonal's own: one that is not above 0 tells, as PARDISO would.
        if not (self._factors.U.diagonal() > 0).all():
            raise ValueError("K: expected a positive definite matrix, found a pivot not above 0")
        return self


class PardisoFactors:
    """Cholesky factors of MKL's PARDISO, on one thread.

    Parameters
    ----------
    K : (n, n) sparse matrix
        Symmetric positive definite.
    """

    def __init__(self, K: sparse.spmatrix) -> None:
        K = self._sorted(K)
        rows = np.repeat(np.arange(K.shape[0]), np.diff(K.indptr))
        self._upper = K.indices >= rows
        self._pattern = K.indptr, K.indices
        upper = np.bincount(rows[self._upper], minlength=K.shape[0])
        self._entries = K.indices[self._upper], np.concatenate([[0], np.cumsum(upper)])
        self._mkl = _new_solver()
        self._release = weakref.finalize(self, self._mkl.free_memory, everything=True)
        self._release.atexit = False
        self._factorise(K, ANALYSE, FACTORISE)

    def __call__(self, right: NDArray) -> NDArray:
        """Solutions of right-hand sides of shape (n,) or (n, k)."""
        right = np.asfortranarray(right, dtype=float)
        if right.shape[0] != self._matrix.shape[0]:
            raise ValueError(
                f"right: expected {self._matrix.shape[0]} rows, found {right.shape[0]}"
            )
        return self._run(SOLVE, right)

    def refactorise(self, K: sparse.spmatrix) -> "PardisoFactors":
        """Take another matrix with the same entries: their order is not sought again."""
        K = self._sorted(K)
        if not all(map(np.array_equal, (K.indptr, K.indices), self._pattern)):
            raise ValueError("K: expected the entries of the first matrix, found others")
        self._factorise(K, FACTORISE)
        return self

    @staticmethod
    def _sorted(K: sparse.spmatrix) -> sparse.csr_matrix:
        K = sparse.csr_matrix(K, dtype=float)
        if not K.has_sorted_indices:
            K = K.sorted_indices()
        return K

    def _factorise(self, K: sparse.csr_matrix, *phases: int) -> None:
        self._matrix = sparse.csr_matrix((K.data[self._upper], *self._entries), shape=K.shape)
        if not (self._matrix.diagonal() > 0).all():
            raise ValueError("K: expected a positive definite matrix, found a diagonal not above 0")
        try:
            for phase in phases:
                self._run(phase, np.zeros((K.shape[0], 1)))
        except PyPardisoError as error:
            raise ValueError(f"K: expected a positive definite matrix, found: {error}") from None

    def _run(self, phase: int, right: NDArray) -> NDArray:
        # The wrapper's own methods repeat the analysis and hold the matrix to the last one.
        self._mkl.set_phase(phase)
        return self._mkl._call_pardiso(self._matrix, right)
