"""What a surface must be before tetrahedra can fill it, and how well they do."""

from dataclasses import dataclass

import numpy as np
import trimesh
from numpy.typing import NDArray

from palpate.capture.closed_surface import turned_outward
from palpate.open3d_core import ClosestPoints, o3d, scene_of
from palpate.solid.mesh import EDGES, SolidMesh, element_volumes

# Heights below this share of an edge are touching, not cutting.
TOUCH = 1e-9
# The two corners off each edge of EDGES.
OPPOSITE = np.array([[2, 3], [0, 3], [1, 3], [1, 2], [0, 2], [0, 1]])


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
    try:
        surface = turned_outward(surface)
    except ValueError as error:
        raise ValueError(f"surface: {error}") from None
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
