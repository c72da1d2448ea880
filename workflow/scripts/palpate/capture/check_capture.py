"""Check the tables and images of one recording: everything that is wrong, one line each."""

import re
from collections import Counter
from collections.abc import Iterable, Mapping
from hashlib import file_digest
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from palpate.capture.clouds import cloud_problem
from palpate.capture.discover import BACKGROUND
from palpate.capture.images import png_problem
from palpate.capture.tables import (
    FORCE,
    FRAMES,
    force_columns,
    image_streams,
    number_text,
    read_table,
    sampled_s,
)
from palpate.yaml_files import one_line

FEWEST_FRAMES, FEWEST_REPEATS = 3, 2
# Each is compared with the others, whose deviations take three at the least.
FEWEST_BACKGROUND_FRAMES = 4
FEWEST_FORCE_SAMPLES = 10
# A time of day, or a date and one.
CLOCK = re.compile(r"(\d+[-./]\d+[-./]\d+[ T]+)?\d+:\d+")


def check_capture(folder: str | Path, sensor: Mapping) -> list[str]:
    """Check one capture's folder against its sensor.

    Parameters
    ----------
    folder : path
        ``raw/<object>/<sensor>/<capture>``, or a background, which has no force.
    sensor : mapping
        The sensor's specification.

    Returns
    -------
    list of str
        One line for each problem; empty when all is right.
    """
    folder, streams = Path(folder), image_streams(sensor)
    if folder.name == BACKGROUND:
        fewest = 1 if "cloud" in streams else FEWEST_BACKGROUND_FRAMES
        return check_images(folder, sensor, fewest=fewest)
    problems, frames = check_frames(folder, streams, fewest=FEWEST_FRAMES)
    if not problems:
        problems += _check_repeated(folder, frames, streams)
    return list(map(one_line, problems + _check_force(folder / FORCE, frames)))


def check_images(folder: Path, sensor: Mapping, *, fewest: int = FEWEST_REPEATS) -> list[str]:
    """Check a recording without forces, one line for each problem: all streams of the sensor."""
    return list(map(one_line, check_frames(folder, image_streams(sensor), fewest=fewest)[0]))


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
    frame = _finite(table["frame"])
    problems += [
        f"{path}: frame: expected whole numbers, found {number_text(frame[row])} in data row"
        f" {row + 1}"
        for row in np.flatnonzero(frame != np.round(frame))[:1]
    ]
    problems += _check_increasing(path, table, "frame") + _check_increasing(path, table, "time_s")
    for stream, spec in streams.items():
        problems += [
            f"{path}: {stream}: expected a file, found nothing in data row {row + 1}"
            for row in np.flatnonzero(table[stream].isna())[:1]
        ]
        problems += _check_stream(folder, stream, table[stream].dropna().map(str), spec)
    return problems, table


def read_columns(path: Path, columns: list[str]) -> tuple[pd.DataFrame | None, list[str]]:
    """Read a table that must have some columns: the table or None, and what is wrong."""
    try:
        table = read_table(path)
    except ValueError as error:
        return None, [str(error)]
    missing = [name for name in columns if name not in table.columns]
    if missing:
        found = ", ".join(map(str, table.columns))
        return None, [f"{path}: columns: expected {', '.join(missing)}, found {found}"]
    return table, []


def check_numbers(path: Path, table: pd.DataFrame, columns: list[str]) -> list[str]:
    """One line for each of some columns that holds anything but finite numbers.

    A row of units under the header is one line too.
    """
    numbers = table[columns].apply(pd.to_numeric, errors="coerce").to_numpy(dtype=float)
    wrong = ~np.isfinite(numbers)
    if len(wrong) > 1 and wrong[0].all() and not wrong[1:].any():
        found = ", ".join(map(str, table[columns].iloc[0]))
        return [
            f"{path}: rows: expected numbers, found {found} in data row 1 (units? leave it out)"
        ]
    problems = []
    for name, column in zip(columns, wrong.T, strict=True):
        for row in np.flatnonzero(column)[:1]:
            found = table[name].iloc[row]
            hint = ", seconds are expected" if CLOCK.match(str(found)) else ""
            problems.append(
                f"{path}: {name}: expected finite numbers, found {found} in data row {row + 1}"
                f" ({column.sum()} such{hint})"
            )
    return problems


def _check_increasing(path: Path, table: pd.DataFrame, name: str) -> list[str]:
    """One line where a column of numbers stands still or falls."""
    values = _finite(table[name])
    return [
        f"{path}: {name}: expected increasing values, found {number_text(values[row])} then"
        f" {number_text(values[row + 1])} in data row {row + 2}"
        for row in np.flatnonzero(np.diff(values) <= 0)[:1]
    ]


def _finite(column: pd.Series) -> NDArray:
    """A column's numbers; none where one is missing."""
    values = pd.to_numeric(column, errors="coerce").to_numpy(dtype=float)
    return values if np.isfinite(values).all() else values[:0]


def _check_stream(folder: Path, stream: str, names: Iterable[str], spec: Mapping) -> list[str]:
    """Check a stream's images; what is wrong with many of them alike is one line."""
    alike: dict[str, list[str]] = {}
    for name in names:
        if problem := _image_problem(folder, name, spec):
            alike.setdefault(problem, []).append(name)
    lines = []
    for problem, wrong in alike.items():
        more = f" (and {len(wrong) - 1} more)" if len(wrong) > 1 else ""
        place = folder / (FRAMES if "files of this folder" in problem else wrong[0])
        lines.append(f"{place}: {stream}: {problem}{more}")
    return lines


def _image_problem(folder: Path, name: str, spec: Mapping) -> str | None:
    path, kind = folder / name, "a cloud" if "unit" in spec else "an image"
    try:
        # A path drops one of an address's slashes.
        if "://" in name or not path.resolve().is_relative_to(folder.resolve()):
            return f"expected files of this folder, found {name}"
        if not path.is_file():
            return f"expected {kind}, found nothing"
    except (OSError, ValueError, RuntimeError):  # too long, with a NUL, a link to itself
        return f"expected {kind}, found a name that no file can have"
    if "unit" in spec:
        return cloud_problem(path)
    return png_problem(path, spec["width_px"], spec["height_px"], spec["encoding"])


def _check_repeated(folder: Path, frames: pd.DataFrame, streams: Iterable[str]) -> list[str]:
    """Check that no two frames show one image: noise makes each another, so a copy is no new frame.

    Only files that share their size with others are read, once each.
    """
    problems = []
    for stream in streams:
        expected = f"expected another {'cloud' if stream == 'cloud' else 'image'} in each frame"
        names, seen = list(map(str, frames[stream])), {}
        sizes = [(folder / name).stat().st_size for name in names]
        counts = Counter(sizes)
        for k in [k for k, size in enumerate(sizes) if counts[size] > 1]:
            with (folder / names[k]).open("rb") as file:
                first = seen.setdefault(file_digest(file, "sha256").digest(), k)
            if first != k:
                found = f"found {names[k]} the same as {names[first]}"
                problems.append(f"{folder / FRAMES}: {stream}: {expected}, {found}")
                break
    return problems


def _check_force(path: Path, frames: pd.DataFrame | None) -> list[str]:
    table, problems = read_columns(path, ["time_s"])
    if table is None:
        return problems
    columns = force_columns(table.columns)
    if columns is None:
        found = ", ".join(map(str, table.columns))
        return [f"{path}: columns: expected time_s and v0..v5 or fx_n..tz_nm, found {found}"]
    if len(table) < FEWEST_FORCE_SAMPLES:
        problems.append(
            f"{path}: rows: expected at least {FEWEST_FORCE_SAMPLES}, found {len(table)}"
        )
    problems += check_numbers(path, table, ["time_s", *sorted(columns)])
    if len(stamps_s := _finite(table["time_s"])):
        table["time_s"] = sampled_s(stamps_s)[0]
    problems += _check_increasing(path, table, "time_s")
    return problems or _check_covered(path, table, frames)


def _check_covered(path: Path, force: pd.DataFrame, frames: pd.DataFrame | None) -> list[str]:
    """One line where a record of forces begins after the first frame or ends before the last."""
    frames_s = _finite(frames["time_s"]) if frames is not None else []
    if not len(frames_s):
        return []
    (first, last), (start, end) = frames_s[[0, -1]], force["time_s"].iloc[[0, -1]]
    if start <= first and end >= last:
        return []
    expected = f"a record that covers the frames' {number_text(first)} to {number_text(last)} s"
    return [
        f"{path}: time_s: expected {expected}, found {number_text(start)} to {number_text(end)} s"
    ]
