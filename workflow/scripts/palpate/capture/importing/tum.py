"""RGB-D folders as the benchmark of the TU Munich lays them out: rgb.txt, depth.txt and images."""

from collections.abc import Iterator, Sequence
from decimal import Decimal, InvalidOperation
from pathlib import Path

import numpy as np

from palpate.capture.importing import optics
from palpate.capture.importing.bags import LARGEST_BYTES, shown
from palpate.capture.importing.optics import NO_DISTORTION
from palpate.capture.importing.pixels import Form, file_form, file_pixels
from palpate.capture.importing.recording import (
    NANOSECONDS,
    Content,
    Picture,
    Progress,
    Stream,
    force_table,
)

COLOR_LIST, DEPTH_LIST, WRENCH_LIST = "rgb.txt", "depth.txt", "wrench.txt"
# Counts of a depth image in a metre.
DEPTH_FACTOR = 5000.0


class TumRecording:
    """A folder with lists of colour and depth images.

    Parameters
    ----------
    path : Path
        The folder.
    depth_factor : float
        Counts of a depth image in a metre.
    intrinsics_px : sequence of 4 floats, optional
        fx, fy, cx, cy of the colour camera [px], in whose frame depth is; no file states them.
    distortion : sequence of 5 floats, optional
        k1, k2, p1, p2, k3 of the same camera; none if not given.
    """

    def __init__(
        self,
        path: Path,
        *,
        depth_factor: float,
        intrinsics_px: Sequence[float] | None = None,
        distortion: Sequence[float] | None = None,
    ) -> None:
        if not (np.isfinite(depth_factor) and depth_factor > 0):
            raise ValueError(f"--depth-factor: expected a number above 0, found {depth_factor}")
        if distortion is not None and intrinsics_px is None:
            raise ValueError("--distortion: expected --intrinsics beside it, found none")
        _require_finite("--intrinsics", intrinsics_px or ())
        _require_finite("--distortion", distortion or ())
        self.path, self._factor, self._intrinsics = path, depth_factor, intrinsics_px
        self._distortion = distortion or NO_DISTORTION
        self._files, self._times_ns = {}, {}
        for kind, name in (("color", COLOR_LIST), ("depth", DEPTH_LIST)):
            self._files[kind], self._times_ns[kind] = _listed(path / name)
        self._forms = {kind: _form(files[0]) for kind, files in self._files.items()}
        for kind, wanted in (("color", False), ("depth", True)):
            if self._forms[kind].is_depth != wanted:
                expected = "16-bit depth" if wanted else "colour or grey"
                place, found = self._files[kind][0], self._forms[kind].encoding
                raise ValueError(f"{place}: {kind}: expected {expected}, found {found}")

    def messages(self) -> int:
        """Number of steps of `survey`: its lists are read already."""
        return 0

    def survey(self, tick: Progress) -> Content:
        """What the lists say; see `Recording`."""
        color, depth = (
            Stream(str(self.path / name), self._forms[kind], self._times_ns[kind])
            for kind, name in (("color", COLOR_LIST), ("depth", DEPTH_LIST))
        )
        cameras = None
        if self._intrinsics is not None:
            cameras = {
                kind: optics.plain_block(form, self._intrinsics, self._distortion)
                for kind, form in self._forms.items()
            }
            cameras["depth"]["color_from_depth"] = optics.rows(np.eye(4))
        said = f"{self._factor:g} counts in a metre"
        said += ", the usual: --depth-factor" if self._factor == DEPTH_FACTOR else ""
        return Content(color, depth, 1 / self._factor, said, None, cameras)

    def pictures(self) -> Iterator[Picture]:
        """All images one by one."""
        for kind, files in self._files.items():
            for index, file in enumerate(files):
                try:
                    pixels = file_pixels(_content(file), self._forms[kind])
                except ValueError as error:
                    raise _named(file, error) from None
                yield Picture(kind, index, pixels)


def is_tum(path: Path) -> bool:
    """Whether a folder has the lists of such a recording."""
    return (path / COLOR_LIST).is_file() and (path / DEPTH_LIST).is_file()


def read_wrenches(path: Path) -> tuple:
    """Table of force.csv and notes on it from a list of stamps [s], forces [N] and torques [Nm].

    Raises
    ------
    ValueError
        If it is missing or a line is not seven numbers.
    """
    if not path.is_file():
        raise ValueError(
            f"{path}: file: expected wrenches (force.csv and --force <file> will do), found nothing"
        )
    times_ns, values = [], []
    for number, words in _lines(path):
        try:
            times_ns.append(_nanoseconds(words[0]))
            values.append([float(word) for word in words[1:]])
        except (ValueError, InvalidOperation):
            values.append([])
        if len(values[-1]) != 6:
            found = shown(" ".join(words))
            place = f"{path}: line {number}"
            raise ValueError(f"{place}: expected stamp and six numbers, found {found}")
    if not values:
        raise ValueError(f"{path}: lines: expected wrenches, found none")
    return force_table(np.array(times_ns, dtype=np.int64), np.array(values, dtype=float))


def _listed(path: Path) -> tuple[list[Path], np.ndarray]:
    """Files and stamps [ns] of a list."""
    files, times_ns, before = [], [], ""
    for number, words in _lines(path):
        place = f"{path}: line {number}"
        try:
            stamp, name = words
            times_ns.append(_nanoseconds(stamp))
        except (ValueError, InvalidOperation):
            found = shown(" ".join(words))
            raise ValueError(f"{place}: expected a stamp and a file, found {found}") from None
        if len(times_ns) > 1 and times_ns[-1] <= times_ns[-2]:
            remedy = "sort the list" if times_ns[-1] < times_ns[-2] else "leave one of them out"
            found = f"{shown(before)} then {shown(stamp)} ({remedy})"
            raise ValueError(f"{place}: expected increasing stamps, found {found}")
        before = stamp
        file = path.parent / name
        if not file.resolve().is_relative_to(path.parent.resolve()):
            raise ValueError(f"{place}: expected a file of this folder, found {shown(name)}")
        if not file.is_file():
            raise ValueError(f"{place}: expected an image, found nothing at {shown(name)}")
        files.append(file)
    if not files:
        raise ValueError(f"{path}: lines: expected images, found none")
    return files, np.array(times_ns, dtype=np.int64)


def _lines(path: Path) -> Iterator[tuple[int, list[str]]]:
    try:
        with path.open(encoding="utf-8") as stream:
            for number, line in enumerate(stream, start=1):
                words = line.replace(",", " ").split()
                if words and not words[0].startswith("#"):
                    yield number, words
    except UnicodeDecodeError:
        raise ValueError(f"{path}: file: expected text, found other bytes") from None


def _nanoseconds(text: str) -> int:
    """Exact: a stamp of 1970's clock has more digits than a float."""
    seconds = Decimal(text)
    if not seconds.is_finite() or abs(seconds) > 2**33:
        raise ValueError(text)
    return int((seconds * NANOSECONDS).to_integral_value())


def _require_finite(option: str, numbers: Sequence[float]) -> None:
    if not np.isfinite(numbers).all():
        found = " ".join(f"{number:g}" for number in numbers)
        raise ValueError(f"{option}: expected finite numbers, found {found}")


def _form(file: Path) -> Form:
    try:
        return file_form(_content(file))
    except ValueError as error:
        raise _named(file, error) from None


def _content(file: Path) -> bytes:
    size = file.stat().st_size
    if size > LARGEST_BYTES:
        raise ValueError(f"size: expected at most {LARGEST_BYTES} bytes, found {size}")
    return file.read_bytes()


def _named(file: Path, error: ValueError) -> ValueError:
    return ValueError(f"{file}: {error}")
