"""From the tracked surface to the solid's nodes (Section 3.3.1)."""

import numpy as np
from numpy.typing import NDArray
from palpate.open3d_core import ClosestPoints
from palpate.solid.mesh import SolidMesh


def to_solid(
    template_m: NDArray, faces: NDArray, displacement_m: NDArray, mesh: SolidMesh
) -> NDArray:
    """Displacement of the solid's surface nodes, by barycentric coordinates on the template.

    Parameters
    ----------
    template_m, faces : (n, 3), (m, 3) arrays
        Undeformed template [m], in the solid's frame.
    displacement_m : (n, 3) array
        Its displacement [m].
    mesh : SolidMesh

    Returns
    -------
    (k, 3) array
        Displacement of each node of the solid [m]; NaN at interior nodes.
    """
    surface = mesh.surface_nodes()
    closest = ClosestPoints(template_m, faces)
    _, triangle, weights = closest(mesh.nodes_m[surface])
    result = np.full(mesh.nodes_m.shape, np.nan)
    result[surface] = closest.interpolate(displacement_m, triangle, weights)
    return result
