"""Node sets of Table 3.1."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from palpate.solid.mesh import SolidMesh


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


def node_sets(
    mesh: SolidMesh,
    *,
    contact_nodes: NDArray,
    support_plane_point_m: NDArray,
    support_plane_normal: NDArray,
    tolerance_m: float,
) -> NodeSets:
    """Sort a mesh's nodes into the sets of Table 3.1.

    Parameters
    ----------
    mesh : SolidMesh
    contact_nodes : int array
        Nodes that carry the contact force.
    support_plane_point_m, support_plane_normal : (3,) arrays
        Plane that the object rests on; surface nodes within the tolerance of it are held.
    tolerance_m : float

    Raises
    ------
    ValueError
        If fewer than three nodes lie on the support, there is no contact node, or one lies off
        the surface or on the support.
    """
    normal = np.asarray(support_plane_normal, dtype=float)
    height = (mesh.nodes_m - support_plane_point_m) @ (normal / np.linalg.norm(normal))
    surface = mesh.surface_nodes()
    support = surface[np.abs(height[surface]) <= tolerance_m]
    if len(support) < 3:
        lowest = np.abs(height[surface]).min()
        raise ValueError(
            f"support: expected at least 3 nodes within {tolerance_m:g} m of its plane,"
            f" found {len(support)} (nearest {lowest:.3g} m)"
        )
    contact = np.unique(contact_nodes)
    inside = np.setdiff1d(contact, surface)
    if not len(contact) or len(inside):
        found = f"node {inside[0]} inside" if len(inside) else "none"
        raise ValueError(f"contact: expected nodes of the surface, found {found}")
    if np.isin(contact, support).any():
        raise ValueError("contact: expected away from the support, found on it")
    free = np.setdiff1d(surface, np.concatenate([support, contact]))
    interior = np.setdiff1d(np.arange(len(mesh.nodes_m)), surface)
    return NodeSets(contact, free, support, interior)
