"""Images of other software as arrays of the capture format."""

import io
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from PIL import Image, UnidentifiedImageError

from palpate.capture.images import COUNTS, MILLIMETRE
from palpate.units import MILLIMETRES

# Encoding of depth in the capture format, where its counts are not finer.
DEPTH = MILLIMETRE
# Floating-point depths, and what a count of theirs becomes: they reach 6.5 m.
METRES, FLOATS_M = "32FC1", 1e-4
# What each encoding's numbers are, and as what a capture keeps them.
RAW_FORMS = {
    "rgb8": (np.uint8, 3, "rgb8"),
    "bgr8": (np.uint8, 3, "rgb8"),
    "rgba8": (np.uint8, 4, "rgb8"),
    "bgra8": (np.uint8, 4, "rgb8"),
    "mono8": (np.uint8, 1, "mono8"),
    "8UC1": (np.uint8, 1, "mono8"),
    "bayer_rggb8": (np.uint8, 1, "bayer_rggb8"),
    "16UC1": (np.uint16, 1, DEPTH),
    "mono16": (np.uint16, 1, DEPTH),
    METRES: (np.float32, 1, DEPTH),
}
TO_RGB = {
    "bgr8": cv2.COLOR_BGR2RGB,
    "rgba8": cv2.COLOR_RGBA2RGB,
    "bgra8": cv2.COLOR_BGRA2RGB,
}
# Modes of Pillow for PNG and JPEG.
FILE_FORMS = {"L": "mono8", "RGB": "rgb8", "RGBA": "rgba8", "I;16": "16UC1", "I": "16UC1"}
FILE_KINDS = ("PNG", "JPEG")
# JPEG holds no 16 bits.
DEPTH_FILE_KINDS = ("PNG",)
# The depth codec of image_transport puts its parameters before the PNG.
DEPTH_CODEC = "compressedDepth"
DEPTH_CODEC_BYTES = 12
SMALLEST_PX, LARGEST_PX = 16, 16384
LARGEST_COUNT = 65535


@dataclass(frozen=True)
class Form:
    """What images of a stream have in common: size [px] and encoding, as the source names it."""

    width_px: int
    height_px: int
    encoding: str

    @property
    def stored(self) -> str:
        """Encoding of the capture format: rgb8, mono8, bayer_rggb8, or millimetre of any depth."""
        return RAW_FORMS[self.encoding][2]

    @property
    def is_depth(self) -> bool:
        """Whether the numbers are depths."""
        return self.stored == DEPTH

    def __str__(self) -> str:
        return f"{self.width_px} x {self.height_px} {self.encoding}"


def taken(*, depth: bool) -> str:
    """Images that are taken as colour, or as depth, in words."""
    stored = {name: form[2] for name, form in RAW_FORMS.items()}
    encodings = [name for name, kept in stored.items() if (kept == DEPTH) == depth]
    files = _either(DEPTH_FILE_KINDS if depth else FILE_KINDS)
    return f"Image of {_either(encodings)}, or CompressedImage of {files}"


def form_of(message: Any) -> Form:
    """Form of an Image or CompressedImage message, from its head alone.

    Raises
    ------
    ValueError
        If the encoding is none that a capture can keep, or the size is beyond reason.
    """
    if hasattr(message, "format"):
        return file_form(_file_bytes(message))
    if message.encoding not in RAW_FORMS:
        known = ", ".join(RAW_FORMS)
        raise ValueError(f"encoding: expected one of {known}, found {message.encoding}")
    return _checked(Form(message.width, message.height, message.encoding))


def file_form(data: bytes) -> Form:
    """Form of a PNG or JPEG file's content, without decoding it.

    Raises
    ------
    ValueError
        If it is neither, or holds other pixels than a capture can keep.
    """
    try:
        with Image.open(io.BytesIO(data), formats=FILE_KINDS) as picture:
            mode, size = picture.mode, picture.size
    except (UnidentifiedImageError, Image.DecompressionBombError, OSError, SyntaxError) as error:
        reason = type(error).__name__
        raise ValueError(
            f"image: expected {_either(FILE_KINDS)}, found neither ({reason})"
        ) from None
    if mode not in FILE_FORMS:
        known = "8-bit grey or colour, or 16-bit grey"
        raise ValueError(f"image: expected {known}, found mode {mode}")
    return _checked(Form(*size, FILE_FORMS[mode]))


def pixels_of(message: Any, form: Form) -> NDArray:
    """Pixels of an Image or CompressedImage message.

    Parameters
    ----------
    message
        Of ROS.
    form : Form
        What it must have.

    Returns
    -------
    array
        (h, w, 3) uint8 RGB, (h, w) uint8, or (h, w) uint16 or float32 depth in the source's counts.

    Raises
    ------
    ValueError
        If the message has another form, or fewer or more bytes than it states.
    """
    found = form_of(message)
    if found != form:
        raise ValueError(f"image: expected {form} as the first, found {found}")
    if hasattr(message, "format"):
        return file_pixels(_file_bytes(message), form)
    dtype, channels, _ = RAW_FORMS[form.encoding]
    dtype = np.dtype(dtype)
    row_bytes = form.width_px * channels * dtype.itemsize
    if message.step < row_bytes or message.step * form.height_px != len(message.data):
        expected = f"{form.height_px} rows of at least {row_bytes} bytes"
        found = f"{len(message.data)} bytes in rows of {message.step}"
        raise ValueError(f"data: expected {expected}, found {found}")
    rows = np.asarray(message.data, dtype=np.uint8).reshape(form.height_px, message.step)
    order = ">" if message.is_bigendian else "<"
    values = np.ascontiguousarray(rows[:, :row_bytes]).view(dtype.newbyteorder(order))
    values = values.astype(dtype, copy=False)
    shape = (form.height_px, form.width_px, channels)[: 2 if channels == 1 else 3]
    return _rgb(values.reshape(shape), form.encoding)


def file_pixels(data: bytes, form: Form) -> NDArray:
    """Pixels of a PNG or JPEG file's content; see `pixels_of`."""
    found = file_form(data)
    if found != form:
        raise ValueError(f"image: expected {form} as the first, found {found}")
    # Nothing the file says of its orientation or colours may change the pixels.
    flags = cv2.IMREAD_UNCHANGED
    try:
        image = cv2.imdecode(np.frombuffer(data, np.uint8), flags)
    except cv2.error:
        image = None
    if image is None or image.shape[:2] != (form.height_px, form.width_px):
        raise ValueError("image: expected one that can be decoded, found damaged data")
    if image.ndim == 2:
        return image
    return _rgb(image, "bgra8" if image.shape[2] == 4 else "bgr8")


def stored_depth(form: Form, unit_m: float) -> dict[str, str | float]:
    """How a new sensor's file has depth: in millimetres, or in the recording's finer counts."""
    unit_m = FLOATS_M if form.encoding == METRES else unit_m
    return (
        {"encoding": MILLIMETRE}
        if unit_m >= 1 / MILLIMETRES
        else {"encoding": COUNTS, "count_m": unit_m}
    )


def counted(depth: NDArray, unit_m: float, count_m: float) -> tuple[NDArray, int]:
    """Depth in whole counts.

    Parameters
    ----------
    depth : (h, w) array
        As the source counts it; NaN, infinite, negative or 0 where there is none.
    unit_m : float
        What one of its counts is [m].
    count_m : float
        What one is to be [m].

    Returns
    -------
    values : (h, w) uint16 array
        0 where there is none.
    beyond : int
        Number of pixels with a depth that 16 bits can't hold; they are 0 as well.
    """
    if depth.dtype == np.uint16 and unit_m == count_m:
        return depth, 0
    values = depth.astype(float) * (unit_m / count_m)
    seen = np.isfinite(values) & (values > 0)
    rounded = np.rint(np.where(seen, values, 0))
    beyond = rounded > LARGEST_COUNT
    return np.where(beyond, 0, rounded).astype(np.uint16), int(beyond.sum())


def _either(names: Sequence[str]) -> str:
    return " or ".join(filter(None, (", ".join(names[:-1]), names[-1])))


def _file_bytes(message: Any) -> bytes:
    data, said = np.asarray(message.data, dtype=np.uint8).tobytes(), message.format
    packed = DEPTH_CODEC in said
    expected = f"format: expected 16UC1; {DEPTH_CODEC} png, found {said}"
    if packed and (not said.startswith("16UC1") or "rvl" in said):
        why = "RVL" if "rvl" in said else "rounded inverse depth"
        raise ValueError(f"{expected} ({why}: republish it as an Image)")
    if said.startswith(("16UC1", METRES)) and "jpeg" in said:
        why = "JPEG keeps 8 of depth's 16 bits: record the Image"
        raise ValueError(f"{expected} ({why})")
    return data[DEPTH_CODEC_BYTES:] if packed else data


def _checked(form: Form) -> Form:
    if not all(SMALLEST_PX <= side <= LARGEST_PX for side in (form.width_px, form.height_px)):
        found = f"{form.width_px} x {form.height_px}"
        raise ValueError(f"image: expected {SMALLEST_PX} to {LARGEST_PX} pixels, found {found}")
    return form


def _rgb(image: NDArray, encoding: str) -> NDArray:
    return cv2.cvtColor(image, TO_RGB[encoding]) if encoding in TO_RGB else image
