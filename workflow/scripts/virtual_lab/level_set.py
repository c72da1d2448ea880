"""Tetrahedra inside the zero level of a signed distance: a lattice, warped and cut.

After the idea of isosurface stuffing (Labelle and Shewchuk 2007), on a lattice of cubes of six
tetrahedra each, which keeps planes of symmetry and flat supports exact.
"""

import numpy as np
from numpy.typing import NDArray
from skfem import MeshTet

from virtual_lab.signed_distance import Distance, slope

# The six tetrahedra of a cube around its diagonal; corner k is (k & 1, k >> 1 & 1, k >> 2 & 1).
CUBE = np.array(
    [[0, 1, 3, 7], [0, 3, 2, 7], [0, 2, 6, 7], [0, 6, 4, 7], [0, 4, 5, 7], [0, 5, 1, 7]]
)
EDGES = np.array([[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]])
# A lattice vertex nearer to the surface than this part of an edge moves onto it.
WARP = 0.3
SMALLEST_VOLUME = 1e-4
PROJECTIONS = 3
# A new vertex on a flat cut this near to the curved surface lies on their common edge.
REACH_M = 3e-4
# What a tetrahedron must keep of its volume when vertices move onto the surface.
LEAST_SHARE = 0.2
# Edges may grow by this part of the distance to the nearest spot.
GROWTH = 0.25


def level_set_mesh(
    distance: Distance, low_m: NDArray, high_m: NDArray, spacing_m: float
) -> tuple[NDArray, NDArray]:
    """Mesh the part of a box where a signed distance is negative.

    Parameters
    ----------
    distance : callable
        Points (n, 3) [m] to signed distances (n,) [m], negative inside.
    low_m, high_m : (3,) arrays
        Corners of the box; where it cuts the solid, the cut is flat.
    spacing_m : float
        About the edge of a cube; the box is divided evenly.

    Returns
    -------
    nodes_m : (n, 3) array
    tetrahedra : (m, 4) int array
        Of positive volume.

    Raises
    ------
    ValueError
        If nothing of the solid lies in the box.
    """
    nodes, tets = _lattice(np.asarray(low_m, float), np.asarray(high_m, float), spacing_m)
    values = distance(nodes)
    near = (values[tets] < 0).any(axis=1)
    if not near.any():
        raise ValueError(f"distance: expected a solid in the box {low_m} to {high_m} m, found none")
    used, tets = np.unique(tets[near], return_inverse=True)
    nodes, values, tets = nodes[used], values[used], tets.reshape(-1, 4)
    nodes, values = _warped(nodes, values, tets, low_m, high_m)
    nodes, tets = _cut(nodes, values, tets)
    return _tidy(nodes, tets, spacing_m)


def boundary_surface(nodes_m: NDArray, tetrahedra: NDArray) -> tuple[NDArray, NDArray]:
    """Outward triangles (m, 3) that bound tetrahedra, with just their vertices (n, 3) [m]."""
    sides = np.concatenate(
        [tetrahedra[:, [1, 2, 3]], tetrahedra[:, [0, 3, 2]], tetrahedra[:, [0, 1, 3]],
         tetrahedra[:, [0, 2, 1]]]
    )  # fmt: skip
    _, first, count = np.unique(
        np.sort(sides, axis=1), axis=0, return_index=True, return_counts=True
    )
    used, faces = np.unique(sides[np.sort(first[count == 1])], return_inverse=True)
    return nodes_m[used], faces.reshape(-1, 3)


def refined_near(
    mesh: MeshTet,
    distance: Distance,
    spots: list[tuple[NDArray, float]],
    *,
    planes: list[tuple[int, float]],
) -> MeshTet:
    """Bisect tetrahedra near spots until their edges are short; new surface vertices move onto it.

    Parameters
    ----------
    mesh : MeshTet
    distance : callable
        Signed distance of the solid.
    spots : list of ((3,) array, float)
        Centres [m] and the edge wanted there; farther away it may grow.
    planes : list of (axis, place)
        Flat cuts, whose vertices stay in them.
    """
    while True:
        corners = mesh.p.T[mesh.t.T]
        edges = np.linalg.norm(corners[:, EDGES[:, 0]] - corners[:, EDGES[:, 1]], axis=2)
        centre, long = corners.mean(axis=1), np.zeros(len(corners), dtype=bool)
        for spot, edge in spots:
            allowed = edge + GROWTH * np.linalg.norm(centre - spot, axis=1)
            long |= edges.max(axis=1) > 1.5 * allowed
        if not long.any():
            return mesh
        count = mesh.p.shape[1]
        mesh = mesh.refined(np.flatnonzero(long))
        boundary = np.unique(mesh.facets[:, mesh.boundary_facets()])
        fresh = boundary[boundary >= count]
        mesh = _settled(
            mesh, fresh, onto_surface(mesh.p[:, fresh].T, distance, planes, reach_m=REACH_M)
        )


def _settled(mesh: MeshTet, moved: NDArray, places_m: NDArray) -> MeshTet:
    """Move vertices to their places, but for those that would crush a tetrahedron."""
    while True:
        points = mesh.p.copy()
        points[:, moved] = places_m.T
        before, after = _volumes(mesh.p.T, mesh.t.T), _volumes(points.T, mesh.t.T)
        crushed = np.abs(before) * LEAST_SHARE > after * np.sign(before)
        bad = np.isin(moved, mesh.t[:, crushed])
        if not bad.any():
            return MeshTet(points, mesh.t)
        moved, places_m = moved[~bad], places_m[~bad]


def _volumes(nodes: NDArray, tets: NDArray) -> NDArray:
    corners = nodes[tets]
    return np.linalg.det(corners[:, 1:] - corners[:, :1]) / 6


def onto_surface(
    points_m: NDArray, distance: Distance, planes: list[tuple[int, float]], *, reach_m: float
) -> NDArray:
    """Move points near the surface onto it; on flat cuts just those within reach, in their cut."""
    points = points_m.copy()
    in_cut = np.stack([np.abs(points[:, axis] - place) < 1e-9 for axis, place in planes], axis=1)
    # A point inside a cut's face is no point of the curved surface.
    inner = in_cut.any(axis=1) & (np.abs(distance(points)) > reach_m)
    for _ in range(PROJECTIONS):
        values, gradient = distance(points), slope(points, distance)
        for column, (axis, _place) in enumerate(planes):
            gradient[in_cut[:, column], axis] = 0
        size = np.maximum((gradient**2).sum(axis=1), 0.05)
        move = gradient * (values / size)[:, None]
        points[~inner] -= move[~inner]
    return points


def _lattice(low: NDArray, high: NDArray, spacing: float) -> tuple[NDArray, NDArray]:
    counts = np.maximum(1, np.round((high - low) / spacing).astype(int))
    axes = [np.linspace(a, b, n + 1) for a, b, n in zip(low, high, counts, strict=True)]
    nodes = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    index = np.arange(len(nodes)).reshape(counts + 1)
    corners = [
        index[k & 1 : counts[0] + (k & 1), k >> 1 & 1 : counts[1] + (k >> 1 & 1),
              k >> 2 : counts[2] + (k >> 2)].ravel()
        for k in range(8)
    ]  # fmt: skip
    return nodes, np.stack(corners, axis=1)[:, CUBE].reshape(-1, 4)


def _warped(
    nodes: NDArray, values: NDArray, tets: NDArray, low: NDArray, high: NDArray
) -> tuple[NDArray, NDArray]:
    """Move vertices whose edge the surface cuts close to them onto the cut."""
    edges = np.unique(np.sort(tets[:, EDGES].reshape(-1, 2), axis=1), axis=0)
    edges = edges[(values[edges[:, 0]] < 0) != (values[edges[:, 1]] < 0)]
    ends = np.concatenate([edges, edges[:, ::-1]])
    share = values[ends[:, 0]] / (values[ends[:, 0]] - values[ends[:, 1]])
    move = share[:, None] * (nodes[ends[:, 1]] - nodes[ends[:, 0]])
    at_cut = (np.abs(nodes[ends[:, 0]] - low) < 1e-12) | (np.abs(nodes[ends[:, 0]] - high) < 1e-12)
    leaves = (at_cut & (np.abs(move) > 1e-12)).any(axis=1)
    chosen = (share < WARP) & ~leaves
    ends, share, move = ends[chosen], share[chosen], move[chosen]
    order = np.lexsort((share, ends[:, 0]))
    vertex, first = np.unique(ends[order, 0], return_index=True)
    nodes, values = nodes.copy(), values.copy()
    nodes[vertex] += move[order][first]
    values[vertex] = 0
    return nodes, values


def _cut(nodes: NDArray, values: NDArray, tets: NDArray) -> tuple[NDArray, NDArray]:
    """Keep the inner part of every tetrahedron."""
    tets = np.take_along_axis(tets, np.argsort(values[tets], axis=1, kind="stable"), axis=1)
    inside, outside = (values[tets] < 0).sum(axis=1), (values[tets] > 0).sum(axis=1)
    keys, fresh = _cut_points(nodes, values, tets)

    def cut(inner: NDArray, outer: NDArray) -> NDArray:
        return len(nodes) + np.searchsorted(keys, inner * len(nodes) + outer)

    kept = [tets[(inside > 0) & (outside == 0)]]
    for p in (1, 2, 3):
        part = tets[(inside == 1) & (outside == p)].T
        corners = [*part[: 4 - p], *(cut(part[0], outer) for outer in part[4 - p :])]
        kept.append(np.stack(corners, axis=1))
    a, b, z, p = tets[(inside == 2) & (outside == 1)].T
    kept.append(_pyramids(a, b, cut(b, p), cut(a, p), z))
    a, b, c, d = tets[(inside == 2) & (outside == 2)].T
    kept.append(_prisms(np.stack([a, cut(a, c), cut(a, d), b, cut(b, c), cut(b, d)], axis=1)))
    a, b, c, d = tets[(inside == 3) & (outside == 1)].T
    kept.append(_prisms(np.stack([a, b, c, cut(a, d), cut(b, d), cut(c, d)], axis=1)))
    return np.concatenate([nodes, fresh]), np.concatenate(kept)


def _cut_points(nodes: NDArray, values: NDArray, tets: NDArray) -> tuple[NDArray, NDArray]:
    """Keys (inner vertex * n + outer vertex) of the edges that the surface cuts, and where."""
    edges = tets[:, EDGES].reshape(-1, 2)
    edges = edges[(values[edges[:, 0]] < 0) & (values[edges[:, 1]] > 0)]
    keys = np.unique(edges[:, 0] * len(nodes) + edges[:, 1])
    inner, outer = np.divmod(keys, len(nodes))
    share = (values[inner] / (values[inner] - values[outer]))[:, None]
    return keys, (1 - share) * nodes[inner] + share * nodes[outer]


def _pyramids(a: NDArray, b: NDArray, c: NDArray, d: NDArray, apex: NDArray) -> NDArray:
    """Two tetrahedra each; the diagonal of the base starts at its least vertex."""
    base = np.stack([a, b, c, d], axis=1)
    first = np.argmin(base, axis=1)[:, None]
    a, b, c, d = np.take_along_axis(base, (first + np.arange(4)) % 4, axis=1).T
    return np.concatenate([np.stack([a, b, c, apex], axis=1), np.stack([a, c, d, apex], axis=1)])


def _prisms(prisms: NDArray) -> NDArray:
    """Three tetrahedra each; diagonals start at the least vertex, so that neighbours agree.

    Columns 0 to 2 are one triangle, 3 to 5 the other, in the same order.
    """
    turns = np.array(
        [[0, 1, 2, 3, 4, 5], [1, 2, 0, 4, 5, 3], [2, 0, 1, 5, 3, 4],
         [3, 5, 4, 0, 2, 1], [4, 3, 5, 1, 0, 2], [5, 4, 3, 2, 1, 0]]
    )  # fmt: skip
    v = np.take_along_axis(prisms, turns[np.argmin(prisms, axis=1)], axis=1)
    other = np.minimum(v[:, 1], v[:, 5]) < np.minimum(v[:, 2], v[:, 4])
    one = [[0, 1, 2, 5], [0, 1, 5, 4], [0, 4, 5, 3]]
    two = [[0, 1, 2, 4], [0, 4, 2, 5], [0, 4, 5, 3]]
    return np.concatenate([v[other][:, one].reshape(-1, 4), v[~other][:, two].reshape(-1, 4)])


def _tidy(nodes: NDArray, tets: NDArray, spacing: float) -> tuple[NDArray, NDArray]:
    """Orient, leave out slivers of no volume and unused nodes."""
    volume = _volumes(nodes, tets)
    tets = np.where((volume < 0)[:, None], tets[:, [0, 2, 1, 3]], tets)
    tets = tets[np.abs(volume) > SMALLEST_VOLUME * spacing**3 / 6]
    used, tets = np.unique(tets, return_inverse=True)
    return nodes[used], tets.reshape(-1, 4)
