"""Clouds of points as files, PLY or PCD, in place of depth images."""

from pathlib import Path
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import NDArray
from trimesh.exchange.ply import load_ply

from palpate.units import METRES

# What files begin with, by the ends of their names.
MARKS = {".ply": (b"ply",), ".pcd": (b"# .PCD", b"VERSION")}
# With fewer a sensor saw nothing.
FEWEST_POINTS = 100


class Cloud(NamedTuple):
    """Points and, where they are known, normals, camera frame, both (n, 3); points in metres."""

    points_m: NDArray
    normals: NDArray | None = None

    def at(self, chosen: NDArray) -> Self:
        """Those points that are chosen, by a mask or by numbers."""
        return Cloud(*(None if part is None else part[chosen] for part in self))


def read_cloud(path: str | Path, unit: str = "m") -> Cloud:
    """Read the points of a PLY or PCD file, organised or not; where some have normals, those alone.

    Its unit is m or mm. Places without a number (NaN) are left out.

    Raises
    ------
    ValueError
        If the file can't be read, or has too few points.
    """
    if problem := cloud_problem(path):
        raise ValueError(f"{path}: cloud: {problem}")
    points, normals = _read(Path(path))
    # Where a device knows no normal it writes what is no number, or zeros.
    known = np.isfinite(normals).all(axis=1) & normals.any(axis=1)
    cloud = Cloud(points * METRES[unit], normals)
    cloud = cloud.at(known) if known.any() else Cloud(cloud.points_m)
    cloud = cloud.at(np.isfinite(cloud.points_m).all(axis=1))
    if (count := len(cloud.points_m)) < FEWEST_POINTS:
        raise ValueError(f"{path}: cloud: expected {FEWEST_POINTS} points or more, found {count}")
    return cloud


def cloud_problem(path: str | Path) -> str | None:
    """What is wrong with a file's name and beginning, as ``expected ..., found ...``, or None."""
    expected = f"expected a cloud as {' or '.join(MARKS)}, found"
    marks = MARKS.get(Path(path).suffix.lower())
    if marks is None:
        return f"{expected} {Path(path).suffix or 'no ending'}"
    with Path(path).open("rb") as stream:
        return None if stream.read(10).startswith(marks) else f"{expected} something else"


def _read(path: Path) -> tuple[NDArray, NDArray]:
    """Points and normals of a file, which may have none."""
    if path.suffix.lower() == ".pcd":
        from palpate.open3d_core import o3d

        with o3d.utility.VerbosityContextManager(o3d.utility.VerbosityLevel.Error):
            cloud = o3d.io.read_point_cloud(str(path))
        return np.asarray(cloud.points), np.asarray(cloud.normals)
    try:
        with path.open("rb") as stream:
            read = load_ply(stream, skip_materials=True, fix_texture=False)
        found = (read.get(name, np.zeros((0, 3))) for name in ("vertices", "vertex_normals"))
        points, normals = (np.asarray(part, dtype=float) for part in found)
        whole = len(points) == read["metadata"]["_ply_raw"]["vertex"]["length"]
    except (OSError, MemoryError):
        raise
    except Exception:  # raises whatever a damaged file leads to
        whole = False
    if not whole:
        raise ValueError(f"{path}: cloud: expected a whole PLY file with x, y, z, found another")
    return points, normals
