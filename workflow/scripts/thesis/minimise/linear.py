"""The iterative linear method (Section 3.3.2, Algorithm 1)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from palpate.solid.laws import engineering_from_lame
from palpate.solid.solve import factorise
from palpate.solid.stiffness import dofs, elastic_stiffness

from thesis.minimise.objective import Problem

# Both halves of an iteration are singular when the moduli have fallen to nothing.
COLLAPSED = 1e-12


@dataclass(frozen=True)
class LinearEstimate:
    """Result of the linear method; nothing keeps it physical.

    Attributes
    ----------
    lame_lambda_pa, lame_mu_pa : float
        May be negative.
    youngs_modulus_pa, poisson_ratio : float
        The same as E and nu.
    residual_n : float
        Norm of K u - f over all nodes (Eq. 3.26) [N].
    iterations : int
    converged : bool
        Whether the moduli's change fell below the tolerance.
    trace : tuple of dict
        The start and each iteration: iteration, lame_lambda_pa, lame_mu_pa, residual_n.
    """

    lame_lambda_pa: float
    lame_mu_pa: float
    youngs_modulus_pa: float
    poisson_ratio: float
    residual_n: float
    iterations: int
    converged: bool
    trace: tuple[dict, ...]


class LinearSystem:
    """Equations 3.26 and 3.30 for one deformation.

    Parameters
    ----------
    problem : Problem
        Displacements inside and on the support are not read.

    Raises
    ------
    ValueError
        If a set that the equations need is empty, or a known value is no number.
    """

    def __init__(self, problem: Problem) -> None:
        sets = problem.sets
        for name in ("interior", "support", "contact"):
            if not len(getattr(sets, name)):
                raise ValueError(f"{name}: expected at least one node, found none")
        known = np.concatenate([sets.contact, sets.free])
        if not np.isfinite(problem.displacement_m[known]).all():
            raise ValueError("displacement: expected numbers at contact and free nodes, found NaN")
        if not np.isfinite(problem.force_n).all():
            raise ValueError("force: expected numbers at all nodes, found NaN")
        if not np.abs(problem.force_n[sets.contact]).max() > 0:
            raise ValueError("force: expected a load on the contact nodes, found none")
        self.K1, self.K2 = elastic_stiffness(problem.mesh)
        self.u = problem.displacement_m.copy()
        self.u[sets.support] = self.u[sets.interior] = 0
        self.u, self.f = self.u.ravel(), problem.force_n.astype(float).ravel()
        self.inside, self.held = dofs(sets.interior), dofs(sets.support)
        self.rows = np.setdiff1d(np.arange(self.u.size), self.held)
        self._parts = [
            (K[self.rows][:, self.inside], K[self.rows] @ self.u) for K in (self.K1, self.K2)
        ]

    def fill_in(self, lam: float, mu: float) -> tuple[NDArray, NDArray]:
        """Displacements u (n, 3) [m] and forces f (n, 3) [N] with the unknown ones by Eq. 3.30.

        A support force stands in the rows of its own node alone, so least squares over all rows
        fits it exactly, and what is left is least squares over the other rows for the interior.
        """
        (A1, b1), (A2, b2) = self._parts
        A, b = lam * A1 + mu * A2, self.f[self.rows] - lam * b1 - mu * b2
        u, f = self.u.copy(), self.f.copy()
        # Normal equations; a step of refinement gives back the digits that A'A costs.
        solve = factorise(A.T @ A)
        x = solve(A.T @ b)
        u[self.inside] = x + solve(A.T @ (b - A @ x))
        f[self.held] = (lam * (self.K1[self.held] @ u)) + mu * (self.K2[self.held] @ u)
        return u.reshape(-1, 3), f.reshape(-1, 3)

    def moduli(self, u: NDArray, f: NDArray) -> tuple[float, float, float]:
        """Lame parameters [Pa] that fit given u and f best (Eq. 3.26), and the residual [N]."""
        columns = np.stack([self.K1 @ u.ravel(), self.K2 @ u.ravel()], axis=1)
        lame = np.linalg.lstsq(columns, f.ravel(), rcond=None)[0]
        residual = np.linalg.norm(columns @ lame - f.ravel())
        return float(lame[0]), float(lame[1]), float(residual)


def linear_method(
    problem: Problem, *, start: tuple[float, float], iterations: int, tolerance: float
) -> LinearEstimate:
    """Estimate the Lame parameters by Algorithm 1.

    Each half of an iteration is linear least squares for the residual of Eq. 3.20: for the
    interior displacements and support forces, and for lambda and mu. Assumes exact displacements
    of the surface: their errors reach the forces through K, and smaller moduli make them smaller.

    Parameters
    ----------
    problem : Problem
    start : (float, float)
        First lambda and mu [Pa].
    iterations : int
        At most so many.
    tolerance : float
        Relative change of (lambda, mu) that ends them.

    Returns
    -------
    LinearEstimate

    Raises
    ------
    ValueError
        If the start is not positive, or as `LinearSystem`.
    """
    if not all(np.isfinite(value) and value > 0 for value in start):
        raise ValueError(
            f"start: expected positive lambda and mu, found {start[0]:g}, {start[1]:g}"
        )
    system = LinearSystem(problem)
    lam, mu = (float(value) for value in start)
    u, f = (values.ravel() for values in system.fill_in(lam, mu))
    residual = float(np.linalg.norm(lam * (system.K1 @ u) + mu * (system.K2 @ u) - f))
    trace = [(lam, mu, residual)]
    converged = False
    while not converged and len(trace) <= iterations and np.hypot(lam, mu) > COLLAPSED * start[1]:
        before = np.array([lam, mu])
        lam, mu, residual = system.moduli(*system.fill_in(lam, mu))
        trace.append((lam, mu, residual))
        change = np.linalg.norm(np.array([lam, mu]) - before)
        converged = bool(change <= tolerance * np.linalg.norm(before))
    names = ("lame_lambda_pa", "lame_mu_pa", "residual_n")
    steps = tuple(
        {"iteration": k} | dict(zip(names, step, strict=True)) for k, step in enumerate(trace)
    )
    E, nu = engineering_from_lame(lam, mu)
    return LinearEstimate(lam, mu, E, nu, residual, len(trace) - 1, converged, steps)
