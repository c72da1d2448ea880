"""Tetrahedra for a closed surface: a mesh of a wanted number of nodes near it."""

import contextlib
import logging
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytetwild
import trimesh
from numpy.typing import NDArray
from skfem import MeshTet
from trimesh import triangles
from trimesh.intersections import slice_faces_plane

from palpate.open3d_core import o3d
from palpate.solid.mesh import SolidMesh, read_solid, solid_mesh
from palpate.solid.quality import MeshQuality, check_surface, mesh_quality, surface_gap
from palpate.solid.support import Support

# Nodes wanted on the support, so that losing one or another does not let the object tilt.
SUPPORT_NODES = 12
# Wanted edge over distance from the support, once away from it.
GROWTH = 1.0
# Area that a node takes in a lattice of regular triangles, in squared edges.
LATTICE = 3**0.5 / 2
# Most cells of the grid that the wanted edge is given on, along an axis.
CELLS = 24
log = logging.getLogger(__name__)

# Share of the wanted number of nodes that is looked for, the share at which an envelope is not
# given up, the share that is taken at last, and fills that may be spent at one envelope.
ENOUGH, FAIR, TAKEN = 0.03, 0.1, 0.3
FILLS = 6
# A longer edge that takes away less than this share of the nodes too many, while they are more
# than fair: it is the envelope that asks for them.
STUCK = 0.25
# How far the mesh's surface may lie off unless told otherwise, as a share of the diagonal.
GAP = 1e-3
# The envelope holds where fTetWild samples it, and not for the way back.
MARGIN = 0.6
# fTetWild's envelopes, as shares of the diagonal: a narrow one keeps the shape, and more nodes.
ENVELOPES = (2e-3, 2.8e-3, 4e-3, 5.6e-3, 8e-3, 11e-3, 16e-3)
# Finer surfaces take minutes a fill: vertices that are left, per wanted node, and the share of
# the gap that they may cost.
THINNED = 1.5
THINNING = 0.3
# Elements per node, fTetWild's mean edge over the one asked for, and the longest to ask for.
ELEMENTS = 3.9
REACHED = 0.72
LONGEST = 2.0
# fTetWild halves edges longer than four thirds of what is asked for.
SPLIT = 0.75
# Nodes go with the edge to a power between -1, if the envelope asks for most, and -3.
POWER, POWERS = 2.5, (1.0, 3.0)
# Volume of a regular element in cubed edges.
REGULAR = 2**0.5 / 12
# A kept mesh of another object is farther from the template than its own ever is, over its size.
LARGEST_GAP = 0.02


def supported_area(surface: trimesh.Trimesh, support: Support) -> float:
    """Area of a surface within the support's tolerance [m^2]."""
    vertices, faces = surface.vertices, surface.faces
    for side in (support.up, -support.up):
        origin = support.plane_point_m - side * support.tolerance_m
        # Trimesh.slice_plane does the same and needs shapely.
        vertices, faces, _ = slice_faces_plane(vertices, faces, side, origin)
    return float(triangles.area(vertices[faces]).sum())


def support_edge(surface: trimesh.Trimesh, support: Support) -> float:
    """Edge with which enough nodes lie on the support [m]; infinite if the surface is off it."""
    area = supported_area(surface, support)
    return float(np.sqrt(area / (LATTICE * SUPPORT_NODES))) if area > 0 else np.inf


def edge_field(
    vertices_m: NDArray, support: Support, *, support_edge_m: float, edge_m: float
) -> dict[str, NDArray]:
    """Edges that grow from the support's to those of the rest, linear between a grid's nodes.

    Parameters
    ----------
    vertices_m : (n, 3) array
        Surface to be filled, whose box the field covers [m].
    support : Support
    support_edge_m, edge_m : float
        Edge wanted on the support, and away from it [m].

    Returns
    -------
    dict
        As `pytetwild.tetrahedralize` takes it: ``bg_vertices`` (n, 3) [m], ``bg_tets`` (m, 4) and
        the edge wanted at the nodes, ``bg_values`` (n,) [m].
    """
    low, high = vertices_m.min(axis=0) - edge_m, vertices_m.max(axis=0) + edge_m
    cells = np.clip(np.ceil((high - low) / support_edge_m), 2, CELLS).astype(int)
    grid = MeshTet.init_tensor(
        *(np.linspace(a, b, n + 1) for a, b, n in zip(low, high, cells, strict=True))
    )
    away = np.abs(support.heights_m(grid.p.T))
    wanted = np.minimum(support_edge_m + GROWTH * away, edge_m)
    return {
        "bg_vertices": np.ascontiguousarray(grid.p.T),
        "bg_tets": np.ascontiguousarray(grid.t.T, dtype=np.int32),
        "bg_values": wanted,
    }


def tetrahedralise(
    vertices_m: NDArray,
    faces: NDArray,
    *,
    vertices: int,
    largest_gap_m: float | None = None,
    support: Support | None = None,
) -> SolidMesh:
    """Fill a closed surface with tetrahedra (fTetWild).

    pytetwild gives another mesh on every run: a mesh that results are to rest on must be kept.

    Parameters
    ----------
    vertices_m, faces : (n, 3), (m, 3) arrays
        Closed surface, outward or inward [m].
    vertices : int
        Wanted number of nodes; edge and envelope are searched until it is met within 3 %. If it
        never is, the nearest mesh within 30 % is taken and the log warns of it.
    largest_gap_m : float, optional
        How far the mesh's surface may lie from the given one, and that from it [m]; a thousandth
        of the surface's diagonal by default. The search begins well below it and uses it up only
        if too many nodes are needed otherwise.
    support : Support, optional
        What the object stands on; edges are shorter there if too few nodes would lie on it.

    Returns
    -------
    SolidMesh

    Raises
    ------
    ValueError
        If the surface is open or cuts itself, no mesh so close to it has the number of nodes, or
        the mesh is too far from it.
    """
    surface = check_surface(vertices_m, faces)
    diagonal = float(np.linalg.norm(np.ptp(vertices_m, axis=0)))
    gap = GAP * diagonal if largest_gap_m is None else largest_gap_m
    thin = _thinned(surface, vertices, gap)
    needed = np.inf if support is None else SPLIT * support_edge(thin, support)
    filler = _Filler(thin, diagonal, support, needed)
    search = _Search(vertices, _usual_edge(surface, vertices), filler)
    narrow = [share * diagonal for share in ENVELOPES if share * diagonal < MARGIN * gap]
    for envelope_m in [*narrow, MARGIN * gap]:
        if search.at(envelope_m, last=envelope_m == MARGIN * gap):
            break
    mesh = search.nearest()
    _check_count(len(mesh.nodes_m), vertices)
    _check_gap(mesh, surface, gap)
    return mesh


@dataclass(frozen=True)
class _Filler:
    """fTetWild on one surface, with shorter edges on the support if need be."""

    surface: trimesh.Trimesh
    diagonal_m: float
    support: Support | None
    support_edge_m: float

    def fill(self, edge_m: float, envelope_m: float) -> SolidMesh:
        """Fill with about this edge, the surface kept within the envelope."""
        options = {"edge_length_abs": edge_m, "epsilon": envelope_m / self.diagonal_m}
        if self.support_edge_m < edge_m:
            edges = {"support_edge_m": self.support_edge_m, "edge_m": edge_m}
            options |= edge_field(self.surface.vertices, self.support, **edges)
        # fTetWild leaves a file in the working directory.
        with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
            nodes, tetrahedra = pytetwild.tetrahedralize(
                np.asarray(self.surface.vertices, dtype=float),
                np.asarray(self.surface.faces, dtype=np.int32),
                num_threads=1,
                **options,
            )
        used, numbers = np.unique(tetrahedra, return_inverse=True)
        return solid_mesh(nodes[used], numbers.reshape(-1, 4))


@dataclass(frozen=True)
class _Search:
    """Edge for a number of nodes: secants on logarithms, kept between bounds."""

    wanted: int
    usual_edge_m: float
    filler: _Filler
    meshes: list[SolidMesh] = field(default_factory=list)

    def at(self, envelope_m: float, *, last: bool) -> bool:
        """Search with one envelope; whether it gave the number of nodes."""
        edge, longest = np.log(self.usual_edge_m * np.array([1, LONGEST]))
        low, high, before, tried = -np.inf, np.inf, np.inf if last else 2 * FAIR, []
        for _ in range(FILLS):
            excess = self._excess(float(np.exp(edge)), envelope_m)
            if abs(np.expm1(excess)) <= ENOUGH:
                return True
            if (edge >= longest and excess > 0) or excess > max(FAIR, (1 - STUCK) * before):
                break
            low, high, before = (edge, high, excess) if excess > 0 else (low, edge, np.inf)
            tried.append((edge, excess))
            step = min(edge + excess / _power(tried), longest)
            edge = step if low < step < high else (low + high) / 2
        return False

    def nearest(self) -> SolidMesh:
        """Mesh whose number of nodes is nearest to the wanted one."""
        return min(self.meshes, key=lambda mesh: abs(len(mesh.nodes_m) - self.wanted))

    def _excess(self, edge_m: float, envelope_m: float) -> float:
        """Logarithm of the nodes reached over those wanted."""
        self.meshes.append(self.filler.fill(edge_m, envelope_m))
        found = len(self.meshes[-1].nodes_m)
        values = found, 1000 * edge_m, 1000 * envelope_m
        log.info("%d nodes with edges of %.3g mm, envelope %.2g mm", *values)
        return float(np.log(found / self.wanted))


def _power(tried: list[tuple[float, float]]) -> float:
    """Power of the edge that the last two fills show, or the usual one."""
    if len(tried) < 2:
        return POWER
    (edge, excess), (other, its) = tried[-2:]
    return float(np.clip((its - excess) / (edge - other), *POWERS)) if edge != other else POWER


def _usual_edge(surface: trimesh.Trimesh, vertices: int) -> float:
    """Edge to ask for if all elements were regular [m]."""
    return (surface.volume / (vertices * ELEMENTS * REGULAR)) ** (1 / 3) / REACHED


def _thinned(surface: trimesh.Trimesh, vertices: int, gap_m: float) -> trimesh.Trimesh:
    """Take vertices of a fine surface away (quadric error), if that leaves it sound and near."""
    _check_reachable(surface, vertices, gap_m)
    thin = _decimated(surface, int(THINNED * vertices))
    return surface if thin is None or _gap(thin, surface) > THINNING * gap_m else thin


def _check_reachable(surface: trimesh.Trimesh, vertices: int, gap_m: float) -> None:
    """Find out before any fill whether so few vertices can keep to the surface."""
    coarse = _decimated(surface, vertices)
    needed = 0.0 if coarse is None else _gap(coarse, surface)
    if needed > gap_m:
        raise ValueError(
            f"largest_gap_m: expected at least {needed:.3g} m with {vertices} nodes,"
            f" found {gap_m:.3g} m"
        )


def _gap(thin: trimesh.Trimesh, surface: trimesh.Trimesh) -> float:
    return surface_gap(thin.vertices, thin.faces, surface.vertices, surface.faces)


def _decimated(surface: trimesh.Trimesh, vertices: int) -> trimesh.Trimesh | None:
    """Surface of so many vertices, or None if it has no more or they spoil it."""
    if len(surface.vertices) <= vertices:
        return None
    mesh = o3d.geometry.TriangleMesh(
        o3d.utility.Vector3dVector(surface.vertices), o3d.utility.Vector3iVector(surface.faces)
    )
    # A closed surface like a sphere has two triangles per vertex.
    thin = mesh.simplify_quadric_decimation(2 * vertices)
    try:
        return check_surface(np.asarray(thin.vertices), np.asarray(thin.triangles))
    except ValueError as fault:
        log.info("%d vertices spoil the surface: %s", vertices, fault)
        return None


def _check_count(found: int, wanted: int) -> None:
    off = abs(found / wanted - 1)
    if off > TAKEN:
        expected = f"a mesh of {wanted} within {TAKEN:.0%}"
        raise ValueError(f"vertices: expected {expected}, found {found} at the nearest")
    if off > ENOUGH:
        log.warning("%d nodes at the nearest, wanted were %d", found, wanted)


def _check_gap(mesh: SolidMesh, surface: trimesh.Trimesh, largest_m: float) -> None:
    found = surface_gap(mesh.nodes_m, mesh.surface_triangles(), surface.vertices, surface.faces)
    if found > largest_m:
        raise ValueError(f"largest_gap_m: expected at most {largest_m:.3g} m, found {found:.3g} m")


def object_solid(
    vertices_m: NDArray,
    faces: NDArray,
    declared: Mapping,
    support: Support,
    *,
    kept: str | Path | None = None,
) -> tuple[SolidMesh, MeshQuality]:
    """Read the kept mesh, or fill the template, and hold it to the template.

    Parameters
    ----------
    vertices_m, faces : (n, 3), (m, 3) arrays
        Template [m].
    declared : mapping
        The ``template`` block of object.yaml: ``vertices``, and ``solid_vertices`` of the solid.
    support : Support
    kept : path, optional
        VTU file; made anew without.

    Raises
    ------
    ValueError
        If the kept mesh, or what was made, lies farther from the template than its own ever does.
    """
    allowed = LARGEST_GAP * float(np.ptp(vertices_m, axis=0).max())
    if kept:
        solid = read_solid(kept)
    else:
        solid = tetrahedralise(
            vertices_m,
            faces,
            vertices=int(declared.get("solid_vertices", declared["vertices"])),
            largest_gap_m=allowed,
            support=support,
        )
    quality = mesh_quality(solid, vertices_m, faces)
    if quality.largest_gap_m > allowed:
        raise ValueError(
            f"{f'{kept}: ' if kept else ''}nodes: expected within {allowed:.2g} m of the template,"
            f" found {quality.largest_gap_m:.2g} m"
        )
    return solid, quality
