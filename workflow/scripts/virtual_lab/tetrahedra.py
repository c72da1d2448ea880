"""Objects of any form for the contact solver: quadratic tetrahedra inside a signed distance."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.spatial import cKDTree
from skfem import ElementTetP2, MeshTet, MeshTet2

from virtual_lab.level_set import REACH_M, level_set_mesh, onto_surface, refined_near
from virtual_lab.signed_distance import Distance
from virtual_lab.solid import SolidMesh, solid_mesh

# Polynomial orders that are integrated exactly.
QUADRATURE = {"volume_order": 3, "facet_order": 6}
CANDIDATES = 24
# Corners, middles and centre of the reference tetrahedron: there a curved one keeps its volume.
CHECKED_AT = np.array(
    [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0.5, 0, 0], [0.5, 0.5, 0], [0, 0.5, 0],
     [0, 0, 0.5], [0.5, 0, 0.5], [0, 0.5, 0.5], [0.25, 0.25, 0.25]]
).T  # fmt: skip
LEAST_SHARE = 0.3
# Nodes of scikit-fem's quadratic tetrahedron: corners, then the middles of these edges.
MIDDLES = np.array([[0, 1], [1, 2], [0, 2], [0, 3], [1, 3], [2, 3]])


def tetrahedral_solid(
    distance: Distance,
    box_m: tuple[NDArray, NDArray],
    planes: list[tuple[int, float]],
    spots: list[tuple[NDArray, float]],
    *,
    spacing_m: float,
    reaches: Mapping[str, tuple[NDArray, float]],
) -> tuple[SolidMesh, MeshTet]:
    """Mesh a signed distance with curved ten-node tetrahedra, finer near spots.

    Parameters
    ----------
    distance : callable
        Signed distance [m].
    box_m : (low, high)
        Box to mesh [m].
    planes, spots
        As of `virtual_lab.level_set.refined_near`.
    spacing_m : float
        Edge elsewhere [m].
    reaches : mapping
        Name of a patch to the centre and radius [m] of the surface that an obstacle can touch.

    Returns
    -------
    solid : SolidMesh
    mesh : MeshTet
        Its straight tetrahedra.
    """
    nodes, tets = level_set_mesh(distance, *box_m, spacing_m)
    mesh = MeshTet(np.ascontiguousarray(nodes.T), np.ascontiguousarray(tets.T))
    mesh = refined_near(mesh, distance, spots, planes=planes)
    facets = {
        name: _near(mesh, distance, planes, centre, radius)
        for name, (centre, radius) in reaches.items()
    }
    curved = _curved(mesh, distance, planes)
    return solid_mesh(curved, ElementTetP2(), facets, **QUADRATURE), mesh


def interpolation(mesh: MeshTet, solid: SolidMesh, points_m: NDArray) -> sparse.csr_matrix:
    """Matrix (k, n) from nodal values to points in or just outside a quadratic mesh."""
    corners = mesh.p.T[mesh.t.T]
    tree = cKDTree(corners.mean(axis=1))
    _, near = tree.query(points_m, k=min(CANDIDATES, len(corners)))
    inverse = np.linalg.inv(corners[:, 1:] - corners[:, :1])
    best, weights = np.full(len(points_m), -np.inf), np.zeros((len(points_m), 4))
    element = np.zeros(len(points_m), dtype=int)
    for candidate in near.T:
        local = np.einsum("ki,kij->kj", points_m - corners[candidate, 0], inverse[candidate])
        full = np.column_stack([1 - local.sum(axis=1), local])
        better = full.min(axis=1) > best
        best[better] = full.min(axis=1)[better]
        weights[better], element[better] = full[better], candidate[better]
    values = np.concatenate(
        [weights * (2 * weights - 1), 4 * weights[:, MIDDLES].prod(axis=2)], axis=1
    )
    rows = np.repeat(np.arange(len(points_m)), values.shape[1])
    columns = solid.elements[element].ravel()
    return sparse.csr_matrix(
        (values.ravel(), (rows, columns)), shape=(len(points_m), len(solid.nodes_m))
    )


def _curved(mesh: MeshTet, distance: Distance, planes: list) -> MeshTet2:
    """Put the middles of the surface's edges onto the curved surface, where that is harmless."""
    curved = MeshTet2.from_mesh(mesh)
    straight = curved.doflocs.T
    boundary = np.unique(curved.dofs.get_facet_dofs(mesh.boundary_facets()).all())
    middles = boundary[boundary >= mesh.p.shape[1]]
    points = straight.copy()
    points[middles] = onto_surface(straight[middles], distance, planes, reach_m=REACH_M)
    nodes = curved.dofs.element_dofs
    while True:
        result = MeshTet2(np.ascontiguousarray(points.T), curved.t)
        volume = np.linalg.det(result.mapping().DF(CHECKED_AT).transpose(2, 3, 0, 1))
        bent = volume.min(axis=1) < LEAST_SHARE * volume.max(axis=1)
        bad = np.intersect1d(nodes[:, bent], middles)
        if not bad.size:
            return result
        points[bad] = straight[bad]
        middles = np.setdiff1d(middles, bad)


def _near(
    mesh: MeshTet, distance: Distance, planes: list, centre: NDArray, radius: float
) -> NDArray:
    """Boundary facets near a centre, but for flat cuts."""
    facets = mesh.boundary_facets()
    corners = mesh.p[:, mesh.facets[:, facets]]
    middle = corners.mean(axis=1).T
    on_cut = np.zeros(len(facets), dtype=bool)
    for axis, place in planes:
        on_cut |= (np.abs(corners[axis] - place) < 1e-9).all(axis=0)
    return facets[~on_cut & (np.linalg.norm(middle - centre, axis=1) < radius)]
