"""Open3D without what nothing here uses."""

import subprocess
import sys

PROGRAM = """
import sys
from palpate.open3d_core import UNUSED, o3d

o3d.t.geometry.RaycastingScene(nthreads=1)
print(*(name for name in (*UNUSED, "sklearn", "dash") if name in sys.modules))
"""


def test_viewers_and_machine_learning_stay_out(root):
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM],
        cwd=root / "workflow" / "scripts",
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout.strip() == ""


def test_open3d_that_was_imported_before_is_taken_as_it_is():
    import open3d
    from palpate.open3d_core import o3d

    assert o3d is open3d
