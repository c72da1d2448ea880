"""A closed triangle mesh as a signed distance, for objects that are drawn elsewhere."""

from pathlib import Path

import numpy as np
import trimesh
from numpy.typing import NDArray
from palpate.open3d_core import o3d


class ClosedMesh:
    """Signed distance to a closed mesh, negative inside.

    Parameters
    ----------
    path : path
        PLY or OBJ file, object frame [m].

    Raises
    ------
    ValueError
        If the mesh is open, or does not reach from above the table (z = 0) to below it: where the
        table cuts it, it is flat and bonded.
    """

    def __init__(self, path: str | Path) -> None:
        mesh = trimesh.load_mesh(path)
        if not mesh.is_watertight:
            raise ValueError(f"{path}: mesh: expected a closed surface, found an open one")
        self.low_m, self.high_m = mesh.bounds
        if not self.low_m[2] < 0 < self.high_m[2]:
            found = f"{self.low_m[2]:g} to {self.high_m[2]:g}"
            raise ValueError(f"{path}: mesh: expected z from below 0 m to above it, found {found}")
        # Single precision: coordinates are taken from the middle to lose nothing.
        self.middle_m = mesh.bounds.mean(axis=0)
        self.scene = o3d.t.geometry.RaycastingScene(nthreads=1)
        self.scene.add_triangles(
            o3d.core.Tensor((mesh.vertices - self.middle_m).astype(np.float32)),
            o3d.core.Tensor(mesh.faces.astype(np.uint32)),
        )

    def __call__(self, points_m: NDArray) -> NDArray:
        """Signed distances of points (n, 3), shape (n,) [m]."""
        query = o3d.core.Tensor((np.asarray(points_m) - self.middle_m).astype(np.float32))
        return self.scene.compute_signed_distance(query, nthreads=1).numpy().astype(float)
