"""Tetrahedra for a closed surface, and finer ones near a point."""

import contextlib
import tempfile

import numpy as np
import open3d as o3d
import pytetwild
import trimesh
from numpy.typing import NDArray
from skfem import MeshTet

from palpate.solid.mesh import SolidMesh, solid_mesh
from palpate.solid.quality import surface_gap
from palpate.solid.surface_check import check_surface

# Share of the wanted number of nodes.
ENOUGH = 0.03
FILLS = 16
# Edge length as a share of the diagonal, at first and at the ends of the search.
FIRST_EDGE = 0.05
EDGES = (0.004, 0.9)
# What fTetWild keeps to unless told otherwise, as a share of the diagonal.
ENVELOPE = 1e-3
# The envelope holds where fTetWild samples it, and not for the way back.
MARGIN = 0.6
# Surfaces with more vertices than this share of the nodes are thinned, down to the second share;
# the long edges that tell how few nodes fill one; how closely a thinned surface is kept to.
SURFACE_SHARE, LEAST_SHARE = 0.85, 0.3
COARSE_EDGE = 0.12
THIN_ENVELOPE = 3e-3
REFINEMENTS = 12
# From the centroid to a corner of a regular element, in edges.
AROUND = 0.612


def tetrahedralise(
    vertices_m: NDArray, faces: NDArray, *, vertices: int, largest_gap_m: float | None = None
) -> SolidMesh:
    """Fill a closed surface with tetrahedra (fTetWild).

    pytetwild gives another mesh on every run: a mesh that results are to rest on must be kept.

    Parameters
    ----------
    vertices_m, faces : (n, 3), (m, 3) arrays
        Closed surface, outward or inward [m].
    vertices : int
        Wanted number of nodes; the edge length is searched until it is met within 3 %.
    largest_gap_m : float, optional
        How far the mesh's surface may lie from the given one, and that from it [m]; a thousandth
        of the surface's diagonal by default.

    Returns
    -------
    SolidMesh

    Raises
    ------
    ValueError
        If the surface is open or cuts itself, no edge length gives the number of nodes, or the
        mesh is too far from the surface.
    """
    surface = check_surface(vertices_m, faces)
    diagonal = float(np.linalg.norm(np.ptp(vertices_m, axis=0)))
    gap = ENVELOPE * diagonal if largest_gap_m is None else largest_gap_m
    thin = _thinned(surface, vertices, gap)
    envelope = ENVELOPE if thin is surface else THIN_ENVELOPE
    mesh = _with_count(thin, vertices, MARGIN * min(gap / diagonal, envelope))
    triangles = mesh.surface_triangles()
    _check_gap(surface_gap(mesh.nodes_m, triangles, surface.vertices, surface.faces), gap)
    return mesh


def refine_near(mesh: SolidMesh, point_m: NDArray, *, radius_m: float, edge_m: float) -> SolidMesh:
    """Bisect elements near a point until their edges are short enough.

    Parameters
    ----------
    mesh : SolidMesh
        Four-node elements.
    point_m : (3,) array
        Point [m].
    radius_m : float
        Elements whose centroid lies within this distance are refined, and elements so large that
        the point may be in them [m].
    edge_m : float
        Longest edge wanted there [m].

    Returns
    -------
    SolidMesh
        Conforming; the same volume and surface.

    Raises
    ------
    ValueError
        If the elements have ten nodes.
    """
    if mesh.order != 1:
        raise ValueError("mesh: expected four-node elements to refine, found ten-node ones")
    for _ in range(REFINEMENTS):
        corners = mesh.nodes_m[mesh.tetrahedra]
        longest = np.linalg.norm(corners[:, :, None] - corners[:, None], axis=-1).max(axis=(1, 2))
        away = np.linalg.norm(corners.mean(axis=1) - point_m, axis=1)
        near = away < np.maximum(radius_m, AROUND * longest)
        chosen = np.flatnonzero(near & (longest > edge_m))
        if not len(chosen):
            break
        refined = MeshTet(*map(np.ascontiguousarray, (mesh.nodes_m.T, mesh.tetrahedra.T))).refined(
            chosen
        )
        mesh = solid_mesh(refined.p.T, refined.t.T)
    return mesh


def _thinned(surface: trimesh.Trimesh, vertices: int, gap_m: float) -> trimesh.Trimesh:
    """Take vertices away (quadric error) until long edges fill the surface with so few nodes."""
    thin, count = surface, float(len(surface.vertices))
    found = int(count / SURFACE_SHARE)
    while found > vertices and count > LEAST_SHARE * vertices:
        count *= max(min(vertices / found, SURFACE_SHARE), SURFACE_SHARE**4)
        thin = _decimated(surface, count)
        gap = surface_gap(thin.vertices, thin.faces, surface.vertices, surface.faces)
        _check_gap(gap, gap_m)
        found = len(_fill(thin, COARSE_EDGE, THIN_ENVELOPE).nodes_m)
    return thin


def _check_gap(found_m: float, largest_m: float) -> None:
    if found_m > largest_m:
        raise ValueError(
            f"largest_gap_m: expected at most {largest_m:.3g} m, found {found_m:.3g} m"
        )


def _decimated(surface: trimesh.Trimesh, vertices: float) -> trimesh.Trimesh:
    mesh = o3d.geometry.TriangleMesh(
        o3d.utility.Vector3dVector(surface.vertices), o3d.utility.Vector3iVector(surface.faces)
    )
    # A closed surface like a sphere has two triangles per vertex.
    thin = mesh.simplify_quadric_decimation(int(2 * vertices))
    return check_surface(np.asarray(thin.vertices), np.asarray(thin.triangles))


def _with_count(surface: trimesh.Trimesh, vertices: int, envelope: float) -> SolidMesh:
    """Search the edge length by secants on logarithms, kept between bounds known."""
    low, high, factor, tried = *np.log(EDGES), float(np.log(FIRST_EDGE)), []
    for _ in range(FILLS):
        mesh = _fill(surface, float(np.exp(factor)), envelope)
        excess = float(np.log(len(mesh.nodes_m) / vertices))
        tried.append((abs(excess), len(mesh.nodes_m)))
        if abs(np.expm1(excess)) <= ENOUGH:
            return mesh
        low, high = (factor, high) if excess > 0 else (low, factor)
        # Nodes go with the edge to a power between -2 and -3.
        step = factor + excess / 2.5
        factor = step if low < step < high else (low + high) / 2
    raise ValueError(
        f"vertices: expected a mesh of {vertices} within {ENOUGH:.0%}, found {min(tried)[1]}"
    )


def _fill(surface: trimesh.Trimesh, edge_factor: float, envelope: float) -> SolidMesh:
    # fTetWild leaves a file in the working directory.
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        nodes, tetrahedra = pytetwild.tetrahedralize(
            np.asarray(surface.vertices, dtype=float),
            np.asarray(surface.faces, dtype=np.int32),
            edge_length_fac=edge_factor,
            epsilon=envelope,
            num_threads=1,
        )
    used, numbers = np.unique(tetrahedra, return_inverse=True)
    return solid_mesh(nodes[used], numbers.reshape(-1, 4))
