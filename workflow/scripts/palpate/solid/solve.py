"""Sparse direct solver behind one small interface."""

from collections.abc import Callable

from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import splu


def factorise(K: sparse.spmatrix) -> Callable[[NDArray], NDArray]:
    """Factorise a symmetric positive definite matrix; the answer solves for right-hand sides."""
    factors = splu(
        sparse.csc_matrix(K),
        permc_spec="MMD_AT_PLUS_A",
        diag_pivot_thresh=0.0,
        options={"SymmetricMode": True},
    )
    return factors.solve
