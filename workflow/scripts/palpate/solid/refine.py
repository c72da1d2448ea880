"""A solid mesh made finer around a point, the same way each time."""

from itertools import combinations

import numpy as np
import skfem
from numpy.typing import NDArray

from palpate.solid.mesh import SolidMesh, solid_mesh

PASSES = 20


def refine_around(
    mesh: SolidMesh, point_m: NDArray, *, radius_m: float, edge_m: float, growth: float
) -> SolidMesh:
    """Bisect elements around a point until their longest edges are short enough.

    Parameters
    ----------
    mesh : SolidMesh
        Of four-node elements.
    point_m : (3,) array
        The point [m].
    radius_m : float
        Elements with a corner within it are refined [m].
    edge_m, growth : float
        Longest edge: edge_m at the point, or growth times the distance of the nearest corner from
        the point where that is more [m].

    Returns
    -------
    SolidMesh
        With the nodes of the given mesh first.

    Raises
    ------
    ValueError
        If the mesh has ten-node elements, or the passes do not suffice.
    """
    if mesh.order != 1:
        raise ValueError("mesh: expected four-node elements, found ten-node ones")
    finer = skfem.MeshTet(*map(np.ascontiguousarray, (mesh.nodes_m.T, mesh.tetrahedra.T)))
    for _ in range(PASSES):
        corners = finer.p.T[finer.t.T]
        away = np.linalg.norm(corners - point_m, axis=2).min(axis=1)
        allowed = np.maximum(edge_m, growth * away)
        chosen = np.flatnonzero((away < radius_m) & (_longest_edges(corners) > allowed))
        if not len(chosen):
            return solid_mesh(np.ascontiguousarray(finer.p.T), finer.t.T)
        finer = finer.refined(chosen)
    raise ValueError(
        f"edge_m: expected elements to be as short within {PASSES} bisections, found {edge_m:g}"
    )


def _longest_edges(corners: NDArray) -> NDArray:
    pairs = combinations(range(4), 2)
    return np.max([np.linalg.norm(corners[:, i] - corners[:, j], axis=1) for i, j in pairs], axis=0)
