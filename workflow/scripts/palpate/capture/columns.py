"""What is wrong with the columns of a table, one line each."""

import re
from pathlib import Path

import numpy as np
import pandas as pd

from palpate.capture.tables import number_text, read_table

# A time of day, or a date and one.
CLOCK = re.compile(r"(\d+[-./]\d+[-./]\d+[ T]+)?\d+:\d+")


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
        if column.any():
            row, found = int(np.argmax(column)), table[name].iloc[int(np.argmax(column))]
            hint = ", seconds are expected" if CLOCK.match(str(found)) else ""
            problems.append(
                f"{path}: {name}: expected finite numbers, found {found} in data row {row + 1}"
                f" ({column.sum()} such{hint})"
            )
    return problems


def check_whole(path: Path, table: pd.DataFrame, name: str) -> list[str]:
    """One line where a column of numbers holds others than whole ones."""
    if not all_finite(table[name]):
        return []
    values = pd.to_numeric(table[name]).to_numpy(dtype=float)
    wrong = np.flatnonzero(values != np.round(values))
    if not len(wrong):
        return []
    row = wrong[0]
    found = f"{number_text(values[row])} in data row {row + 1}"
    return [f"{path}: {name}: expected whole numbers, found {found}"]


def check_filled(path: Path, table: pd.DataFrame, name: str) -> list[str]:
    """One line where a column has an empty cell."""
    blank = np.flatnonzero(table[name].isna())
    if not len(blank):
        return []
    return [f"{path}: {name}: expected a file, found nothing in data row {blank[0] + 1}"]


def check_increasing(path: Path, table: pd.DataFrame, name: str) -> list[str]:
    """One line where a column of numbers stands still or falls."""
    if not all_finite(table[name]):
        return []
    values = pd.to_numeric(table[name]).to_numpy(dtype=float)
    wrong = np.flatnonzero(np.diff(values) <= 0)
    if not len(wrong):
        return []
    row = wrong[0]
    before, after = number_text(values[row]), number_text(values[row + 1])
    found = f"{before} then {after} in data row {row + 2}"
    return [f"{path}: {name}: expected increasing values, found {found}"]


def all_finite(column: pd.Series) -> bool:
    """Whether a column holds finite numbers alone."""
    return bool(np.isfinite(pd.to_numeric(column, errors="coerce").to_numpy(dtype=float)).all())
