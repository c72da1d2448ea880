"""Check the tables and images of one recording: everything that is wrong, one line each."""

import re
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping
from hashlib import file_digest
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from palpate.capture.discover import BACKGROUND
from palpate.capture.images import cloud_problem, png_problem
from palpate.capture.poses import LARGEST_GAP_S, NAMES, POSES, TIME, PoseRecord, read_poses
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
# Frames in a row without poses near them that nothing makes up for.
MOST_LOST_FRAMES = 10
# A time of day, or a date and one.
CLOCK = re.compile(r"(\d+[-./]\d+[-./]\d+[ T]+)?\d+:\d+")


def check_capture(folder: str | Path, sensor: Mapping, probe: Mapping | None = None) -> list[str]:
    """Check one capture against its sensor, and the probe that is to be followed if one is given.

    A line for each problem of ``raw/<object>/<sensor>/<capture>``, or of a background, which has no
    force.
    """
    folder, streams = Path(folder), image_streams(sensor)
    if folder.name == BACKGROUND:
        fewest = 1 if "cloud" in streams else FEWEST_BACKGROUND_FRAMES
        return check_images(folder, sensor, fewest=fewest)
    problems, frames = check_frames(folder, streams, fewest=FEWEST_FRAMES)
    if not problems:
        problems += _check_repeated(folder, frames, streams)
    problems += check_force(folder / FORCE, frames) + check_poses(folder, frames, sensor, probe)
    return list(map(one_line, problems))


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
    for row in np.flatnonzero(frame % 1)[:1]:
        found = f"{number_text(frame[row])} in data row {row + 1}"
        problems.append(f"{path}: frame: expected whole numbers, found {found}")
    problems += _check_increasing(path, table, "frame") + _check_increasing(path, table, "time_s")
    for stream, spec in streams.items():
        for row in np.flatnonzero(table[stream].isna())[:1]:
            found = f"nothing in data row {row + 1}"
            problems.append(f"{path}: {stream}: expected a file, found {found}")
        problems += _check_stream(folder, stream, table[stream].dropna().map(str), spec)
    return problems, table


def read_columns(path: Path, columns: list[str]) -> tuple[pd.DataFrame | None, list[str]]:
    """Read a table that must have some columns: the table or None, and what is wrong."""
    try:
        return read_table(path, columns), []
    except ValueError as error:
        return None, [str(error)]


def check_numbers(path: Path, table: pd.DataFrame, columns: list[str]) -> list[str]:
    """One line for each of some columns that holds anything but finite numbers.

    A row of units under the header is one line too.
    """
    numbers = table[columns].apply(pd.to_numeric, errors="coerce").to_numpy(dtype=float)
    wrong = ~np.isfinite(numbers)
    if len(wrong) > 1 and wrong[0].all() and not wrong[1:].any():
        found = ", ".join(map(str, table[columns].iloc[0]))
        hint = "(units? leave it out)"
        return [f"{path}: rows: expected numbers, found {found} in data row 1 {hint}"]
    problems = []
    for name, column in zip(columns, wrong.T, strict=True):
        for row in np.flatnonzero(column)[:1]:
            found = table[name].iloc[row]
            hint = ", seconds are expected" if CLOCK.match(str(found)) else ""
            found = f"{found} in data row {row + 1} ({column.sum()} such{hint})"
            problems.append(f"{path}: {name}: expected finite numbers, found {found}")
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


def _check_stream(folder: Path, stream: str, names: Iterable[str], spec: Mapping) -> Iterator[str]:
    """Check a stream's images; what is wrong with many of them alike is one line."""
    alike = defaultdict(list)
    for name in names:
        alike[_image_problem(folder, name, spec)].append(name)
    alike.pop(None, None)
    for problem, wrong in alike.items():
        more = f" (and {len(wrong) - 1} more)" if len(wrong) > 1 else ""
        place = folder / (FRAMES if "files of this folder" in problem else wrong[0])
        yield f"{place}: {stream}: {problem}{more}"


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


def _check_repeated(folder: Path, frames: pd.DataFrame, streams: Iterable[str]) -> Iterator[str]:
    """Check that no two frames show one image: noise makes each another, so a copy is no new frame.

    Only files that share their size with others are read, once each.
    """
    for stream in streams:
        expected = f"expected another {'cloud' if stream == 'cloud' else 'image'} in each frame"
        names, seen = list(map(str, frames[stream])), {}
        sizes = pd.Series([(folder / name).stat().st_size for name in names])
        for k in np.flatnonzero(sizes.duplicated(keep=False)):
            with (folder / names[k]).open("rb") as file:
                first = seen.setdefault(file_digest(file, "sha256").digest(), k)
            if first != k:
                found = f"found {names[k]} the same as {names[first]}"
                yield f"{folder / FRAMES}: {stream}: {expected}, {found}"
                break


def check_force(path: Path, frames: pd.DataFrame | None) -> list[str]:
    """Check a record of forces, one line for each problem; that it covers the frames, if any."""
    table, problems = read_columns(path, ["time_s"])
    if table is None:
        return problems
    columns = force_columns(table.columns)
    if columns is None:
        found = ", ".join(map(str, table.columns))
        return [f"{path}: columns: expected time_s and v0..v5 or fx_n..tz_nm, found {found}"]
    if (count := len(table)) < FEWEST_FORCE_SAMPLES:
        problems.append(f"{path}: rows: expected at least {FEWEST_FORCE_SAMPLES}, found {count}")
    problems += check_numbers(path, table, ["time_s", *sorted(columns)])
    if len(stamps_s := _finite(table["time_s"])):
        table["time_s"] = sampled_s(stamps_s)[0]
    problems += _check_increasing(path, table, "time_s")
    return problems or _check_covered(path, table, frames)


def _check_covered(path: Path, record: Mapping, frames: pd.DataFrame | None) -> list[str]:
    """One line where a record begins after the first frame or ends before the last."""
    frames_s = _finite(frames["time_s"]) if frames is not None else []
    if not len(frames_s):
        return []
    (first, last), (start, end) = frames_s[[0, -1]], np.asarray(record["time_s"])[[0, -1]]
    if start <= first and end >= last:
        return []
    apart = " (another clock?)" if start > last or end < first else ""
    expected = f"a record that covers the frames' {number_text(first)} to {number_text(last)} s"
    found = f"{number_text(start)} to {number_text(end)} s{apart}"
    return [f"{path}: time_s: expected {expected}, found {found}"]


def check_poses(
    folder: Path, frames: pd.DataFrame | None, sensor: Mapping, probe: Mapping | None
) -> list[str]:
    """Check what a probe is followed by, one line for each problem: poses, else its target.

    ``frames`` is frames.csv, where it can be read; a recording need not show a probe.
    """
    path, needed = folder / POSES, {"sensor": sensor, "probe": probe or {"marker": None}}
    if not path.is_file():
        without = [f"{kind} {one[kind]}" for kind, one in needed.items() if "marker" not in one]
        expected = f"poses ({' and '.join(without)} without marker)"
        return [f"{path}: file: expected {expected}, found nothing"] if without else []
    try:
        record = read_poses(folder)
    except ValueError as error:
        # What is wrong with the frames is a line already.
        return [str(error)] if str(path) in str(error) else []
    lines = [f"{path}: {line}" for line in _unlike(record, sensor, probe)]
    times = None if frames is None else _finite(frames[TIME])
    if times is None or not len(times):
        return lines
    times = times - times[0]
    if uncovered := _check_covered(path, vars(record), frames.assign(time_s=times)):
        return lines + uncovered
    for k in np.flatnonzero(np.diff(record.time_s) > LARGEST_GAP_S):
        start, end = record.time_s[k : k + 2]
        lost = int(((times > start) & (times < end)).sum())
        if lost > MOST_LOST_FRAMES:
            gap = f"none from {number_text(start)} to {number_text(end)} s, through {lost} frames"
            expected = f"poses at most {LARGEST_GAP_S:g} s apart"
            return [*lines, f"{path}: {TIME}: expected {expected}, found {gap} (tool out of view?)"]
    return lines


def _unlike(record: PoseRecord, sensor: Mapping, probe: Mapping | None) -> Iterable[str]:
    """Frames of a record that are not those of the sensor's file and of the probe's."""
    if "base" not in sensor:
        expected = f"a sensor whose file places it (base.camera_from_base of {sensor['sensor']})"
        yield f"base: expected {expected}, found none"
    if probe is not None and "tracked" not in probe:
        expected = f"a probe whose file names the tracked frame (tracked of {probe['probe']})"
        yield f"tracked: expected {expected}, found none"
    stated = sensor.get("base", {}).get("name"), (probe or {}).get("tracked")
    for name, wanted, hint in zip(NAMES, stated, ("another base", "another tool"), strict=True):
        found = getattr(record, name)
        if wanted and found and found != wanted:
            yield f"{name}: expected {wanted}, found {found} (poses of {hint}?)"
