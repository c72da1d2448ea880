"""Optics as other programs' calibration files hold them: Kalibr, OpenCV, ROS."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from palpate.capture.importing.optics import coefficients, shortest
from palpate.config.model import problems
from palpate.config.sensor import LONGEST_SHIFT_M, CameraSpec, rigid_fault
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
    found = []
    for path in paths:
        try:
            found.append((path, _as_written(load_yaml(path))))
        except ValueError as error:
            said = str(error).startswith(str(path))
            raise ValueError(f"{'' if said else f'{path}: '}{error}") from None
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
        for field, known in (("camera_model", "pinhole"), ("distortion_model", "radtan")):
            if (found := _at(block, field, place)) != known:
                raise ValueError(one_line(f"{place}.{field}: expected {known}, found {found}"))
        fx, fy, cx, cy = _numbers(block, "intrinsics", 4, place)
        K = [fx, 0, cx, 0, fy, cy, 0, 0, 1]
        bent = _numbers(block, "distortion_coeffs", 4, place)
        cameras.append(_camera(_numbers(block, "resolution", 2, place), K, bent, place))
    if len(cameras) == 1:
        return StatedOptics(tuple(cameras))
    place = f"{path}: cam1"
    if "T_cn_cnm1" in content["cam1"]:
        return StatedOptics(tuple(cameras), _rigid(content["cam1"], "T_cn_cnm1", place))
    # Both by the IMU: T_cam_imu takes its coordinates to a camera's, T_imu_cam back.
    by_imu = []
    for name in names:
        known = [key for key in ("T_cam_imu", "T_imu_cam") if key in content[name]]
        if not known:
            expected = "expected it, or T_cam_imu or T_imu_cam of both cameras"
            raise ValueError(f"{place}.T_cn_cnm1: {expected}, found none of {name}")
        matrix = _rigid(content[name], known[0], f"{path}: {name}")
        by_imu.append(matrix if known[0] == "T_cam_imu" else np.linalg.inv(matrix))
    second_from_first = {"T_cn_cnm1": by_imu[1] @ np.linalg.inv(by_imu[0])}
    return StatedOptics(tuple(cameras), _rigid(second_from_first, "T_cn_cnm1", place))


def _as_written(content: Any) -> Any:
    """Content of a file of ROS, of a camera_info as echoed or a file of VINS (camodocal)."""
    if not isinstance(content, Mapping) or not {"k", "K", "projection_parameters"} & set(content):
        return content
    if content.get("model_type") == "PINHOLE":
        blocks = (content.get(f"{name}_parameters") for name in ("projection", "distortion"))
        optics, bent = (one if isinstance(one, Mapping) else {} for one in blocks)
        fx, fy, cx, cy = (optics.get(name) for name in ("fx", "fy", "cx", "cy"))
        bent = [bent.get(name) for name in ("k1", "k2", "p1", "p2")]
        content = {**content, "k": [fx, 0, cx, 0, fy, cy, 0, 0, 1], "d": bent}
        content["distortion_model"] = "plumb_bob"
    plain = {str(name).lower(): value for name, value in content.items()}
    roi = plain.get("roi") if isinstance(plain.get("roi"), Mapping) else {}
    bins = [plain.get(f"binning_{axis}") or 1 for axis in "xy"]
    if any(roi.get(f"{axis}_offset") for axis in "xy") or bins != [1, 1]:
        raise ValueError("roi, binning_x, binning_y: expected the whole picture's, found a part's")
    fields = {ECHOED[name]: {"data": plain[name]} for name in ECHOED if name in plain}
    sizes = {f"image_{side}": plain[side] for side in ("width", "height") if side in plain}
    return {**plain, **fields, **sizes}


def _ros(files: Sequence[tuple[Path, Mapping]]) -> StatedOptics:
    """One or two camera_info files; a pair's projection matrices say how it is rectified."""
    cameras = tuple(_ros_camera(*item) for item in files)
    if len(files) == 1:
        return StatedOptics(cameras)
    name = "projection_matrix"
    first, second = (
        _numbers(_at(content, name, str(path)), "data", 12, f"{path}: {name}")
        for path, content in files
    )
    baseline_m = -second[3] / second[0] if second[0] else 0.0
    if not 0 < baseline_m <= LONGEST_SHIFT_M:
        raise ValueError(
            f"{files[1][0]}: {name}.data: expected the right camera of a pair (its fourth value"
            f" -fx times the baseline in metres), found a baseline of {baseline_m:g} m"
        )
    size = [cameras[0]["width_px"], cameras[0]["height_px"]]
    K = np.delete(first, [3, 7, 11])
    return StatedOptics(cameras, rectified=(_camera(size, K, [], str(files[0][0])), baseline_m))


def _ros_camera(path: Path, content: Mapping) -> dict:
    place = str(path)
    size = [_numbers(content, f"image_{side}", 1, place)[0] for side in ("width", "height")]
    K, bent = (
        _numbers(_at(content, name, place), "data", count, f"{place}: {name}")
        for name, count in (("camera_matrix", 9), ("distortion_coefficients", None))
    )
    try:
        bent = coefficients(str(_at(content, "distortion_model", place)), bent)
    except ValueError as error:
        raise ValueError(one_line(f"{place}: {error}")) from None
    return _camera(size, K, bent, place)


def _opencv(paths: Sequence[Path], size_px: tuple[int, int] | None) -> StatedOptics:
    """One camera, or a pair's M1 D1 M2 D2 with R and T, over one or more files."""
    found: dict[str, Any] = {}
    for path in paths:
        stored = _stored(path)
        if twice := sorted(set(stored) & set(found) & MATRICES):
            raise ValueError(f"{path}: {twice[0]}: expected in one file, found in both")
        found |= stored
    place = str(paths[0])
    if {"image_width", "image_height"} <= set(found):
        size_px = tuple(found[f"image_{side}"] for side in ("width", "height"))
    if size_px is None:
        raise ValueError(
            f"{place}: image_width, image_height: expected the pictures' size in the file or by"
            " --size, found neither"
        )
    names = PAIR_NAMES if "M1" in found else [n for n in SINGLE_NAMES if n[0] in found][:1]
    if not names:
        raise ValueError(f"{place}: file: expected camera_matrix or M1, found {', '.join(found)}")
    cameras = tuple(
        _camera(
            size_px, _numbers(found, K, 9, place), _numbers(found, D, None, place), f"{place}: {D}"
        )
        for K, D in names
    )
    if len(cameras) == 1:
        return StatedOptics(cameras)
    matrix = np.eye(4)
    matrix[:3, :3] = np.reshape(_numbers(found, "R", 9, place), (3, 3))
    matrix[:3, 3] = _numbers(found, "T", 3, place)
    return StatedOptics(cameras, _rigid({"R, T": matrix}, "R, T", place))


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


def _camera(size: Sequence[float], K: Sequence[float], bent: Sequence[float], place: str) -> dict:
    """A camera's block, of its size, camera matrix row by row and distortion."""
    if K[1]:
        raise ValueError(f"{place}: expected a skew of 0, found {K[1]:g}")
    optics = {"fx_px": K[0], "fy_px": K[4], "cx_px": K[2], "cy_px": K[5]}
    sides = {"width_px": size[0], "height_px": size[1]}
    block = {**sides, **optics, "distortion": [*map(float, bent)] or [0.0] * 5}
    lines = problems(CameraSpec, block | {"encoding": "any"}, place)
    if lines:
        raise ValueError(lines[0])
    return {
        **{name: int(side) for name, side in sides.items()},
        **{name: float(value) for name, value in optics.items()},
        "distortion": shortest(block["distortion"]),
    }


def _rigid(block: Mapping, name: str, place: str) -> NDArray:
    """A rigid transform (4, 4) of a block."""
    matrix = np.reshape(_numbers(block, name, 16, place), (4, 4))
    fault = rigid_fault(matrix) or ("" if matrix[:3, 3].any() else "no shift")
    if fault:
        raise ValueError(f"{place}: {name}: expected a rotation and a shift, found {fault}")
    return matrix


def _at(block: Any, name: str, place: str) -> Any:
    if not isinstance(block, Mapping) or name not in block:
        raise ValueError(one_line(f"{place}: {name}: expected a value, found none"))
    return block[name]


def _numbers(block: Any, name: str, count: int | None, place: str) -> list[float]:
    """Finite numbers of a field, in rows or not."""
    values = _at(block, name, place)
    try:
        flat = np.array(values, dtype=float).ravel()
    except (TypeError, ValueError):
        flat = np.array([np.nan])
    if (count is not None and flat.size != count) or not np.isfinite(flat).all():
        much = "finite numbers" if count is None else f"{count} finite numbers"
        raise ValueError(one_line(f"{place}: {name}: expected {much}, found {values}"))
    return flat.tolist()
