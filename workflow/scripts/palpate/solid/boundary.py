"""Node sets of Table 3.1."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from palpate.solid.mesh import SolidMesh
from palpate.solid.support import Support


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


def support_nodes(mesh: SolidMesh, support: Support) -> NDArray:
    """Surface nodes on the plane that an object stands on, sorted.

    Raises
    ------
    ValueError
        If fewer than three nodes lie on the plane.
    """
    surface = mesh.surface_nodes()
    held = surface[support.holds(mesh.nodes_m[surface])]
    if len(held) < 3:
        nearest = np.abs(support.heights_m(mesh.nodes_m[surface])).min()
        raise ValueError(
            f"support: expected at least 3 nodes within {support.tolerance_m:g} m of its plane,"
            f" found {len(held)} (nearest {nearest:.3g} m)"
        )
    return held
