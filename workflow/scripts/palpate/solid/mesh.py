"""Solid meshes of tetrahedra with four or ten nodes, and finer ones near a point."""

import logging
import zlib
from dataclasses import dataclass
from pathlib import Path
from xml.etree.ElementTree import ParseError

import meshio
import numpy as np
from numpy.typing import NDArray
from skfem import MeshTet

# VTK's order: four corners, then the middles of these edges.
EDGES = np.array([[0, 1], [1, 2], [2, 0], [0, 3], [1, 3], [2, 3]])
# Nodes of a tetrahedron's faces seen from outside: corners, middles of the edges 01, 12, 20.
FACES = np.array([[0, 2, 1, 6, 5, 4], [0, 1, 3, 4, 8, 7], [1, 2, 3, 5, 9, 8], [0, 3, 2, 7, 9, 6]])
# The same element with its volume's sign turned: corners 1 and 2 change places.
TURNED = np.array([0, 2, 1, 3, 6, 5, 4, 7, 9, 8])
CELLS = {4: "tetra", 10: "tetra10"}
FLAT = 1e-12
# How far a middle node may be from the middle, as a share of the longest element's size.
STRAIGHT = 1e-6
# What meshio's reader of VTU meets in files that are damaged or something else.
UNREADABLE = (
    meshio.ReadError,
    ParseError,
    ValueError,
    LookupError,
    TypeError,
    AttributeError,
    AssertionError,
    zlib.error,
    SystemExit,
)
# It warns of the order of the arrays that it has made itself.
logging.getLogger("skfem.mesh").setLevel(logging.ERROR)
BISECTIONS = 12
# From the centroid to a corner of a regular element, in edges.
AROUND = 0.612


@dataclass(frozen=True)
class SolidMesh:
    """Tetrahedra of positive volume; sides are straight but where `curved_to` bent them.

    Attributes
    ----------
    nodes_m : (n, 3) array
        Node coordinates [m].
    tetrahedra : (m, 4) or (m, 10) int array
        Nodes of each element: corners, then the middles of the edges 01, 12, 20, 03, 13, 23.
    """

    nodes_m: NDArray
    tetrahedra: NDArray

    @property
    def order(self) -> int:
        """Polynomial order of the displacement in an element, 1 or 2."""
        return 1 if self.tetrahedra.shape[1] == 4 else 2

    @property
    def corners(self) -> NDArray:
        """Corner nodes of each element, shape (m, 4)."""
        return self.tetrahedra[:, :4]

    @property
    def volume_m3(self) -> float:
        """Volume of the elements as their corners have it, with straight sides [m^3]."""
        return float(element_volumes(self.nodes_m, self.tetrahedra).sum())

    def surface_faces(self) -> NDArray:
        """All nodes of the boundary triangles, outward, shape (k, 3) or (k, 6)."""
        _, first, inverse = _face_groups(self.corners)
        alone = np.sort(first[np.bincount(inverse) == 1])
        faces = FACES[:, :3] if self.order == 1 else FACES
        return self.tetrahedra[alone // 4][np.arange(len(alone))[:, None], faces[alone % 4]]

    def surface_triangles(self) -> NDArray:
        """Corners of the boundary triangles, outward, shape (k, 3)."""
        return self.surface_faces()[:, :3]

    def surface_nodes(self) -> NDArray:
        """Numbers of all nodes on the boundary, sorted."""
        return np.unique(self.surface_faces())


def element_volumes(nodes_m: NDArray, tetrahedra: NDArray) -> NDArray:
    """Signed volume of each straight-sided tetrahedron, shape (m,) [m^3]."""
    a, b, c, d = (nodes_m[tetrahedra[:, k]] for k in range(4))
    return np.einsum("ij,ij->i", np.cross(b - a, c - a), d - a) / 6


def doubled_normals(nodes_m: NDArray, faces: NDArray) -> NDArray:
    """Normals of triangles over nodes, as long as twice their areas, shape (k, 3) [m^2]."""
    a, b, c = (nodes_m[faces[:, k]] for k in range(3))
    return np.cross(b - a, c - a)


def at_nodes(nodes: NDArray, vectors: NDArray, size: int) -> NDArray:
    """Sums of vectors (..., k) at the nodes (...) that they belong to, shape (size, k)."""
    parts = vectors.reshape(-1, vectors.shape[-1]).T
    return np.stack([np.bincount(nodes.ravel(), part, size) for part in parts], axis=1, dtype=float)


def solid_mesh(nodes_m: NDArray, tetrahedra: NDArray) -> SolidMesh:
    """Make a solid mesh, with all elements turned to positive volume.

    Parameters
    ----------
    nodes_m : (n, 3) array
        Node coordinates [m].
    tetrahedra : (m, 4) or (m, 10) int array
        Nodes of each element in VTK's order.

    Returns
    -------
    SolidMesh

    Raises
    ------
    ValueError
        If a node is missing or in no element, an element has no volume or a curved side, or
        elements overlap: a face that three share, or with both elements on one side of it.
    """
    nodes_m = np.asarray(nodes_m, dtype=float)
    tetrahedra = np.asarray(tetrahedra, dtype=np.int64)
    _check_numbers(nodes_m, tetrahedra)
    volumes = element_volumes(nodes_m, tetrahedra)
    flat = np.flatnonzero(np.abs(volumes) <= FLAT * np.abs(volumes).max())
    if len(flat):
        raise ValueError(f"tetrahedra: expected volumes, found element {flat[0]} without one")
    turned = tetrahedra[:, TURNED[: tetrahedra.shape[1]]]
    mesh = SolidMesh(nodes_m, np.where((volumes < 0)[:, None], turned, tetrahedra))
    _check_overlap(mesh.corners)
    _check_straight(mesh)
    return mesh


def quadratic(mesh: SolidMesh) -> SolidMesh:
    """Add the middle of each edge to four-node elements.

    Parameters
    ----------
    mesh : SolidMesh
        Of order 1.

    Returns
    -------
    SolidMesh
        Of order 2; the first nodes are those of the mesh.

    Raises
    ------
    ValueError
        If the mesh has ten-node elements already.
    """
    if mesh.order != 1:
        raise ValueError("mesh: expected four-node elements, found ten-node ones")
    pairs = np.sort(mesh.tetrahedra[:, EDGES].reshape(-1, 2), axis=1)
    edges, number = np.unique(pairs, axis=0, return_inverse=True)
    nodes = np.concatenate([mesh.nodes_m, mesh.nodes_m[edges].mean(axis=1)])
    middles = len(mesh.nodes_m) + number.reshape(-1, 6)
    return SolidMesh(nodes, np.concatenate([mesh.tetrahedra, middles], axis=1))


def write_solid(
    path: str | Path, mesh: SolidMesh, *, point_data: dict[str, NDArray] | None = None
) -> None:
    """Write a solid mesh as VTU, with values at its nodes if given."""
    cells = [(CELLS[mesh.tetrahedra.shape[1]], mesh.tetrahedra)]
    data = meshio.Mesh(mesh.nodes_m, cells, point_data=point_data or {})
    meshio.write(path, data, file_format="vtu")


def read_solid(path: str | Path) -> SolidMesh:
    """Read a solid mesh from VTU.

    Raises
    ------
    ValueError
        If the file is no VTU, holds no tetrahedra of one kind, or `solid_mesh` refuses them.

    Examples
    --------
    >>> read_solid("config/meshes/foam_block.vtu").tetrahedra.shape[1]
    4
    """
    mesh = _read_vtu(path)
    kinds = sorted(mesh.cells_dict)
    if kinds not in (["tetra"], ["tetra10"]):
        raise ValueError(f"{path}: cells: expected tetrahedra of one kind, found {kinds}")
    try:
        return solid_mesh(mesh.points, mesh.cells_dict[kinds[0]])
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None


def _read_vtu(path: str | Path) -> meshio.Mesh:
    # Not meshio.read, which ends the process over a file that it cannot read.
    try:
        return meshio.vtu.read(str(path))
    except UNREADABLE as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        raise ValueError(f"{path}: file: expected a VTU mesh, found none ({reason})") from None


def _face_groups(corners: NDArray) -> tuple[NDArray, NDArray, NDArray]:
    """Faces in element order, sign of their turn; first of each and its number for all."""
    faces = corners[:, FACES[:, :3]].reshape(-1, 3)
    order = np.argsort(faces, axis=1)
    low, middle, high = np.take_along_axis(faces, order, axis=1).T
    size = corners.max() + 1
    _, first, inverse = np.unique(
        (low * size + middle) * size + high, return_index=True, return_inverse=True
    )
    even = (order[:, 1] - order[:, 0]) % 3 == 1
    return np.where(even, 1, -1), first, inverse


def _check_numbers(nodes_m: NDArray, tetrahedra: NDArray) -> None:
    if tetrahedra.ndim != 2 or tetrahedra.shape[1] not in CELLS or not len(tetrahedra):
        raise ValueError(
            f"tetrahedra: expected elements of 4 or 10 nodes, found shape {tetrahedra.shape}"
        )
    if not np.isfinite(nodes_m).all():
        raise ValueError("nodes_m: expected numbers, found NaN or infinity")
    if tetrahedra.min() < 0 or tetrahedra.max() >= len(nodes_m):
        raise ValueError(
            f"tetrahedra: expected nodes 0 to {len(nodes_m) - 1},"
            f" found {tetrahedra.min()} to {tetrahedra.max()}"
        )
    used = np.bincount(tetrahedra.ravel(), minlength=len(nodes_m))
    if not used.all():
        raise ValueError(
            f"nodes_m: expected each in an element, found node {np.argmin(used)} in none"
        )


def _check_overlap(corners: NDArray) -> None:
    # Of two elements on both sides of a face one sees it turned left and the other right.
    sign, _, inverse = _face_groups(corners)
    count, balance = np.bincount(inverse), np.bincount(inverse, weights=sign)
    bad = (count > 2) | ((count == 2) & (balance != 0))
    if bad.any():
        elements = np.flatnonzero(np.isin(inverse, np.argmax(bad))) // 4
        names = ", ".join(str(element) for element in elements)
        raise ValueError(
            "tetrahedra: expected elements on the two sides of each face,"
            f" found elements {names} that overlap"
        )


def _check_straight(mesh: SolidMesh) -> None:
    if mesh.order == 1:
        return
    ends = mesh.nodes_m[mesh.corners[:, EDGES]]
    gap = np.linalg.norm(ends.mean(axis=2) - mesh.nodes_m[mesh.tetrahedra[:, 4:]], axis=-1)
    length = np.linalg.norm(ends[:, :, 0] - ends[:, :, 1], axis=-1)
    curved = np.flatnonzero((gap > STRAIGHT * length.max()).any(axis=1))
    if len(curved):
        raise ValueError(
            f"tetrahedra: expected nodes in the middle of straight edges,"
            f" found element {curved[0]} with others"
        )


def refine_near(
    mesh: SolidMesh, point_m: NDArray, *, radius_m: float, edge_m: float, growth: float = 0.0
) -> SolidMesh:
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
    growth : float, optional
        Edges may be this part of the centroid's distance from the point where that is longer.

    Returns
    -------
    SolidMesh
        Conforming; the same volume and surface.

    Raises
    ------
    ValueError
        If the elements have ten nodes, or edges stay longer after as many bisections as are tried.
    """
    if mesh.order != 1:
        raise ValueError("mesh: expected four-node elements to refine, found ten-node ones")
    for bisections in range(BISECTIONS + 1):
        corners = mesh.nodes_m[mesh.tetrahedra]
        longest = np.linalg.norm(corners[:, :, None] - corners[:, None], axis=-1).max(axis=(1, 2))
        away = np.linalg.norm(corners.mean(axis=1) - point_m, axis=1)
        near = away < np.maximum(radius_m, AROUND * longest)
        chosen = np.flatnonzero(near & (longest > np.maximum(edge_m, growth * away)))
        if not len(chosen):
            break
        if bisections == BISECTIONS:
            expected = f"at most {edge_m:g} m after {BISECTIONS} bisections"
            raise ValueError(f"edge_m: expected {expected}, found {longest[chosen].max():.3g} m")
        refined = MeshTet(*map(np.ascontiguousarray, (mesh.nodes_m.T, mesh.tetrahedra.T))).refined(
            chosen
        )
        mesh = solid_mesh(refined.p.T, refined.t.T)
    return mesh
