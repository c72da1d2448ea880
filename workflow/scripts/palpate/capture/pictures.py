"""What is wrong with frames.csv and the images that it names, one line each."""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from hashlib import file_digest
from pathlib import Path

import pandas as pd

from palpate.capture.columns import (
    check_filled,
    check_increasing,
    check_numbers,
    check_whole,
    read_columns,
)
from palpate.capture.images import png_problem
from palpate.capture.tables import FRAMES


def check_frames(
    folder: Path, streams: Mapping[str, Mapping], *, fewest: int
) -> tuple[list[str], pd.DataFrame | None]:
    """Check frames.csv and the images of its streams: problems, and the table if it can be read."""
    path = folder / FRAMES
    table, problems = read_columns(path, ["frame", "time_s", *streams])
    if table is None:
        return problems, None
    if len(table) < fewest:
        problems.append(f"{path}: rows: expected at least {fewest}, found {len(table)}")
    problems += check_numbers(path, table, ["frame", "time_s"])
    problems += check_whole(path, table, "frame")
    problems += check_increasing(path, table, "frame")
    problems += check_increasing(path, table, "time_s")
    for stream, spec in streams.items():
        problems += check_filled(path, table, stream)
        names = [str(name) for name in table[stream].dropna()]
        problems += _check_stream(folder, path, stream, names, spec)
    return problems, table


def _check_stream(
    folder: Path, source: Path, stream: str, names: list[str], spec: Mapping
) -> list[str]:
    """Check a stream's images; what is wrong with many of them alike is one line."""
    alike: dict[str, list[str]] = {}
    for name in names:
        problem = _image_problem(folder, name, spec)
        if problem:
            alike.setdefault(problem, []).append(name)
    lines = []
    for problem, wrong in alike.items():
        more = f" (and {len(wrong) - 1} more)" if len(wrong) > 1 else ""
        place = source if "files of this folder" in problem else folder / wrong[0]
        lines.append(f"{place}: {stream}: {problem}{more}")
    return lines


def _image_problem(folder: Path, name: str, spec: Mapping) -> str | None:
    path = folder / name
    try:
        # A path drops one of an address's slashes.
        if "://" in name or not path.resolve().is_relative_to(folder.resolve()):
            return f"expected files of this folder, found {name}"
        if not path.is_file():
            return "expected an image, found nothing"
    except (OSError, ValueError, RuntimeError):  # too long, with a NUL, a link to itself
        return "expected an image, found a name that no file can have"
    return png_problem(path, spec["width_px"], spec["height_px"], spec["encoding"])


def check_repeated(folder: Path, frames: pd.DataFrame, streams: Iterable[str]) -> list[str]:
    """Check that no two frames show one image: noise makes each another, so a copy is no new frame.

    Only files that share their size with others are read, once each.
    """
    problems = []
    for stream in streams:
        found = _first_repeated(folder, list(map(str, frames[stream])))
        if found:
            expected = f"expected another image in each frame, found {found[1]} the same as"
            problems.append(f"{folder / FRAMES}: {stream}: {expected} {found[0]}")
    return problems


def _first_repeated(folder: Path, names: Sequence[str]) -> tuple[str, str] | None:
    """The first file with the content of one before it, behind that one."""
    sizes = [(folder / name).stat().st_size for name in names]
    counts = Counter(sizes)
    seen: dict[bytes, str] = {}
    for name, size in zip(names, sizes, strict=True):
        if counts[size] > 1:
            with (folder / name).open("rb") as stream:
                digest = file_digest(stream, "sha256").digest()
            if digest in seen:
                return seen[digest], name
            seen[digest] = name
    return None
