"""Ten-node mesh for one pressed point: fine at the contact, without what does not move."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from palpate.solid.boundary import support_nodes
from palpate.solid.mesh import SolidMesh, quadratic
from palpate.solid.patch import hertz_patch
from palpate.solid.refine import refine_near
from palpate.solid.sizing import Support
from palpate.solid.solve import factorise
from palpate.solid.stiffness import combined, elastic_stiffness

# Of the linear solution that tells how far a press reaches; nearly incompressible reaches farther.
REACH_POISSON_RATIO = 0.45
# Contact radius over the sphere's of that solution.
REACH_CONTACT = 0.7


def moving_nodes(
    mesh: SolidMesh,
    support: Support,
    point_m: NDArray,
    direction: NDArray,
    *,
    radius_m: float,
    share: float,
) -> NDArray:
    """Nodes that a press moves, by the linear solution with the support held.

    Parameters
    ----------
    mesh : SolidMesh
        n nodes; either order.
    support : Support
        That the solid is bonded to.
    point_m, direction : (3,) arrays
        Where the surface is pressed [m], and which way, of length 1.
    radius_m : float
        Of the sphere [m].
    share : float
        Nodes that move by less than this part of the indentation are taken as still.

    Returns
    -------
    (n,) bool array
    """
    nu, contact = REACH_POISSON_RATIO, REACH_CONTACT * radius_m
    K1, K2 = elastic_stiffness(mesh)
    held = support_nodes(
        mesh,
        plane_point_m=support.point_m,
        plane_normal=support.normal,
        tolerance_m=support.tolerance_m,
    )
    free = np.setdiff1d(
        np.arange(3 * len(mesh.nodes_m)), (3 * held[:, None] + np.arange(3)).ravel()
    )
    K = combined(K1, K2, nu / ((1 + nu) * (1 - 2 * nu)), 1 / (2 * (1 + nu)))
    load = hertz_patch(mesh, point_m, direction, direction, contact_radius_m=contact)
    u = np.zeros(load.size)
    u[free] = factorise(K[free][:, free])(load.ravel()[free])
    # Hertz: the depth of force 1 at this contact radius.
    depth = 3 * (1 - nu**2) / (4 * contact)
    return np.linalg.norm(u.reshape(-1, 3), axis=1) > share * depth


def moving_part(mesh: SolidMesh, moving: NDArray) -> tuple[NDArray, NDArray]:
    """Elements with a moving node, and which nodes of them are held because others were left out.

    Parameters
    ----------
    mesh : SolidMesh
    moving : (n,) bool array

    Returns
    -------
    elements : (m,) bool array
    still : (n,) bool array
        Nodes of elements that were left out.
    """
    elements = moving[mesh.tetrahedra].any(axis=1)
    still = np.zeros(len(mesh.nodes_m), dtype=bool)
    still[mesh.tetrahedra[~elements]] = True
    return elements, still


def fine_mesh(
    mesh: SolidMesh, point_m: NDArray, *, edge_m: float, growth: float, radius_m: float
) -> SolidMesh:
    """Ten-node elements with edges of at most `edge_m` at a point, as `refine_near` takes them."""
    return quadratic(refine_near(mesh, point_m, radius_m=radius_m, edge_m=edge_m, growth=growth))


def nearest_values(values: NDArray, from_m: NDArray, to_m: NDArray) -> NDArray:
    """Values of the nearest of the points they are given at."""
    return values[cKDTree(from_m).query(to_m)[1]]
