"""The tracked surface as a time series that ParaView opens: one VTKHDF file of polygons.

VTKHDF, version 2, is HDF5 with a group of steps; VTK's own writer makes it. It keeps single
precision, 0.03 micrometres over half a metre, and times of steps likewise: tracked.npz is exact.
"""

import os
import re
import time
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray
from vtkmodules.util.vtkAlgorithm import VTKPythonAlgorithmBase
from vtkmodules.vtkCommonCore import vtkPoints
from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkDataObject, vtkPolyData
from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline as Pipeline
from vtkmodules.vtkIOHDF import vtkHDFWriter

from palpate.surface.pose import to_object
from palpate.surface.tracked import Tracked

COMPRESSION_LEVEL = 6
# Of one step: two vectors, a length and a flag; three corners and an offset.
VERTEX_BYTES, FACE_BYTES = 29, 32
AMPLE, OVERHEAD_BYTES = 2, 4_000_000
# Message 0x0012 of an HDF5 object header: 8 bytes, any flags, version 1, seconds since 1970.
MODIFIED = re.compile(rb"(\x12\x00\x08\x00.\x00\x00\x00\x01\x00\x00\x00)(.{4})", re.DOTALL)


def save_series(path: str | Path, tracked: Tracked, *, time_s: NDArray, tips_m: NDArray) -> None:
    """Write the tracked surface, object frame, as VTKHDF.

    Points carry ``displacement_m``, ``distance_moved_m`` (its length) and ``observed`` (0 or 1);
    each step's field data are ``time_s``, ``residual_m``, ``contact_point_m`` and ``tip_m`` (the
    sphere's centre), points in the object frame.

    Parameters
    ----------
    path : path
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
        If the file cannot be written.
    """
    time_s, tips_m = np.asarray(time_s, dtype=float), np.asarray(tips_m, dtype=float)
    _check(tracked, time_s, tips_m)
    # The writer holds no reference of its own to what is written in Python.
    source = _Frames(tracked, time_s, to_object(tracked.camera_from_object, tips_m))
    writer = vtkHDFWriter()
    writer.SetInputConnection(source.GetOutputPort())
    writer.SetFileName(str(path))
    writer.SetWriteAllTimeSteps(True)
    writer.SetCompressionLevel(COMPRESSION_LEVEL)
    writer.SetChunkSize(max(len(tracked.template_m), 1))
    if not Path(path).parent.is_dir():
        raise OSError(f"{path}: expected a folder to write into, found none")
    _require_space(Path(path), tracked)
    started = int(time.time())
    if not writer.Write():
        raise OSError(f"{path}: the time series could not be written")
    _without_times(Path(path), started, int(time.time()))


def _check(tracked: Tracked, time_s: NDArray, tips_m: NDArray) -> None:
    frames = len(tracked.vertices_m)
    if time_s.shape != (frames,):
        raise ValueError(f"time_s: expected {frames} times, found shape {time_s.shape}")
    if (np.diff(time_s) <= 0).any():
        raise ValueError("time_s: expected increasing times, found one that is not")
    if tips_m.shape != (frames, 3):
        raise ValueError(f"tips_m: expected shape ({frames}, 3), found {tips_m.shape}")


class _Frames(VTKPythonAlgorithmBase):
    """Source of VTK's pipeline: the polygons at each of the frames' times."""

    def __init__(self, tracked: Tracked, time_s: NDArray, tips_m: NDArray) -> None:
        super().__init__(nInputPorts=0, nOutputPorts=1, outputType="vtkPolyData")
        self.tracked, self.time_s, self.tips_m = tracked, time_s, tips_m
        self.cells = _cells(tracked.faces)

    def RequestInformation(self, request, inputs, outputs) -> int:
        """Tell the times."""
        information = outputs.GetInformationObject(0)
        information.Set(Pipeline.TIME_STEPS(), self.time_s.tolist(), len(self.time_s))
        information.Set(Pipeline.TIME_RANGE(), [self.time_s[0], self.time_s[-1]], 2)
        return 1

    def RequestData(self, request, inputs, outputs) -> int:
        """Give the polygons of the time that is asked for."""
        information = outputs.GetInformationObject(0)
        asked = information.Get(Pipeline.UPDATE_TIME_STEP())
        k = int(np.argmin(np.abs(self.time_s - (self.time_s[0] if asked is None else asked))))
        self._fill(vtkPolyData.GetData(outputs), k)
        return 1

    def _fill(self, surface: vtkPolyData, k: int) -> None:
        tracked = self.tracked
        vertices = to_object(tracked.camera_from_object, tracked.vertices_m[k])
        displacement = vertices - tracked.template_m
        points = vtkPoints()
        points.SetData(_array("points_m", vertices.astype(np.float32)))
        surface.SetPoints(points)
        surface.SetPolys(self.cells)
        length = np.linalg.norm(displacement, axis=1)
        for name, values in (
            ("displacement_m", displacement.astype(np.float32)),
            ("distance_moved_m", length.astype(np.float32)),
            ("observed", tracked.observed[k].astype(np.uint8)),
        ):
            surface.GetPointData().AddArray(_array(name, values))
        for name, values in (
            ("time_s", self.time_s[k : k + 1]),
            ("residual_m", tracked.residual_m[k : k + 1]),
            ("contact_point_m", tracked.contact_point_m[None]),
            ("tip_m", self.tips_m[k : k + 1]),
        ):
            surface.GetFieldData().AddArray(_array(name, np.asarray(values, dtype=float)))
        surface.GetInformation().Set(vtkDataObject.DATA_TIME_STEP(), float(self.time_s[k]))


def _array(name: str, values: NDArray):
    array = numpy_to_vtk(np.ascontiguousarray(values), deep=True)
    array.SetName(name)
    return array


def _cells(faces: NDArray) -> vtkCellArray:
    offsets = np.arange(0, 3 * len(faces) + 1, 3, dtype=np.int64)
    corners = np.array(faces, dtype=np.int64).ravel()
    cells = vtkCellArray()
    cells.SetData(
        numpy_to_vtkIdTypeArray(offsets, deep=True), numpy_to_vtkIdTypeArray(corners, deep=True)
    )
    return cells


def _require_space(path: Path, tracked: Tracked) -> None:
    """Ask for more than the file needs: VTK's writer tells nobody of a full disk, or never ends."""
    if not hasattr(os, "posix_fallocate"):
        return
    frames, vertices = tracked.vertices_m.shape[:2]
    step = vertices * VERTEX_BYTES + len(tracked.faces) * FACE_BYTES
    with path.open("wb") as stream:
        os.posix_fallocate(stream.fileno(), 0, OVERHEAD_BYTES + AMPLE * frames * step)


def _without_times(path: Path, started: int, ended: int) -> None:
    """Set to zero when each object was written: same inputs, same bytes."""

    def zeroed(found: re.Match) -> bytes:
        written = int.from_bytes(found[2], "little")
        return found[1] + bytes(4) if started <= written <= ended else found[0]

    path.write_bytes(MODIFIED.sub(zeroed, path.read_bytes()))
