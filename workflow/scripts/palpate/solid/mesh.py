"""Solid meshes of linear tetrahedra."""

import contextlib
import tempfile
from dataclasses import dataclass
from pathlib import Path

import meshio
import numpy as np
import pytetwild
import trimesh
from numpy.typing import NDArray
from skfem import MeshTet

# Vertices of a tetrahedron's faces, each seen from outside.
FACES = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
BISECTIONS = 12
ENOUGH = 0.03
REFINEMENTS = 12


@dataclass(frozen=True)
class SolidMesh:
    """Tetrahedra of positive volume.

    Attributes
    ----------
    nodes_m : (n, 3) array
        Node coordinates [m].
    tetrahedra : (m, 4) int array
        Nodes of each element.
    """

    nodes_m: NDArray
    tetrahedra: NDArray

    @property
    def volume_m3(self) -> float:
        """Volume of the mesh [m^3]."""
        return float(element_volumes(self.nodes_m, self.tetrahedra).sum())

    def surface_triangles(self) -> NDArray:
        """Boundary triangles, outward, shape (k, 3)."""
        faces = self.tetrahedra[:, FACES].reshape(-1, 3)
        _, first, count = np.unique(
            np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True
        )
        return faces[np.sort(first[count == 1])]

    def surface_nodes(self) -> NDArray:
        """Numbers of the nodes on the boundary, sorted."""
        return np.unique(self.surface_triangles())


def element_volumes(nodes_m: NDArray, tetrahedra: NDArray) -> NDArray:
    """Signed volume of each tetrahedron, shape (m,) [m^3]."""
    a, b, c, d = (nodes_m[tetrahedra[:, k]] for k in range(4))
    return np.einsum("ij,ij->i", np.cross(b - a, c - a), d - a) / 6


def solid_mesh(nodes_m: NDArray, tetrahedra: NDArray) -> SolidMesh:
    """Make a solid mesh, with all elements turned to positive volume.

    Raises
    ------
    ValueError
        If an element has no volume.
    """
    volumes = element_volumes(nodes_m, tetrahedra)
    flat = np.flatnonzero(np.abs(volumes) <= 1e-12 * np.abs(volumes).max())
    if len(flat):
        raise ValueError(f"tetrahedra: expected volumes, found element {flat[0]} without one")
    tetrahedra = np.where((volumes < 0)[:, None], tetrahedra[:, [0, 2, 1, 3]], tetrahedra)
    return SolidMesh(np.asarray(nodes_m, dtype=float), tetrahedra.astype(np.int64))


def tetrahedralise(vertices_m: NDArray, faces: NDArray, *, vertices: int) -> SolidMesh:
    """Fill a closed surface with tetrahedra (fTetWild).

    pytetwild gives another mesh on every run: a mesh that results are to rest on must be kept.

    Parameters
    ----------
    vertices_m, faces : (n, 3), (m, 3) arrays
        Closed surface [m].
    vertices : int
        Wanted number of nodes; the edge length is bisected until it is met within 3 %.

    Returns
    -------
    SolidMesh

    Raises
    ------
    ValueError
        If the surface is not closed.
    """
    surface = trimesh.Trimesh(vertices_m, faces, process=False)
    if not surface.is_watertight:
        raise ValueError("surface: expected a closed one, found open edges")
    low, high, best = 0.005, 0.5, None
    for _ in range(BISECTIONS):
        factor = np.sqrt(low * high)
        nodes, tetrahedra = _fill(vertices_m, faces, float(factor))
        if best is None or abs(len(nodes) - vertices) < abs(len(best[0]) - vertices):
            best = nodes, tetrahedra
        if abs(len(best[0]) - vertices) <= ENOUGH * vertices:
            break
        low, high = (low, factor) if len(nodes) < vertices else (factor, high)
    return solid_mesh(*best)


def _fill(vertices_m: NDArray, faces: NDArray, edge_factor: float) -> tuple[NDArray, NDArray]:
    # fTetWild leaves a file in the working directory.
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        return pytetwild.tetrahedralize(
            np.asarray(vertices_m, dtype=float),
            np.asarray(faces, dtype=np.int32),
            edge_length_fac=edge_factor,
            optimize=True,
        )


def refine_near(mesh: SolidMesh, point_m: NDArray, *, radius_m: float, edge_m: float) -> SolidMesh:
    """Bisect elements near a point until their edges are short enough.

    Parameters
    ----------
    mesh : SolidMesh
    point_m : (3,) array
        Point [m].
    radius_m : float
        Elements whose centroid lies within this distance are refined [m].
    edge_m : float
        Longest edge wanted there [m].

    Returns
    -------
    SolidMesh
        Conforming; the same volume and surface.
    """
    for _ in range(REFINEMENTS):
        corners = mesh.nodes_m[mesh.tetrahedra]
        near = np.linalg.norm(corners.mean(axis=1) - point_m, axis=1) < radius_m
        longest = np.linalg.norm(corners[:, :, None] - corners[:, None], axis=-1).max(axis=(1, 2))
        chosen = np.flatnonzero(near & (longest > edge_m))
        if not len(chosen):
            break
        refined = MeshTet(mesh.nodes_m.T, mesh.tetrahedra.T).refined(chosen)
        mesh = solid_mesh(refined.p.T, refined.t.T)
    return mesh


def write_solid(
    path: str | Path, mesh: SolidMesh, *, point_data: dict[str, NDArray] | None = None
) -> None:
    """Write a solid mesh as VTU, with values at its nodes if given."""
    data = meshio.Mesh(mesh.nodes_m, [("tetra", mesh.tetrahedra)], point_data=point_data or {})
    meshio.write(path, data, file_format="vtu")


def read_solid(path: str | Path) -> SolidMesh:
    """Read a solid mesh from VTU.

    Raises
    ------
    ValueError
        If the file holds no tetrahedra.
    """
    mesh = meshio.read(path, file_format="vtu")
    if "tetra" not in mesh.cells_dict:
        raise ValueError(f"{path}: cells: expected tetrahedra, found {sorted(mesh.cells_dict)}")
    return solid_mesh(mesh.points, mesh.cells_dict["tetra"])
