"""Rigid obstacles that a solid's surface may touch: first touch, penalty energy and its slopes."""

from dataclasses import dataclass

import numpy as np
import trimesh
from numpy.typing import NDArray

from palpate.solid.load import face_parts
from palpate.solid.mesh import SolidMesh, at_nodes, doubled_normals
from palpate.solid.stiffness import shape_values

# Pressure per penetration, and shear per sliding, over Young's modulus [1/m].
PENALTY_PER_M = 3e4
# Faces this many radii around the sphere's line may come into touch.
AROUND = 2.2
# The surface's points in each of its triangles, by parts of an edge.
PARTS = 8


@dataclass(frozen=True)
class SurfacePoints:
    """Quadrature points on faces of a solid's surface.

    Attributes
    ----------
    faces : (f, 6) int array
        Nodes of the faces.
    shapes : (q, 6) array
        Shape functions at the points of a face.
    areas_m2 : (f, q) array
        Undeformed area of each point [m^2].
    """

    faces: NDArray
    shapes: NDArray
    areas_m2: NDArray

    def places(self, x: NDArray) -> NDArray:
        """Where the points are at node positions x (n, 3), shape (f, q, 3) [m]."""
        return np.matmul(self.shapes, x[self.faces])


def surface_points(mesh: SolidMesh, faces: NDArray, *, parts: int) -> SurfacePoints:
    """Quadrature points on faces, each cut into parts^2 triangles of three points.

    Parameters
    ----------
    mesh : SolidMesh
    faces : (f, 3) or (f, 6) int array
        Some of `mesh.surface_faces()`.
    parts : int
        Parts of an edge.
    """
    inside = face_parts(parts)
    areas = np.linalg.norm(doubled_normals(mesh.nodes_m, faces), axis=1)[:, None] / (
        2 * len(inside)
    )
    return SurfacePoints(
        faces, shape_values(inside, mesh.order), np.repeat(areas, len(inside), axis=1)
    )


@dataclass(frozen=True)
class Touch:
    """Penetrations of an obstacle where it is touched.

    Attributes
    ----------
    points : tuple of two (k,) int arrays
        Faces of the points in touch, and their numbers within the faces.
    depth_m : (k,) array
        How far they are inside the obstacle, above 0 [m].
    normals : (k, 3) array
        Out of the obstacle.
    curvature : (k,) array
        Of the obstacle's surface at the points, positive if convex [1/m].
    """

    points: tuple[NDArray, NDArray]
    depth_m: NDArray
    normals: NDArray
    curvature: NDArray


def sphere_touch(places_m: NDArray, centre_m: NDArray, radius_m: float) -> Touch:
    """Points (f, q, 3) inside a sphere."""
    away = places_m - centre_m
    length = np.sqrt((away**2).sum(axis=-1))
    points = np.nonzero(length < radius_m)
    inside = length[points]
    return Touch(points, radius_m - inside, away[points] / inside[:, None], 1 / inside)


def plane_touch(places_m: NDArray, point_m: NDArray, normal: NDArray) -> Touch:
    """Points (f, q, 3) beneath a plane; its normal of length 1."""
    height = (places_m - point_m) @ normal
    points = np.nonzero(height < 0)
    depth = -height[points]
    return Touch(points, depth, np.repeat(normal[None], len(depth), axis=0), np.zeros(len(depth)))


def touch_energy(touch: Touch, surface: SurfacePoints) -> float:
    """Energy of the penetration over Young's modulus [m^3]."""
    return float(0.5 * PENALTY_PER_M * (surface.areas_m2[touch.points] @ touch.depth_m**2))


def touch_forces(touch: Touch, surface: SurfacePoints, size: int) -> NDArray:
    """Gradient of the energy at n nodes, shape (n, 3) [m^2]; points into the obstacle."""
    faces, inside = touch.points
    pressure = PENALTY_PER_M * surface.areas_m2[touch.points] * touch.depth_m
    pull = -pressure[:, None, None] * (
        surface.shapes[inside][:, :, None] * touch.normals[:, None, :]
    )
    return at_nodes(surface.faces[faces], pull, size)


def touch_blocks(
    touch: Touch,
    surface: SurfacePoints,
    *,
    positive: bool = False,
    stick_per_m: NDArray | float = 0.0,
) -> tuple[NDArray, NDArray]:
    """Second derivative of the energy for the faces in touch.

    Parameters
    ----------
    touch, surface
        Penetrations at some of the surface's points.
    positive : bool, optional
        Leave out the turning of the normal, which makes it negative.
    stick_per_m : (k,) array or float, optional
        Stiffness across the normal, which holds the points sideways [1/m].

    Returns
    -------
    faces : (t,) int array
        Numbers of the faces in touch.
    blocks : (t, 6, 6, 3, 3) array
        [m].
    """
    faces, number = np.unique(touch.points[0], return_inverse=True)
    nn = touch.normals[:, :, None] * touch.normals[:, None, :]
    across = stick_per_m - (0.0 if positive else PENALTY_PER_M * touch.depth_m * touch.curvature)
    across = np.broadcast_to(across, len(touch.depth_m))
    stiff = PENALTY_PER_M * nn + across[:, None, None] * (np.eye(3) - nn)
    stiff *= surface.areas_m2[touch.points][:, None, None]
    count = surface.shapes.shape[1]
    pairs = np.einsum("qi,qj->qij", surface.shapes, surface.shapes).reshape(-1, count * count)
    # Sum over the points of each face: one dense product, with zeros where none touches.
    dense = np.zeros((len(faces), len(surface.shapes), 9))
    dense[number, touch.points[1]] = stiff.reshape(-1, 9)
    blocks = np.matmul(pairs.T, dense)
    return faces, blocks.reshape(-1, count, count, 3, 3)


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
