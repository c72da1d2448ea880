"""Which columns of an export are depth and force, and in what unit."""

import re
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from palpate.capture.curves.export import Export
from palpate.capture.curves.units import FORCES, LENGTHS, UNITS, Header, header, plain
from palpate.yaml_files import one_line


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
    "mm, um, nm",
)
FORCE = Quantity(
    "force",
    FORCES,
    (
        r"force|load|vdeflection|kraft|standardkraft|last|f|p|fn",
        r"f[xyz]|deflection|vertical.?deflection",
    ),
    "N, mN, uN",
)


# Words of what is neither; and of what a unit alone does not make one.
NEITHER = r"torque|moment|stiffness|energy|work|stress|strain|rate|speed|velocity"
OTHERS = re.compile(
    rf"\b({NEITHER}|time|zeit|cycles?|samples?|index|segments?|temp\w*|count|area|diameter|radius|width"
    r"|thickness|mass|weight)\b"
)
# A nanoindenter's contact depth is less than that of its indentation; tangential forces.
NEVER = re.compile(
    rf"\b({NEITHER}|(contact|plastic|elastic|residual|final|max|maximum) (depth|displacement|load)"
    r"|h ?c|f ?t|tangential|lateral|friction|shear)\b"
)
# Words of the tip's own depth, and of what drives the indenter.
TIP = re.compile(r"\b(tip|indentation|indent|penetration|separation|into surface|eindring\w*)\b")
DRIVE = re.compile(r"\b(piezo|height|z sensor|z|crosshead|traverse|stage|motor|ramp|actuator)\b")
# A drive's way is the tip's and the spring's as whole parts of it, to this much.
WHOLE = 0.1
DEFLECTIONS = re.compile(r"[mu]?v|volts?")


@dataclass(frozen=True)
class Asked:
    """What a person says of a column: its name or number (from 1), and its unit."""

    column: str | None = None
    unit: str | None = None


@dataclass(frozen=True)
class Found:
    """How a column was found, in words, and what of that may be otherwise, a line each."""

    name: str
    text: str
    doubts: tuple[str, ...]

    @property
    def of_tip(self) -> bool:
        """Whether a depth's name says that it is the tip's own."""
        return TIP.search(_words(self.name)) is not None

    @property
    def of_drive(self) -> bool:
        """Whether a depth's name says that it is the drive's."""
        return DRIVE.search(_words(self.name)) is not None and not self.of_tip


def column_of(export: Export, quantity: Quantity, asked: Asked) -> tuple[NDArray, Found]:
    """Column of a quantity in SI units (n,), and how it was found.

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
    if asked.column is None:
        place = _found_place(export, quantity)
    else:
        place = _place(export, asked.column, f"--{quantity.name}-column")
    found = _headers(export)[place]
    if asked.unit is not None and plain(asked.unit) not in quantity.units:
        known = ", ".join(quantity.units)
        expected = f"--{quantity.name}-unit: expected one of {known}, found {asked.unit}"
        raise ValueError(one_line(f"{export.path}: {expected}"))
    written = UNITS.get(found.unit, found.unit) or found.marked
    used = plain(asked.unit) if asked.unit is not None else found.unit
    if used not in quantity.units:
        shown = export.names[place] if export.names else found.name
        line = _no_unit(quantity, shown, written, named=asked.column is not None)
        raise ValueError(one_line(f"{export.path}: {line}"))
    told = f"{quantity.name} in {UNITS.get(used, used)}"
    told += "" if plain(found.name) == quantity.name else f" ({found.name})"
    doubts = tuple(_doubts(quantity, asked, found.name, written, used))
    return export.values[:, place] * quantity.units[used], Found(found.name, told, doubts)


def _doubts(quantity: Quantity, asked: Asked, name: str, written: str, used: str) -> Iterator[str]:
    if asked.unit is not None and written and plain(written) != used:
        yield f"{name} says {written}, where {asked.unit} was asked for"
    if asked.column is None and _word_rank(name, quantity) is None:
        yield f"{name} is taken for {quantity.name} by its unit alone"


def _no_unit(quantity: Quantity, shown: str, written: str, *, named: bool) -> str:
    expected = f"{shown}: expected a unit of {quantity.name}"
    if written:
        remedy = "" if named else f" (another column? --{quantity.name}-column names it)"
        if plain(written) in quantity.units:
            remedy = f" in capitals alone (say --{quantity.name}-unit, like mN or MN)"
        length = plain(written) in LENGTHS
        if quantity is FORCE and (length or DEFLECTIONS.fullmatch(plain(written))):
            sensitivity = "" if length else " times sensitivity in m/V"
            remedy = f" (force = deflection{sensitivity} times stiffness in N/m: make that column)"
        return f"{expected}, found {written}{remedy}"
    option = f"--{quantity.name}-unit"
    return f"{expected}, found none (say {option}: {quantity.example} ...)"


def asked_column(export: Export, column: str, option: str) -> NDArray:
    """A column that a person named, as it is, (n,)."""
    return export.values[:, _place(export, column, option)]


def _headers(export: Export) -> list[Header]:
    """Name and unit of each column."""
    if not export.names:
        return [Header(f"column {k + 1}", "", "") for k in range(export.values.shape[1])]
    return [header(name, export.names) for name in export.names]


def _place(export: Export, column: str, option: str) -> int:
    """Place of a column by its name, its name without unit, or its number from 1."""
    wanted = column.strip().lower()
    for known in (
        [name.lower() for name in export.names],
        [one.name.lower() for one in _headers(export)],
        [str(k + 1) for k in range(export.values.shape[1])],
    ):
        if known.count(wanted) == 1:
            return known.index(wanted)
    raise ValueError(
        one_line(f"{export.path}: {option}: expected one of {_listed(export)}, found {column}")
    )


def _found_place(export: Export, quantity: Quantity) -> int:
    """Place of the column that its name and unit make the likeliest."""
    ranks = [_rank(one, quantity) for one in _headers(export)] if export.names else []
    known = [rank for rank in ranks if rank is not None]
    places = [k for k, rank in enumerate(ranks) if known and rank == min(known)]
    if len(places) == 1:
        return places[0]
    what = f"one column of {quantity.name}" if export.names else "names of the columns"
    found = ", ".join(export.names[k] for k in places) if places else _listed(export)
    how = "NAME, or its number" if export.names else "and its number, from 1"
    remedy = f"say --{quantity.name}-column {how}"
    line = f"{export.path}: columns: expected {what}, found {found} ({remedy})"
    raise ValueError(one_line(line))


def _rank(one: Header, quantity: Quantity) -> tuple[int, int] | None:
    """How unlikely a column is of a quantity: by its words, and whether its unit is one of it."""
    words, rank = _words(one.name), _word_rank(one.name, quantity)
    # What stands in brackets within a name is said of it, as in Load (friction corrected).
    bare = _words(re.sub(r"[\[({][^\])}]*[\])}]", " ", one.name))
    if (one.unit and one.unit not in quantity.units) or NEVER.search(bare):
        return None
    if rank is not None:
        return rank, not one.unit
    # A unit alone tells enough where it stands in brackets.
    alone = one.unit and one.marked and not OTHERS.search(words)
    return (len(quantity.words), 0) if alone else None


def _word_rank(name: str, quantity: Quantity) -> int | None:
    """Which of a quantity's words a name has, the likeliest first."""
    words = _words(name)
    found = (re.search(rf"(?<!\w)(?:{pattern})(?!\w)", words) for pattern in quantity.words)
    return next((rank for rank, one in enumerate(found) if one), None)


def _words(name: str) -> str:
    """Words of a name, apart: verticalTip_position is vertical tip position."""
    apart = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", name)
    return re.sub(r"[^\w]+|_", " ", apart.lower()).strip()


def _listed(export: Export) -> str:
    count = export.values.shape[1]
    names = export.names or [f"{count} columns without names"]
    return ", ".join(names)


def is_tips(export: Export, tip_m: NDArray, force_n: NDArray, stiffness_n_m: float) -> bool:
    """Whether a depth's column is the tip's, since another is it and what a spring gives way by.

    Parameters
    ----------
    export : Export
    tip_m, force_n : (n,) arrays
        Columns of the export, with the signs that make both grow in the press [m, N].
    stiffness_n_m : float
        Of what is between the drive and the tip.
    """
    rows = np.column_stack([tip_m, force_n / stiffness_n_m, np.ones(len(tip_m))])
    for one, column in zip(_headers(export), export.values.T, strict=True):
        drive_m = column * LENGTHS.get(one.unit, np.nan)
        right = np.isfinite(rows).all(axis=1) & np.isfinite(drive_m)
        if right.sum() > rows.shape[1]:
            parts = np.linalg.lstsq(rows[right], drive_m[right], rcond=None)[0]
            off = np.std(drive_m[right] - rows[right] @ parts)
            # The other way round this column would be the drive's, and the other the tip's.
            whole = np.abs(parts[:2] * np.sign(parts[0]) - 1) < WHOLE
            if whole.all() and off < WHOLE * np.std(rows[right, 1]):
                return True
    return False


def numbers_of(columns: list[NDArray]) -> tuple[list[NDArray], int]:
    """Columns without the rows where one has no number, and how many those are."""
    right = np.isfinite(columns).all(axis=0)
    return [column[right] for column in columns], int((~right).sum())
