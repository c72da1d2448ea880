"""Optics as other programs' calibration files hold them: Kalibr, OpenCV, ROS."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from palpate.capture.importing.optics import NO_DISTORTION, coefficients, shortest
from palpate.capture.importing.recording import named
from palpate.config.model import problems
from palpate.config.sensor import LONGEST_SHIFT_M, CameraSpec, rigid_fault
from palpate.yaml_files import LARGEST_BYTES, NO_VALUES, is_file, load_yaml, mismatch

FORMATS = "cam0 (Kalibr), camera_matrix (ROS, OpenCV) or M1 (OpenCV)"
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

    A Kalibr ``camchain.yaml``, files of OpenCV's FileStorage, or one or two ``camera_info`` files,
    by ROS or as their topic prints them. ``size_px`` is the pictures' width and height, for files
    of OpenCV that do not say it.

    Raises
    ------
    ValueError
        If a file is none of these, or holds another lens than OpenCV's.
    """
    contents = [_content(path) for path in paths]
    # OpenCV alone says what type of number a matrix has.
    by_opencv = [any("dt" in _fields(value) for value in one.values()) for one in contents]
    if any(by_opencv):
        if not all(by_opencv):
            other = paths[by_opencv.index(False)]
            raise mismatch(f"{other}: file", "one of OpenCV, as another is", "one without a matrix")
        return _opencv(paths, contents, size_px)
    for k, path in enumerate(paths):
        with named(path):
            contents[k] = _as_written(contents[k])
            if not {"cam0", "camera_matrix"} & set(contents[k]):
                raise mismatch("file", FORMATS, "none")
    if "cam0" not in contents[0]:
        return _ros(paths, contents)
    if len(paths) > 1:
        raise mismatch(f"{paths[1]}: file", "one camchain.yaml", "another file")
    with named(paths[0]):
        return _kalibr(contents[0])


def _content(path: Path) -> Mapping:
    """Fields of a file: OpenCV's XML, or YAML, which its JSON is too."""
    text = b""
    if is_file(path):
        with path.open("rb") as stream:
            text = stream.read(LARGEST_BYTES + 1)
    is_xml = text.startswith(b"<")
    with named(path):
        if len(text) > LARGEST_BYTES:
            expected = f"{'XML' if is_xml else 'YAML'} of at most {LARGEST_BYTES} bytes"
            found = f"{path.stat().st_size} (leave out what is no matrix and no size)"
            raise mismatch("file", expected, found)
        try:
            content = _texts(ElementTree.fromstring(text)) if is_xml else load_yaml(path)
        except (ElementTree.ParseError, *NO_VALUES) as error:
            if text.decode(errors="ignore").encode() != text:
                hint = "save it as UTF-8, or copy it again?"
                raise mismatch("file", "UTF-8", f"other bytes ({hint})") from None
            fault = f"file: expected XML, found none ({error})" if is_xml else error
            hint = " (copy or write it again?)" if text else ""
            raise ValueError(f"{fault}{hint}") from None
        if not isinstance(content, Mapping):
            raise mismatch("file", FORMATS, "none")
    return content


def _fields(value: Any) -> Mapping:
    """A field's own fields, none if it has none."""
    return value if isinstance(value, Mapping) else {}


def _texts(element: ElementTree.Element) -> dict[str, Any] | list[str]:
    return {part.tag: _texts(part) for part in element} or (element.text or "").split()


def _kalibr(content: Mapping) -> StatedOptics:
    """Camera 0 and, where there is one, camera 1 of a camchain.yaml."""
    names = [name for name in ("cam0", "cam1") if name in content]
    cameras = tuple(_kalibr_camera(content[name], name) for name in names)
    if len(cameras) == 1:
        return StatedOptics(cameras)
    with named("cam1"):
        return StatedOptics(cameras, _rigid(content["cam1"], "T_cn_cnm1"))


def _kalibr_camera(block: Mapping, name: str) -> dict:
    with named(name):
        for field, known in (("camera_model", "pinhole"), ("distortion_model", "radtan")):
            if (found := _at(block, field)) != known:
                raise mismatch(field, known, found)
        fx, fy, cx, cy = _numbers(block, "intrinsics", 4)
        distortion = _numbers(block, "distortion_coeffs", 4)
        size = _numbers(block, "resolution", 2)
        return _camera(size, [fx, 0, cx, 0, fy, cy, 0, 0, 1], distortion)


def _as_written(content: Mapping) -> Mapping:
    """Content of a file of ROS, or of a camera_info as echoed."""
    if not {"k", "K"} & set(content):
        return content
    plain = {str(name).lower(): value for name, value in content.items()}
    roi, bins = _fields(plain.get("roi")), [plain.get(f"binning_{axis}") or 1 for axis in "xy"]
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
    """Numbers of a matrix as ROS writes it, or OpenCV."""
    block = _at(content, name)
    with named(name):
        channels = re.search(r"\d+", str(_fields(block).get("dt")))
        if channels and int(channels[0]) > 1:
            remedy = "write it by rows, as Mat::reshape(1) has it"
            raise mismatch("dt", "a matrix of one channel", f"one of {channels[0]} ({remedy})")
        values = _numbers(block, "data", count)
        names = ["sizes"] if "sizes" in block else ["rows", "cols"] if "dt" in block else []
        sides = [side for one in names for side in _numbers(block, one)]
        if sides and np.prod(sides) != len(values):
            expected = " x ".join(f"{side:g}" for side in sides)
            raise mismatch("data", f"{expected} numbers", len(values))
    return values


def _opencv(
    paths: Sequence[Path], contents: Sequence[Mapping], size_px: tuple[int, int] | None
) -> StatedOptics:
    """One camera, or a pair's M1 D1 M2 D2 with R and T, over one or more files."""
    found: dict[str, Any] = {}
    for path, stored in zip(paths, contents, strict=True):
        if twice := sorted(set(stored) & set(found) & MATRICES):
            raise mismatch(f"{path}: {twice[0]}", "in one file", "in both")
        found |= stored
    with named(paths[0]):
        if {"image_width", "image_height"} <= set(found):
            size_px = *_numbers(found, "image_width", 1), *_numbers(found, "image_height", 1)
        if size_px is None:
            expected = "the pictures' size in the file or by --size"
            raise mismatch("image_width, image_height", expected, "neither")
        names = PAIR_NAMES if "M1" in found else [n for n in SINGLE_NAMES if n[0] in found][:1]
        if not names:
            raise mismatch("file", "camera_matrix or M1", ", ".join(map(str, found)))
        cameras = []
        for K, D in names:
            lens = _data(found, K, 9), _data(found, D)
            with named(D):
                cameras.append(_camera(size_px, *lens))
        if len(cameras) == 1:
            return StatedOptics(tuple(cameras))
        matrix = np.eye(4)
        matrix[:3, :3] = np.reshape(_data(found, "R", 9), (3, 3))
        matrix[:3, 3] = _data(found, "T", 3)
        return StatedOptics(tuple(cameras), _rigid({"R, T": matrix}, "R, T"))


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
    if name not in _fields(block):
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
