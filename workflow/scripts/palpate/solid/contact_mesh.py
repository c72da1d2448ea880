"""Ten-node mesh for one pressed point: fine at the contact, without what does not move."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from palpate.solid.boundary import support_nodes
from palpate.solid.contact_pressure import contact_pressure
from palpate.solid.mesh import SolidMesh
from palpate.solid.moduli import lame_from_engineering
from palpate.solid.refine import refine_near
from palpate.solid.solve import factorise
from palpate.solid.stiffness import combined, elastic_stiffness
from palpate.solid.support import Support

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
    held = support_nodes(mesh, support)
    free = np.setdiff1d(
        np.arange(3 * len(mesh.nodes_m)), (3 * held[:, None] + np.arange(3)).ravel()
    )
    K = combined(K1, K2, *lame_from_engineering(1.0, nu))
    load = contact_pressure(mesh, point_m, direction, direction, contact_radius_m=contact)
    u = np.zeros(load.size)
    u[free] = factorise(K[free][:, free])(load.ravel()[free])
    # Hertz: the depth of force 1 at this contact radius.
    depth = 3 * (1 - nu**2) / (4 * contact)
    return np.linalg.norm(u.reshape(-1, 3), axis=1) > share * depth


@dataclass(frozen=True)
class Fineness:
    """How fine a mesh is around a point.

    Attributes
    ----------
    point_m : (3,) array
        [m].
    radius_m : float
        Elements within it are refined [m].
    edge_m, growth : float
        Longest edges at the point [m], or this part of the distance from it.
    """

    point_m: NDArray
    radius_m: float
    edge_m: float
    growth: float

    def holds(self, points_m: NDArray) -> NDArray:
        """Which of points (k, 3) lie within its radius, as a mask (k,)."""
        return np.linalg.norm(points_m - self.point_m, axis=1) < self.radius_m


def fine_mesh(mesh: SolidMesh, places: tuple[Fineness, ...]) -> SolidMesh:
    """Four-node elements refined at places, as `refine_near` does it."""
    for place in places:
        mesh = refine_near(
            mesh,
            place.point_m,
            radius_m=place.radius_m,
            edge_m=place.edge_m,
            growth=place.growth,
        )
    return mesh


def base_m(mesh: SolidMesh, support: Support) -> NDArray:
    """Middle of the surface nodes that are nearest to the support, (3,) [m]."""
    nodes = mesh.nodes_m[mesh.surface_nodes()]
    heights = support.heights_m(nodes)
    return nodes[heights <= heights.min() + support.tolerance_m].mean(axis=0)


def moving_elements(whole: SolidMesh, coarse: SolidMesh, moving: NDArray) -> NDArray:
    """Elements of a finer mesh with a node whose nearest one of a coarser mesh moves, (m,) bool."""
    nearest = cKDTree(coarse.nodes_m).query(whole.nodes_m)[1]
    return moving[nearest][whole.tetrahedra].any(axis=1)
