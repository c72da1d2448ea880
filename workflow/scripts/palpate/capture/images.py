"""Images and clouds of a capture and what their numbers mean, by the sensor's encoding."""

import struct
import zlib
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple, Self

import cv2
import numpy as np
from numpy.typing import NDArray
from trimesh.exchange.ply import load_ply

from palpate.capture.tables import STREAMS, image_streams, read_frames
from palpate.units import METRES, MILLIMETRES
from palpate.yaml_files import mismatch

PNG_SIGNATURE, PNG_END = b"\x89PNG\r\n\x1a\n", b"\x00\x00\x00\x00IEND\xaeB`\x82"
HEADER_BYTES = 26
# Depth as counts of a stated size, 0 where there is none; and a Kinect's.
MILLIMETRE, COUNTS, DISPARITY = "millimetre", "counts", "kinect_disparity"
# Bits and channels of each encoding, and PNG's colour type by the channels.
PNG_FORMS = {"rgb8": (8, 3), "mono8": (8, 1), "bayer_rggb8": (8, 1)}
PNG_FORMS |= dict.fromkeys((DISPARITY, MILLIMETRE, COUNTS), (16, 1))
COLOUR_TYPES = {1: 0, 3: 2}
# OpenCV names a Bayer pattern by its second row and column: RGGB is its "BG".
RGGB_TO_BGR = cv2.COLOR_BayerBG2BGR_EA
# What files of clouds begin with, by the ends of their names.
MARKS = {".ply": (b"ply",), ".pcd": (b"# .PCD", b"VERSION")}
# With fewer a sensor saw nothing.
FEWEST_POINTS = 100


class Cloud(NamedTuple):
    """Points and, where they are known, normals, camera frame, both (n, 3); points in metres."""

    points_m: NDArray
    normals: NDArray | None = None

    def at(self, chosen: NDArray) -> Self:
        """Those points that are chosen, by a mask or by numbers."""
        return Cloud(*(None if part is None else part[chosen] for part in self))


class Stream(Sequence):
    """Lazy sequence of one stream's images, or clouds; each is read when it is asked for.

    Parameters
    ----------
    folder : path
        Folder of a capture or a background.
    sensor : mapping
        The sensor's file.
    stream : str, optional
        Name of the stream; the reference camera's by default.
    samples : bool, optional
        Whether mosaics stay as the camera sampled them.
    """

    def __init__(
        self,
        folder: str | Path,
        sensor: Mapping,
        stream: str | None = None,
        *,
        samples: bool = False,
    ) -> None:
        self.folder, self.read = Path(folder), read_samples if samples else read_image
        stream = stream or STREAMS[sensor["kind"]][0]
        self.files = [str(name) for name in read_frames(folder)[stream]]
        spec = image_streams(sensor)[stream]
        self.encoding = spec.get("encoding", spec.get("unit"))
        if "unit" in spec:
            self.read = read_cloud

    def __len__(self) -> int:
        return len(self.files)

    def __getitem__(self, index: int) -> NDArray | Cloud:
        return self.read(self.folder / self.files[index], self.encoding)


def all_streams(
    folder: str | Path, sensor: Mapping, chosen: Sequence[int] | None = None
) -> Iterator[dict[str, NDArray | Cloud]]:
    """Images of all streams, frame by frame: of the chosen frames, or of all."""
    streams = {name: Stream(folder, sensor, name) for name in image_streams(sensor)}
    count = len(next(iter(streams.values())))
    for k in range(count) if chosen is None else chosen:
        yield {name: stream[k] for name, stream in streams.items()}


def count_m(spec: Mapping) -> float:
    """What one count of a depth image is [m], by the ``depth`` block of the sensor's file."""
    return spec["count_m"] if spec["encoding"] == COUNTS else 1 / MILLIMETRES


def depth_of(counts: NDArray, spec: Mapping) -> NDArray:
    """Depths of an image; of a Kinect from normalised disparity (Eq. 4.1-4.3).

    Parameters
    ----------
    counts : (...) uint16 array
        As the image has them.
    spec : mapping
        ``depth`` block of the sensor's file.

    Returns
    -------
    (...) array
        Depth along the camera's axis [m]; NaN where there is no reading.
    """
    if spec["encoding"] != DISPARITY:
        return np.where(counts > 0, counts / (1 / count_m(spec)), np.nan)
    disparity = spec["disparity_scale"] * counts.astype(float) + spec["disparity_offset_px"]
    known = (counts != spec["no_reading"]) & (disparity > 0)
    focal_px_m = spec["fx_px"] * spec["baseline_m"]
    return np.where(known, focal_px_m / np.where(known, disparity, 1), np.nan)


def read_image(path: str | Path, encoding: str) -> NDArray:
    """Read a PNG of a capture, its mosaic filled in.

    Parameters
    ----------
    path : path
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
    pixels = np.frombuffer(content, dtype=np.uint8)
    image = cv2.imdecode(pixels, cv2.IMREAD_UNCHANGED) if _is_whole(content) else None
    if image is None:
        raise mismatch(f"{path}: image", "a whole PNG", "one that can't be decoded")
    forms = _form(encoding), (image.itemsize * 8, 1 if image.ndim == 2 else image.shape[2])
    expected, found = (f"{bits} bits, {channels} channels" for bits, channels in forms)
    if found != expected:
        raise mismatch(f"{path}: {encoding}", expected, found)
    return cv2.cvtColor(image, cv2.COLOR_BGR2RGB) if encoding == "rgb8" else image


def _is_whole(content: bytes) -> bool:
    """Whether each chunk of a PNG fits its checksum: OpenCV fills up what it can't decode."""
    place, name = len(PNG_SIGNATURE), b""
    while name != b"IEND" and place + 12 <= len(content):
        (length,) = struct.unpack_from(">I", content, place)
        end = place + 8 + length
        if content[end : end + 4] != struct.pack(">I", zlib.crc32(content[place + 4 : end])):
            return False
        place, name = end + 4, content[place + 4 : place + 8]
    return name == b"IEND" and content.startswith(PNG_SIGNATURE)


def demosaic(samples: NDArray, encoding: str) -> NDArray:
    """Fill in a mosaic, (h, w) to (h, w, 3) RGB; images of other encodings stay as they are."""
    if encoding != "bayer_rggb8":
        return samples
    return cv2.cvtColor(cv2.cvtColor(samples, RGGB_TO_BGR), cv2.COLOR_BGR2RGB)


def grey(image: NDArray) -> NDArray:
    """Grey levels of an RGB image, or those that it has, (h, w) uint8."""
    return image if image.ndim == 2 else cv2.cvtColor(image, cv2.COLOR_RGB2GRAY)


def write_image(path: str | Path, image: NDArray, encoding: str) -> None:
    """Write an image of a capture as PNG; ``bayer_rggb8`` takes the (h, w) mosaic.

    Raises
    ------
    ValueError
        If the array does not fit the encoding.
    OSError
        If the file can't be written.
    """
    bits, channels = _form(encoding)
    shape_fits = image.shape[2:] == ((3,) if channels == 3 else ()) and image.ndim > 1
    if image.dtype != f"uint{bits}" or not shape_fits:
        found = f"{image.dtype} {image.shape}"
        raise mismatch(f"{path}: {encoding}", f"uint{bits} of its shape", found)
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
    """What is wrong with a PNG, undecoded, as ``expected ..., found ...``, or None.

    Size and encoding are what the sensor states.
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
    bits, channels = _form(encoding)
    if (depth, colour_type) != (bits, COLOUR_TYPES[channels]):
        found = f"{depth} bits of PNG colour type {colour_type}"
        return f"expected {bits}-bit {encoding}, found {found}"
    return None


def _form(encoding: str) -> tuple[int, int]:
    if encoding not in PNG_FORMS:
        raise mismatch("encoding", f"one of {', '.join(PNG_FORMS)}", encoding)
    return PNG_FORMS[encoding]


def read_cloud(path: str | Path, unit: str = "m") -> Cloud:
    """Read the points of a PLY or PCD file, organised or not; where some have normals, those alone.

    ``unit`` is that of its coordinates, m or mm. Places without a number (NaN) are left out.

    Raises
    ------
    ValueError
        If the file can't be read, or has too few points.
    """
    if problem := cloud_problem(path):
        raise ValueError(f"{path}: cloud: {problem}")
    points, normals = _points(Path(path))
    # Where a device knows no normal it writes what is no number, or zeros.
    known = np.isfinite(normals).all(axis=1) & normals.any(axis=1)
    cloud = Cloud(points * METRES[unit], normals)
    cloud = cloud.at(known) if known.any() else Cloud(cloud.points_m)
    cloud = cloud.at(np.isfinite(cloud.points_m).all(axis=1))
    if (count := len(cloud.points_m)) < FEWEST_POINTS:
        raise ValueError(f"{path}: cloud: expected {FEWEST_POINTS} points or more, found {count}")
    return cloud


def cloud_problem(path: str | Path) -> str | None:
    """What is wrong with a file's name and beginning, as ``expected ..., found ...``, or None."""
    expected = f"expected a cloud as {' or '.join(MARKS)}, found"
    marks = MARKS.get(Path(path).suffix.lower())
    if marks is None:
        return f"{expected} {Path(path).suffix or 'no ending'}"
    with Path(path).open("rb") as stream:
        return None if stream.read(10).startswith(marks) else f"{expected} something else"


def _points(path: Path) -> tuple[NDArray, NDArray]:
    """Points and normals of a file, which may have none."""
    if path.suffix.lower() == ".pcd":
        from palpate.open3d_core import o3d

        with o3d.utility.VerbosityContextManager(o3d.utility.VerbosityLevel.Error):
            cloud = o3d.io.read_point_cloud(str(path))
        return np.asarray(cloud.points), np.asarray(cloud.normals)
    try:
        with path.open("rb") as stream:
            read = load_ply(stream, skip_materials=True, fix_texture=False)
        found = (read.get(name, np.zeros((0, 3))) for name in ("vertices", "vertex_normals"))
        points, normals = (np.asarray(part, dtype=float) for part in found)
        whole = len(points) == read["metadata"]["_ply_raw"]["vertex"]["length"]
    except (OSError, MemoryError):
        raise
    except Exception:  # raises whatever a damaged file leads to
        whole = False
    if not whole:
        raise ValueError(f"{path}: cloud: expected a whole PLY file with x, y, z, found another")
    return points, normals
