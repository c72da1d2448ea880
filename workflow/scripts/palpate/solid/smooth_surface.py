"""A template's facets as a smooth surface, and a solid bent to it."""

import logging
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from palpate.open3d_core import ClosestPoints
from palpate.solid.mesh import SolidMesh, at_nodes, doubled_normals, element_volumes
from palpate.solid.solve import factorise
from palpate.solid.stiffness import QUADRATURE, combined, dofs, elastic_stiffness, point_volumes

# Facets that meet at a greater angle meet at an edge of the object.
SHARP_DEG = 35.0
SIDES = np.array([[0, 1], [1, 2], [2, 0]])
# No element may lose more than this part of its volume.
LEAST_VOLUME = 0.2
# Where it would, the surface's moves are halved, this often, and given up then; where a solid is to
# be smooth, at this part of the nodes and edges at most.
HALVINGS = 6
MOST_HALVED = 0.05
# Where elements must not fold: the quadrature's points and the corners.
WATCHED = np.concatenate([QUADRATURE[2], np.eye(4)])
# Corners farther from the smooth surface are not on it [m].
OFF_SURFACE_M = 1e-4
# Moves below it leave the solid as it is [m].
NO_MOVE_M = 1e-6


class SmoothSurface:
    """Six-node triangles over a template's facets, with the curvature that its normals tell.

    The middle of an edge rises along the mean of its ends' normals by ((n_b - n_a) (b - a)) / 8,
    which is exact on a sphere up to the fourth power of the edge; at creases edges stay straight.

    Parameters
    ----------
    vertices_m, faces : (n, 3), (m, 3) arrays
        Closed surface, outward [m].
    """

    def __init__(self, vertices_m: NDArray, faces: NDArray) -> None:
        self.vertices_m, self.faces = vertices_m, faces
        self._closest = ClosestPoints(vertices_m, faces)
        self._rises = _edge_rises(vertices_m, faces)

    def nearest(self, points_m: NDArray) -> NDArray:
        """Points (k, 3) put on the surface by way of the nearest point of its facets [m]."""
        flat, face, weights = self._closest(points_m)
        bends = 4 * weights[:, SIDES[:, 0]] * weights[:, SIDES[:, 1]]
        return flat + np.einsum("ke,kea->ka", bends, self._rises[face])

    def distance(self, points_m: NDArray) -> NDArray:
        """Distance of points (k, 3) from the surface, (k,) [m]."""
        return np.linalg.norm(points_m - self.nearest(points_m), axis=1)

    def normals(self, points_m: NDArray) -> NDArray:
        """Unit normals of the facets that are nearest to points (k, 3)."""
        _, face, _ = self._closest(points_m)
        normals = doubled_normals(self.vertices_m, self.faces[face])
        return normals / np.linalg.norm(normals, axis=1, keepdims=True)


def everywhere(points_m: NDArray) -> NDArray:
    """All of the points (k, 3), as a mask (k,)."""
    return np.ones(len(points_m), dtype=bool)


def bent_to(
    mesh: SolidMesh, surface: SmoothSurface, smooth_at: Callable[[NDArray], NDArray] = everywhere
) -> SolidMesh:
    """Solid whose surface nodes lie on a smooth surface; the inside follows as an elastic solid.

    Parameters
    ----------
    mesh : SolidMesh
        Four-node elements.
    surface : SmoothSurface
    smooth_at : callable
        Which of some points (k, 3) lie where the solid must be smooth, as a mask (k,).

    Returns
    -------
    SolidMesh
        The mesh itself where nothing moves.

    Raises
    ------
    ValueError
        If too little could be moved where the solid must be smooth.
    """
    outer = mesh.surface_nodes()
    moves = surface.nearest(mesh.nodes_m[outer]) - mesh.nodes_m[outer]
    if np.abs(moves).max() < NO_MOVE_M:
        return mesh
    follow = _following(mesh, outer)
    before = element_volumes(mesh.nodes_m, mesh.tetrahedra)
    halved, judged = np.zeros(len(outer), dtype=bool), smooth_at(mesh.nodes_m[outer])
    for again in range(2 * HALVINGS):
        bent = SolidMesh(mesh.nodes_m + follow(moves), mesh.tetrahedra)
        kept = element_volumes(bent.nodes_m, bent.tetrahedra) / before
        if kept.min() >= LEAST_VOLUME:
            return bent
        # Flat elements of surface nodes alone collapse first: there facets stay flatter.
        collapsed = np.isin(outer, mesh.tetrahedra[kept < LEAST_VOLUME])
        halved |= collapsed
        if halved[judged].any() and halved[judged].mean() > MOST_HALVED:
            break
        moves[collapsed] *= 0.5 if again < HALVINGS else 0.0
    raise ValueError(
        f"mesh: expected elements that keep {LEAST_VOLUME:g} of their volume on the smooth"
        f" surface, found {kept.min():.2g}"
    )


def curved_to(
    mesh: SolidMesh, surface: SmoothSurface, smooth_at: Callable[[NDArray], NDArray] = everywhere
) -> SolidMesh:
    """Ten-node elements whose outer sides are curved as a smooth surface is.

    On a ball of radius R the middle of a straight edge of length h lies h^2 / (8 R) too deep: a
    coarse mesh begins to bear that much later. Edges with an end off the surface, where `bent_to`
    moved less, and sides of elements that would fold stay straight.

    Parameters
    ----------
    mesh : SolidMesh
        Ten-node elements whose corners are on the surface (`bent_to`).
    surface : SmoothSurface
    smooth_at : callable
        Which of some points (k, 3) lie where the solid must be smooth, as a mask (k,).

    Raises
    ------
    ValueError
        If many edges would have to stay straight where the solid must be smooth.
    """
    faces = mesh.surface_faces()
    ends = np.unique(faces[:, :3])
    apart = np.linalg.norm(surface.nearest(mesh.nodes_m[ends]) - mesh.nodes_m[ends], axis=1)
    off = np.zeros(len(mesh.nodes_m), dtype=bool)
    off[ends] = apart > OFF_SURFACE_M
    sides = faces[:, :3][:, SIDES]
    middles, first = np.unique(faces[:, 3:], return_index=True)
    curved = ~off[sides].any(axis=2).ravel()[first]
    whole = element_volumes(mesh.nodes_m, mesh.corners)[:, None]
    places = surface.nearest(mesh.nodes_m[middles])
    judged = smooth_at(mesh.nodes_m[middles])
    for _ in range(2 * HALVINGS):
        nodes = mesh.nodes_m.copy()
        nodes[middles[curved]] = places[curved]
        found = SolidMesh(nodes, mesh.tetrahedra)
        kept = len(WATCHED) * point_volumes(found, WATCHED) / whole
        folded = np.isin(middles, mesh.tetrahedra[kept.min(axis=1) < LEAST_VOLUME])
        if not (folded & curved).any():
            break
        curved &= ~folded
    else:
        expected = f"edges that fold nothing after {2 * HALVINGS} rounds"
        raise ValueError(f"mesh: expected {expected}, found {int(folded.sum())} that do")
    straight = 1 - curved[judged].mean() if judged.any() else 0.0
    logging.info(
        "%.2g of the outer edges stay straight, %.2g of those that count",
        1 - curved.mean(),
        straight,
    )
    if straight > MOST_HALVED:
        raise ValueError(
            f"mesh: expected at most {MOST_HALVED:g} of the outer edges off the smooth surface, or"
            f" folded by it, where the solid is pressed, found {straight:.2g}"
        )
    return found


def _following(mesh: SolidMesh, outer: NDArray) -> Callable[[NDArray], NDArray]:
    """How all nodes move (n, 3) with the outer ones (k, 3), as an elastic solid."""
    inner = np.setdiff1d(np.arange(len(mesh.nodes_m)), outer)
    free, given = dofs(inner), dofs(outer)
    K = combined(*elastic_stiffness(mesh), 0.5, 0.5)
    solve, coupling = factorise(K[free][:, free]), K[free][:, given]

    def follow(moves_m: NDArray) -> NDArray:
        u = np.zeros_like(mesh.nodes_m)
        u[outer] = moves_m
        u.reshape(-1)[free] = -solve(coupling @ moves_m.ravel())
        return u

    return follow


def _edge_rises(vertices_m: NDArray, faces: NDArray) -> NDArray:
    """How far the middles of the faces' edges rise, shape (m, 3, 3) [m]."""
    normals = corner_normals(vertices_m, faces)
    a, b = (vertices_m[faces[:, SIDES[:, k]]] for k in (0, 1))
    na, nb = (normals[:, SIDES[:, k]] for k in (0, 1))
    mean = _unit(na + nb)
    rises = ((nb - na) * (b - a)).sum(axis=-1, keepdims=True) / 8 * mean
    pairs = np.sort(faces[:, SIDES].reshape(-1, 2), axis=1)
    _, number, count = np.unique(pairs, axis=0, return_inverse=True, return_counts=True)
    number = number.ravel()
    means = at_nodes(number, rises, len(count)) / count[:, None]
    facing = np.repeat(_unit(doubled_normals(vertices_m, faces)), 3, axis=0)
    joint = at_nodes(number, facing, len(count))
    # Of two facets at an angle t the normals' sum has the length 2 cos(t/2).
    smooth = np.linalg.norm(joint, axis=1) > 2 * np.cos(np.radians(SHARP_DEG) / 2)
    return np.where(smooth[:, None], means, 0.0)[number].reshape(-1, 3, 3)


def corner_normals(vertices_m: NDArray, faces: NDArray) -> NDArray:
    """Normal of each face's corner: mean of the faces around it that meet without a crease.

    A facet without an area has no say; its own corners have the mean of all around them.

    Parameters
    ----------
    vertices_m, faces : (n, 3), (m, 3) arrays
        Closed surface, outward [m].

    Returns
    -------
    (m, 3, 3) array
        Of length 1.
    """
    double = doubled_normals(vertices_m, faces)
    flat = ~double.any(axis=1)
    normals, weights = _unit(double), _corner_weights(vertices_m[faces])
    order = np.argsort(faces.ravel(), kind="stable")
    starts = np.searchsorted(faces.ravel()[order], np.arange(len(vertices_m) + 1))
    least = np.cos(np.radians(SHARP_DEG))
    found = np.zeros((len(faces), 3, 3))
    for vertex in range(len(vertices_m)):
        around = order[starts[vertex] : starts[vertex + 1]]
        mine, corner = around // 3, around % 3
        near = (normals[mine] @ normals[mine].T >= least) | flat[mine, None]
        found[mine, corner] = (near * weights[mine, corner]) @ normals[mine]
    return _unit(found)


def _corner_weights(corners: NDArray) -> NDArray:
    """Weights of a face's normal at its corners that are exact on spheres, (m, 3) (Max 1999)."""
    onward = np.roll(corners, -1, axis=1) - corners
    back = np.roll(corners, 1, axis=1) - corners
    double = np.linalg.norm(np.cross(onward, back), axis=-1)
    return double / np.maximum((onward**2).sum(axis=-1) * (back**2).sum(axis=-1), 1e-300)


def _unit(vectors: NDArray) -> NDArray:
    """Vectors of length 1; those without a length stay."""
    return vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-300)
