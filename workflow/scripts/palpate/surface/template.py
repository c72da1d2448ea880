"""The undeformed template: a closed triangle mesh of the whole object."""

import logging
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import trimesh
from numpy.typing import NDArray
from trimesh.triangles import closest_point

from palpate.capture.closed_surface import read_surface
from palpate.open3d_core import ClosestPoints, o3d
from palpate.solid.mesh import at_nodes, doubled_normals
from palpate.solid.quality import cutting_triangles

# Two passes halve an edge: so many take the longest plausible one to a few micrometres.
PASSES = 40
# A surface of more is thinned: at a millimetre's edge, half a square metre.
MOST_VERTICES = 50_000
# Of smoothing, until a surface that thinning folded over does not cut itself.
UNFOLDING_ROUNDS = 20


@dataclass(frozen=True)
class Template:
    """Closed triangle mesh with outward triangles.

    Attributes
    ----------
    vertices_m : (n, 3) array
        Object frame [m].
    faces : (m, 3) int array
    """

    vertices_m: NDArray
    faces: NDArray


def read_template(path: str | Path, *, unit: str) -> Template:
    """Read a closed surface.

    Parameters
    ----------
    path : path
        Any mesh file that trimesh reads.
    unit : {"m", "mm"}
        Unit of its coordinates.

    Raises
    ------
    ValueError
        If it is no closed surface of one piece, or its size says that the unit is wrong.
    """
    mesh = read_surface(path, unit=unit)
    if len(mesh.vertices) > MOST_VERTICES:
        found = f"{len(mesh.vertices)} vertices"
        mesh = decimated(mesh, MOST_VERTICES)
        if not mesh.is_watertight or mesh.volume <= 0:
            expected = f"at most {MOST_VERTICES} vertices, or a surface that can be thinned"
            raise ValueError(f"{path}: template: expected {expected}, found {found}")
        logging.info("%s: template: thinned from %s to %d", path, found, len(mesh.vertices))
    return Template(np.asarray(mesh.vertices), np.asarray(mesh.faces))


def decimated(mesh: trimesh.Trimesh, vertices: int) -> trimesh.Trimesh:
    """Thin a closed surface to about so many vertices, which lie on it."""
    wanted = 2 * (vertices - mesh.euler_number)
    legacy = o3d.geometry.TriangleMesh(
        o3d.utility.Vector3dVector(mesh.vertices), o3d.utility.Vector3iVector(mesh.faces)
    )
    if len(mesh.faces) > wanted:
        legacy = legacy.simplify_quadric_decimation(wanted)
    # Collapsed edges leave vertices beside the surface, by several times its own noise.
    on_surface, _, _ = ClosestPoints(mesh.vertices, mesh.faces)(np.asarray(legacy.vertices))
    return unfolded(trimesh.Trimesh(on_surface, np.asarray(legacy.triangles), process=False))


def unfolded(mesh: trimesh.Trimesh) -> trimesh.Trimesh:
    """Smooth a closed surface where its triangles cut each other, and nowhere else.

    Parameters
    ----------
    mesh : trimesh.Trimesh

    Returns
    -------
    trimesh.Trimesh
        With the same triangles; the same surface if none of them cut.

    Raises
    ------
    ValueError
        If the surface still cuts itself when smoothing has had its rounds.
    """
    mesh = mesh.copy()
    for _ in range(UNFOLDING_ROUNDS):
        cutting = cutting_triangles(mesh.vertices, mesh.faces)
        if not len(cutting):
            return mesh
        moved = np.unique(mesh.faces[np.unique(cutting)])
        vertices = mesh.vertices.copy()
        vertices[moved] = [mesh.vertices[mesh.vertex_neighbors[k]].mean(axis=0) for k in moved]
        mesh.vertices = vertices
    first, second = cutting[0]
    raise ValueError(
        "scans: expected a surface that does not cut itself,"
        f" found triangles {first} and {second} that do"
    )


def unique_edges(faces: NDArray) -> NDArray:
    """Edges of a mesh, each once, shape (k, 2)."""
    edges = np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    return np.unique(edges, axis=0)


def vertex_normals(vertices: NDArray, faces: NDArray) -> NDArray:
    """Unit normals, means of the adjacent triangles' by area, shape (n, 3)."""
    areas = np.repeat(doubled_normals(vertices, faces)[:, None], 3, axis=1)
    normals = at_nodes(faces, areas, len(vertices))
    return normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)


def refine_template(
    template: Template, point_m: NDArray, *, radius_m: float, edge_m: float
) -> Template:
    """Bisect triangles around the contact until their edges are short (Section 5.2.1).

    Longest edges are bisected and the bisection handed on to neighbours (Rivara), so that the
    surface stays closed and its triangles well shaped.

    Parameters
    ----------
    template : Template
    point_m : (3,) array
        Contact point, object frame [m].
    radius_m, edge_m : float
        Triangles that come within the radius get edges of at most edge_m [m]; those of a box
        that is drawn by its corners may have no vertex there.

    Raises
    ------
    ValueError
        If edges stay longer after as many passes as are tried.
    """
    vertices, faces = template.vertices_m, template.faces
    for passes in range(PASSES + 1):
        longest = _edge_lengths(vertices, faces).max(axis=1)
        chosen = longest > edge_m
        # In edges, as trimesh's zero is of triangles about that large.
        corners = (vertices[faces[chosen]] - point_m) / edge_m
        away = np.linalg.norm(closest_point(corners, np.zeros((len(corners), 3))), axis=1)
        chosen[chosen] = away < radius_m / edge_m
        if not chosen.any():
            break
        if passes == PASSES:
            expected = f"at most {edge_m:g} m after {PASSES} passes"
            raise ValueError(f"edge_m: expected {expected}, found {longest[chosen].max():.3g} m")
        vertices, faces = _bisect(vertices, faces, chosen)
    return Template(vertices, faces)


def _edge_lengths(vertices: NDArray, faces: NDArray) -> NDArray:
    """Lengths of the edges 01, 12, 20 of each triangle, shape (m, 3)."""
    corners = vertices[faces]
    return np.linalg.norm(corners - np.roll(corners, -1, axis=1), axis=-1)


def _bisect(vertices: NDArray, faces: NDArray, chosen: NDArray) -> tuple[NDArray, NDArray]:
    # Turn each triangle so that its longest edge comes first; ties go to the lower vertices, so
    # that both neighbours of an edge agree.
    faces = _longest_first(vertices, faces)
    sides = np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 3, 2), axis=-1)
    edges, index = np.unique(sides.reshape(-1, 2), axis=0, return_inverse=True)
    index = index.reshape(-1, 3)
    marked = np.zeros(len(edges), dtype=bool)
    marked[index[chosen, 0]] = True
    while True:
        more = marked[index].any(axis=1) & ~marked[index[:, 0]]
        if not more.any():
            break
        marked[index[more, 0]] = True
    middle = np.full(len(edges), -1)
    middle[marked] = len(vertices) + np.arange(marked.sum())
    vertices = np.concatenate([vertices, vertices[edges[marked]].mean(axis=1)])
    return vertices, _split(faces, middle[index])


def _split(faces: NDArray, middle: NDArray) -> NDArray:
    a, b, c = faces.T
    ab, bc, ca = middle.T
    whole = ab < 0
    parts = [faces[whole]]
    for first, second, third, mark in ((ab, b, c, bc), (a, ab, c, ca)):
        one = ~whole & (mark < 0)
        parts.append(np.stack([first, second, third], axis=1)[one])
    two = ~whole & (bc >= 0)
    parts += [np.stack(t, axis=1)[two] for t in ((ab, b, bc), (ab, bc, c))]
    three = ~whole & (ca >= 0)
    parts += [np.stack(t, axis=1)[three] for t in ((a, ab, ca), (ab, c, ca))]
    return np.concatenate(parts)


def _longest_first(vertices: NDArray, faces: NDArray) -> NDArray:
    lengths = np.round(_edge_lengths(vertices, faces), 12)
    pairs = np.sort(np.stack([faces, np.roll(faces, -1, axis=1)], axis=-1), axis=-1)
    rank = pairs[..., 0] * (faces.max() + 1) + pairs[..., 1]
    best = np.lexsort((rank, -lengths), axis=1)[:, 0]
    return np.take_along_axis(faces, (best[:, None] + np.arange(3)) % 3, axis=1)
