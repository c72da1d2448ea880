"""Sharp edges of a surface, near which a sensor's window holds two sides of it."""

import numpy as np
import trimesh
from numpy.typing import NDArray
from scipy.spatial import cKDTree

# Sides that turn by more are two sides; facets of smooth objects turn by less.
SHARP_RAD = np.deg2rad(60)
# Shorter creases are a scan's bumps [m].
LEAST_EXTENT_M = 0.02
# Edges are sampled at this distance [m].
SAMPLING_M = 0.001


def sharp_edge_distance(vertices_m: NDArray, faces: NDArray, points_m: NDArray) -> NDArray:
    """Distance of points from the nearest sharp edge, (n,) [m]; infinite without any.

    Parameters
    ----------
    vertices_m, faces : (v, 3), (f, 3) arrays
        Closed surface [m].
    points_m : (n, 3) array
    """
    mesh = trimesh.Trimesh(vertices_m, faces, process=False)
    sharp = _long(mesh, mesh.face_adjacency_edges[mesh.face_adjacency_angles > SHARP_RAD])
    if not len(sharp):
        return np.full(len(points_m), np.inf)
    start, end = mesh.vertices[sharp[:, 0]], mesh.vertices[sharp[:, 1]]
    count = int(np.ceil(np.linalg.norm(end - start, axis=1).max() / SAMPLING_M)) + 1
    part = np.linspace(0, 1, count)[:, None, None]
    samples = (start + part * (end - start)).reshape(-1, 3)
    return cKDTree(samples).query(points_m)[0]


def _long(mesh: trimesh.Trimesh, edges: NDArray) -> NDArray:
    """Edges that belong to a connected crease of some extent."""
    kept = [np.zeros((0, 2), dtype=int)]
    for nodes in trimesh.graph.connected_components(edges, min_len=2):
        if np.linalg.norm(np.ptp(mesh.vertices[nodes], axis=0)) >= LEAST_EXTENT_M:
            kept.append(edges[np.isin(edges[:, 0], nodes)])
    return np.concatenate(kept)
