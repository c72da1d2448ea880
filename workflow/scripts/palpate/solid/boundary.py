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
        As `support_nodes` does; or if there is no contact node, or one lies off the surface or on
        the support.
    """
    surface = mesh.surface_nodes()
    support = support_nodes(
        mesh,
        plane_point_m=support_plane_point_m,
        plane_normal=support_plane_normal,
        tolerance_m=tolerance_m,
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


def support_nodes(
    mesh: SolidMesh, *, plane_point_m: NDArray, plane_normal: NDArray, tolerance_m: float
) -> NDArray:
    """Surface nodes on the plane that an object rests on, sorted.

    Parameters
    ----------
    mesh : SolidMesh
    plane_point_m, plane_normal : (3,) arrays
        The plane [m]; its normal of any length.
    tolerance_m : float
        How far from the plane a node may lie [m].

    Raises
    ------
    ValueError
        If the normal has no direction, or fewer than three nodes lie on the plane.
    """
    normal = np.asarray(plane_normal, dtype=float)
    length = np.linalg.norm(normal)
    if not 0 < length < np.inf:
        raise ValueError(f"support.plane_normal: expected a direction, found {normal.tolist()}")
    surface = mesh.surface_nodes()
    away = np.abs((mesh.nodes_m[surface] - plane_point_m) @ normal) / length
    held = surface[away <= tolerance_m]
    if len(held) < 3:
        raise ValueError(
            f"support: expected at least 3 nodes within {tolerance_m:g} m of its plane,"
            f" found {len(held)} (nearest {away.min():.3g} m)"
        )
    return held
