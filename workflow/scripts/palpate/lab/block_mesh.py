"""Graded quadratic hexahedra of a block, with its nodes on a tensor grid."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from skfem import Basis, ElementHex2, FacetBasis, MeshHex

CONTACT_QUADRATURE = 10
VOLUME_QUADRATURE = 4


@dataclass(frozen=True)
class BlockMesh:
    """Block of quadratic hexahedra on the support z = 0.

    Attributes
    ----------
    axes_m : tuple of three arrays
        Node coordinates along x, y and z, vertices and midpoints in turn [m].
    grid : (nx, ny, nz) int array
        Number of the node at each place of the tensor grid.
    nodes_m : (n, 3) array
        Node coordinates [m].
    elements : (m, 27) int array
        Nodes of each hexahedron.
    gradients : (m, q, 27, 3) array
        Gradients of the shape functions at the quadrature points [1/m].
    weights_m3 : (m, q) array
        Quadrature weights.
    top : TopFace
    """

    axes_m: tuple[NDArray, NDArray, NDArray]
    grid: NDArray
    nodes_m: NDArray
    elements: NDArray
    gradients: NDArray
    weights_m3: NDArray
    top: "TopFace"


@dataclass(frozen=True)
class TopFace:
    """Quadrature of the facets that the sphere can touch.

    Attributes
    ----------
    nodes : (f, 27) int array
        Nodes of the hexahedron below each facet.
    shapes : (f, q, 27) array
        Shape functions at the quadrature points.
    weights_m2 : (f, q) array
    """

    nodes: NDArray
    shapes: NDArray
    weights_m2: NDArray


def graded_axis(
    start: float, stop: float, centre: float, smallest: float, growth: float
) -> NDArray:
    """Vertex coordinates from start to stop, finest at the centre, growing geometrically [m]."""
    below = centre - _graded(centre - start, smallest, growth)
    above = centre + _graded(stop - centre, smallest, growth)
    return np.concatenate([below[:0:-1], above])


def block_mesh(
    x: NDArray, y: NDArray, z: NDArray, *, reach_m: float, centre_m: NDArray
) -> BlockMesh:
    """Mesh a block from its vertex coordinates along each axis.

    Parameters
    ----------
    x, y, z : arrays
        Increasing vertex coordinates [m]; z from the support up.
    reach_m : float
        Facets of the top within this distance of the centre can be touched [m].
    centre_m : (2,) array
        x and y of the contact [m].
    """
    mesh = MeshHex.init_tensor(x, y, z)
    volume = Basis(mesh, ElementHex2(), intorder=VOLUME_QUADRATURE)
    gradients = np.stack([field[0].grad for field in volume.basis])
    nodes = volume.doflocs.T
    axes = tuple(np.unique(np.round(nodes[:, k], 12)) for k in range(3))
    top = _top_face(mesh, z[-1], reach_m, centre_m)
    return BlockMesh(
        axes,
        _grid_of(nodes, axes),
        nodes,
        volume.element_dofs.T,
        np.ascontiguousarray(gradients.transpose(2, 3, 0, 1)),
        volume.dx,
        top,
    )


def _graded(length: float, smallest: float, growth: float) -> NDArray:
    """Distances 0 ... length in steps that start near the smallest and grow."""
    if length <= 0:
        return np.zeros(1)
    steps = max(1, int(np.ceil(np.log1p(length * (growth - 1) / smallest) / np.log(growth))))
    distances = np.concatenate([[0.0], np.cumsum(growth ** np.arange(steps))])
    return distances * (length / distances[-1])


def _grid_of(nodes: NDArray, axes: tuple) -> NDArray:
    places = [np.searchsorted(axis, np.round(nodes[:, k], 12)) for k, axis in enumerate(axes)]
    grid = np.empty([len(axis) for axis in axes], dtype=int)
    grid[tuple(places)] = np.arange(len(nodes))
    return grid


def _top_face(mesh: MeshHex, height: float, reach_m: float, centre_m: NDArray) -> TopFace:
    def near(x: NDArray) -> NDArray:
        distance = np.hypot(x[0] - centre_m[0], x[1] - centre_m[1])
        return (np.abs(x[2] - height) < 1e-9) & (distance < reach_m)

    facets = mesh.facets_satisfying(near, boundaries_only=True)
    basis = FacetBasis(mesh, ElementHex2(), facets=facets, intorder=CONTACT_QUADRATURE)
    shapes = np.stack([np.asarray(field[0].value) for field in basis.basis], axis=-1)
    shapes = np.broadcast_to(shapes, (*basis.dx.shape, shapes.shape[-1]))
    return TopFace(basis.element_dofs.T, np.ascontiguousarray(shapes), basis.dx)
