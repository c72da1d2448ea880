"""Which columns of an export are depth and force, and in what unit."""

import re
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from palpate.capture.curves.export import Export
from palpate.capture.curves.units import FORCES, LENGTHS, UNITS, name_and_unit, plain
from palpate.capture.words import one_line


@dataclass(frozen=True)
class Quantity:
    """What a column may hold: its option's name, its units, and words for it, likeliest first."""

    name: str
    units: dict[str, float]
    words: tuple[str, ...]
    example: str


DEPTH = Quantity(
    "depth",
    LENGTHS,
    (
        r"indentation|indent|depth|penetration|eindring\w*",
        r"tip.?(position|sample|height)?|separation",
        r"displacement|disp|extension|stroke|travel|compression|deformation|crosshead|weg|verformung",
        r"position|pos|height|piezo|distance|hub|d|h|u|x|z",
    ),
    "mm",
)
FORCE = Quantity(
    "force",
    FORCES,
    (
        r"force|load|vdeflection|kraft|standardkraft|last|f|p",
        r"f[xyz]|deflection|vertical.?deflection",
    ),
    "N",
)


@dataclass(frozen=True)
class Asked:
    """What a person says of a column: its name or number (from 1), and its unit."""

    column: str | None = None
    unit: str | None = None


def column_of(export: Export, quantity: Quantity, asked: Asked) -> tuple[NDArray, str]:
    """Column of a quantity in SI units (n,), and how it was found, in words.

    Parameters
    ----------
    export : Export
    quantity : Quantity
    asked : Asked

    Raises
    ------
    ValueError
        Naming the option that says which column, or which unit.
    """
    place = _asked_place(export, quantity, asked.column) if asked.column else None
    if place is None:
        place = _found_place(export, quantity)
    header = export.names[place] if export.names else f"column {place + 1}"
    name, unit = name_and_unit(header)
    if asked.unit is not None and plain(asked.unit) not in quantity.units:
        known = ", ".join(quantity.units)
        expected = f"--{quantity.name}-unit: expected one of {known}, found {asked.unit}"
        raise ValueError(one_line(expected))
    unit = plain(asked.unit) if asked.unit is not None else unit
    if unit not in quantity.units:
        remedy = f"say --{quantity.name}-unit, like --{quantity.name}-unit {quantity.example}"
        line = f"{export.path}: {header}: expected a unit of {quantity.name}, found none ({remedy})"
        raise ValueError(one_line(line))
    told = f"{quantity.name} in {UNITS.get(unit, unit)}"
    shown = told if plain(name) == quantity.name else f"{told} ({name})"
    return export.values[:, place] * quantity.units[unit], shown


def asked_column(export: Export, column: str, option: str) -> NDArray:
    """A column that a person named, as it is, (n,)."""
    return export.values[:, _place(export, column, option)]


def _asked_place(export: Export, quantity: Quantity, column: str) -> int:
    return _place(export, column, f"--{quantity.name}-column")


def _place(export: Export, column: str, option: str) -> int:
    """Place of a column by its name, its name without unit, or its number from 1."""
    wanted = column.strip().lower()
    for known in (
        [name.lower() for name in export.names],
        [name_and_unit(name)[0].lower() for name in export.names],
        [str(k + 1) for k in range(export.values.shape[1])],
    ):
        if known.count(wanted) == 1:
            return known.index(wanted)
    raise ValueError(
        one_line(f"{export.path}: {option}: expected one of {_listed(export)}, found {column}")
    )


def _found_place(export: Export, quantity: Quantity) -> int:
    """Place of the column that its name and unit make the likeliest."""
    ranks = [_rank(name, quantity) for name in export.names]
    known = [rank for rank in ranks if rank is not None]
    places = [k for k, rank in enumerate(ranks) if known and rank == min(known)]
    if len(places) == 1:
        return places[0]
    what = f"one column of {quantity.name}" if export.names else "names of the columns"
    found = ", ".join(export.names[k] for k in places) if places else _listed(export)
    remedy = f"say --{quantity.name}-column NAME, or its number"
    line = f"{export.path}: columns: expected {what}, found {found} ({remedy})"
    raise ValueError(one_line(line))


def _rank(header: str, quantity: Quantity) -> tuple[int, int] | None:
    """How unlikely a column is of a quantity: by its words, and whether its unit is one of it."""
    name, unit = name_and_unit(header)
    if unit and unit not in quantity.units:
        return None
    words = re.sub(r"[^\w]+|_", " ", name.lower()).strip()
    for rank, pattern in enumerate(quantity.words):
        if re.search(rf"(?<!\w)(?:{pattern})(?!\w)", words):
            return rank, not unit
    return (len(quantity.words), 0) if unit else None


def _listed(export: Export) -> str:
    count = export.values.shape[1]
    names = export.names or [f"{count} columns without names"]
    return ", ".join(names)


def numbers_of(columns: list[NDArray]) -> tuple[list[NDArray], int]:
    """Columns without the rows where one has no number, and how many those are."""
    right = np.isfinite(columns).all(axis=0)
    return [column[right] for column in columns], int((~right).sum())
