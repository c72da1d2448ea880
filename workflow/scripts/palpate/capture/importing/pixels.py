"""Images of other software as arrays of the capture format."""

import io
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from PIL import Image, UnidentifiedImageError

from palpate.capture.images import MILLIMETRE
from palpate.yaml_files import mismatch

# Floating-point depths [m].
METRES = "32FC1"
# What each encoding's numbers are, as what a capture keeps them, and OpenCV's way there.
RAW_FORMS = {
    "rgb8": (np.uint8, 3, "rgb8", None),
    "bgr8": (np.uint8, 3, "rgb8", cv2.COLOR_BGR2RGB),
    "rgba8": (np.uint8, 4, "rgb8", cv2.COLOR_RGBA2RGB),
    "bgra8": (np.uint8, 4, "rgb8", cv2.COLOR_BGRA2RGB),
    "mono8": (np.uint8, 1, "mono8", None),
    "8UC1": (np.uint8, 1, "mono8", None),
    "bayer_rggb8": (np.uint8, 1, "bayer_rggb8", None),
    "16UC1": (np.uint16, 1, MILLIMETRE, None),
    "mono16": (np.uint16, 1, MILLIMETRE, None),
    METRES: (np.float32, 1, MILLIMETRE, None),
}
# Modes of Pillow for PNG and JPEG.
FILE_FORMS = {"L": "mono8", "RGB": "rgb8", "RGBA": "rgba8", "I;16": "16UC1", "I": "16UC1"}
FILE_KINDS = ("PNG", "JPEG")
# The depth codec of image_transport puts its parameters before the PNG.
DEPTH_CODEC = "compressedDepth"
DEPTH_CODEC_BYTES = 12
SMALLEST_PX, LARGEST_PX = 16, 16384


@dataclass(frozen=True)
class Form:
    """What images of a stream have in common: size [px] and encoding, as the source names it."""

    width_px: int
    height_px: int
    encoding: str

    def __post_init__(self) -> None:
        sides = self.width_px, self.height_px
        if not all(SMALLEST_PX <= side <= LARGEST_PX for side in sides):
            found = f"{self.width_px} x {self.height_px}"
            raise mismatch("image", f"{SMALLEST_PX} to {LARGEST_PX} pixels", found)

    @property
    def stored(self) -> str:
        """Encoding of the capture format: rgb8, mono8, bayer_rggb8, or millimetre of any depth."""
        return RAW_FORMS[self.encoding][2]

    @property
    def kind(self) -> str:
        """``depth`` where the numbers are depths, else ``color``."""
        return "depth" if self.stored == MILLIMETRE else "color"

    def __str__(self) -> str:
        return f"{self.width_px} x {self.height_px} {self.encoding}"

    def require(self, found: "Form") -> None:
        """Reject an image of another form than the first of its stream."""
        if found != self:
            raise mismatch("image", f"{self} as the first", found)


def taken(kind: str) -> str:
    """Images that are taken as ``color``, or as ``depth``, in words."""
    depth = kind == "depth"
    encodings = [name for name, form in RAW_FORMS.items() if (form[2] == MILLIMETRE) == depth]
    # JPEG holds no 16 bits.
    files = _either(FILE_KINDS[:1] if depth else FILE_KINDS)
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
        raise mismatch("encoding", f"one of {', '.join(RAW_FORMS)}", message.encoding)
    return Form(message.width, message.height, message.encoding)


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
        found = f"neither ({type(error).__name__})"
        raise mismatch("image", _either(FILE_KINDS), found) from None
    if mode not in FILE_FORMS:
        raise mismatch("image", "8-bit grey or colour, or 16-bit grey", f"mode {mode}")
    return Form(*size, FILE_FORMS[mode])


def pixels_of(message: Any, form: Form) -> NDArray:
    """Pixels of an Image or CompressedImage message of some form.

    Returns
    -------
    array
        (h, w, 3) uint8 RGB, (h, w) uint8, or (h, w) uint16 or float32 depth in the source's counts.

    Raises
    ------
    ValueError
        If the message has another form, or fewer or more bytes than it states.
    """
    if hasattr(message, "format"):
        return file_pixels(_file_bytes(message), form)
    form.require(form_of(message))
    kind, channels, *_ = RAW_FORMS[form.encoding]
    dtype = np.dtype(kind).newbyteorder(">" if message.is_bigendian else "<")
    row_bytes = form.width_px * channels * dtype.itemsize
    if message.step < row_bytes or message.step * form.height_px != len(message.data):
        expected = f"{form.height_px} rows of at least {row_bytes} bytes"
        found = f"{len(message.data)} bytes in rows of {message.step}"
        raise mismatch("data", expected, found)
    rows = np.asarray(message.data, dtype=np.uint8).reshape(form.height_px, message.step)
    values = np.ascontiguousarray(rows[:, :row_bytes]).view(dtype).astype(kind, copy=False)
    shape = (form.height_px, form.width_px, channels)[: 2 if channels == 1 else 3]
    return _rgb(values.reshape(shape), form.encoding)


def file_pixels(data: bytes, form: Form) -> NDArray:
    """Pixels of a PNG or JPEG file's content; see `pixels_of`."""
    form.require(file_form(data))
    try:
        # Nothing the file says of its orientation or colours may change the pixels.
        image = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED)
    except cv2.error:
        image = None
    if image is None or image.shape[:2] != (form.height_px, form.width_px):
        raise mismatch("image", "one that can be decoded", "damaged data")
    if image.ndim == 2:
        return image
    return _rgb(image, "bgra8" if image.shape[2] == 4 else "bgr8")


def _either(names: Sequence[str]) -> str:
    return " or ".join(filter(None, (", ".join(names[:-1]), names[-1])))


def _file_bytes(message: Any) -> bytes:
    """The PNG or JPEG of a CompressedImage."""
    said, why = message.format, ""
    packed = DEPTH_CODEC in said
    if packed and "rvl" in said:
        why = "RVL: republish it as an Image"
    elif packed and not said.startswith("16UC1"):
        why = "rounded inverse depth: republish it as an Image"
    elif said.startswith(("16UC1", METRES)) and "jpeg" in said:
        why = "JPEG keeps 8 of depth's 16 bits: record the Image"
    if why:
        raise mismatch("format", f"16UC1; {DEPTH_CODEC} png", f"{said} ({why})")
    data = np.asarray(message.data, dtype=np.uint8).tobytes()
    return data[DEPTH_CODEC_BYTES:] if packed else data


def _rgb(image: NDArray, encoding: str) -> NDArray:
    code = RAW_FORMS[encoding][3]
    return image if code is None else cv2.cvtColor(image, code)
