"""Where a sphere that moves along a line touches a surface first."""

import numpy as np
import trimesh
from numpy.typing import NDArray

from palpate.solid.contact_pressure import face_parts
from palpate.solid.mesh import SolidMesh, doubled_normals
from palpate.solid.stiffness import shape_values

# Faces this many radii around the sphere's line may come into touch.
AROUND = 2.2
# The surface's points in each of its triangles, by parts of an edge.
PARTS = 8


def facing_faces(
    mesh: SolidMesh, point_m: NDArray, direction: NDArray, *, radius_m: float, deepest_m: float
) -> NDArray:
    """Faces of the surface that a sphere may touch, as `surface_faces` gives them.

    Parameters
    ----------
    mesh : SolidMesh
    point_m, direction : (3,) arrays
        Line of the sphere's centre [m]; the direction has length 1.
    radius_m, deepest_m : float
        Of the sphere; how deep it goes [m].
    """
    faces = mesh.surface_faces()
    normals = doubled_normals(mesh.nodes_m, faces)
    away = mesh.nodes_m[faces[:, :3]].mean(axis=1) - point_m
    along = away @ direction
    beside = np.linalg.norm(away - along[:, None] * direction, axis=1)
    size = np.sqrt(np.linalg.norm(normals, axis=1))
    near = (beside < AROUND * radius_m + size) & (np.abs(along) < AROUND * radius_m + deepest_m)
    return faces[near & (normals @ direction < 0)]


def first_touch(
    nodes_m: NDArray, faces: NDArray, point_m: NDArray, direction: NDArray, *, radius_m: float
) -> float:
    """How far along its line a sphere's tip is from the point when it touches the surface first.

    Parameters
    ----------
    nodes_m : (n, 3) array
        [m].
    faces : (f, 3 or 6) int array
        Of the surface.
    point_m, direction : (3,) arrays
        A point of the line [m] and the direction, of length 1.
    radius_m : float
        Of the sphere [m].

    Returns
    -------
    float
        Negative where it touches before it reaches the point [m].

    Raises
    ------
    ValueError
        If it touches no face.
    """
    shapes = shape_values(face_parts(PARTS), 1 if faces.shape[1] == 3 else 2)
    places = np.matmul(shapes, nodes_m[faces]).reshape(-1, 3)
    places = np.concatenate([places, nodes_m[faces[:, :3]].reshape(-1, 3)]) - point_m
    along = places @ direction
    beside2 = (places**2).sum(axis=1) - along**2
    under = beside2 < radius_m**2
    if not under.any():
        raise ValueError("point_m: expected a surface under the sphere's way, found none")
    centre = along[under] - np.sqrt(radius_m**2 - beside2[under])
    return float(centre.min() + radius_m)


def thickness_m(mesh: SolidMesh, point_m: NDArray, direction: NDArray) -> float:
    """Length of a line's way through the solid, from where it enters first to where it leaves [m].

    Raises
    ------
    ValueError
        If the line misses the solid.
    """
    surface = trimesh.Trimesh(mesh.nodes_m, mesh.surface_triangles(), process=False)
    start = point_m - np.ptp(mesh.nodes_m, axis=0).sum() * direction
    hits, _, faces = surface.ray.intersects_location([start], [direction])
    if not len(hits):
        raise ValueError("point_m: expected a line through the solid, found one beside it")
    way, inward = (hits - point_m) @ direction, surface.face_normals[faces] @ direction < 0
    nearest = min(way[inward], key=abs)
    return float(way[~inward & (way > nearest)].min() - nearest)
