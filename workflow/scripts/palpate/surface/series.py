"""The tracked surface as a time series that ParaView opens: a VTP file a frame, and their times."""

from errno import EIO
from pathlib import Path

import numpy as np
import pyvista as pv
from numpy.typing import NDArray

from palpate.capture.files import whole_folder, write_text
from palpate.surface.pose import to_object
from palpate.surface.tracked import Tracked

INDEX = "series.pvd"


def save_series(folder: str | Path, tracked: Tracked, *, time_s: NDArray, tips_m: NDArray) -> None:
    """Write the tracked surface, object frame, as VTP files that ``series.pvd`` names by time.

    Points carry ``displacement_m``, ``distance_moved_m`` (its length) and ``observed`` (0 or 1);
    each frame's field data are ``residual_m``, ``contact_point_m`` and ``tip_m`` (the sphere's
    centre), points in the object frame. Arrays of the vertices are in single precision, 0.03
    micrometres over half a metre.

    Parameters
    ----------
    folder : path
        Which the files are written into, whole or not at all.
    tracked : Tracked
    time_s : (f,) array
        Times of the frames, increasing [s].
    tips_m : (f, 3) array
        Centre of the sphere in each frame, camera frame [m].

    Raises
    ------
    ValueError
        If times or tips are not those of as many frames, or times do not increase.
    OSError
        If a file cannot be written.
    """
    time_s, tips_m = np.asarray(time_s, dtype=float), np.asarray(tips_m, dtype=float)
    frames = len(tracked.vertices_m)
    if time_s.shape != (frames,):
        raise ValueError(f"time_s: expected {frames} times, found shape {time_s.shape}")
    if (np.diff(time_s) <= 0).any():
        raise ValueError("time_s: expected increasing times, found one that is not")
    if tips_m.shape != (frames, 3):
        raise ValueError(f"tips_m: expected shape ({frames}, 3), found {tips_m.shape}")
    lines = ['<VTKFile type="Collection">', "<Collection>"]
    with whole_folder(folder) as part:
        for k, at in enumerate(time_s.tolist()):
            _save_frame(part / f"{k:06}.vtp", tracked, k, tips_m[k])
            lines.append(f'<DataSet timestep="{at}" file="{k:06}.vtp"/>')
        write_text(part / INDEX, "\n".join([*lines, "</Collection>", "</VTKFile>", ""]))


def _save_frame(path: Path, tracked: Tracked, k: int, tip_m: NDArray) -> None:
    pose = tracked.camera_from_object
    vertices = to_object(pose, tracked.vertices_m[k])
    displacement = vertices - tracked.template_m
    surface = pv.PolyData.from_regular_faces(vertices.astype(np.float32), tracked.faces)
    surface["displacement_m"] = displacement.astype(np.float32)
    surface["distance_moved_m"] = np.linalg.norm(displacement, axis=1).astype(np.float32)
    surface["observed"] = tracked.observed[k].astype(np.uint8)
    surface.field_data["residual_m"] = tracked.residual_m[k : k + 1]
    surface.field_data["contact_point_m"] = tracked.contact_point_m[None]
    surface.field_data["tip_m"] = to_object(pose, tip_m)[None]
    surface.save(path)
    # VTK's writer removes what it has no space for, and raises nothing.
    if not path.is_file():
        raise OSError(EIO, "not written (is the disk full?)", str(path))
