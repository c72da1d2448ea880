"""Error between tracked and computed deformation and force (Eq. 3.31-3.33)."""

from copy import copy
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from palpate.solid.mesh import SolidMesh
from palpate.solid.solve import factorise
from palpate.solid.stiffness import dofs, elastic_stiffness
from palpate.solid.support import Support, support_nodes

OPTIONS = ("force_displacement", "displacement")


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
class Measurement:
    """What was measured of one deformation, in the frame of the solid.

    Attributes
    ----------
    displacement_m : (n, 3) array
        Displacement of the surface nodes [m]; NaN at interior nodes.
    force_n : (n, 3) array
        Nodal forces at the contact, zero elsewhere [N].
    total_force_n : float
        Magnitude of the measured force [N].
    """

    displacement_m: NDArray
    force_n: NDArray
    total_force_n: float


class Objective:
    """Mean error per node as a function of (lam, mu) [m].

    Parameters
    ----------
    mesh : SolidMesh
    sets : NodeSets
    measurement : Measurement
    option : {"force_displacement", "displacement"}
        Both terms of Eq. 3.31, or the displacement term alone.
    left_out : int array, optional
        Surface nodes whose displacement is not compared.

    Raises
    ------
    ValueError
        If the option is unknown, a surface node has no displacement, nothing moved or pressed, or
        no node is left to compare.
    """

    def __init__(
        self,
        mesh: SolidMesh,
        sets: NodeSets,
        measurement: Measurement,
        *,
        option: str,
        left_out: NDArray | None = None,
    ) -> None:
        if option not in OPTIONS:
            raise ValueError(f"error: expected one of {', '.join(OPTIONS)}, found {option}")
        self.option, self.sets = option, sets
        self.K1, self.K2 = elastic_stiffness(mesh)
        self.surface = np.sort(np.concatenate([sets.contact, sets.free, sets.support]))
        self.u = measurement.displacement_m.copy()
        self.u[sets.support] = 0
        if not np.isfinite(self.u[self.surface]).all():
            raise ValueError("displacement: expected numbers at all surface nodes, found NaN")
        self.compared = _compared(self.surface, sets, left_out)
        self.f = measurement.force_n
        self.largest_m = float(np.linalg.norm(self.u[self.surface], axis=1).max())
        if self.largest_m == 0 or measurement.total_force_n == 0:
            raise ValueError("measurement: expected a deformation and a force, found none")
        self.force_weight = self.largest_m / measurement.total_force_n
        free = np.setdiff1d(np.arange(len(mesh.nodes_m)), sets.support)
        self.force_nodes = len(free)
        self.free_dofs, self.interior_dofs = dofs(free), dofs(sets.interior)
        self.surface_dofs = dofs(self.surface)
        self.blocks = [
            _blocks(K, self.free_dofs, self.interior_dofs, self.surface_dofs)
            for K in (self.K1, self.K2)
        ]
        # Reduced models by their settings, which objectives of the same system may have in common.
        self.displacement_models: dict = {}
        self.interior_models: dict = {}
        self.evaluations = 0

    def with_option(self, option: str) -> "Objective":
        """The same objective for another error option; both share what does not depend on it."""
        if option not in OPTIONS:
            raise ValueError(f"error: expected one of {', '.join(OPTIONS)}, found {option}")
        other = copy(self)
        other.option, other.evaluations = option, 0
        return other

    def __call__(self, lam: float, mu: float) -> float:
        """Evaluate Eq. 3.31 for the option [m]."""
        self.evaluations += 1
        error = float(self.displacement_errors(lam, mu).mean())
        if self.option == "displacement":
            return error
        return error + self.force_weight * float(self.force_errors(lam, mu).mean())

    def displacement(self, lam: float, mu: float) -> NDArray:
        """Displacement that the measured force causes, shape (n, 3) [m]."""
        u = np.zeros(self.u.size)
        K = self._combined("free", lam, mu)
        u[self.free_dofs] = factorise(K)(self.f.ravel()[self.free_dofs])
        return u.reshape(-1, 3)

    def displacement_errors(self, lam: float, mu: float) -> NDArray:
        """Mismatch of each surface node that is compared (terms of Eq. 3.33), shape (k,) [m]."""
        gap = self.displacement(lam, mu)[self.compared] - self.u[self.compared]
        return np.linalg.norm(gap, axis=1)

    def completed(self, lam: float, mu: float) -> NDArray:
        """Tracked displacement with that of interior nodes solved for (Eq. 3.30), (n, 3) [m]."""
        u = np.zeros(self.u.size)
        known = self.u[self.surface].ravel()
        u[self.surface_dofs] = known
        if len(self.interior_dofs):
            right = -self._combined("coupling", lam, mu) @ known
            u[self.interior_dofs] = factorise(self._combined("interior", lam, mu))(right)
        return u.reshape(-1, 3)

    def force_errors(self, lam: float, mu: float) -> NDArray:
        """Mismatch of the force at each node but the support's (terms of Eq. 3.32) [N]."""
        u = self.completed(lam, mu).ravel()
        f = (lam * (self.K1 @ u) + mu * (self.K2 @ u)).reshape(-1, 3)
        kept = np.setdiff1d(np.arange(len(f)), self.sets.support)
        return np.linalg.norm((f - self.f)[kept], axis=1)

    def _combined(self, name: str, lam: float, mu: float):
        return lam * self.blocks[0][name] + mu * self.blocks[1][name]


def _compared(surface: NDArray, sets: NodeSets, left_out: NDArray | None) -> NDArray:
    """Surface nodes whose displacement counts."""
    kept = surface if left_out is None else np.setdiff1d(surface, left_out)
    if not len(np.setdiff1d(kept, sets.support)):
        raise ValueError("left_out: expected surface nodes to compare off the support, found none")
    return kept


def _blocks(K, free: NDArray, interior: NDArray, surface: NDArray) -> dict:
    rows = K[interior]
    return {
        "free": K[free][:, free],
        "interior": rows[:, interior],
        "coupling": rows[:, surface],
    }
