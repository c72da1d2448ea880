"""What a surface must be before tetrahedra can fill it."""

import numpy as np
import trimesh
from numpy.typing import NDArray

from palpate.open3d_core import o3d, scene_of

# Heights below this share of an edge are touching, not cutting.
TOUCH = 1e-9


def check_surface(vertices_m: NDArray, faces: NDArray) -> trimesh.Trimesh:
    """Hold a surface of one piece to closed and free of cuts through itself.

    Parameters
    ----------
    vertices_m, faces : (n, 3), (m, 3) arrays
        The surface [m].

    Returns
    -------
    trimesh.Trimesh
        The same surface, all triangles turned outward.

    Raises
    ------
    ValueError
        If it is open, has one side only, or cuts itself.
    """
    surface = trimesh.Trimesh(np.asarray(vertices_m, dtype=float), faces, process=False)
    if not surface.is_watertight:
        raise ValueError("surface: expected a closed one, found open edges")
    if not surface.is_winding_consistent:
        surface = _wound_alike(surface)
    if surface.volume < 0:
        surface.invert()
    pairs = cutting_triangles(surface.vertices, surface.faces)
    if len(pairs):
        raise ValueError(
            "surface: expected one that does not cut itself,"
            f" found triangles {pairs[0, 0]} and {pairs[0, 1]} that do"
        )
    return surface


def cutting_triangles(vertices_m: NDArray, faces: NDArray) -> NDArray:
    """Find all pairs of triangles of a surface that cut each other.

    Of two triangles that cut, an edge of one goes through the other. Embree lists the triangles
    on the line of each edge in single precision; each is then settled in double precision.
    Triangles that only touch, or lie in one plane, do not count.

    Parameters
    ----------
    vertices_m, faces : (n, 3), (m, 3) arrays
        The surface [m]; vertices without a triangle do not matter.

    Returns
    -------
    (k, 2) int array
        Numbers of two triangles each: one that the edge belongs to, and the one it goes through.
    """
    vertices, faces = np.asarray(vertices_m, dtype=float), np.asarray(faces)
    edges, owner = np.unique(
        np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0, return_index=True
    )
    points = vertices - vertices.mean(axis=0)
    rays = np.concatenate([points[edges[:, 0]], np.diff(points[edges], axis=1)[:, 0]], axis=1)
    answer = scene_of(points, faces).list_intersections(
        o3d.core.Tensor(rays.astype(np.float32)), nthreads=1
    )
    edge, triangle = (answer[name].numpy().astype(int) for name in ("ray_ids", "primitive_ids"))
    apart = ~(edges[edge][:, :, None] == faces[triangle][:, None]).any(axis=(1, 2))
    edge, triangle = edge[apart], triangle[apart]
    cut = _pierced(points[edges[edge]], points[faces[triangle]])
    return np.column_stack([owner[edge[cut]] // 3, triangle[cut]])


def _wound_alike(surface: trimesh.Trimesh) -> trimesh.Trimesh:
    mesh = o3d.geometry.TriangleMesh(
        o3d.utility.Vector3dVector(surface.vertices), o3d.utility.Vector3iVector(surface.faces)
    )
    if not mesh.orient_triangles():
        raise ValueError("surface: expected an inside and an outside, found one side only")
    return trimesh.Trimesh(surface.vertices, np.asarray(mesh.triangles), process=False)


def _pierced(edges: NDArray, triangles: NDArray) -> NDArray:
    """Whether each edge (k, 2, 3) goes through its triangle (k, 3, 3)."""
    a, b, c = triangles.transpose(1, 0, 2)
    p, q = edges.transpose(1, 0, 2)
    normal = np.cross(b - a, c - a)
    size = np.linalg.norm(normal, axis=1) * np.linalg.norm(q - p, axis=1)
    below, above = (((end - a) * normal).sum(axis=1) / size for end in (p, q))
    sides = [
        (np.cross(s - p, t - p) * (q - p)).sum(axis=1) / size for s, t in ((a, b), (b, c), (c, a))
    ]
    through = (np.array(sides) > TOUCH).all(axis=0) | (np.array(sides) < -TOUCH).all(axis=0)
    return (below * above < 0) & (np.minimum(abs(below), abs(above)) > TOUCH) & through
