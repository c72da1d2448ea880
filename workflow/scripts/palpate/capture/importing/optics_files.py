"""Optics as other programs' calibration files hold them: Kalibr, OpenCV, ROS."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from palpate.capture.importing.optics import NO_DISTORTION, coefficients, shortest
from palpate.config.sensor import COEFFICIENTS, LONGEST_SHIFT_M, ROTATION_TOLERANCE
from palpate.yaml_files import load_yaml, one_line

OPENCV_MARK = "opencv-matrix"
# Names of fields as `ros2 topic echo` prints a camera_info.
ECHOED = {"k": "camera_matrix", "d": "distortion_coefficients", "p": "projection_matrix"}
# Names under which OpenCV's own programs write a single camera's and a pair's matrices.
SINGLE_NAMES = (("camera_matrix", "distortion_coefficients"), ("cameraMatrix", "distCoeffs"))
PAIR_NAMES = (("M1", "D1"), ("M2", "D2"))
MATRICES = {name for pair in (*SINGLE_NAMES, *PAIR_NAMES) for name in pair}


@dataclass(frozen=True)
class StatedOptics:
    """Optics of one or two cameras as a file states them.

    Attributes
    ----------
    cameras : tuple of dict
        ``width_px``, ``height_px``, ``fx_px``, ``fy_px``, ``cx_px``, ``cy_px``, ``distortion``.
    second_from_first : (4, 4) array or None
        Where there are two cameras [m].
    rectified : tuple or None
        Camera and baseline [m] of a pair that the file says how to rectify.
    """

    cameras: tuple[dict, ...]
    second_from_first: NDArray | None = None
    rectified: tuple[dict, float] | None = None


def read_optics(paths: Sequence[Path], size_px: tuple[int, int] | None = None) -> StatedOptics:
    """Read calibration files of one kind.

    Parameters
    ----------
    paths : sequence of path
        A Kalibr ``camchain.yaml``, files of OpenCV's FileStorage or of VINS, or one or two
        ``camera_info`` files of ROS, or as its topic prints them.
    size_px : (width, height), optional
        Of the pictures, where OpenCV's file does not say it.

    Raises
    ------
    ValueError
        If a file is none of these, or holds another lens than OpenCV's.
    """
    if all(_is_opencv(path) for path in paths):
        return _opencv(paths, size_px)
    found = [(path, _as_written(load_yaml(path))) for path in paths]
    for path, content in found:
        if not isinstance(content, Mapping) or not {"cam0", "camera_matrix"} & set(content):
            raise ValueError(
                one_line(
                    f"{path}: file: expected cam0 (Kalibr), camera_matrix (ROS, OpenCV) or M1"
                    " (OpenCV), found none"
                )
            )
    if "cam0" in found[0][1]:
        if len(found) > 1:
            raise ValueError(f"{paths[1]}: file: expected one camchain.yaml, found another file")
        return _kalibr(*found[0])
    return _ros(found)


def _kalibr(path: Path, content: Mapping) -> StatedOptics:
    """Camera 0 and, where there is one, camera 1 of a camchain.yaml."""
    names = [name for name in ("cam0", "cam1") if name in content]
    cameras = []
    for name in names:
        block, place = content[name], f"{path}: {name}"
        _one_of(_at(block, "camera_model", place), ("pinhole",), f"{place}.camera_model")
        fx, fy, cx, cy = _numbers(_at(block, "intrinsics", place), 4, f"{place}.intrinsics")
        size = _numbers(_at(block, "resolution", place), 2, f"{place}.resolution")
        _one_of(_at(block, "distortion_model", place), ("radtan",), f"{place}.distortion_model")
        bent = _numbers(_at(block, "distortion_coeffs", place), 4, f"{place}.distortion_coeffs")
        cameras.append(_camera(size, (fx, fy, cx, cy), bent, f"{place}.distortion_coeffs"))
    if len(cameras) == 1:
        return StatedOptics(tuple(cameras))
    place = f"{path}: cam1.T_cn_cnm1"
    if "T_cn_cnm1" in content["cam1"]:
        return StatedOptics(tuple(cameras), _rigid(_transform(content["cam1"], place), place))
    # Both by the IMU: T_cam_imu takes its coordinates to a camera's, T_imu_cam back.
    by_imu = []
    for name in names:
        known = [key for key in ("T_cam_imu", "T_imu_cam") if key in content[name]]
        if not known:
            expected = "expected it, or T_cam_imu or T_imu_cam of both cameras"
            raise ValueError(f"{place}: {expected}, found none of {name}")
        at = f"{path}: {name}.{known[0]}"
        matrix = _rigid(_transform(content[name], at), at)
        by_imu.append(matrix if known[0] == "T_cam_imu" else np.linalg.inv(matrix))
    second_from_first = by_imu[1] @ np.linalg.inv(by_imu[0])
    return StatedOptics(tuple(cameras), _rigid(second_from_first, place))


def _transform(block: Mapping, place: str) -> NDArray:
    """A (4, 4) matrix of a camchain.yaml, whose field the place ends with."""
    rows = _at(block, place.rpartition(".")[2], place)
    flat = [value for row in rows for value in row] if _is_rows(rows) else rows
    return np.reshape(_numbers(flat, 16, place), (4, 4))


def _as_written(content: Any) -> Any:
    """Content of a file of ROS, of a camera_info as echoed or a file of VINS (camodocal)."""
    if not isinstance(content, Mapping) or not {"k", "K", "projection_parameters"} & set(content):
        return content
    if content.get("model_type") == "PINHOLE":
        optics, bent = (content.get(f"{n}_parameters") or {} for n in ("projection", "distortion"))
        fx, fy, cx, cy = (optics.get(name) for name in ("fx", "fy", "cx", "cy"))
        bent = [bent.get(name) for name in ("k1", "k2", "p1", "p2")]
        content = {**content, "k": [fx, 0, cx, 0, fy, cy, 0, 0, 1], "d": bent}
        content["distortion_model"] = "plumb_bob"
    plain = {str(name).lower(): value for name, value in content.items()}
    fields = {ECHOED[name]: {"data": plain[name]} for name in ECHOED if name in plain}
    sizes = {f"image_{side}": plain[side] for side in ("width", "height") if side in plain}
    return {**plain, **fields, **sizes}


def _ros(files: Sequence[tuple[Path, Mapping]]) -> StatedOptics:
    """One or two camera_info files; a pair's projection matrices say how it is rectified."""
    cameras = tuple(_ros_camera(*item) for item in files)
    if len(files) == 1:
        return StatedOptics(cameras)
    first, second = (
        _numbers(_data(content, "projection_matrix", path), 12, f"{path}: projection_matrix.data")
        for path, content in files
    )
    baseline_m = -second[3] / second[0] if second[0] else 0.0
    if not 0 < baseline_m <= LONGEST_SHIFT_M:
        raise ValueError(
            f"{files[1][0]}: projection_matrix.data: expected the right camera of a pair (its"
            f" fourth value -fx times the baseline in metres), found a baseline of {baseline_m:g} m"
        )
    size = (cameras[0]["width_px"], cameras[0]["height_px"])
    optics = (first[0], first[5], first[2], first[6])
    rectified = _camera(size, optics, (), f"{files[0][0]}: projection_matrix.data")
    return StatedOptics(cameras, rectified=(rectified, baseline_m))


def _ros_camera(path: Path, content: Mapping) -> dict:
    size = [_at(content, f"image_{side}", str(path)) for side in ("width", "height")]
    size = _numbers(size, 2, f"{path}: image_width, image_height")
    K = _numbers(_data(content, "camera_matrix", path), 9, f"{path}: camera_matrix.data")
    _without_skew(K, f"{path}: camera_matrix.data")
    place = f"{path}: distortion_coefficients.data"
    bent = _numbers(_data(content, "distortion_coefficients", path), None, place)
    try:
        bent = coefficients(str(_at(content, "distortion_model", str(path))), bent)
    except ValueError as error:
        raise ValueError(one_line(f"{path}: {error}")) from None
    return _camera(size, (K[0], K[4], K[2], K[5]), bent, place)


def _opencv(paths: Sequence[Path], size_px: tuple[int, int] | None) -> StatedOptics:
    """One camera, or a pair's M1 D1 M2 D2 with R and T, over one or more files."""
    found: dict[str, tuple[NDArray, str]] = {}
    for path in paths:
        stored = {name: (value, f"{path}: {name}") for name, value in _stored(path).items()}
        if twice := sorted(set(stored) & set(found) & MATRICES):
            raise ValueError(f"{path}: {twice[0]}: expected in one file, found in both")
        found |= stored
    first = paths[0]
    if {"image_width", "image_height"} <= set(found):
        size_px = tuple(found[f"image_{side}"][0] for side in ("width", "height"))
    if size_px is None:
        raise ValueError(
            f"{first}: image_width, image_height: expected the pictures' size in the file or by"
            " --size, found neither"
        )
    size = _numbers(list(size_px), 2, f"{first}: image_width, image_height")
    names = PAIR_NAMES if "M1" in found else [n for n in SINGLE_NAMES if n[0] in found][:1]
    if not names:
        raise ValueError(f"{first}: file: expected camera_matrix or M1, found {', '.join(found)}")
    cameras = []
    for matrix, distortion in names:
        for name in (matrix, distortion):
            if name not in found:
                raise ValueError(f"{first}: {name}: expected a matrix, found none")
        K = _numbers(np.ravel(found[matrix][0]).tolist(), 9, found[matrix][1])
        _without_skew(K, found[matrix][1])
        bent, place = found[distortion]
        cameras.append(_camera(size, (K[0], K[4], K[2], K[5]), np.ravel(bent).tolist(), place))
    if len(cameras) == 1:
        return StatedOptics(tuple(cameras))
    for name in ("R", "T"):
        if name not in found:
            raise ValueError(f"{first}: {name}: expected a matrix, found none")
    (turn, place), (shift, _) = found["R"], found["T"]
    matrix = np.eye(4)
    matrix[:3, :3] = np.reshape(_numbers(np.ravel(turn).tolist(), 9, place), (3, 3))
    matrix[:3, 3] = _numbers(np.ravel(shift).tolist(), 3, found["T"][1])
    return StatedOptics(tuple(cameras), _rigid(matrix, place))


def _is_opencv(path: Path) -> bool:
    """Whether a file is one of OpenCV's FileStorage; a missing one is refused later."""
    try:
        with path.open("rb") as stream:
            return OPENCV_MARK.encode() in stream.read(1_000_000)
    except OSError:
        return False


def _stored(path: Path) -> dict[str, Any]:
    """Matrices and numbers at the top of a FileStorage."""
    try:
        storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_READ)
        root = storage.root()
        nodes = {name: root.getNode(name) for name in root.keys()}
        readers: tuple[tuple[Callable, Callable], ...] = (
            (lambda node: node.isMap(), lambda node: node.mat()),
            (lambda node: node.isInt() or node.isReal(), lambda node: node.real()),
        )
        found = {
            name: read(node) for name, node in nodes.items() for fits, read in readers if fits(node)
        }
    except (cv2.error, SystemError, UnicodeDecodeError):
        raise ValueError(one_line(f"{path}: file: expected OpenCV's YAML, found none")) from None
    return {name: value for name, value in found.items() if value is not None}


def _camera(size: Sequence[float], optics: Sequence[float], distortion: Any, place: str) -> dict:
    """A camera's block."""
    bent = _numbers(distortion, None, place) or NO_DISTORTION
    if len(bent) not in COEFFICIENTS:
        expected = f"expected {', '.join(map(str, COEFFICIENTS))} coefficients of OpenCV's lenses"
        raise ValueError(f"{place}: {expected}, found {len(bent)}")
    sides = [int(side) for side in size]
    if sides != list(size) or min(sides) < 1:
        raise ValueError(f"{place}: expected whole pixels in width and height, found {list(size)}")
    if not min(optics[:2]) > 0:
        raise ValueError(f"{place}: expected focal lengths above 0, found {list(optics[:2])}")
    if not all(0 <= centre <= side for centre, side in zip(optics[2:], sides, strict=True)):
        raise ValueError(
            f"{place}: expected a principal point within {sides[0]} x {sides[1]} pixels, found"
            f" {list(optics[2:])}"
        )
    names = ("fx_px", "fy_px", "cx_px", "cy_px")
    return {
        "width_px": int(size[0]),
        "height_px": int(size[1]),
        **dict(zip(names, map(float, optics), strict=True)),
        "distortion": shortest(bent),
    }


def _without_skew(K: Sequence[float], place: str) -> None:
    """Refuse a camera whose axes are not at right angles (nine numbers)."""
    if K[1]:
        raise ValueError(f"{place}: expected a skew of 0, found {K[1]:g}")


def _rigid(matrix: NDArray, place: str) -> NDArray:
    turn, shift = matrix[:3, :3], np.abs(matrix[:3, 3]).max()
    right = np.allclose(turn @ turn.T, np.eye(3), atol=ROTATION_TOLERANCE)
    if not (right and np.linalg.det(turn) > 0):
        raise ValueError(f"{place}: expected a rotation, found another matrix")
    if not 0 < shift <= LONGEST_SHIFT_M:
        raise ValueError(
            f"{place}: expected a shift above 0 and at most {LONGEST_SHIFT_M:g} m, found {shift:g}"
            " (metres?)"
        )
    return matrix


def _at(block: Any, name: str, place: str) -> Any:
    if not isinstance(block, Mapping) or name not in block:
        raise ValueError(one_line(f"{place}: {name}: expected a value, found none"))
    return block[name]


def _data(content: Mapping, name: str, path: Path) -> Any:
    return _at(_at(content, name, str(path)), "data", f"{path}: {name}")


def _one_of(found: Any, names: Sequence[str], place: str) -> None:
    if found not in names:
        raise ValueError(one_line(f"{place}: expected {' or '.join(names)}, found {found}"))


def _is_rows(values: Any) -> bool:
    return isinstance(values, list) and all(isinstance(row, list) for row in values)


def _numbers(values: Any, count: int | None, place: str) -> list[float]:
    """A list of finite numbers."""
    fits = isinstance(values, list | tuple) and (count is None or len(values) == count)
    kinds = (int, float)
    if not (fits and all(isinstance(v, kinds) and not isinstance(v, bool) for v in values)):
        much = "numbers" if count is None else f"{count} numbers"
        raise ValueError(one_line(f"{place}: expected a list of {much}, found {values}"))
    if not all(map(math.isfinite, values)):
        raise ValueError(one_line(f"{place}: expected finite numbers, found {values}"))
    return list(map(float, values))
