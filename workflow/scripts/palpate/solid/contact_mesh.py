"""Which nodes of a solid a press moves, by a linear solution."""

import numpy as np
from numpy.typing import NDArray

from palpate.solid.boundary import support_nodes
from palpate.solid.contact_pressure import contact_pressure
from palpate.solid.mesh import SolidMesh
from palpate.solid.moduli import lame_from_engineering
from palpate.solid.solve import factorise
from palpate.solid.stiffness import combined, dofs, elastic_stiffness
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
    free = np.setdiff1d(np.arange(mesh.nodes_m.size), dofs(held))
    K = combined(K1, K2, *lame_from_engineering(1.0, nu))
    load = contact_pressure(mesh, point_m, direction, direction, contact_radius_m=contact)
    u = np.zeros(load.size)
    u[free] = factorise(K[free][:, free])(load.ravel()[free])
    # Hertz: the depth of force 1 at this contact radius.
    depth = 3 * (1 - nu**2) / (4 * contact)
    return np.linalg.norm(u.reshape(-1, 3), axis=1) > share * depth
