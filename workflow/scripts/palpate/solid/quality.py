"""How well tetrahedra are shaped, and how far their surface is from another."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from palpate.open3d_core import ClosestPoints
from palpate.solid.mesh import EDGES, SolidMesh, element_volumes

# The two corners off each edge of EDGES.
OPPOSITE = np.array([[2, 3], [0, 3], [1, 3], [1, 2], [0, 2], [0, 1]])


@dataclass(frozen=True)
class MeshQuality:
    """Counts and shapes of a solid mesh.

    Attributes
    ----------
    nodes, elements : int
    order : int
        1 for four-node and 2 for ten-node elements.
    volume_m3 : float
        [m^3].
    least_radius_ratio, mean_radius_ratio : float
        Three inradii over the circumradius: 1 for a regular element, 0 for a flat one.
    least_dihedral_deg, greatest_dihedral_deg : float
        Angles between faces [deg].
    largest_gap_m : float
        Largest distance between the mesh's surface and the template's, from either [m].
    """

    nodes: int
    elements: int
    order: int
    volume_m3: float
    least_radius_ratio: float
    mean_radius_ratio: float
    least_dihedral_deg: float
    greatest_dihedral_deg: float
    largest_gap_m: float


def mesh_quality(mesh: SolidMesh, vertices_m: NDArray, faces: NDArray) -> MeshQuality:
    """Quality of a mesh that fills a closed surface.

    Parameters
    ----------
    mesh : SolidMesh
    vertices_m, faces : (n, 3), (m, 3) arrays
        The surface [m].

    Returns
    -------
    MeshQuality
    """
    ratios, angles = radius_ratios(mesh), dihedral_angles(mesh)
    return MeshQuality(
        nodes=len(mesh.nodes_m),
        elements=len(mesh.tetrahedra),
        order=mesh.order,
        volume_m3=mesh.volume_m3,
        least_radius_ratio=float(ratios.min()),
        mean_radius_ratio=float(ratios.mean()),
        least_dihedral_deg=float(np.degrees(angles.min())),
        greatest_dihedral_deg=float(np.degrees(angles.max())),
        largest_gap_m=surface_gap(mesh.nodes_m, mesh.surface_triangles(), vertices_m, faces),
    )


def radius_ratios(mesh: SolidMesh) -> NDArray:
    """Three inradii over the circumradius of each element, shape (m,)."""
    corners = mesh.nodes_m[mesh.corners]
    volume = element_volumes(mesh.nodes_m, mesh.corners)
    a, b, c = (corners[:, k] - corners[:, 0] for k in (1, 2, 3))
    areas = [np.cross(b, a), np.cross(a, c), np.cross(c, b), np.cross(b - a, c - a)]
    area = sum(np.linalg.norm(double, axis=1) for double in areas) / 2
    # Centre of the sphere through all corners, from corner 0.
    centre = sum(
        (p * p).sum(axis=1, keepdims=True) * np.cross(q, r)
        for p, q, r in ((a, b, c), (b, c, a), (c, a, b))
    ) / (12 * volume[:, None])
    return 9 * volume / (area * np.linalg.norm(centre, axis=1))


def dihedral_angles(mesh: SolidMesh) -> NDArray:
    """Angles between the faces at the edges of each element, shape (m, 6) [rad]."""
    corners = mesh.nodes_m[mesh.corners]
    start, end = corners[:, EDGES[:, 0]], corners[:, EDGES[:, 1]]
    along = end - start
    along /= np.linalg.norm(along, axis=-1, keepdims=True)
    sides = corners[:, OPPOSITE] - start[:, :, None]
    sides -= np.einsum("eksi,eki->eks", sides, along)[..., None] * along[:, :, None]
    sides /= np.linalg.norm(sides, axis=-1, keepdims=True)
    cosine = np.einsum("eki,eki->ek", sides[:, :, 0], sides[:, :, 1])
    return np.arccos(np.clip(cosine, -1, 1))


def surface_gap(
    vertices_m: NDArray, faces: NDArray, others_m: NDArray, other_faces: NDArray
) -> float:
    """Largest distance between two surfaces, taken both ways [m].

    Measured at vertices, middles of edges and centres of triangles.

    Parameters
    ----------
    vertices_m, faces : (n, 3), (m, 3) arrays
        One surface [m].
    others_m, other_faces : (k, 3), (l, 3) arrays
        The other [m].
    """
    one, two = (vertices_m, faces), (others_m, other_faces)
    return max(float(_distance(a, b).max()) for a, b in ((one, two), (two, one)))


def _distance(surface: tuple[NDArray, NDArray], other: tuple[NDArray, NDArray]) -> NDArray:
    vertices, faces = surface
    used = vertices[np.unique(faces)]
    corners = vertices[faces]
    middles = (corners + np.roll(corners, -1, axis=1)).reshape(-1, 3) / 2
    points = np.concatenate([used, middles, corners.mean(axis=1)])
    return ClosestPoints(*other).distance(points)
