"""Coarser and coarser meshes of a template (Section 4.3.1).

Edges are collapsed onto one of their vertices, so that the vertices of a coarse mesh are vertices
of the finer one. Collapses that have no vertex in common are made together; a collapse that would
make the surface fold, cut itself or lose its manifold is not made.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from palpate.solid.quality import cutting_triangles
from palpate.surface.template import Template, unique_edges
from scipy import sparse

# A triangle may turn by so much when a corner of it moves.
LARGEST_TURN_DEG = 60.0
# Shape of a triangle, 1 where its sides are alike; worse ones are not made from better ones.
POOREST_SHAPE = 0.05
# Lengths count beside distances from the surface, to keep flat parts even.
LENGTH_WEIGHT = 0.05
CHEAP_PART = 3
# "Around 1000 vertices": a mesh is not halved again when it has less than this times as many.
AROUND = 2**0.5


@dataclass(frozen=True)
class Level:
    """A mesh of the hierarchy.

    Attributes
    ----------
    template : Template
    kept : (n,) int array
        Number of each of its vertices in the next finer mesh; in itself for the finest.
    """

    template: Template
    kept: NDArray


def hierarchy(template: Template, *, coarsest_vertices: int) -> list[Level]:
    """Meshes from the coarsest to the template itself, each about half the next one's vertices.

    Parameters
    ----------
    template : Template
        Closed.
    coarsest_vertices : int
        Halving stops around so many vertices, or when no edge can be collapsed.
    """
    levels = [Level(template, np.arange(len(template.vertices_m)))]
    while len(levels[0].template.vertices_m) > AROUND * coarsest_vertices:
        finer = levels[0].template
        goal = max(len(finer.vertices_m) // 2, coarsest_vertices)
        faces = collapse_edges(finer.vertices_m, finer.faces, vertices=goal)
        kept = np.unique(faces)
        if len(kept) == len(finer.vertices_m):
            break
        coarse = Template(finer.vertices_m[kept], np.searchsorted(kept, faces))
        levels.insert(0, Level(coarse, kept))
    return levels


def collapse_edges(vertices_m: NDArray, faces: NDArray, *, vertices: int) -> NDArray:
    """Collapse edges onto their vertices until so many vertices are left.

    Parameters
    ----------
    vertices_m, faces : (n, 3), (m, 3) arrays
        Closed surface [m].
    vertices : int
        How many to keep; more are kept when no edge can be collapsed.

    Returns
    -------
    (k, 3) int array
        Triangles of the coarse surface, in the vertices of the fine one.
    """
    # Corners of the surface are kept as long as possible: planes of all triangles that a
    # vertex has had add up in its quadric.
    quadrics = _quadrics(vertices_m, faces)
    banned = np.zeros(len(vertices_m), dtype=bool)
    while True:
        surplus = len(np.unique(faces)) - vertices
        if surplus <= 0:
            return faces
        gone, onto = _independent_collapses(vertices_m, faces, quadrics, banned, surplus)
        if not len(gone):
            return faces
        coarse = _collapsed(faces, gone, onto, len(vertices_m))
        wrong = _cutting(vertices_m, coarse, gone, onto)
        while wrong.any():
            banned[gone[wrong]] = True
            gone, onto = gone[~wrong], onto[~wrong]
            coarse = _collapsed(faces, gone, onto, len(vertices_m))
            wrong = _cutting(vertices_m, coarse, gone, onto)
        np.add.at(quadrics, onto, quadrics[gone])
        faces = coarse


def _independent_collapses(
    vertices: NDArray, faces: NDArray, quadrics: NDArray, banned: NDArray, most: int
) -> tuple[NDArray, NDArray]:
    """Vertices to take out and the neighbours they go to, the cheapest of each surrounding."""
    size = len(vertices)
    edges = unique_edges(faces)
    ends = np.concatenate([edges, edges[:, ::-1]])
    ends = ends[~banned[ends[:, 0]]]
    costs = _costs(vertices, quadrics, ends)
    ends = ends[np.lexsort((ends[:, 1], ends[:, 0], costs))]
    adjacent = sparse.csr_matrix((np.ones(len(edges), np.int32), edges.T), shape=(size, size))
    adjacent = adjacent + adjacent.T
    # The dear ones are looked at only when no cheap one is left: they may become needless.
    cheap = len(ends) // CHEAP_PART
    for some in (ends[:cheap], ends[cheap:]):
        some = some[_valid(vertices, faces, adjacent, some)]
        some = some[np.sort(np.unique(some[:, 0], return_index=True)[1])]
        some = some[_apart(adjacent, some[:, 0], size)][:most]
        if len(some):
            break
    return some[:, 0], some[:, 1]


def _costs(vertices: NDArray, quadrics: NDArray, ends: NDArray) -> NDArray:
    """Squared distance of the kept vertex from the planes of the other, and the edge's length."""
    point = np.column_stack([vertices[ends[:, 1]], np.ones(len(ends))])
    away = np.einsum("ka,kab,kb->k", point, quadrics[ends[:, 0]], point)
    area = np.maximum(quadrics[ends[:, 0], :3, :3].trace(axis1=1, axis2=2), 1e-30)
    length = ((vertices[ends[:, 1]] - vertices[ends[:, 0]]) ** 2).sum(axis=1)
    return np.maximum(away, 0) / area + LENGTH_WEIGHT * length


def _quadrics(vertices: NDArray, faces: NDArray) -> NDArray:
    """Sums of squared plane equations by area, shape (n, 4, 4)."""
    normals, doubled = _normals(vertices[faces])
    planes = np.column_stack([normals, -(normals * vertices[faces[:, 0]]).sum(axis=1)])
    squares = doubled[:, None, None] * planes[:, :, None] * planes[:, None, :]
    quadrics = np.zeros((len(vertices), 4, 4))
    for corner in range(3):
        np.add.at(quadrics, faces[:, corner], squares)
    return quadrics


def _valid(
    vertices: NDArray, faces: NDArray, adjacent: sparse.csr_matrix, ends: NDArray
) -> NDArray:
    """Collapses that keep a manifold (two common neighbours) and fold no triangle."""
    gone, onto = ends.T
    common = np.asarray((adjacent[gone].multiply(adjacent[onto])).sum(axis=1)).ravel()
    degree = np.diff(adjacent.indptr)
    closed = (common == 2) & (degree[gone] > 3) & (degree[gone] + degree[onto] - 4 >= 3)
    incident = sparse.csr_matrix(
        (np.ones(faces.size), (faces.ravel(), np.repeat(np.arange(len(faces)), 3))),
        shape=(len(vertices), len(faces)),
    )
    rows = incident[gone[closed]]
    which = np.flatnonzero(closed)[np.repeat(np.arange(rows.shape[0]), np.diff(rows.indptr))]
    old = faces[rows.indices]
    stays = ~(old == onto[which][:, None]).any(axis=1)
    which, old = which[stays], old[stays]
    new = np.where(old == gone[which][:, None], onto[which][:, None], old)
    bad = _folded(vertices[old], vertices[new])
    closed[np.unique(which[bad])] = False
    return closed


def _folded(old: NDArray, new: NDArray) -> NDArray:
    """Triangles (k, 3, 3) that turn too far or become slivers."""
    before, _ = _normals(old)
    after, doubled = _normals(new)
    sides = ((new - np.roll(new, 1, axis=1)) ** 2).sum(axis=(1, 2))
    shape = 2 * np.sqrt(3) * doubled / np.maximum(sides, 1e-30)
    turned = (before * after).sum(axis=1) < np.cos(np.deg2rad(LARGEST_TURN_DEG))
    return turned | (shape < POOREST_SHAPE)


def _normals(corners: NDArray) -> tuple[NDArray, NDArray]:
    """Unit normals and twice the areas of triangles (k, 3, 3)."""
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    doubled = np.linalg.norm(across, axis=1)
    return across / np.maximum(doubled, 1e-30)[:, None], doubled


def _apart(adjacent: sparse.csr_matrix, gone: NDArray, size: int) -> NDArray:
    """Vertices before all others that are neighbours, or have a neighbour with them."""
    # The surroundings of such vertices change independently, those of the kept ones too.
    claimed = (adjacent + sparse.eye(size, dtype=np.int32, format="csr"))[gone]
    rank = np.repeat(np.arange(len(gone)), np.diff(claimed.indptr))
    first = np.full(size, len(gone))
    np.minimum.at(first, claimed.indices, rank)
    lost = np.bincount(rank, first[claimed.indices] != rank, len(gone))
    return lost == 0


def _collapsed(faces: NDArray, gone: NDArray, onto: NDArray, size: int) -> NDArray:
    renamed = np.arange(size)
    renamed[gone] = onto
    faces = renamed[faces]
    whole = (faces != np.roll(faces, 1, axis=1)).all(axis=1)
    return faces[whole]


def _cutting(vertices: NDArray, faces: NDArray, gone: NDArray, onto: NDArray) -> NDArray:
    """Collapses whose triangles, around the kept vertex, cut others."""
    pairs = cutting_triangles(vertices, faces)
    touched = np.zeros(len(vertices), dtype=bool)
    touched[faces[pairs.ravel()].ravel()] = True
    return touched[onto]
