"""Error between tracked and computed deformation and force (Eq. 3.31-3.33).

At one Poisson's ratio all separates in E: the computed displacement goes with 1/E, the computed
force with E. Reduced models give how both go with the ratio: an evaluation neither assembles nor
solves. It is about 1,000 times faster than whole solutions (`Objective.full`) of the study's 1,500
nodes, and 15,000 times of 10,000 nodes of quadratic elements.

The solution of ``(r K1 + K2) x = r b1 + b2``, with r = lam / mu, is smooth in r: a Galerkin
projection on the solutions at a few r and their derivatives there (moment matching, a rational
Krylov space) is as good as the whole system. One factorisation serves all derivatives at its r.
Diagonalised once, an evaluation costs a dozen divisions.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from palpate.solid.laws import lame_from_engineering
from palpate.solid.mesh import SolidMesh
from palpate.solid.solve import factorise
from palpate.solid.stiffness import combined, dofs, elastic_stiffness
from palpate.solid.support import Support, support_nodes
from scipy import sparse
from scipy.linalg import eigh

OPTIONS = ("force_displacement", "displacement")
# Of derivatives by a complex step, which have no rounding.
STEP = 1e-30
# Poisson's ratios for which a model is made, and what is solved at how many r.
LOWEST, HIGHEST = 0.0, 0.499
SHIFTS, MOMENTS = 3, 6
DEPENDENT = 1e-12


@dataclass(frozen=True)
class NodeSets:
    """Nodes by what is known of them; each a sorted int array, together all nodes.

    Attributes
    ----------
    contact : array
        Displacement tracked, force measured.
    free : array
        On the free surface: displacement tracked, no force.
    support : array
        On the support: no displacement, force unknown.
    interior : array
        Displacement unknown, no force.
    """

    contact: NDArray
    free: NDArray
    support: NDArray
    interior: NDArray


def node_sets(mesh: SolidMesh, support: Support, *, contact_nodes: NDArray) -> NodeSets:
    """Sort a mesh's nodes into the sets of Table 3.1.

    Parameters
    ----------
    mesh : SolidMesh
    support : Support
        Surface nodes on it are held.
    contact_nodes : int array
        Nodes that carry the contact force.

    Raises
    ------
    ValueError
        As `support_nodes` does; or if there is no contact node, or one lies off the surface or on
        the support.
    """
    surface, held = mesh.surface_nodes(), support_nodes(mesh, support)
    contact = np.unique(contact_nodes)
    inside = np.setdiff1d(contact, surface)
    if not len(contact) or len(inside):
        found = f"node {inside[0]} inside" if len(inside) else "none"
        raise ValueError(f"contact: expected nodes of the surface, found {found}")
    if np.isin(contact, held).any():
        raise ValueError("contact: expected away from the support, found on it")
    free = np.setdiff1d(surface, np.concatenate([held, contact]))
    interior = np.setdiff1d(np.arange(len(mesh.nodes_m)), surface)
    return NodeSets(contact, free, held, interior)


@dataclass(frozen=True)
class Problem:
    """What is known of one deformation, in the frame of the solid.

    Attributes
    ----------
    mesh : SolidMesh
    sets : NodeSets
    displacement_m : (n, 3) array
        Measured displacement of the surface nodes [m]; NaN at interior nodes.
    force_n : (n, 3) array
        Nodal forces at the contact, zero elsewhere [N].
    total_force_n : float
        Magnitude of the measured force [N].
    left_out : int array or None
        Nodes whose displacement is not compared.
    """

    mesh: SolidMesh
    sets: NodeSets
    displacement_m: NDArray
    force_n: NDArray
    total_force_n: float
    left_out: NDArray | None = None


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


@dataclass(frozen=True)
class Term:
    """Part of the error: a weight times the sum of the lengths of gaps E^power v(nu) - measured.

    Attributes
    ----------
    nodes : (k,) int array
    weight : float
        Metres per unit of the gaps.
    power : {-1, 1}
    columns : (3k, m) array
    factors : callable
        v(nu) = columns @ factors(nu), also for complex nu.
    measured : (k, 3) array
    """

    nodes: NDArray
    weight: float
    power: int
    columns: NDArray
    factors: Callable[[complex], NDArray]
    measured: NDArray

    def gaps(self, E: float, nu: float) -> NDArray:
        """Gaps, shape (k, 3)."""
        return E**self.power * self._rows(self.factors(nu)) - self.measured

    def slopes(self, E: float, nu: float) -> NDArray:
        """Derivatives of the gaps with respect to log E and nu, shape (k, 3, 2)."""
        by_log = self.power * self._rows(self.factors(nu))
        by_nu = self._rows(self.factors(nu + STEP * 1j).imag / STEP)
        return E**self.power * np.stack([by_log, by_nu], axis=2)

    def _rows(self, factors: NDArray) -> NDArray:
        return (self.columns @ factors).reshape(-1, 3)


class Objective:
    """Mean error per node as a function of E and nu [m].

    Parameters
    ----------
    problem : Problem
    option : {"force_displacement", "displacement"}
        Both terms of Eq. 3.31, or the displacement term alone.
    kept : dict, optional
        Stiffness and reduced models that objectives of one object, equally supported, have in
        common; what this one makes is added. Most of the time goes into making them.

    Raises
    ------
    ValueError
        If the option is unknown, a surface node has no displacement, nothing moved or pressed, or
        no node is left to compare.
    """

    def __init__(self, problem: Problem, option: str, kept: dict | None = None) -> None:
        if option not in OPTIONS:
            raise ValueError(f"error: expected one of {', '.join(OPTIONS)}, found {option}")
        self.option, self.sets, sets = option, problem.sets, problem.sets
        self.nodes_m, self._kept = problem.mesh.nodes_m, {} if kept is None else kept
        self.surface = np.sort(np.concatenate([sets.contact, sets.free, sets.support]))
        self.u, self.f = problem.displacement_m.copy(), problem.force_n
        self.u[sets.support] = 0
        if not np.isfinite(self.u[self.surface]).all():
            raise ValueError("displacement: expected numbers at all surface nodes, found NaN")
        out = np.array([], int) if problem.left_out is None else problem.left_out
        self.compared = np.setdiff1d(self.surface, out)
        if not len(np.setdiff1d(self.compared, sets.support)):
            raise ValueError(
                "left_out: expected surface nodes to compare off the support, found none"
            )
        self.largest_m = float(np.linalg.norm(self.u[self.surface], axis=1).max())
        if self.largest_m == 0 or problem.total_force_n == 0:
            raise ValueError("measurement: expected a deformation and a force, found none")
        self.free = np.setdiff1d(np.arange(len(self.nodes_m)), sets.support)
        self.force_weight = self.largest_m / problem.total_force_n / len(self.free)
        self.K1, self.K2 = self._once("stiffness", lambda: elastic_stiffness(problem.mesh))

    def __call__(self, E: float, nu: float, norm: str = "length") -> float:
        """Evaluate Eq. 3.31 for the option [m]; with norm "square" the sum of squares instead."""
        if not LOWEST - 1e-12 <= nu <= HIGHEST + 1e-12:
            return self.full(E, nu)
        squares = [(t.weight, (t.gaps(E, nu) ** 2).sum(axis=1)) for t in self.terms]
        if norm == "length":
            return float(sum(weight * np.sqrt(square).sum() for weight, square in squares))
        return float(sum(weight**2 * square.sum() for weight, square in squares))

    def full(self, E: float, nu: float) -> float:
        """Eq. 3.31 by whole solutions [m]."""
        gaps = (self.displacement(E, nu) - self.u)[self.compared]
        error = float(np.linalg.norm(gaps, axis=1).mean())
        if self.option == "displacement":
            return error
        u, (lam, mu) = self.completed(E, nu).ravel(), lame_from_engineering(E, nu)
        gaps = ((lam * (self.K1 @ u) + mu * (self.K2 @ u)).reshape(-1, 3) - self.f)[self.free]
        return error + self.force_weight * float(np.linalg.norm(gaps, axis=1).sum())

    def displacement(self, E: float, nu: float) -> NDArray:
        """Displacement that the measured force causes, shape (n, 3) [m]."""
        u, free = np.zeros(self.u.size), dofs(self.free)
        u[free] = factorise(self._stiffness(free, free, E, nu))(self.f.ravel()[free])
        return u.reshape(-1, 3)

    def completed(self, E: float, nu: float) -> NDArray:
        """Tracked displacement with that of interior nodes solved for (Eq. 3.30), (n, 3) [m]."""
        u, inside = self._tracked(), dofs(self.sets.interior)
        if len(inside):
            coupling = self._stiffness(inside, np.arange(u.size), E, nu)
            u[inside] = factorise(self._stiffness(inside, inside, E, nu))(-coupling @ u)
        return u.reshape(-1, 3)

    @cached_property
    def terms(self) -> list[Term]:
        """Terms of the error by reduced models, for nu from 0 to 0.499."""
        terms = [self._displacement_term()]
        return terms if self.option == "displacement" else [*terms, self._force_term()]

    def _displacement_term(self) -> Term:
        """Gaps of the surface; those of the support are zero, and count in the mean alone."""
        free, f = dofs(self.free), self.f.ravel()
        K1, K2 = (K[free][:, free] for K in (self.K1, self.K2))
        model = self._once(
            "load", lambda: reduced_model(K1, K2, np.zeros(len(free)), f[free]), self.f
        )
        nodes = np.setdiff1d(self.compared, self.sets.support)
        modes = model.modes[np.searchsorted(free, dofs(nodes))]

        def factors(nu: complex) -> NDArray:
            # At E = 1: mu = 1 / (2 + 2 nu).
            return 2 * (1 + nu) * model.amplitudes(lame_ratio(nu))

        return Term(nodes, 1 / len(self.compared), -1, modes, factors, self.u[nodes])

    def _force_term(self) -> Term:
        """Contact and free surface: interior forces vanish; those of the support don't count."""
        # Interior nodes follow the tracked surface (Eq. 3.30), whatever E.
        known, inside = self._tracked(), dofs(self.sets.interior)
        model = self._once("surface", lambda: self._interior_model(known, inside), known)
        modes = np.zeros((known.size, len(model.poles)))
        modes[inside] = model.modes
        nodes = np.setdiff1d(self.surface, self.sets.support)
        parts = [K[dofs(nodes)] @ np.column_stack([modes, known]) for K in (self.K1, self.K2)]

        def factors(nu: complex) -> NDArray:
            r = lame_ratio(nu)
            amplitudes = np.append(model.amplitudes(r), 1.0) / (2 * (1 + nu))
            return np.concatenate([r * amplitudes, amplitudes])

        return Term(nodes, self.force_weight, 1, np.hstack(parts), factors, self.f[nodes])

    def _interior_model(self, known: NDArray, inside: NDArray) -> ReducedModel:
        rows = [K[inside] for K in (self.K1, self.K2)]
        return reduced_model(*(K[:, inside] for K in rows), *(-K @ known for K in rows))

    def _tracked(self) -> NDArray:
        """Tracked displacement, zero inside, shape (3n,) [m]."""
        known = np.zeros_like(self.u)
        known[self.surface] = self.u[self.surface]
        return known.ravel()

    def _stiffness(self, rows: NDArray, columns: NDArray, E: float, nu: float):
        lam, mu = lame_from_engineering(E, nu)
        return combined(self.K1, self.K2, lam, mu)[rows][:, columns]

    def _once(self, name: str, make: Callable[[], Any], given: NDArray | None = None) -> Any:
        """What is kept of a mesh, and of what is given on it, or made now."""
        key = name, self.nodes_m.tobytes(), b"" if given is None else given.tobytes()
        if key not in self._kept:
            self._kept[key] = make()
        return self._kept[key]
