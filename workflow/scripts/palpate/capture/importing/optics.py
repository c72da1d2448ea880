"""The sensor's file of an imported recording: made from the optics that it states, or compared."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray

from palpate.capture.images import COUNTS
from palpate.capture.importing.pixels import METRES, Form
from palpate.capture.importing.recording import Content, Request, is_capture, named
from palpate.config.model import FILL_IN, blank_fields, problems
from palpate.config.sensor import COEFFICIENTS, SensorSpec
from palpate.units import MILLIMETRES
from palpate.yaml_files import load_yaml, mismatch

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
# Depth cameras differ; what is seen is bounded by mask and table, not by this.
RANGE_M = (0.1, 10.0)
# The study's for its Kinect (Section 4.2.3).
REPROJECTION_THRESHOLD_PX = 0.45
# What a count of floating-point depths becomes [m]: they reach 6.5 m.
FLOATS_M = 1e-4
# A driver rounds; another device or resolution differs by far more.
TOLERANCES = {
    **dict.fromkeys(("fx_px", "fy_px", "cx_px", "cy_px"), (0.05, " px")),
    "distortion": (1e-3, ""),
    "color_from_depth": (2e-4, ""),
}
HEAD = """\
# Made by an import: the optics are those that the recording states. range_m and
# reprojection_threshold_px are no part of recordings: look them over.
"""


def camera_block(info: Any, form: Form, topic: str) -> dict:
    """Block ``color`` or ``depth`` of a sensor's file from a CameraInfo of ROS 1 or 2.

    It is without ``color_from_depth``. Form and topic are those of the camera's images. Those whose
    topic is called ``image_rect...`` are free of the distortion that the message states; their
    optics are those of its projection matrix.

    Raises
    ------
    ValueError
        If the message states another size, no focal length, or a lens that the file can't.
    """
    # ROS 2 writes them small.
    K, D, P = (
        np.array(getattr(info, name if hasattr(info, name) else name.lower()), dtype=float)
        for name in ("K", "D", "P")
    )
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
        raise mismatch("camera_info", f"{expected} pixels as the images", found)
    rectified = any(part.startswith(RECTIFIED) for part in topic.split("/"))
    if rectified and np.any(D):
        K, D = np.delete(P, [3, 7, 11]), np.array([])
    if not (np.isfinite(K).all() and K[0] > 0 and K[4] > 0):
        raise mismatch("camera_info: K", "focal lengths above 0", f"{K[0]}, {K[4]}")
    with named("camera_info"):
        distortion = coefficients(info.distortion_model, D.tolist())
    return plain_block(form, [K[0], K[4], K[2], K[5]], distortion)


def coefficients(model: str, found: Sequence[float]) -> list[float]:
    """Distortion of a lens in OpenCV's order, of one of its models by their names in ROS.

    Raises
    ------
    ValueError
        If the model is another, or has not so many coefficients.
    """
    if not np.isfinite(found).all():
        raise mismatch("D", "finite numbers", "others")
    plain = model.lower().replace(" ", "_")
    if not np.any(found) and plain not in FISHEYES:
        return NO_DISTORTION
    if len(found) not in LENSES.get(plain, ()):
        expected = f"one of {', '.join(LENSES)} with its coefficients (or rectified images)"
        raise mismatch("distortion_model", expected, f"{model} with {len(found)}")
    return shortest(found)


def shortest(distortion: Sequence[float]) -> list[float]:
    """Coefficients without zeros that OpenCV doesn't need, but five."""
    count = next(count for count in COEFFICIENTS[1:] if not any(distortion[count:]))
    return [*map(float, distortion), 0.0][:count]


def plain_block(form: Form, intrinsics: Iterable[float], distortion: Iterable[float]) -> dict:
    """Camera block of a sensor's file from fx, fy, cx, cy [px] and its distortion."""
    optics = dict(zip(("fx_px", "fy_px", "cx_px", "cy_px"), map(float, intrinsics), strict=True))
    size = {"width_px": form.width_px, "height_px": form.height_px, "encoding": form.stored}
    return size | optics | {"distortion": [float(value) for value in distortion]}


def rows(transform: NDArray) -> list[list[float]]:
    """A transform as a sensor's file has it."""
    return [[round(float(value), DECIMALS) + 0.0 for value in row] for row in transform]


def sensor_of(request: Request, content: Content, rate_hz: float) -> tuple[dict, str | None]:
    """Specification of a recording's sensor, with ``rate_hz`` frames per second, and a file's text.

    Fields of its file that are left to fill in are taken from the recording; the text is None where
    the file is whole as it is.

    Raises
    ------
    ValueError
        If the file is wrong or contradicts the recording, or there is neither file nor optics.
    """
    path, spec, written = request.sensor_file, _stated(request, content, rate_hz), None
    if path.exists():
        written = load_yaml(path)
        names = written if isinstance(written, Mapping) else ()
        known = {name: value for name, value in spec.items() if name in names}
        spec = SensorSpec.plain(_filled_in(written, known))
    elif content.cameras is None:
        expected = "a sensor file, or optics in the recording (camera_info, --intrinsics)"
        raise mismatch(f"{path}: file", expected, "neither")
    lines = problems(SensorSpec, spec, str(path))
    if not is_capture(request.folder):  # where poses' base is, an import of a capture says
        lines = [line for line in lines if not line.startswith(f"{path}: base.")]
    if lines:
        raise ValueError(lines[0])
    if path.exists():
        with named(path):
            _check_streams(spec, content)
            if not request.trust_sensor_file and spec.get("optics", "stated") == "stated":
                _check_optics(spec, content.cameras or {})
    if spec == written:
        return spec, None
    return spec, HEAD + yaml.safe_dump(spec, sort_keys=False, default_flow_style=None, width=100)


def _stated(request: Request, content: Content, rate_hz: float) -> dict:
    """What a recording says of its sensor, and what a new file has besides."""
    cameras = dict(content.cameras or {})
    if "depth" in cameras:
        floats = content.depth.form.encoding == METRES
        unit_m = FLOATS_M if floats else content.depth_unit_m
        finer = unit_m < 1 / MILLIMETRES
        cameras["depth"] |= {"encoding": COUNTS, "count_m": unit_m} if finer else {}
    return {
        "sensor": request.sensor_file.stem,
        "kind": "depth",
        "frame_rate_hz": float(f"{rate_hz:.4g}"),
        "range_m": list(RANGE_M),
        **cameras,
        "marker": {"reprojection_threshold_px": REPROJECTION_THRESHOLD_PX},
    }


def _filled_in(written: object, stated: object) -> object:
    """A file's content with what is left to fill in taken from the recording."""
    if isinstance(written, Mapping) and isinstance(stated, Mapping):
        found = {k: _filled_in(v, stated[k]) if k in stated else v for k, v in written.items()}
        # What a filled value needs beside it, as counts need their size.
        blanks = [name for name, value in written.items() if value == FILL_IN]
        return dict(stated) | found if blanks else found
    return stated if blank_fields(written) else written


def _check_streams(spec: Mapping, content: Content) -> None:
    """Compare kind, size and encoding with the recording's."""
    if spec["kind"] != "depth":
        found = f"{spec['kind']} (another name in raw/ gives it a file of its own)"
        raise mismatch("kind", "depth, as the recording is", found)
    for kind, form in (("color", content.color.form), ("depth", content.depth.form)):
        stated = {"width_px": form.width_px, "height_px": form.height_px}
        # Depths are rounded to the file's counts.
        stated |= {} if kind == "depth" else {"encoding": form.stored}
        for name, value in stated.items():
            if spec[kind][name] != value:
                expected = f"{value}, as the recording has it"
                raise mismatch(f"{kind}.{name}", expected, spec[kind][name])


def _check_optics(spec: Mapping, cameras: Mapping) -> None:
    """Compare optics with those that the recording states."""
    for kind, camera in cameras.items():
        for name in [name for name in TOLERANCES if name in camera and name in spec[kind]]:
            tolerance, unit = TOLERANCES[name]
            pair = [np.array(one[name], dtype=float) for one in (camera, spec[kind])]
            padding = max(COEFFICIENTS) if name == "distortion" else 0
            stated, own = (np.pad(one, (0, padding - len(one))) if padding else one for one in pair)
            if not np.abs(stated - own).max() <= tolerance:
                expected, found = (str(np.round(one, DECIMALS).tolist()) + unit for one in pair)
                hint = "(--trust-sensor-file takes the file's)"
                raise mismatch(f"{kind}.{name}", expected, f"{found} {hint}")
