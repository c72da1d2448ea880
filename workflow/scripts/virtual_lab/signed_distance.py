"""Signed distances [m] to forms that are neither block nor ball, negative inside."""

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from virtual_lab.ear import ear_distance

Distance = Callable[[NDArray], NDArray]
STEP_M = 1e-5


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
        # Only here: Snakemake's own process looks at points of other forms.
        import trimesh
        from palpate.open3d_core import o3d

        mesh, self.tensor = trimesh.load_mesh(path), o3d.core.Tensor
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
            self.tensor((mesh.vertices - self.middle_m).astype(np.float32)),
            self.tensor(mesh.faces.astype(np.uint32)),
        )

    def __call__(self, points_m: NDArray) -> NDArray:
        """Signed distances of points (n, 3), shape (n,) [m]."""
        query = self.tensor((np.asarray(points_m) - self.middle_m).astype(np.float32))
        return self.scene.compute_signed_distance(query, nthreads=1).numpy().astype(float)


def distance_of(shape: Mapping) -> Distance:
    """Signed distance of a ``shape`` block of lab.yaml of kind ear or mesh."""
    return ear_distance if shape["kind"] == "ear" else ClosedMesh(shape["file"])


def slope(points_m: NDArray, distance: Distance) -> NDArray:
    """Gradient of a signed distance by central differences, shape (n, 3)."""
    offsets = STEP_M * np.eye(3)
    sides = [distance(points_m + o) - distance(points_m - o) for o in offsets]
    return np.stack(sides, axis=1) / (2 * STEP_M)
