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
