"""The tables of a capture: frames.csv, and force.csv as instruments write it."""

import logging
import re
import warnings
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from palpate.capture.files import whole_file
from palpate.yaml_files import is_file, mismatch, one_line

FRAMES, FORCE = "frames.csv", "force.csv"
GAUGE_COLUMNS = ("v0", "v1", "v2", "v3", "v4", "v5")
WRENCH_COLUMNS = ("fx_n", "fy_n", "fz_n", "tx_nm", "ty_nm", "tz_nm")
# From here on nine significant digits are coarser than a microsecond: clocks that count from 1970.
LARGE = 1000.0
# More take pandas minutes.
MOST_COLUMNS = 1000
# What pandas makes of the second column of a name.
TWICE = re.compile(r"(.*)\.[0-9]+", re.DOTALL)
# Of a record in bursts, steps within a burst over the mean step, how many of all they are at least
# (half of all where two samples come together), and so many bursts are no accident.
WITHIN_BURST, LEAST_WITHIN, FEWEST_BURSTS = 0.2, 0.4, 5
# No buffer is handed out less often than this (100 samples of 1 kHz take 0.1 s, give or take);
# stretches farther apart were recorded apart [s].
LONGEST_BURST_S = 0.25
# Of each kind of sensor, the reference camera's first.
STREAMS = {
    "stereo": ("left", "right"),
    "structured_light": ("color", "depth"),
    "depth": ("color", "depth"),
    "cloud": ("cloud",),
}


def image_streams(sensor: Mapping) -> dict[str, Mapping]:
    """Image streams of a sensor and the block of its specification that describes each."""
    streams = STREAMS[sensor["kind"]]
    return {name: sensor[name if name in ("depth", "cloud") else "color"] for name in streams}


def read_frames(folder: str | Path) -> pd.DataFrame:
    """Read a capture's frames.csv: ``frame,time_s`` and one column of files for each stream.

    Times count from the first frame: beside those since 1970 a clock's small steps vanish.
    """
    table = read_table(Path(folder) / FRAMES)
    time_s = columns_of(table, ["time_s"])[:, 0]
    return table.assign(time_s=time_s - time_s[:1])


def read_force(folder: str | Path) -> pd.DataFrame:
    """Read a capture's force.csv: ``time_s`` and gauge volts [V] or a wrench [N, Nm].

    Times count from the capture's first frame, if it has any. Stamps in bursts are spread
    (`sampled_s`).
    """
    path = Path(folder) / FORCE
    table, first_s = read_table(path), first_frame_s(folder)
    time_s, burst = sampled_s(columns_of(table, ["time_s"])[:, 0] - first_s)
    if burst > 1:
        logging.info("%s: its stamps in bursts of %.0f samples, which were spread", path, burst)
    return table.assign(time_s=time_s)


def first_frame_s(folder: str | Path) -> float:
    """When the first frame of a folder was taken by frames.csv [s]; 0 without one."""
    path = Path(folder) / FRAMES
    if not path.is_file():
        return 0.0
    time_s = columns_of(read_table(path), ["time_s"])[:, 0]
    if not len(time_s):
        raise mismatch(f"{path}: rows", "at least 1", 0)
    return float(time_s[0])


def force_columns(columns: Iterable, probe: Mapping | None = None) -> tuple[str, ...] | None:
    """Columns of force.csv that count: volts where the probe's file has their gauge, else newtons.

    Volts alone where nothing else is there; None where neither is whole.
    """
    sets = [names for names in (GAUGE_COLUMNS, WRENCH_COLUMNS) if set(names) <= set(columns)]
    if len(sets) > 1 and probe is not None and "gauge" not in probe:
        return WRENCH_COLUMNS
    return sets[0] if sets else None


def sampled_s(stamps_s: NDArray) -> tuple[NDArray, float]:
    """When samples were taken that came in bursts, each burst with the stamps of one moment.

    A burst is handed out as its last sample is taken, and its samples are as far apart as is usual,
    or as they can be since the burst before: what is missing stays missing.

    Parameters
    ----------
    stamps_s : (n,) array
        Times as they were written [s].

    Returns
    -------
    times_s : (n,) array
        The stamps themselves where they don't come in bursts.
    burst : float
        Mean number of samples in a burst; 1 without.
    """
    steps = np.diff(stamps_s)
    if not len(steps) or not (steps >= 0).all():
        return stamps_s, 1.0
    mean = (stamps_s[-1] - stamps_s[0]) / len(steps)
    ends = np.append(np.flatnonzero(steps > mean), len(steps))
    if (steps < WITHIN_BURST * mean).mean() < LEAST_WITHIN or len(ends) <= FEWEST_BURSTS:
        return stamps_s, 1.0
    since, size = np.diff(stamps_s[ends]), np.diff(ends)
    if np.median(since) > LONGEST_BURST_S:
        return stamps_s, 1.0
    usual = np.median(since / size)
    apart = np.append(usual, np.minimum(usual, since / size))
    number = np.arange(len(stamps_s))
    burst = np.searchsorted(ends, number)
    return stamps_s[ends[burst]] - apart[burst] * (ends[burst] - number), len(stamps_s) / len(ends)


def write_frames(folder: str | Path, frames: pd.DataFrame) -> None:
    """Write frames.csv into a capture's folder."""
    write_table(Path(folder) / FRAMES, frames)


def write_force(folder: str | Path, force: pd.DataFrame) -> None:
    """Write force.csv into a capture's folder."""
    write_table(Path(folder) / FORCE, force)


def read_table(path: str | Path, columns: Iterable[str] = ()) -> pd.DataFrame:
    """Read a CSV table with exact numbers that has some columns.

    Raises
    ------
    ValueError
        If the file is missing or is no table, a column is missing, there are too many or one twice,
        or rows are longer than the header, whose first cells pandas by itself takes for an index:
        all columns shift by one.
    """
    table = _parsed(Path(path))
    if isinstance(table, str):
        raise ValueError(one_line(f"{path}: {table}"))
    if missing := [name for name in columns if name not in table.columns]:
        raise mismatch(f"{path}: columns", ", ".join(missing), ", ".join(map(str, table.columns)))
    return table


def _parsed(path: Path) -> pd.DataFrame | str:
    """A file's table, or what is wrong with it."""
    if not is_file(path):
        return "file: expected a CSV table, found nothing"
    with path.open("rb") as stream:
        columns = stream.readline().count(b",") + 1
    if columns > MOST_COLUMNS:
        return f"columns: expected at most {MOST_COLUMNS}, found {columns}"
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", pd.errors.ParserWarning)  # of cells that are left out
            table = pd.read_csv(path, low_memory=False, index_col=False)
    except pd.errors.ParserWarning:
        return "rows: expected as many cells as column names, found more"
    except (ValueError, OverflowError) as error:
        reason = " ".join(str(error).split())
        return f"file: expected a CSV table, found none ({reason})"
    for name in map(TWICE.fullmatch, map(str, table.columns)):
        if name and name[1] in table.columns:
            return f"columns: expected each name once, found {name[1]} twice"
    return table


def columns_of(table: Mapping, names: Sequence[str], *, frames: int | None = None) -> NDArray:
    """Columns of a table as numbers, shape (f, k); ``frames`` is how many rows are expected.

    Raises
    ------
    ValueError
        If a column is missing or not of finite numbers, or there are more or fewer rows.
    """
    for name in names:
        if name not in table:
            raise mismatch(name, "a column", "none")
    try:
        values = np.stack([np.asarray(table[name], dtype=float) for name in names], axis=1)
    except (TypeError, ValueError):
        raise mismatch(names[0], "numbers", "others") from None
    for row, column in np.argwhere(~np.isfinite(values))[:1]:
        raise mismatch(names[column], f"a number in frame {row}", "none")
    if frames is not None and len(values) != frames:
        raise mismatch(names[0], f"{frames} frames", len(values))
    return values


def write_table(path: str | Path, table: pd.DataFrame) -> None:
    """Write a CSV table whole or not at all, its numbers as `number_text` gives them."""
    with whole_file(path) as part:
        table.to_csv(part, index=False, float_format=number_text, lineterminator="\n")


def as_written(table: pd.DataFrame) -> pd.DataFrame:
    """A table whose numbers are those that `write_table` keeps."""
    numbers = table.select_dtypes("float")
    return table.assign(**numbers.map(lambda value: float(number_text(value))))


def number_text(value: float) -> str:
    """Nine significant digits, and never less than microseconds."""
    return f"{value:.6f}" if abs(value) >= LARGE else f"{value:.9g}"
