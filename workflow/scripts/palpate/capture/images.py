"""Images of a capture: what the numbers mean is the sensor's encoding."""

import struct
import zlib
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

PNG_SIGNATURE = b"\x89PNG\r\n\x1a\n"
PNG_END = b"\x00\x00\x00\x00IEND\xaeB`\x82"
HEADER_BYTES = 26
# Bit depth and PNG colour types (0 grey, 2 RGB) of each encoding.
PNG_FORMS = {
    "rgb8": (8, (2,)),
    "mono8": (8, (0,)),
    "bayer_rggb8": (8, (0,)),
    "kinect_disparity": (16, (0,)),
    "millimetre": (16, (0,)),
    "counts": (16, (0,)),
}
# OpenCV names a Bayer pattern by its second row and column: RGGB is its "BG".
RGGB_TO_RGB = cv2.COLOR_BayerBG2BGR_EA, cv2.COLOR_BGR2RGB


def read_image(path: str | Path, encoding: str) -> NDArray:
    """Read an image of a capture, its mosaic filled in.

    Parameters
    ----------
    path : path
        PNG file.
    encoding : str
        ``rgb8``, ``mono8``, ``bayer_rggb8``, ``kinect_disparity``, ``millimetre`` or ``counts``.

    Returns
    -------
    array
        (h, w, 3) uint8 RGB for the first and third, (h, w) uint8 or uint16 for the others.

    Raises
    ------
    ValueError
        If the file can't be decoded or does not hold what the encoding says.
    """
    return demosaic(read_samples(path, encoding), encoding)


def read_samples(path: str | Path, encoding: str) -> NDArray:
    """Read an image as the camera sampled it: like `read_image`, but a mosaic stays (h, w)."""
    content = Path(path).read_bytes()
    whole = chunks_are_whole(content)
    pixels = np.frombuffer(content, dtype=np.uint8)
    image = cv2.imdecode(pixels, cv2.IMREAD_UNCHANGED) if whole else None
    if image is None:
        raise ValueError(f"{path}: image: expected a whole PNG, found one that can't be decoded")
    bits, colour_types = _form(encoding)
    channels = 3 if colour_types == (2,) else 1
    found_channels = 1 if image.ndim == 2 else image.shape[2]
    if image.dtype.itemsize * 8 != bits or found_channels != channels:
        found = f"{image.dtype.itemsize * 8} bits, {found_channels} channels"
        expected = f"{bits} bits, {channels} channels"
        raise ValueError(f"{path}: {encoding}: expected {expected}, found {found}")
    return cv2.cvtColor(image, cv2.COLOR_BGR2RGB) if encoding == "rgb8" else image


def chunks_are_whole(content: bytes) -> bool:
    """Whether each chunk of a PNG fits its checksum: OpenCV fills up what it can't decode."""
    place = len(PNG_SIGNATURE)
    while place + 12 <= len(content):
        (length,) = struct.unpack_from(">I", content, place)
        end = place + 8 + length
        if end + 4 > len(content):
            return False
        (checksum,) = struct.unpack_from(">I", content, end)
        if zlib.crc32(content[place + 4 : end]) != checksum:
            return False
        if content[place + 4 : place + 8] == b"IEND":
            return content.startswith(PNG_SIGNATURE)
        place = end + 4
    return False


def demosaic(samples: NDArray, encoding: str) -> NDArray:
    """Fill in a mosaic, (h, w) to (h, w, 3) RGB; images of other encodings stay as they are."""
    if encoding != "bayer_rggb8":
        return samples
    to_bgr, to_rgb = RGGB_TO_RGB
    return cv2.cvtColor(cv2.cvtColor(samples, to_bgr), to_rgb)


def write_image(path: str | Path, image: NDArray, encoding: str) -> None:
    """Write an image of a capture as PNG; ``bayer_rggb8`` takes the (h, w) mosaic.

    Raises
    ------
    ValueError
        If the array does not fit the encoding.
    OSError
        If the file can't be written.
    """
    bits, colour_types = _form(encoding)
    shape_fits = image.shape[2:] == ((3,) if colour_types == (2,) else ()) and image.ndim > 1
    if image.dtype != np.dtype(f"uint{bits}") or not shape_fits:
        found = f"{image.dtype} {image.shape}"
        raise ValueError(f"{path}: {encoding}: expected uint{bits} of its shape, found {found}")
    pixels = cv2.cvtColor(image, cv2.COLOR_RGB2BGR) if encoding == "rgb8" else image
    # Python writes the file: OpenCV doesn't say why it can't.
    Path(path).write_bytes(cv2.imencode(".png", pixels)[1])


def mosaic_rggb(rgb: NDArray) -> NDArray:
    """Keep of each pixel of an (h, w, 3) image what an RGGB mosaic sees, shape (h, w)."""
    mosaic = rgb[..., 1].copy()
    mosaic[0::2, 0::2] = rgb[0::2, 0::2, 0]
    mosaic[1::2, 1::2] = rgb[1::2, 1::2, 2]
    return mosaic


def png_problem(path: str | Path, width_px: int, height_px: int, encoding: str) -> str | None:
    """Check a PNG's structure without decoding it.

    Parameters
    ----------
    path : path
        File to check.
    width_px, height_px : int
        Size that the sensor states.
    encoding : str
        Encoding that the sensor states.

    Returns
    -------
    str or None
        What is wrong, as ``expected ..., found ...``; None when nothing is.
    """
    path = Path(path)
    with path.open("rb") as stream:
        head = stream.read(HEADER_BYTES)
        stream.seek(-min(len(PNG_END), path.stat().st_size), 2)
        tail = stream.read()
    if len(head) < HEADER_BYTES or not head.startswith(PNG_SIGNATURE):
        return "expected a PNG image, found something else"
    if tail != PNG_END:
        return "expected a whole PNG image, found a truncated one"
    width, height, depth, colour_type = struct.unpack(">IIBB", head[16:26])
    if (width, height) != (width_px, height_px):
        return f"expected {width_px} x {height_px} pixels, found {width} x {height}"
    bits, colour_types = _form(encoding)
    if depth != bits or colour_type not in colour_types:
        return (
            f"expected {bits}-bit {encoding}, found {depth} bits of PNG colour type {colour_type}"
        )
    return None


def _form(encoding: str) -> tuple[int, tuple[int, ...]]:
    if encoding not in PNG_FORMS:
        known = ", ".join(PNG_FORMS)
        raise ValueError(f"encoding: expected one of {known}, found {encoding}")
    return PNG_FORMS[encoding]
