"""Open3D without its viewers and machine learning.

Their imports (scikit-learn, dash, plotly) take four fifths of Open3D's start, about two seconds
of every job that only wants a closest point, and nothing here uses them.
"""

import sys
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

UNUSED = ("open3d.ml", "open3d.visualization")


def _core() -> ModuleType:
    """Import Open3D while empty modules stand for the unused ones."""
    if "open3d" not in sys.modules:
        standing_in = {name: ModuleType(name) for name in UNUSED}
        sys.modules.update(standing_in)
        try:
            import open3d  # noqa: F401
        finally:
            for name in standing_in:
                del sys.modules[name]
    return sys.modules["open3d"]


o3d = _core()


def scene_of(vertices: NDArray, faces: NDArray) -> Any:
    """Triangles (m, 3) over vertices (n, 3) for ray and distance queries.

    Single precision and one thread: take coordinates from their mean to lose nothing.
    """
    scene = o3d.t.geometry.RaycastingScene(nthreads=1)
    scene.add_triangles(
        o3d.core.Tensor(np.ascontiguousarray(vertices, dtype=np.float32)),
        o3d.core.Tensor(np.ascontiguousarray(faces, dtype=np.uint32)),
    )
    return scene


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

    def _query(self, points: NDArray) -> "o3d.core.Tensor":
        return o3d.core.Tensor((np.asarray(points) - self.origin).astype(np.float32))
