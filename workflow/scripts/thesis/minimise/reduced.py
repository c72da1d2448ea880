"""Solutions for all Poisson's ratios from three factorisations.

The solution of ``(r K1 + K2) x = r b1 + b2``, with r = lam / mu, is smooth in r: a Galerkin
projection on the solutions at a few r and their derivatives there (moment matching, a rational
Krylov space) is as good as the whole system. One factorisation serves all derivatives at its r.
Diagonalised once, an evaluation costs a dozen divisions.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from palpate.solid.solve import factorise
from palpate.solid.stiffness import combined
from scipy import sparse
from scipy.linalg import eigh

# Poisson's ratios for which a model is made, and what is solved at how many r.
LOWEST, HIGHEST = 0.0, 0.499
SHIFTS, MOMENTS = 3, 6
DEPENDENT = 1e-12


def lame_ratio(nu: complex) -> complex:
    """Ratio lam / mu."""
    return 2 * nu / (1 - 2 * nu)


@dataclass(frozen=True)
class ReducedModel:
    """Diagonal model with k modes of a system of n unknowns.

    Attributes
    ----------
    modes : (n, k) array
        Columns U with U' K2 U = 1 and U' K1 U = diag(poles).
    poles, lam_load, mu_load : (k,) arrays
        The last two are U' b1 and U' b2.
    """

    modes: NDArray
    poles: NDArray
    lam_load: NDArray
    mu_load: NDArray

    def amplitudes(self, r: complex) -> NDArray:
        """Amplitude of each mode, shape (k,)."""
        return (r * self.lam_load + self.mu_load) / (r * self.poles + 1)


def reduced_model(
    K1: sparse.csr_matrix, K2: sparse.csr_matrix, b1: NDArray, b2: NDArray
) -> ReducedModel:
    """Build the model of ``(r K1 + K2) x = r b1 + b2`` for Poisson's ratios up to 0.499.

    Parameters
    ----------
    K1, K2 : (n, n) sparse matrices
        With the same entries; K2 positive definite.
    b1, b2 : (n,) arrays
    """
    if not len(b2):
        return ReducedModel(np.zeros((0, 0)), *np.zeros((3, 0)))
    # Chebyshev's points in log(1 + r).
    places = (1 - np.cos(np.pi * (np.arange(SHIFTS) + 0.5) / SHIFTS)) / 2
    solve, columns = None, []
    for r in np.expm1(places * np.log1p(lame_ratio(HIGHEST))):
        K = combined(K1, K2, r, 1.0)
        solve = solve.refactorise(K) if solve else factorise(K)
        right = r * b1 + b2
        for moment in range(MOMENTS):
            x = solve(right)
            size = np.linalg.norm(x)
            if size == 0:
                break
            columns.append(x / size)
            right = K1 @ columns[-1] if moment else b1 - K1 @ x
    V, s, _ = np.linalg.svd(np.column_stack(columns), full_matrices=False)
    V = V[:, s > DEPENDENT * s[0]]
    poles, Q = eigh(V.T @ (K1 @ V), V.T @ (K2 @ V))
    U = V @ Q
    return ReducedModel(U, poles, U.T @ b1, U.T @ b2)
