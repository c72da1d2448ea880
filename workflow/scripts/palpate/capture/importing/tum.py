"""RGB-D folders as the benchmark of the TU Munich lays them out: rgb.txt, depth.txt and images."""

from collections.abc import Iterator
from decimal import Decimal, InvalidOperation
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from palpate.capture.importing.bags import LARGEST_BYTES
from palpate.capture.importing.optics import NO_DISTORTION, plain_block, rows
from palpate.capture.importing.pixels import file_form, file_pixels
from palpate.capture.importing.recording import NANOSECONDS, Content, Images, Request, named, shown
from palpate.yaml_files import mismatch

COLOR_LIST, DEPTH_LIST = "rgb.txt", "depth.txt"
# What a count of a depth image usually is [m].
DEPTH_UNIT_M = 1 / 5000


class TumRecording:
    """A folder with lists of colour and depth images."""

    def __init__(self, request: Request) -> None:
        if request.distortion and not request.intrinsics:
            raise mismatch("--distortion", "--intrinsics beside it", "none")
        for name in ("intrinsics", "distortion"):
            numbers = getattr(request, name) or ()
            if not np.isfinite(numbers).all():
                found = " ".join(f"{number:g}" for number in numbers)
                raise mismatch(f"--{name}", "finite numbers", found)
        self._request, path = request, request.recording
        self._files, self._streams = {}, {}
        for kind, name in (("color", COLOR_LIST), ("depth", DEPTH_LIST)):
            self._files[kind], times_ns = _listed(path / name)
            first = self._files[kind][0]
            with named(first):
                form = file_form(_content(first))
                if form.kind != kind:
                    expected = "16-bit depth" if kind == "depth" else "colour or grey"
                    raise mismatch(kind, expected, form.encoding)
            self._streams[kind] = Images(str(path / name), form, times_ns)

    def survey(self) -> Content:
        """What the lists say; see `Recording`."""
        cameras, unit_m = None, self._request.depth_unit_m or DEPTH_UNIT_M
        if self._request.intrinsics:
            lens = self._request.intrinsics, self._request.distortion or NO_DISTORTION
            cameras = {kind: plain_block(one.form, *lens) for kind, one in self._streams.items()}
            cameras["depth"]["color_from_depth"] = rows(np.eye(4))
        said = f"{1 / unit_m:g} counts in a metre"
        said += ", the usual: --depth-unit" if unit_m == DEPTH_UNIT_M else ""
        return Content(*self._streams.values(), unit_m, said, None, cameras)

    def pictures(self) -> Iterator[tuple[str, int, NDArray]]:
        """All images one by one; see `Recording`."""
        for kind, files in self._files.items():
            for index, file in enumerate(files):
                with named(file):
                    pixels = file_pixels(_content(file), self._streams[kind].form)
                yield kind, index, pixels


def _content(file: Path) -> bytes:
    if (size := file.stat().st_size) > LARGEST_BYTES:
        raise mismatch("size", f"at most {LARGEST_BYTES} bytes", size)
    return file.read_bytes()


def is_tum(path: Path) -> bool:
    """Whether a folder has the lists of such a recording."""
    return (path / COLOR_LIST).is_file() and (path / DEPTH_LIST).is_file()


def _listed(path: Path) -> tuple[list[Path], NDArray]:
    """Files and stamps [ns] of a list."""
    try:
        lines = path.read_text(encoding="utf-8").split("\n")
    except UnicodeDecodeError:
        raise mismatch(f"{path}: file", "text", "other bytes") from None
    files, times_ns, before = [], [], ""
    for number, line in enumerate(lines, start=1):
        stamp, *names = line.replace(",", " ").split() or ["#"]
        if stamp.startswith("#"):
            continue
        place, stamp_ns = f"{path}: line {number}", _nanoseconds(stamp)
        if len(names) != 1 or stamp_ns is None:
            raise mismatch(place, "a stamp and a file", shown(" ".join([stamp, *names])))
        if times_ns and stamp_ns <= times_ns[-1]:
            remedy = "sort the list" if stamp_ns < times_ns[-1] else "leave one of them out"
            found = f"{shown(before)} then {shown(stamp)} ({remedy})"
            raise mismatch(place, "increasing stamps", found)
        file = path.parent / names[0]
        if not file.resolve().is_relative_to(path.parent.resolve()):
            raise mismatch(place, "a file of this folder", shown(names[0]))
        if not file.is_file():
            raise mismatch(place, "an image", f"nothing at {shown(names[0])}")
        files.append(file)
        times_ns.append(stamp_ns)
        before = stamp
    if not files:
        raise mismatch(f"{path}: lines", "images", "none")
    return files, np.array(times_ns, dtype=np.int64)


def _nanoseconds(text: str) -> int | None:
    """Exact: a stamp of 1970's clock has more digits than a float; None of what is none."""
    try:
        seconds = Decimal(text)
    except InvalidOperation:
        return None
    if not seconds.is_finite() or abs(seconds) > 2**33:
        return None
    return int((seconds * NANOSECONDS).to_integral_value())
