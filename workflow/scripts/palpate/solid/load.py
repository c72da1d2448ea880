"""Contact triangle and nodal force (Section 3.3.1)."""

import numpy as np
import trimesh
from numpy.typing import NDArray

from palpate.solid.mesh import SolidMesh, doubled_normals

RULES = ("conserve", "area_ratio")


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
    if rule not in RULES:
        raise ValueError(f"force_rule: expected one of {', '.join(RULES)}, found {rule}")
    if rule == "area_ratio" and mesh.order != 1:
        raise ValueError("force_rule: expected conserve for ten-node elements, found area_ratio")
    if len(triangle) != 3 * mesh.order:
        raise ValueError(f"triangle: expected {3 * mesh.order} nodes, found {len(triangle)}")
