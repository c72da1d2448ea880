"""The objective of Eq. 3.31 by reduced models: the same error, thousands of times faster."""

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray
from palpate.solid.laws import poisson_ratio
from palpate.solid.stiffness import dofs

from thesis.minimise.objective import Objective
from thesis.minimise.reduced import SHIFTS, ReducedModel, reduced_model

# Relative error of displacements in the energy norm that a fit may carry.
TOLERANCE = 1e-5


class ReducedObjective:
    """Mean error per node as a function of (lam, mu) [m], and its derivatives.

    Parameters
    ----------
    full : Objective
        What is reduced; moduli outside of the range are left to it.
    poisson_ratios : (float, float)
        Range of the reduced models.
    shifts : int
        Factorisations that each of them takes.
    """

    def __init__(
        self,
        full: Objective,
        *,
        poisson_ratios: tuple[float, float] = (0.0, 0.499),
        shifts: int = SHIFTS,
    ) -> None:
        self.full, self.option = full, full.option
        self.poisson_ratios, self.shifts = poisson_ratios, shifts
        self.evaluations = 0
        settings = {"poisson_ratios": poisson_ratios, "shifts": shifts}
        model = _kept(full.displacement_models, _displacement_model, full, settings)
        self.models = {"displacement": model}
        self._terms = [_displacement_term(full, self.models["displacement"])]
        if self.option == "force_displacement":
            model = _kept(full.interior_models, _interior_model, full, settings)
            self.models["interior"] = model
            self._terms.append(_force_term(full, self.models["interior"]))

    def __call__(self, lam: float, mu: float) -> float:
        """Evaluate Eq. 3.31 for the option [m]."""
        self.evaluations += 1
        if not self.holds(lam, mu):
            return self.full(lam, mu)
        return sum(term.error(lam, mu) for term in self._terms)

    def holds(self, lam: float, mu: float) -> bool:
        """Whether moduli lie in the range of the reduced models."""
        low, high = self.poisson_ratios
        return mu > 0 and low - 1e-12 <= poisson_ratio(lam, mu) <= high + 1e-12

    def gaps(self, lam: float, mu: float) -> list[tuple[float, NDArray, NDArray]]:
        """Terms of the error with their derivatives.

        Returns
        -------
        list of (weight, gap, derivative)
            The error is the sum over terms of the weight [m per unit of the gap] times the sum of
            the lengths of the gaps (k, 3); derivatives (k, 3, 2) with respect to lam and mu [1/Pa].
        """
        return [(term.weight, *term.gap(lam, mu)) for term in self._terms]

    @property
    def node_sets(self) -> list[NDArray]:
        """Nodes of the rows of each term."""
        return [term.nodes for term in self._terms]

    def error_bounds(self, moduli_pa: ArrayLike) -> NDArray:
        """Largest bound of the models' relative errors in the energy norm at (k, 2) moduli."""
        return np.max(
            [model.error_bounds(moduli_pa) for model in self.models.values() if model], axis=0
        )


class _Term:
    """Sum of lengths of gaps that are linear in functions of (lam, mu)."""

    def __init__(self, columns: NDArray, weight: float, nodes: NDArray, model: ReducedModel):
        # Axis by axis: the squares of the components then add up row by row.
        count = len(nodes)
        order = np.arange(3 * count).reshape(count, 3).T.ravel()
        self._columns = np.asfortranarray(columns[order])
        self.weight, self.nodes, self.model = weight, nodes, model

    def error(self, lam: float, mu: float) -> float:
        gap = (self._columns @ self.factors(lam, mu)).reshape(3, -1)
        return self.weight * float(np.sqrt((gap * gap).sum(axis=0)).sum())

    def gap(self, lam: float, mu: float) -> tuple[NDArray, NDArray]:
        count = len(self.nodes)
        gap = self._columns @ self.factors(lam, mu)
        slope = self._columns @ self.factor_derivatives(lam, mu)
        return gap.reshape(3, count).T, slope.reshape(3, count, 2).transpose(1, 0, 2)


class _DisplacementTerm(_Term):
    """Columns [modes, measured displacement]."""

    def factors(self, lam: float, mu: float) -> NDArray:
        return np.append(self.model.amplitudes(lam, mu), -1.0)

    def factor_derivatives(self, lam: float, mu: float) -> NDArray:
        return np.vstack([self.model.amplitude_derivatives(lam, mu), np.zeros((1, 2))])


class _ForceTerm(_Term):
    """Columns [K1 modes, K2 modes, K1 u, K2 u, measured force], u as tracked."""

    def factors(self, lam: float, mu: float) -> NDArray:
        c = self.model.amplitudes(lam, mu) if self.model else np.zeros(0)
        return np.concatenate([lam * c, mu * c, [lam, mu, -1.0]])

    def factor_derivatives(self, lam: float, mu: float) -> NDArray:
        constant = np.vstack([np.eye(2), np.zeros((1, 2))])
        if not self.model:
            return constant
        c = self.model.amplitudes(lam, mu)[:, None]
        slope = self.model.amplitude_derivatives(lam, mu)
        first, second = lam * slope + c * [1.0, 0.0], mu * slope + c * [0.0, 1.0]
        return np.vstack([first, second, constant])


def _kept(models: dict, make: Callable, full: Objective, settings: dict) -> ReducedModel | None:
    """A model that the objective has already, or a new one."""
    key = tuple(settings.values())
    if key not in models:
        models[key] = make(full, settings)
    return models[key]


def _displacement_model(full: Objective, settings: dict) -> ReducedModel:
    A1, A2 = (block["free"] for block in full.blocks)
    return reduced_model(A1, A2, load=full.f.ravel()[full.free_dofs], **settings)


def _displacement_term(full: Objective, model: ReducedModel) -> _Term:
    """Gaps of the surface; those of the support are zero, and count in the mean alone."""
    nodes = np.setdiff1d(full.compared, full.sets.support)
    modes = np.zeros((full.u.size, len(model.poles)))
    modes[full.free_dofs] = model.modes
    columns = np.column_stack([modes, full.u.ravel()])[dofs(nodes)]
    return _DisplacementTerm(columns, 1 / len(full.compared), nodes, model)


def _interior_model(full: Objective, settings: dict) -> ReducedModel | None:
    """Interior nodes under the tracked displacement of the surface (Eq. 3.30)."""
    if not len(full.interior_dofs):
        return None
    known = full.u.ravel()[full.surface_dofs]
    loads = [-block["coupling"] @ known for block in full.blocks]
    A1, A2 = (block["interior"] for block in full.blocks)
    return reduced_model(A1, A2, lam_load=loads[0], mu_load=loads[1], **settings)


def _force_term(full: Objective, model: ReducedModel | None) -> _Term:
    """Contact and free surface: interior forces vanish, and those of the support do not count."""
    nodes = np.setdiff1d(full.surface, full.sets.support)
    rows = dofs(nodes)
    known = np.zeros(full.u.size)
    known[full.surface_dofs] = full.u.ravel()[full.surface_dofs]
    stiffness = [K[rows] for K in (full.K1, full.K2)]
    modes = np.zeros((full.u.size, len(model.poles) if model else 0))
    if model:
        modes[full.interior_dofs] = model.modes
    parts = [K @ modes for K in stiffness]
    parts += [(K @ known)[:, None] for K in stiffness]
    columns = np.hstack([*parts, full.f.ravel()[rows][:, None]])
    return _ForceTerm(columns, full.force_weight / full.force_nodes, nodes, model)
