"""Optics as other programs' calibration files hold them: Kalibr, OpenCV, ROS."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from palpate.capture.importing.optics import NO_DISTORTION, coefficients, shortest
from palpate.capture.importing.recording import named
from palpate.config.model import problems
from palpate.config.sensor import LONGEST_SHIFT_M, CameraSpec, rigid_fault
from palpate.yaml_files import load_yaml, mismatch

OPENCV_MARK = b"opencv-matrix"
# Names of fields as `ros2 topic echo` prints a camera_info.
ECHOED = {"k": "camera_matrix", "d": "distortion_coefficients", "p": "projection_matrix"}
# Names under which OpenCV's own programs write a single camera's and a pair's matrices.
SINGLE_NAMES = (("camera_matrix", "distortion_coefficients"), ("cameraMatrix", "distCoeffs"))
PAIR_NAMES = (("M1", "D1"), ("M2", "D2"))
MATRICES = {name for pair in (*SINGLE_NAMES, *PAIR_NAMES) for name in pair}


@dataclass(frozen=True)
class StatedOptics:
    """Optics of one or two cameras as a file states them."""

    cameras: tuple[dict, ...]  # width_px, height_px, fx_px, fy_px, cx_px, cy_px, distortion of each
    second_from_first: NDArray | None = None  # (4, 4) [m], where there are two
    # Camera and baseline [m] of a pair that the file says how to rectify.
    rectified: tuple[dict, float] | None = None


def read_optics(paths: Sequence[Path], size_px: tuple[int, int] | None = None) -> StatedOptics:
    """Read calibration files of one kind.

    A Kalibr ``camchain.yaml``, files of OpenCV's FileStorage, with the pictures' width and height
    where these do not say it, or one or two ``camera_info`` files of ROS, or as its topic prints
    them.

    Raises
    ------
    ValueError
        If a file is none of these, or holds another lens than OpenCV's.
    """
    if all(_is_opencv(path) for path in paths):
        return _opencv(paths, size_px)
    contents = []
    for path in paths:
        with named(path):
            contents.append(content := _as_written(load_yaml(path)))
            if not isinstance(content, Mapping) or not {"cam0", "camera_matrix"} & set(content):
                expected = "cam0 (Kalibr), camera_matrix (ROS, OpenCV) or M1 (OpenCV)"
                raise mismatch("file", expected, "none")
    if "cam0" not in contents[0]:
        return _ros(paths, contents)
    if len(paths) > 1:
        raise mismatch(f"{paths[1]}: file", "one camchain.yaml", "another file")
    with named(paths[0]):
        return _kalibr(contents[0])


def _kalibr(content: Mapping) -> StatedOptics:
    """Camera 0 and, where there is one, camera 1 of a camchain.yaml."""
    names = [name for name in ("cam0", "cam1") if name in content]
    cameras = tuple(_kalibr_camera(content[name], name) for name in names)
    if len(cameras) == 1:
        return StatedOptics(cameras)
    with named("cam1"):
        return StatedOptics(cameras, _rigid(content["cam1"], "T_cn_cnm1"))


def _kalibr_camera(block: Mapping, name: str) -> dict:
    for field, known in (("camera_model", "pinhole"), ("distortion_model", "radtan")):
        with named(name):
            found = _at(block, field)
        if found != known:
            raise mismatch(f"{name}.{field}", known, found)
    with named(name):
        fx, fy, cx, cy = _numbers(block, "intrinsics", 4)
        distortion = _numbers(block, "distortion_coeffs", 4)
        size = _numbers(block, "resolution", 2)
        return _camera(size, [fx, 0, cx, 0, fy, cy, 0, 0, 1], distortion)


def _as_written(content: Any) -> Any:
    """Content of a file of ROS, or of a camera_info as echoed."""
    if not isinstance(content, Mapping) or not {"k", "K"} & set(content):
        return content
    plain = {str(name).lower(): value for name, value in content.items()}
    roi = plain.get("roi") if isinstance(plain.get("roi"), Mapping) else {}
    bins = [plain.get(f"binning_{axis}") or 1 for axis in "xy"]
    if any(roi.get(f"{axis}_offset") for axis in "xy") or bins != [1, 1]:
        raise mismatch("roi, binning_x, binning_y", "the whole picture's", "a part's")
    fields = {ECHOED[name]: {"data": plain[name]} for name in ECHOED if name in plain}
    sizes = {f"image_{side}": plain[side] for side in ("width", "height") if side in plain}
    return {**plain, **fields, **sizes}


def _ros(paths: Sequence[Path], contents: Sequence[Mapping]) -> StatedOptics:
    """One or two camera_info files; a pair's projection matrices say how it is rectified."""
    cameras, projections = [], []
    for path, content in zip(paths, contents, strict=True):
        with named(path):
            size = [*_numbers(content, "image_width", 1), *_numbers(content, "image_height", 1)]
            K = _data(content, "camera_matrix", 9)
            lens = _data(content, "distortion_coefficients")
            lens = coefficients(str(_at(content, "distortion_model")), lens)
            cameras.append(_camera(size, K, lens))
            if len(paths) == 2:
                projections.append(_data(content, "projection_matrix", 12))
    if len(paths) == 1:
        return StatedOptics(tuple(cameras))
    first, second = projections
    baseline_m = -second[3] / second[0] if second[0] else 0.0
    if not 0 < baseline_m <= LONGEST_SHIFT_M:
        expected = "the right camera of a pair (its fourth value -fx times the baseline in metres)"
        found = f"a baseline of {baseline_m:g} m"
        raise mismatch(f"{paths[1]}: projection_matrix.data", expected, found)
    size = [cameras[0]["width_px"], cameras[0]["height_px"]]
    with named(paths[0]):
        rectified = _camera(size, np.delete(first, [3, 7, 11]).tolist(), [])
    return StatedOptics(tuple(cameras), rectified=(rectified, baseline_m))


def _data(content: Mapping, name: str, count: int | None = None) -> list[float]:
    """Numbers of a matrix as ROS writes it."""
    block = _at(content, name)
    with named(name):
        return _numbers(block, "data", count)


def _opencv(paths: Sequence[Path], size_px: tuple[int, int] | None) -> StatedOptics:
    """One camera, or a pair's M1 D1 M2 D2 with R and T, over one or more files."""
    found: dict[str, Any] = {}
    for path in paths:
        stored = _stored(path)
        if twice := sorted(set(stored) & set(found) & MATRICES):
            raise mismatch(f"{path}: {twice[0]}", "in one file", "in both")
        found |= stored
    with named(paths[0]):
        if {"image_width", "image_height"} <= set(found):
            size_px = (found["image_width"], found["image_height"])
        if size_px is None:
            expected = "the pictures' size in the file or by --size"
            raise mismatch("image_width, image_height", expected, "neither")
        names = PAIR_NAMES if "M1" in found else [n for n in SINGLE_NAMES if n[0] in found][:1]
        if not names:
            raise mismatch("file", "camera_matrix or M1", ", ".join(found))
        cameras = []
        for K, D in names:
            lens = _numbers(found, K, 9), _numbers(found, D)
            with named(D):
                cameras.append(_camera(size_px, *lens))
        if len(cameras) == 1:
            return StatedOptics(tuple(cameras))
        matrix = np.eye(4)
        matrix[:3, :3] = np.reshape(_numbers(found, "R", 9), (3, 3))
        matrix[:3, 3] = _numbers(found, "T", 3)
        return StatedOptics(tuple(cameras), _rigid({"R, T": matrix}, "R, T"))


def _is_opencv(path: Path) -> bool:
    """Whether a file is one of OpenCV's FileStorage; a missing one is reported later."""
    try:
        with path.open("rb") as stream:
            return OPENCV_MARK in stream.read(1_000_000)
    except OSError:
        return False


def _stored(path: Path) -> dict[str, Any]:
    """Matrices and numbers at the top of a FileStorage."""
    found = {}
    try:
        storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_READ)
        for name in storage.root().keys():
            node = storage.root().getNode(name)
            if node.isMap():
                found[name] = node.mat()
            elif node.isInt() or node.isReal():
                found[name] = node.real()
    except (cv2.error, SystemError, UnicodeDecodeError):
        with named(path):
            raise mismatch("file", "OpenCV's YAML", "none") from None
    return {name: value for name, value in found.items() if value is not None}


def _camera(size: Sequence[float], K: Sequence[float], distortion: Sequence[float]) -> dict:
    """A camera's block, of its size, camera matrix row by row and distortion."""
    if K[1]:
        raise ValueError(f"expected a skew of 0, found {K[1]:g}")
    optics = {"fx_px": K[0], "fy_px": K[4], "cx_px": K[2], "cy_px": K[5]}
    optics |= {"distortion": [*map(float, distortion)] or NO_DISTORTION}
    block = {"width_px": size[0], "height_px": size[1], **optics}
    if lines := problems(CameraSpec, block | {"encoding": "any"}):
        raise ValueError(lines[0])
    return CameraSpec.plain(block | {"distortion": shortest(optics["distortion"])})


def _rigid(block: Mapping, name: str) -> NDArray:
    """A rigid transform (4, 4) of a block."""
    matrix = np.reshape(_numbers(block, name, 16), (4, 4))
    fault = rigid_fault(matrix) or ("" if matrix[:3, 3].any() else "no shift")
    if fault:
        raise mismatch(name, "a rotation and a shift", fault)
    return matrix


def _at(block: Any, name: str) -> Any:
    if not isinstance(block, Mapping) or name not in block:
        raise mismatch(name, "a value", "none")
    return block[name]


def _numbers(block: Any, name: str, count: int | None = None) -> list[float]:
    """Finite numbers of a field, in rows or not."""
    values = _at(block, name)
    try:
        flat = np.array(values, dtype=float).ravel()
    except (TypeError, ValueError):
        flat = np.array([np.nan])
    if (count is not None and flat.size != count) or not np.isfinite(flat).all():
        much = "finite numbers" if count is None else f"{count} finite numbers"
        raise mismatch(name, much, values)
    return flat.tolist()
