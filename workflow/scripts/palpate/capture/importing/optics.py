"""Optics that a recording states, as the blocks of a sensor's file."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from palpate.capture.importing.pixels import Form
from palpate.config.sensor import COEFFICIENTS

NO_DISTORTION = [0.0] * 5
# Names of OpenCV's model, with its numbers of coefficients. RealSense calls that of its colour
# cameras inverse, yet takes rays to the image with it (rs2_project).
BROWN_CONRADY = ("plumb_bob", "radtan", "brown_conrady", "inverse_brown_conrady")
LENSES = dict.fromkeys(BROWN_CONRADY, COEFFICIENTS[:2]) | {"rational_polynomial": COEFFICIENTS[2:]}
# Models that are no pinhole's without coefficients either.
FISHEYES = ("equidistant", "fisheye", "ftheta", "kannala_brandt4")
# Camera drivers of ROS call images so whose distortion has been taken out.
RECTIFIED = "image_rect"
DECIMALS = 9
# A driver rounds; another device or resolution differs by far more.
TOLERANCES = {
    "fx_px": (0.05, " px"),
    "fy_px": (0.05, " px"),
    "cx_px": (0.05, " px"),
    "cy_px": (0.05, " px"),
    "distortion": (1e-3, ""),
    "color_from_depth": (2e-4, ""),
}


def camera_block(info: Any, form: Form, *, rectified: bool) -> dict:
    """Size, encoding and optics of one camera from a CameraInfo message.

    Parameters
    ----------
    info
        CameraInfo of ROS 1 or ROS 2.
    form : Form
        Of the camera's images.
    rectified : bool
        Whether the images are free of the distortion that the message states; their optics are then
        those of its projection matrix.

    Returns
    -------
    dict
        ``color`` or ``depth`` block of a sensor's file, without ``color_from_depth``.

    Raises
    ------
    ValueError
        If the message states another size, no focal length, or a lens that the file can't.
    """
    K, D, P = (_numbers(info, name) for name in ("K", "D", "P"))
    size, stated = (form.width_px, form.height_px), (info.width, info.height)
    if stated != size:
        # Optics are those of the whole chip; images are of a region of it, in bins.
        roi, bins = info.roi, np.maximum([info.binning_x, info.binning_y], 1)
        for optics in (K.reshape(3, 3), P.reshape(3, 4)):
            optics[:2, 2] -= roi.x_offset, roi.y_offset
            optics[:2] /= bins[:, None]
        part = np.array([roi.width or info.width, roi.height or info.height]) // bins
        stated = (int(part[0]), int(part[1]))
    if stated != size:
        expected, found = (f"{width} x {height}" for width, height in (size, stated))
        raise ValueError(f"camera_info: expected {expected} pixels as the images, found {found}")
    if rectified and np.any(D):
        K, D = np.delete(P, [3, 7, 11]), np.array([])
    if not (np.isfinite(K).all() and K[0] > 0 and K[4] > 0):
        raise ValueError(f"camera_info: K: expected focal lengths above 0, found {K[0]}, {K[4]}")
    try:
        distortion = coefficients(info.distortion_model, D.tolist())
    except ValueError as error:
        raise ValueError(f"camera_info: {error}") from None
    return plain_block(form, [K[0], K[4], K[2], K[5]], distortion)


def coefficients(model: str, found: Sequence[float]) -> list[float]:
    """Distortion of a lens in OpenCV's order, of one of its models by their names in ROS.

    Raises
    ------
    ValueError
        If the model is another, or has not so many coefficients.
    """
    if not np.isfinite(found).all():
        raise ValueError("D: expected finite numbers, found others")
    plain = model.lower().replace(" ", "_")
    if not np.any(found) and plain not in FISHEYES:
        return NO_DISTORTION
    if len(found) not in LENSES.get(plain, ()):
        expected = f"one of {', '.join(LENSES)} with its coefficients (or rectified images)"
        found = f"{model} with {len(found)}"
        raise ValueError(f"distortion_model: expected {expected}, found {found}")
    return shortest(found)


def shortest(distortion: Sequence[float]) -> list[float]:
    """Coefficients without zeros that OpenCV doesn't need, but five."""
    count = next(count for count in COEFFICIENTS[1:] if not any(distortion[count:]))
    return [*map(float, distortion), 0.0][:count]


def plain_block(
    form: Form, intrinsics: Iterable[float], distortion: Iterable[float] = NO_DISTORTION
) -> dict:
    """Camera block of a sensor's file from fx, fy, cx, cy [px] and its distortion."""
    names = ("fx_px", "fy_px", "cx_px", "cy_px")
    optics = {name: float(value) for name, value in zip(names, intrinsics, strict=True)}
    size = {"width_px": form.width_px, "height_px": form.height_px, "encoding": form.stored}
    return size | optics | {"distortion": [float(value) for value in distortion]}


def is_rectified(topic: str) -> bool:
    """Whether an image topic's name says that its distortion has been taken out."""
    return any(part.startswith(RECTIFIED) for part in topic.split("/"))


def matrix(transform: Any) -> NDArray:
    """Homogeneous (4, 4) matrix of a Transform message, translation in metres.

    Raises
    ------
    ValueError
        If its numbers are not finite, or its quaternion has no length.
    """
    q, t = transform.rotation, transform.translation
    quaternion = np.array([q.x, q.y, q.z, q.w], dtype=float)
    translation = np.array([t.x, t.y, t.z], dtype=float)
    length = np.linalg.norm(quaternion)
    if not (np.isfinite(translation).all() and abs(length - 1) < 0.01):
        found = f"length {length:g}, {translation}"
        raise ValueError(f"transform: expected a unit quaternion and metres, found {found}")
    result = np.eye(4)
    result[:3, :3] = Rotation.from_quat(quaternion).as_matrix()
    result[:3, 3] = translation
    return result


def chained(transforms: Iterable[Any], target: str, source: str) -> NDArray:
    """Transform between two frames by way of those that a recording states.

    Parameters
    ----------
    transforms : iterable of TransformStamped
        Each takes coordinates in its child frame to its parent.
    target, source : str
        Names of frames.

    Returns
    -------
    (4, 4) array
        ``target_from_source``, translation in metres.

    Raises
    ------
    ValueError
        If nothing leads from one to the other.
    """
    steps: dict[str, list[tuple[str, NDArray]]] = {}
    for one in transforms:
        parent_from_child = matrix(one.transform)
        parent, child = _frame(one.header.frame_id), _frame(one.child_frame_id)
        steps.setdefault(child, []).append((parent, parent_from_child))
        steps.setdefault(parent, []).append((child, np.linalg.inv(parent_from_child)))
    reached, waiting = {_frame(source): np.eye(4)}, [_frame(source)]
    while waiting:
        here = waiting.pop()
        for there, there_from_here in steps.get(here, []):
            if there not in reached:
                reached[there] = there_from_here @ reached[here]
                waiting.append(there)
    if _frame(target) not in reached:
        raise ValueError(
            f"tf_static: expected a way from frame {source} to {target}, found none"
            " (--registered says that depth is registered to colour)"
        )
    return reached[_frame(target)]


def rows(transform: NDArray) -> list[list[float]]:
    """A transform as a sensor's file has it."""
    return [[round(float(value), DECIMALS) + 0.0 for value in row] for row in transform]


def _numbers(info: Any, name: str) -> NDArray:
    """K, D or P of a CameraInfo; ROS 2 writes them small."""
    value = getattr(info, name) if hasattr(info, name) else getattr(info, name.lower())
    return np.array(value, dtype=float)


def _frame(name: str) -> str:
    """Name of a frame; old ROS put a slash before it."""
    return name.lstrip("/")


def agree(stated: Mapping, found: Mapping) -> str | None:
    """Compare a camera's stated optics with those of a recording: what differs first, or None."""
    for name, (tolerance, unit) in TOLERANCES.items():
        if name not in stated or name not in found:
            continue
        pair = [np.asarray(one[name], dtype=float) for one in (stated, found)]
        if name == "distortion":
            pair = [np.pad(one, (0, max(COEFFICIENTS) - len(one))) for one in pair]
        difference = np.abs(pair[0] - pair[1]).max()
        if not difference <= tolerance:
            return (
                f"{name}: expected {_short(found[name])}{unit}, found {_short(stated[name])}{unit}"
            )
    return None


def _short(value: Any) -> str:
    numbers = np.round(np.asarray(value, dtype=float), DECIMALS).tolist()
    return " ".join(str(numbers).split())
