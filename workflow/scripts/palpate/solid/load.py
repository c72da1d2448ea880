"""Nodal forces of a contact: on one triangle (Section 3.3.1), and of Hertz's pressure."""

from functools import lru_cache

import numpy as np
import trimesh
from numpy.typing import NDArray

from palpate.solid.mesh import SolidMesh, doubled_normals
from palpate.solid.stiffness import shape_values

# How a force is spread over the contact's triangle.
TRIANGLE_RULES = ("conserve", "area_ratio")
# Edge of the parts a triangle is cut into, as a share of the contact radius.
FINENESS = 1 / 12
# Three points of equal weight in each part, exact for polynomials of degree 2.
THREE = np.array([[2 / 3, 1 / 6, 1 / 6], [1 / 6, 2 / 3, 1 / 6], [1 / 6, 1 / 6, 2 / 3]])


def contact_triangle(mesh: SolidMesh, point_m: NDArray, *, largest_distance_m: float) -> NDArray:
    """Nodes of the surface triangle closest to the contact point.

    Parameters
    ----------
    mesh : SolidMesh
    point_m : (3,) array
        Contact point [m].
    largest_distance_m : float

    Returns
    -------
    (3,) or (6,) int array
        Corners, outward; for ten-node elements the middles of the edges 01, 12, 20 too.

    Raises
    ------
    ValueError
        If the point is farther from the surface than the stated distance.
    """
    faces = mesh.surface_faces()
    corners = mesh.nodes_m[faces[:, :3]]
    points = np.broadcast_to(point_m, (len(corners), 3))
    nearest = trimesh.triangles.closest_point(corners, points)
    distance = np.linalg.norm(nearest - point_m, axis=1)
    best = int(np.argmin(distance))
    if not distance[best] <= largest_distance_m:
        raise ValueError(
            f"contact: expected within {largest_distance_m:g} m of the surface,"
            f" found {distance[best]:.3g} m away"
        )
    return faces[best]


def nodal_force(
    mesh: SolidMesh,
    triangle: NDArray,
    force_n: NDArray,
    *,
    rule: str,
    turn_to_normal: bool,
    indenter_radius_m: float,
    depth_m: float,
) -> NDArray:
    """Spread a measured force over the nodes of the contact triangle.

    Parameters
    ----------
    mesh : SolidMesh
    triangle : (3,) or (6,) int array
        All nodes of the contact triangle, outward, as `contact_triangle` gives them.
    force_n : (3,) array
        Force on the object [N].
    rule : {"conserve", "area_ratio"}
        Keep the total force, as a uniform traction on the triangle does: a third for each corner,
        or for each middle of an edge where elements have ten nodes. Or Eq. 3.27 as printed, which
        gives each corner the force times the triangle's area over the indenter's contact area
        (the result then depends on the mesh).
    turn_to_normal : bool
        Turn the force against the triangle's outward normal (Section 5.2.2).
    indenter_radius_m, depth_m : float
        Radius of the sphere and depth; Hertz's contact area is pi R d [m].

    Returns
    -------
    (n, 3) array
        Nodal forces [N].

    Raises
    ------
    ValueError
        If the rule is unknown or meant for four-node elements, or nodes are missing.
    """
    _check(mesh, triangle, rule)
    area = np.linalg.norm(doubled_normals(mesh.nodes_m, triangle[None])) / 2
    force = np.asarray(force_n, dtype=float)
    if turn_to_normal:
        force = -np.linalg.norm(force) * outward_normal(mesh, triangle)
    share = 1 / 3 if rule == "conserve" else area / (np.pi * indenter_radius_m * depth_m)
    forces = np.zeros_like(mesh.nodes_m)
    # The last three are the corners of three nodes and the middles of six.
    forces[triangle[-3:]] = share * force
    return forces


def outward_normal(mesh: SolidMesh, triangle: NDArray) -> NDArray:
    """Unit normal of a surface triangle whose first three nodes are its corners, shape (3,)."""
    normal = doubled_normals(mesh.nodes_m, triangle[None])[0]
    return normal / np.linalg.norm(normal)


def _check(mesh: SolidMesh, triangle: NDArray, rule: str) -> None:
    if rule not in TRIANGLE_RULES:
        expected = ", ".join((*TRIANGLE_RULES, "hertz_patch (`contact_pressure`)"))
        raise ValueError(f"force_rule: expected one of {expected}, found {rule}")
    if rule == "area_ratio" and mesh.order != 1:
        expected = "conserve or hertz_patch for ten-node elements"
        raise ValueError(f"force_rule: expected {expected}, found area_ratio")
    if len(triangle) != 3 * mesh.order:
        raise ValueError(f"triangle: expected {3 * mesh.order} nodes, found {len(triangle)}")


def contact_pressure(
    mesh: SolidMesh,
    centre_m: NDArray,
    axis: NDArray,
    force_n: NDArray,
    *,
    contact_radius_m: float,
) -> NDArray:
    """Consistent nodal forces of the pressure p0 sqrt(1 - r^2/a^2) (Hertz 1882).

    The distance r is measured from the centre in the plane across the axis. Triangles that face
    against the axis carry the pressure where they are within a of the centre along the axis too,
    so that a part behind the contact carries none. The traction has the force's direction
    everywhere, and its sum is the force, whatever part of the disc is on the surface.

    Parameters
    ----------
    mesh : SolidMesh
        Elements of either order.
    centre_m : (3,) array
        Centre of the contact [m].
    axis : (3,) array
        Pressing direction, into the object.
    force_n : (3,) array
        Force on the object [N].
    contact_radius_m : float
        Contact radius a [m].

    Returns
    -------
    (n, 3) array
        Nodal forces [N].

    Raises
    ------
    ValueError
        If the radius isn't positive, the axis has no direction, or no triangle is in reach.
    """
    if not contact_radius_m > 0:
        raise ValueError(f"contact_radius_m: expected above 0, found {contact_radius_m:g}")
    length = np.linalg.norm(axis)
    if not length > 0:
        raise ValueError("axis: expected a direction, found one without length")
    axis = np.asarray(axis, dtype=float) / length
    share = np.zeros(len(mesh.nodes_m))
    for face in _near(mesh, centre_m, axis, contact_radius_m):
        corners = (mesh.nodes_m[face[:3]] - centre_m) / contact_radius_m
        share[face] += _integral(corners, axis, mesh.order)
    if not share.sum() > 0:
        raise ValueError(
            f"contact: expected triangles within {contact_radius_m:.3g} m of the centre that"
            " face against the axis, found none"
        )
    return (share / share.sum())[:, None] * np.asarray(force_n, dtype=float)


def hertz_contact_radius(*, indenter_radius_m: float, depth_m: float) -> float:
    """Contact radius sqrt(R d) of Hertz's sphere at a depth, at most R [m].

    Raises
    ------
    ValueError
        If the depth is not positive.
    """
    if not depth_m > 0:
        raise ValueError(f"depth_m: expected above 0, found {depth_m:g}")
    return float(min(np.sqrt(indenter_radius_m * depth_m), indenter_radius_m))


def _near(mesh: SolidMesh, centre_m: NDArray, axis: NDArray, reach_m: float) -> NDArray:
    """Faces against the axis whose bounding box is in reach of the centre, (k, 3) or (k, 6)."""
    faces = mesh.surface_faces()
    corners = mesh.nodes_m[faces[:, :3]] - centre_m
    # The cylinder of radius and half length a lies in a ball.
    reach = 2**0.5 * reach_m
    near = (corners.min(axis=1) <= reach).all(axis=1) & (corners.max(axis=1) >= -reach).all(axis=1)
    return faces[near & (doubled_normals(mesh.nodes_m, faces) @ axis < 0)]


def _integral(corners: NDArray, axis: NDArray, order: int) -> NDArray:
    """Integral of pressure times each shape function over a triangle; lengths over a."""
    edge = np.linalg.norm(corners - np.roll(corners, 1, axis=0), axis=1).max()
    points = face_parts(int(np.ceil(edge / FINENESS)))
    place = points @ corners
    height = place @ axis
    r2 = (place * place).sum(axis=1) - height**2
    pressure = np.sqrt(np.maximum(1 - r2, 0)) * (np.abs(height) <= 1)
    across = abs(np.cross(corners[1] - corners[0], corners[2] - corners[0]) @ axis) / 2
    return across * pressure @ shape_values(points, order) / len(points)


@lru_cache(maxsize=64)
def face_parts(count: int) -> NDArray:
    """Points of equal weight in a triangle cut into count^2 equal ones: barycentric, (p, 3)."""
    i, j = np.meshgrid(np.arange(count), np.arange(count), indexing="ij")
    upright = np.stack([i, j], axis=-1)[i + j < count]
    turned = np.stack([i, j], axis=-1)[i + j < count - 1] + 1
    inner = THREE[:, :2]
    points = np.concatenate(
        [(upright[:, None] + inner).reshape(-1, 2), (turned[:, None] - inner).reshape(-1, 2)]
    )
    return np.column_stack([points, count - points.sum(axis=1)]) / count
