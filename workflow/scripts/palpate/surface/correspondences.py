"""What a frame's points see of a surface."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.spatial import cKDTree

from palpate.open3d_core import ClosestPoints
from palpate.solid.mesh import doubled_normals
from palpate.surface.options import ElasticTracking
from palpate.surface.template import Template

# Distances at rest are smoothed over this [m]; they shrink to zero where fewer points are seen.
SMOOTHING_M = 0.005
FEW = 3.0


@dataclass(frozen=True)
class Correspondences:
    """Points paired with the surface, k of them.

    Attributes
    ----------
    corners : (k, 3) int array
        Template vertices of the triangle that each point is nearest to.
    weights : (k, 3) array
        Barycentric weights of its closest there.
    rest_m : (k, 3) array
        The closest on the undeformed template [m].
    normals : (k, 3) array
        Unit normals of the deformed triangles.
    distance_m : (k,) array
        Of the point from the surface along the normal, positive outside [m].
    """

    corners: NDArray
    weights: NDArray
    rest_m: NDArray
    normals: NDArray
    distance_m: NDArray

    def observed(self, count: int) -> NDArray:
        """Which of a template's vertices have a point on one of their triangles, shape (count,)."""
        return np.bincount(self.corners.ravel(), minlength=count) > 0

    def less(self, offset: NDArray) -> "Correspondences":
        """The same with an offset (n,) at the vertices taken off the distances [m]."""
        taken = (self.weights * offset[self.corners]).sum(axis=1)
        return replace(self, distance_m=self.distance_m - taken)


def pair(
    vertices_m: NDArray,
    template: Template,
    cloud: tuple[NDArray, NDArray],
    options: ElasticTracking,
) -> Correspondences:
    """Pair a cloud with the deformed template.

    Parameters
    ----------
    vertices_m : (n, 3) array
        Deformed vertices [m].
    template : Template
    cloud : (points (m, 3) [m], normals (m, 3))
    options : ElasticTracking
        Points farther away than it allows, or turned more against the surface, are left out.
    """
    points, directions = cloud
    closest, triangle, weights = ClosestPoints(vertices_m, template.faces)(points)
    normals = doubled_normals(vertices_m, template.faces)
    normals = (normals / np.linalg.norm(normals, axis=1, keepdims=True))[triangle]
    gap = points - closest
    kept = np.linalg.norm(gap, axis=1) < options.largest_distance_m
    kept &= (normals * directions).sum(axis=1) > np.cos(np.deg2rad(options.largest_normal_deg))
    corners, weights, normals = template.faces[triangle[kept]], weights[kept], normals[kept]
    distance = (gap[kept] * normals).sum(axis=1)
    rest = np.einsum("kc,kcd->kd", weights, template.vertices_m[corners])
    return Correspondences(corners, weights, rest, normals, distance)


def rest_offsets(
    template: Template, pairs_by_frame: Sequence[Correspondences]
) -> tuple[NDArray, NDArray]:
    """Mean distance of undeformed frames' points at each vertex.

    It is what sensor and template are wrong by before anything moves; zero where nothing is seen.

    Returns
    -------
    offset : (n,) array
        Of all frames [m].
    others : (f, n) array
        Of all frames but one, for each; of that one where it is alone [m].
    """
    count = len(template.vertices_m)
    sums, seen = np.zeros((2, len(pairs_by_frame), count))
    for k, pairs in enumerate(pairs_by_frame):
        weights, corners = pairs.weights.ravel(), pairs.corners.ravel()
        sums[k] = np.bincount(corners, weights * np.repeat(pairs.distance_m, 3), count)
        seen[k] = np.bincount(corners, weights, count)
    smooth = _gaussian(template.vertices_m)
    sums, seen = (smooth @ sums.T).T, (smooth @ seen.T).T
    whole = sums.sum(axis=0) / (seen.sum(axis=0) + FEW)
    if len(pairs_by_frame) == 1:
        return whole, whole[None]
    return whole, (sums.sum(axis=0) - sums) / (seen.sum(axis=0) - seen + FEW)


def _gaussian(points: NDArray) -> sparse.csr_matrix:
    """Weights between points by their distance, cut off at two standard deviations."""
    tree = cKDTree(points)
    near = tree.sparse_distance_matrix(tree, 2 * SMOOTHING_M, output_type="coo_matrix")
    share = np.exp(-0.5 * (near.data / SMOOTHING_M) ** 2)
    return sparse.csr_matrix((share, (near.row, near.col)), shape=near.shape)
