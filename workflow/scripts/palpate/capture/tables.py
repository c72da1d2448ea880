"""The tables of a capture: frames.csv and force.csv."""

import logging
import re
import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from palpate.capture.files import whole_file
from palpate.capture.force_record import sampled_s
from palpate.yaml_files import is_file, one_line

FRAMES = "frames.csv"
FORCE = "force.csv"
# From here on nine significant digits are coarser than a microsecond: clocks that count from 1970.
LARGE = 1000.0
# More take pandas minutes.
MOST_COLUMNS = 1000
# What pandas makes of the second column of a name.
TWICE = re.compile(r".*\.[0-9]+", re.DOTALL)
# Of each kind of sensor, the reference camera's first.
STREAMS = {
    "stereo": ("left", "right"),
    "structured_light": ("color", "depth"),
    "depth": ("color", "depth"),
}


def image_streams(sensor: Mapping) -> dict[str, Mapping]:
    """Image streams of a sensor and the block of its specification that describes each."""
    return {
        name: sensor["depth"] if name == "depth" else sensor["color"]
        for name in STREAMS[sensor["kind"]]
    }


def read_frames(folder: str | Path) -> pd.DataFrame:
    """Read a capture's frames.csv: ``frame,time_s`` and one column of files for each stream.

    Times count from the first frame: beside those since 1970 a clock's small steps vanish.
    """
    table = read_table(Path(folder) / FRAMES)
    time_s = columns_of(table, ["time_s"])[:, 0]
    return table.assign(time_s=time_s - time_s[:1])


def read_force(folder: str | Path) -> pd.DataFrame:
    """Read a capture's force.csv: ``time_s`` and gauge volts [V] or a wrench [N, Nm].

    Times count from the capture's first frame. Stamps in bursts are spread
    (`palpate.capture.force_record.sampled_s`).
    """
    path = Path(folder) / FORCE
    table, frames = read_table(path), read_table(Path(folder) / FRAMES)
    force_s, frame_s = (columns_of(of, ["time_s"])[:, 0] for of in (table, frames))
    time_s, burst = sampled_s(force_s - frame_s[:1])
    if burst > 1:
        logging.info("%s: its stamps in bursts of %.0f samples, which were spread", path, burst)
    return table.assign(time_s=time_s)


def write_frames(folder: str | Path, frames: pd.DataFrame) -> None:
    """Write frames.csv into a capture's folder."""
    write_table(Path(folder) / FRAMES, frames)


def write_force(folder: str | Path, force: pd.DataFrame) -> None:
    """Write force.csv into a capture's folder."""
    write_table(Path(folder) / FORCE, force)


def read_table(path: str | Path) -> pd.DataFrame:
    """Read a CSV table with exact numbers.

    Raises
    ------
    ValueError
        If the file is missing or is no table, it has too many columns or one twice, or rows are
        longer than the header, whose first cells pandas by itself takes for an index: all columns
        shift by one.
    """
    if not is_file(Path(path)):
        raise ValueError(one_line(f"{path}: file: expected a CSV table, found nothing"))
    columns = _commas(path) + 1
    if columns > MOST_COLUMNS:
        expected = f"expected at most {MOST_COLUMNS}, found {columns}"
        raise ValueError(one_line(f"{path}: columns: {expected}"))
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", pd.errors.ParserWarning)  # of cells that are left out
            table = pd.read_csv(path, low_memory=False, index_col=False)
    except pd.errors.ParserWarning:
        expected = "expected as many cells as column names, found more"
        raise ValueError(one_line(f"{path}: rows: {expected}")) from None
    except (ValueError, OverflowError) as error:
        reason = " ".join(str(error).split())
        line = f"{path}: file: expected a CSV table, found none ({reason})"
        raise ValueError(one_line(line)) from None
    for name in table.columns:
        if TWICE.fullmatch(str(name)) and str(name).rpartition(".")[0] in table.columns:
            found = f"found {str(name).rpartition('.')[0]} twice"
            raise ValueError(one_line(f"{path}: columns: expected each name once, {found}"))
    return table


def columns_of(table: Mapping, names: Sequence[str], *, frames: int | None = None) -> NDArray:
    """Columns of a table as numbers, shape (f, k).

    Parameters
    ----------
    table : mapping
        Columns by name.
    names : sequence of str
    frames : int, optional
        How many rows are expected.

    Raises
    ------
    ValueError
        If a column is missing or not of finite numbers, or there are more or fewer rows.
    """
    for name in names:
        if name not in table:
            raise ValueError(f"{name}: expected a column, found none")
    try:
        values = np.stack([np.asarray(table[name], dtype=float) for name in names], axis=1)
    except (TypeError, ValueError):
        raise ValueError(f"{names[0]}: expected numbers, found others") from None
    wrong = ~np.isfinite(values)
    if wrong.any():
        row, column = np.argwhere(wrong)[0]
        raise ValueError(f"{names[column]}: expected a number in frame {row}, found none")
    if frames is not None and len(values) != frames:
        raise ValueError(f"{names[0]}: expected {frames} frames, found {len(values)}")
    return values


def _commas(path: str | Path) -> int:
    """Commas in a table's first line."""
    with Path(path).open("rb") as stream:
        return stream.readline().count(b",")


def write_table(path: str | Path, table: pd.DataFrame) -> None:
    """Write a CSV table whole or not at all, its numbers as `number_text` gives them."""
    with whole_file(path) as part:
        table.to_csv(part, index=False, float_format=number_text, lineterminator="\n")


def as_written(table: pd.DataFrame) -> pd.DataFrame:
    """A table whose numbers are those that `write_table` keeps."""
    numbers = table.select_dtypes("float")
    return table.assign(**{name: numbers[name].map(_kept) for name in numbers})


def _kept(value: float) -> float:
    return float(number_text(value))


def number_text(value: float) -> str:
    """Nine significant digits, and never less than microseconds."""
    return f"{value:.6f}" if abs(value) >= LARGE else f"{value:.9g}"
