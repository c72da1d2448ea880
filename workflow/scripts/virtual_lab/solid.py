"""An object as the contact solver takes it: quadrature of its elements, fixed nodes, surface."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from skfem import Basis, FacetBasis, Mesh
from skfem.element import Element

from virtual_lab.obstacle import Table


@dataclass(frozen=True)
class Patch:
    """Quadrature of facets that an obstacle can touch.

    Attributes
    ----------
    elements : (f,) int array
        The solid element below each facet.
    shapes : (f, q, a) array
        Shape functions of that element at the quadrature points.
    weights_m2 : (f, q) array
    """

    elements: NDArray
    shapes: NDArray
    weights_m2: NDArray


@dataclass(frozen=True)
class SolidMesh:
    """Nodes, elements and quadrature of a solid.

    Attributes
    ----------
    nodes_m : (n, 3) array
    elements : (m, a) int array
        Nodes of each element.
    gradients : (m, q, a, 3) array
        Gradients of the shape functions at the quadrature points [1/m].
    weights_m3 : (m, q) array
    places_m : (m, q, 3) array
        The quadrature points.
    patches : mapping
        Name to facets that can be touched.
    """

    nodes_m: NDArray
    elements: NDArray
    gradients: NDArray
    weights_m3: NDArray
    places_m: NDArray
    patches: Mapping[str, Patch]


@dataclass(frozen=True)
class Model:
    """An object, discretised to be indented at one point.

    Attributes
    ----------
    solid : SolidMesh
        With the patch ``top``, and ``bottom`` where a table is an obstacle.
    fixed : (n, 3) bool array
        Displacements that are zero.
    supports : tuple of Table
        Obstacles besides the probe.
    mirrors : tuple of int
        Axes along which the other half of the object is the mirror image of what is solved.
    surface_rest_m, surface_faces : (k, 3) array, (m, 3) int array
        Closed undeformed surface, object frame [m], and its triangles, outward.
    sample : callable
        Nodal displacements (n, 3) to those of the surface (k, 3) [m].
    """

    solid: SolidMesh
    fixed: NDArray
    supports: tuple[Table, ...]
    mirrors: tuple[int, ...]
    surface_rest_m: NDArray
    surface_faces: NDArray
    sample: Callable[[NDArray], NDArray]


def solid_mesh(
    mesh: Mesh,
    element: Element,
    facets: Mapping[str, NDArray],
    *,
    volume_order: int,
    facet_order: int,
) -> SolidMesh:
    """Prepare a scikit-fem mesh.

    Parameters
    ----------
    mesh : skfem.Mesh
    element : skfem.Element
        Scalar Lagrange element of a displacement's component.
    facets : mapping
        Name of a patch to its facets.
    volume_order, facet_order : int
        Polynomial order that the quadrature integrates exactly.
    """
    volume = Basis(mesh, element, intorder=volume_order)
    gradients = np.stack([field[0].grad for field in volume.basis])
    return SolidMesh(
        volume.doflocs.T,
        volume.element_dofs.T,
        np.ascontiguousarray(gradients.transpose(2, 3, 0, 1)),
        volume.dx,
        np.moveaxis(np.asarray(volume.global_coordinates()), 0, -1),
        {name: _patch(mesh, element, chosen, facet_order) for name, chosen in facets.items()},
    )


def _patch(mesh: Mesh, element: Element, facets: NDArray, order: int) -> Patch:
    basis = FacetBasis(mesh, element, facets=facets, intorder=order)
    shapes = np.stack([np.asarray(field[0].value) for field in basis.basis], axis=-1)
    shapes = np.broadcast_to(shapes, (*basis.dx.shape, shapes.shape[-1]))
    return Patch(np.asarray(basis.tind), np.ascontiguousarray(shapes), basis.dx)
