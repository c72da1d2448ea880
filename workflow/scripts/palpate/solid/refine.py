"""A solid mesh made finer near a point, the same way each time."""

import logging

import numpy as np
from numpy.typing import NDArray
from skfem import MeshTet

from palpate.solid.mesh import SolidMesh, solid_mesh

# It warns of the order of the arrays that it has made itself.
logging.getLogger("skfem.mesh").setLevel(logging.ERROR)
BISECTIONS = 12
# From the centroid to a corner of a regular element, in edges.
AROUND = 0.612


def refine_near(
    mesh: SolidMesh, point_m: NDArray, *, radius_m: float, edge_m: float, growth: float = 0.0
) -> SolidMesh:
    """Bisect elements near a point until their edges are short enough.

    Parameters
    ----------
    mesh : SolidMesh
        Four-node elements.
    point_m : (3,) array
        Point [m].
    radius_m : float
        Elements whose centroid lies within this distance are refined, and elements so large that
        the point may be in them [m].
    edge_m : float
        Longest edge wanted there [m].
    growth : float, optional
        Edges may be this part of the centroid's distance from the point where that is longer.

    Returns
    -------
    SolidMesh
        Conforming; the same volume and surface.

    Raises
    ------
    ValueError
        If the elements have ten nodes, or edges stay longer after as many bisections as are tried.
    """
    if mesh.order != 1:
        raise ValueError("mesh: expected four-node elements to refine, found ten-node ones")
    for bisections in range(BISECTIONS + 1):
        corners = mesh.nodes_m[mesh.tetrahedra]
        longest = np.linalg.norm(corners[:, :, None] - corners[:, None], axis=-1).max(axis=(1, 2))
        away = np.linalg.norm(corners.mean(axis=1) - point_m, axis=1)
        near = away < np.maximum(radius_m, AROUND * longest)
        chosen = np.flatnonzero(near & (longest > np.maximum(edge_m, growth * away)))
        if not len(chosen):
            break
        if bisections == BISECTIONS:
            expected = f"at most {edge_m:g} m after {BISECTIONS} bisections"
            raise ValueError(f"edge_m: expected {expected}, found {longest[chosen].max():.3g} m")
        refined = MeshTet(*map(np.ascontiguousarray, (mesh.nodes_m.T, mesh.tetrahedra.T))).refined(
            chosen
        )
        mesh = solid_mesh(refined.p.T, refined.t.T)
    return mesh
