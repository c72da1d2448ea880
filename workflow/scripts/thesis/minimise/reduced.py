"""Reduced model of a system that depends on the Lame parameters linearly.

The solution of ``(lam A1 + mu A2) x = lam b1 + mu b2 + f`` depends, up to scale, on the ratio
``r = lam / mu`` alone, and smoothly: a Galerkin projection on the solutions at a few ratios and
their derivatives there (moment matching, a rational Krylov space) is as good as the full solve. One
factorisation serves all derivatives at its ratio. Diagonalised once, an evaluation costs a dozen
divisions.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from palpate.solid.solve import factorise
from palpate.solid.stiffness import combined
from scipy import sparse
from scipy.linalg import eigh

SHIFTS, MOMENTS = 3, 6
# (tr e)^2 <= 3 e:e, hence x' A1 x <= 3/2 x' A2 x for the matrices of Eq. 3.21 and 3.22.
LARGEST_POLE = 1.5
DEPENDENT = 1e-12
# Where log(1 + lam / mu) still exists with room to spare.
LEAST_POISSON_RATIO = -0.4


def lame_ratio(nu: float) -> float:
    """Ratio lam / mu."""
    return 2 * nu / (1 - 2 * nu)


@dataclass(frozen=True)
class ReducedModel:
    """Diagonal model with k modes of a system of n unknowns.

    Attributes
    ----------
    modes : (n, k) array
        Columns U with U' A2 U = 1 and U' A1 U = diag(poles).
    poles : (k,) array
        From 0 to 3/2.
    lam_load, mu_load, load : (k,) arrays
        U' b1, U' b2 and U' f.
    system : tuple
        A1, A2, b1, b2, f.
    shift : float
        A ratio lam / mu of the model.
    solve : callable
        Solver of shift A1 + A2.
    """

    modes: NDArray
    poles: NDArray
    lam_load: NDArray
    mu_load: NDArray
    load: NDArray
    system: tuple
    shift: float
    solve: Callable[[NDArray], NDArray]

    def amplitudes(self, lam: float, mu: float) -> NDArray:
        """Amplitude of each mode, shape (k,)."""
        return (lam * self.lam_load + mu * self.mu_load + self.load) / (lam * self.poles + mu)

    def amplitude_derivatives(self, lam: float, mu: float) -> NDArray:
        """Derivatives of the amplitudes with respect to lam and mu, shape (k, 2) [1/Pa]."""
        stiffness = lam * self.poles + mu
        c = self.amplitudes(lam, mu)
        return np.column_stack(
            [(self.lam_load - c * self.poles) / stiffness, (self.mu_load - c) / stiffness]
        )

    def solution(self, lam: float, mu: float) -> NDArray:
        """Unknowns, shape (n,)."""
        return self.modes @ self.amplitudes(lam, mu)

    def error_bounds(self, moduli_pa: ArrayLike) -> NDArray:
        """Bounds on the relative error of solutions in the energy norm, shape (k,).

        The residual is measured in the inverse of K at the model's middle ratio, which bounds the
        inverse of K(lam, mu) since the poles of the system lie between 0 and 3/2: no further
        factorisation, and one solve for all. They hold for all stable moduli, also outside of the
        model's range.

        Parameters
        ----------
        moduli_pa : (k, 2) array
            lam and mu [Pa].

        Raises
        ------
        ValueError
            If the moduli are not those of a stable solid.
        """
        places = np.asarray(moduli_pa, dtype=float)
        lam, mu = places.T
        least = np.minimum(mu, (lam * LARGEST_POLE + mu) / (self.shift * LARGEST_POLE + 1))
        if not (least > 0).all():
            found = ", ".join(f"{value:g}" for value in places[np.argmin(least)])
            raise ValueError(f"moduli: expected those of a stable solid, found {found}")
        A1, A2, b1, b2, f = self.system
        X = np.column_stack([self.solution(*place) for place in places])
        KX = (A1 @ X) * lam + (A2 @ X) * mu
        residuals = np.outer(b1, lam) + np.outer(b2, mu) + f[:, None] - KX
        squares = np.sum(residuals * self.solve(residuals), axis=0) / least
        return np.sqrt(np.maximum(squares, 0.0) / np.sum(X * KX, axis=0))


def reduced_model(
    A1: sparse.spmatrix,
    A2: sparse.spmatrix,
    *,
    lam_load: NDArray | None = None,
    mu_load: NDArray | None = None,
    load: NDArray | None = None,
    poisson_ratios: tuple[float, float] = (0.0, 0.499),
    shifts: int = SHIFTS,
    moments: int = MOMENTS,
) -> ReducedModel:
    """Build the reduced model of ``(lam A1 + mu A2) x = lam b1 + mu b2 + f``.

    Parameters
    ----------
    A1, A2 : (n, n) sparse matrices
        Parts of the stiffness, A2 positive definite.
    lam_load, mu_load, load : (n,) arrays, optional
        b1, b2 and f; zero by default.
    poisson_ratios : (float, float)
        Range in which the model is made to hold.
    shifts : int
        Number of ratios, at Chebyshev's points in log(1 + r), each with one factorisation.
    moments : int
        Solution and derivatives taken at each ratio.

    Raises
    ------
    ValueError
        If there is no load, or the range does not belong to stable solids.
    """
    n = A1.shape[0]
    loads = (lam_load, mu_load, load)
    b1, b2, f = (np.zeros(n) if b is None else np.asarray(b, float) for b in loads)
    if not any(np.any(b) for b in (b1, b2, f)):
        raise ValueError("load: expected a load that is not zero, found zero")
    # By amplitude r b1 + b2 and f are apart: f stands beside moduli of any size.
    solve, columns, zero = None, [], np.zeros(n)
    for r in (ratios := _ratios(poisson_ratios, shifts)):
        K = combined(A1, A2, r, 1.0)
        solve = solve.refactorise(K) if solve else factorise(K)
        columns += [x for b in ((b1, b2), (zero, f)) for x in _moments(A1, *b, r, solve, moments)]
    V = _orthonormal(columns)
    poles, Q = eigh(V.T @ (A1 @ V), V.T @ (A2 @ V))
    U = V @ Q
    return ReducedModel(
        modes=U,
        poles=poles,
        lam_load=U.T @ b1,
        mu_load=U.T @ b2,
        load=U.T @ f,
        system=(A1, A2, b1, b2, f),
        shift=float(ratios[-1]),
        solve=solve,
    )


def _ratios(poisson_ratios: tuple[float, float], count: int) -> NDArray:
    """Chebyshev's points in log(1 + r), the middle one last: its factors are kept."""
    low, high = poisson_ratios
    if not LEAST_POISSON_RATIO < low < high < 0.5:
        expected = f"{LEAST_POISSON_RATIO} < low < high < 0.5"
        raise ValueError(f"poisson_ratios: expected {expected}, found {low}, {high}")
    ends = np.log1p([lame_ratio(low), lame_ratio(high)])
    middle, half = ends.mean(), np.diff(ends)[0] / 2
    points = middle - half * np.cos(np.pi * (np.arange(count) + 0.5) / count)
    return np.expm1(points[np.argsort(-np.abs(points - middle), kind="stable")])


def _moments(
    A1: sparse.spmatrix, b1: NDArray, b2: NDArray, r: float, solve: Callable, count: int
) -> list[NDArray]:
    """Directions of the solution at mu = 1, lam = r, and of its derivatives with respect to r."""
    if not (np.any(b1) or np.any(b2)):
        return []
    x = solve(r * b1 + b2)
    columns, slope = [x], b1 - A1 @ x
    for _ in range(count - 1):
        x = solve(slope)
        size = np.linalg.norm(x)
        if size == 0:
            break
        columns.append(x / size)
        slope = A1 @ columns[-1]
    return columns


def _orthonormal(columns: list[NDArray]) -> NDArray:
    scaled = np.column_stack([c / np.linalg.norm(c) for c in columns if np.any(c)])
    V, s, _ = np.linalg.svd(scaled, full_matrices=False)
    return V[:, s > DEPENDENT * s[0]]
