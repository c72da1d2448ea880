"""Contact triangle and nodal force (Section 3.3.1)."""

import numpy as np
import trimesh
from numpy.typing import NDArray

from palpate.solid.mesh import SolidMesh

RULES = ("conserve", "area_ratio")


def contact_triangle(mesh: SolidMesh, point_m: NDArray, *, largest_distance_m: float) -> NDArray:
    """Nodes of the surface triangle closest to the contact point, shape (3,), outward.

    Raises
    ------
    ValueError
        If the point is farther from the surface than the stated distance.
    """
    triangles = mesh.surface_triangles()
    corners = mesh.nodes_m[triangles]
    points = np.broadcast_to(point_m, (len(corners), 3))
    nearest = trimesh.triangles.closest_point(corners, points)
    distance = np.linalg.norm(nearest - point_m, axis=1)
    best = int(np.argmin(distance))
    if distance[best] > largest_distance_m:
        raise ValueError(
            f"contact: expected within {largest_distance_m:g} m of the surface,"
            f" found {distance[best]:.3g} m away"
        )
    return triangles[best]


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
    triangle : (3,) int array
        Nodes of the contact triangle, outward.
    force_n : (3,) array
        Force on the object [N].
    rule : {"conserve", "area_ratio"}
        Keep the total force, a third for each node; or Eq. 3.27 as printed, which gives each node
        the force times the triangle's area over the indenter's contact area (the result then
        depends on the mesh).
    turn_to_normal : bool
        Turn the force against the triangle's outward normal (Section 5.2.2).
    indenter_radius_m, depth_m : float
        Radius of the sphere and depth; Hertz's contact area is pi R d [m].

    Returns
    -------
    (n, 3) array
        Nodal forces [N].
    """
    if rule not in RULES:
        raise ValueError(f"force_rule: expected one of {', '.join(RULES)}, found {rule}")
    a, b, c = mesh.nodes_m[triangle]
    normal = np.cross(b - a, c - a)
    area = np.linalg.norm(normal) / 2
    force = np.asarray(force_n, dtype=float)
    if turn_to_normal:
        force = -np.linalg.norm(force) * normal / (2 * area)
    share = 1 / 3 if rule == "conserve" else area / (np.pi * indenter_radius_m * depth_m)
    forces = np.zeros_like(mesh.nodes_m)
    forces[triangle] = share * force
    return forces
