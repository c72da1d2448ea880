"""Graded quadratic hexahedra of a block, with its nodes on a tensor grid."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from skfem import ElementHex2, MeshHex

from virtual_lab.mesh import SolidMesh, solid_mesh

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
    solid : SolidMesh
        With the patches ``top`` and ``bottom``.
    """

    axes_m: tuple[NDArray, NDArray, NDArray]
    grid: NDArray
    solid: SolidMesh


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

    def near(x: NDArray) -> NDArray:
        distance = np.hypot(x[0] - centre_m[0], x[1] - centre_m[1])
        return (np.abs(x[2] - z[-1]) < 1e-9) & (distance < reach_m)

    solid = solid_mesh(
        mesh,
        ElementHex2(),
        {
            "top": mesh.facets_satisfying(near, boundaries_only=True),
            "bottom": mesh.facets_satisfying(lambda x: x[2] < 1e-9, boundaries_only=True),
        },
        volume_order=VOLUME_QUADRATURE,
        facet_order=CONTACT_QUADRATURE,
    )
    axes = tuple(np.unique(np.round(solid.nodes_m[:, k], 12)) for k in range(3))
    return BlockMesh(axes, _grid_of(solid.nodes_m, axes), solid)


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
