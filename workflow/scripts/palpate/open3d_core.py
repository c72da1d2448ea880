"""Open3D without its viewers and machine learning.

Their imports (scikit-learn, dash, plotly) take four fifths of Open3D's start, about two seconds
of every job that only wants a closest point, and nothing here uses them.
"""

import sys
from types import ModuleType

UNUSED = ("open3d.ml", "open3d.visualization")


def _core() -> ModuleType:
    """Import Open3D while empty modules stand for the unused ones."""
    if "open3d" not in sys.modules:
        resting_in = {name: ModuleType(name) for name in UNUSED}
        sys.modules.update(resting_in)
        try:
            import open3d  # noqa: F401
        finally:
            for name in resting_in:
                del sys.modules[name]
    return sys.modules["open3d"]


o3d = _core()
