"""Where a solid mesh needs shorter edges: on what the object stands on."""

import numpy as np
import trimesh
from numpy.typing import NDArray
from skfem import MeshTet
from trimesh import triangles
from trimesh.intersections import slice_faces_plane

from palpate.solid.support import Support

# Nodes wanted on the support, so that losing one or another does not let the object tilt.
SUPPORT_NODES = 12
# Wanted edge over distance from the support, once away from it.
GROWTH = 1.0
# Area that a node takes in a lattice of regular triangles, in squared edges.
LATTICE = 3**0.5 / 2
# Most cells of the grid that the wanted edge is given on, along an axis.
CELLS = 24


def supported_area(surface: trimesh.Trimesh, support: Support) -> float:
    """Area of a surface within the support's tolerance [m^2]."""
    vertices, faces = surface.vertices, surface.faces
    for side in (support.up, -support.up):
        origin = support.plane_point_m - side * support.tolerance_m
        # Trimesh.slice_plane does the same and needs shapely.
        vertices, faces, _ = slice_faces_plane(vertices, faces, side, origin)
    return float(triangles.area(vertices[faces]).sum())


def support_edge(surface: trimesh.Trimesh, support: Support) -> float:
    """Edge with which enough nodes lie on the support [m]; infinite if the surface is off it."""
    area = supported_area(surface, support)
    return float(np.sqrt(area / (LATTICE * SUPPORT_NODES))) if area > 0 else np.inf


def edge_field(
    vertices_m: NDArray, support: Support, *, support_edge_m: float, edge_m: float
) -> dict[str, NDArray]:
    """Edges that grow from the support's to those of the rest, linear between a grid's nodes.

    Parameters
    ----------
    vertices_m : (n, 3) array
        Surface to be filled, whose box the field covers [m].
    support : Support
    support_edge_m, edge_m : float
        Edge wanted on the support, and away from it [m].

    Returns
    -------
    dict
        As `pytetwild.tetrahedralize` takes it: ``bg_vertices`` (n, 3) [m], ``bg_tets`` (m, 4) and
        the edge wanted at the nodes, ``bg_values`` (n,) [m].
    """
    low, high = vertices_m.min(axis=0) - edge_m, vertices_m.max(axis=0) + edge_m
    cells = np.clip(np.ceil((high - low) / support_edge_m), 2, CELLS).astype(int)
    grid = MeshTet.init_tensor(
        *(np.linspace(a, b, n + 1) for a, b, n in zip(low, high, cells, strict=True))
    )
    away = np.abs(support.heights_m(grid.p.T))
    wanted = np.minimum(support_edge_m + GROWTH * away, edge_m)
    return {
        "bg_vertices": np.ascontiguousarray(grid.p.T),
        "bg_tets": np.ascontiguousarray(grid.t.T, dtype=np.int32),
        "bg_values": wanted,
    }
