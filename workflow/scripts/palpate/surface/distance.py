"""Closest points of a triangle mesh."""

import numpy as np
from numpy.typing import NDArray

from palpate.open3d_core import o3d, scene_of


class ClosestPoints:
    """Closest points of a mesh to query points.

    Parameters
    ----------
    vertices, faces : (n, 3), (m, 3) arrays
        The mesh [m].
    """

    def __init__(self, vertices: NDArray, faces: NDArray) -> None:
        # Single precision: coordinates are taken from their mean to lose nothing.
        self.vertices, self.faces = np.asarray(vertices, dtype=float), np.asarray(faces)
        self.origin = self.vertices.mean(axis=0)
        self.scene = scene_of(self.vertices - self.origin, self.faces)

    def __call__(self, points: NDArray) -> tuple[NDArray, NDArray, NDArray]:
        """Closest points (k, 3) [m], their triangles (k,) and barycentric weights (k, 3)."""
        answer = self.scene.compute_closest_points(self._query(points), nthreads=1)
        triangle = answer["primitive_ids"].numpy().astype(np.int64)
        u, v = answer["primitive_uvs"].numpy().astype(float).T
        weights = np.stack([1 - u - v, u, v], axis=1)
        return self.interpolate(self.vertices, triangle, weights), triangle, weights

    def interpolate(self, values: NDArray, triangle: NDArray, weights: NDArray) -> NDArray:
        """Interpolate values at the vertices, (n, k), at the points of an earlier answer."""
        return np.einsum("kc,kcd->kd", weights, values[self.faces[triangle]])

    def distance(self, points: NDArray) -> NDArray:
        """Unsigned distances, shape (k,) [m]."""
        return self.scene.compute_distance(self._query(points), nthreads=1).numpy().astype(float)

    def signed_distance(self, points: NDArray) -> NDArray:
        """Distances to a closed mesh, negative inside, shape (k,) [m]."""
        return (
            self.scene.compute_signed_distance(self._query(points), nthreads=1)
            .numpy()
            .astype(float)
        )

    def _query(self, points: NDArray) -> o3d.core.Tensor:
        return o3d.core.Tensor((np.asarray(points) - self.origin).astype(np.float32))
