"""Which columns of an export are depth and force, and in what unit."""

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from palpate.capture.curves.export import FORCES, LENGTHS, UNITS, Export, Header, fault, plain


@dataclass(frozen=True)
class Quantity:
    """What a column may hold: its option's name, its units, and words for it, likeliest first."""

    name: str
    units: dict[str, float]
    example: str
    words: tuple[str, ...]


DEPTHS = (
    r"indentation|indent|depth|penetration|eindring\w*",
    r"tip.?(position|sample|height)?|separation",
    r"displacement|disp|extension|stroke|travel|compression|deformation|crosshead|weg|verformung",
    r"position|pos|height|piezo|distance|hub|d|h|u|x|z",
)
DEPTH = Quantity("depth", LENGTHS, "mm, um, nm", DEPTHS)
LOADS = (
    r"force|load|vdeflection|kraft|standardkraft|last|f|p|fn",
    r"f[xyz]|deflection|vertical.?deflection",
)
FORCE = Quantity("force", FORCES, "N, mN, uN", LOADS)
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
BRACKETS = re.compile(r"[\[({][^\])}]*[\])}]")
# A drive's way is the tip's and the spring's as whole parts of it, to this much.
WHOLE = 0.1
VOLTS = re.compile(r"[mu]?v(olts?)?(/v)?")


@dataclass(frozen=True)
class Column:
    """A column in SI units (n,), how it was found, and what of that may be otherwise."""

    name: str
    values: NDArray
    text: str
    warnings: tuple[str, ...]

    @property
    def of_tip(self) -> bool:
        """Whether a depth's name says that it is the tip's own."""
        return TIP.search(_words(self.name)) is not None

    @property
    def of_drive(self) -> bool:
        """Whether a depth's name says that it is the drive's."""
        return DRIVE.search(_words(self.name)) is not None and not self.of_tip


def column_of(
    export: Export, quantity: Quantity, column: str | None = None, unit: str | None = None
) -> Column:
    """The column of a quantity; a person may say its name or number (from 1), and its unit.

    Raises
    ------
    ValueError
        Naming the option that says which column, or which unit.
    """
    if column is None:
        place = _found_place(export, quantity)
    else:
        place = _place_of(export, column, f"--{quantity.name}-column")
    found = export.headers[place]
    used = found.unit if unit is None else plain(unit)
    if unit is not None and used not in quantity.units:
        known = f"one of {', '.join(quantity.units)}"
        raise fault(export.path, f"--{quantity.name}-unit", known, unit)
    written = UNITS.get(found.unit, found.unit) or found.marked
    if used not in quantity.units:
        shown = export.names[place] if export.names else found.name
        found = _no_unit(quantity, written, named=column is not None)
        raise fault(export.path, shown, f"a unit of {quantity.name}", found)
    text = f"{quantity.name} in {UNITS.get(used, used)}"
    text += "" if plain(found.name) == quantity.name else f" ({found.name})"
    warnings = []
    if unit is not None and written and plain(written) != used:
        warnings.append(f"{found.name} says {written}, where {unit} was asked for")
    if column is None and _word_rank(found.name, quantity) is None:
        warnings.append(f"{found.name} is taken for {quantity.name} by its unit alone")
    return Column(found.name, export.values[:, place] * quantity.units[used], text, tuple(warnings))


def _no_unit(quantity: Quantity, written: str, *, named: bool) -> str:
    """What was found in place of a unit, and the remedy."""
    option, unit = f"--{quantity.name}-unit", plain(written)
    if not written:
        volts = "; make newtons of volts first" if quantity is FORCE else ""
        return f"none (say {option}: {quantity.example} ...{volts})"
    if quantity is FORCE and unit in LENGTHS:
        return f"{written} (force = deflection times stiffness in N/m: make that column)"
    if quantity is FORCE and VOLTS.fullmatch(unit):
        factor = "N/V of a load cell, or m/V times N/m of a cantilever"
        return f"{written} (force = volts times {factor}: make that column)"
    if unit in quantity.units:
        return f"{written} in capitals alone (say {option}, like mN or MN)"
    return written + ("" if named else f" (another column? --{quantity.name}-column names it)")


def _place_of(export: Export, column: str, option: str) -> int:
    """Place of a column by its name, its name without unit, or its number from 1."""
    wanted = column.strip().lower()
    for known in (
        [name.lower() for name in export.names],
        [one.name.lower() for one in export.headers],
        [str(k + 1) for k in range(export.values.shape[1])],
    ):
        if known.count(wanted) == 1:
            return known.index(wanted)
    raise fault(export.path, option, f"one of {_listed(export)}", column)


def _found_place(export: Export, quantity: Quantity) -> int:
    """Place of the column that its name and unit make the likeliest."""
    ranks = [_rank(one, quantity) for one in export.headers] if export.names else []
    least = min((rank for rank in ranks if rank is not None), default=())
    places = [k for k, rank in enumerate(ranks) if rank == least]
    if len(places) == 1:
        return places[0]
    what = f"one column of {quantity.name}" if export.names else "names of the columns"
    found = ", ".join(export.names[k] for k in places) or _listed(export)
    how = "NAME, or its number" if export.names else "and its number, from 1"
    raise fault(export.path, "columns", what, f"{found} (say --{quantity.name}-column {how})")


def _rank(one: Header, quantity: Quantity) -> tuple[int, int] | None:
    """How unlikely a column is of a quantity: by its words, and whether its unit is one of it."""
    # What stands in brackets within a name is said of it, as in Load (friction corrected).
    bare = _words(BRACKETS.sub(" ", one.name))
    if (one.unit and one.unit not in quantity.units) or NEVER.search(bare):
        return None
    rank = _word_rank(one.name, quantity)
    if rank is not None:
        return rank, not one.unit
    # A unit alone is enough where it stands in brackets.
    alone = one.unit and one.marked and not OTHERS.search(_words(one.name))
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
    return ", ".join(export.names) or f"{export.values.shape[1]} columns without names"


def is_tips(export: Export, tip_m: NDArray, force_n: NDArray, stiffness_n_m: float) -> bool:
    """Whether a depth's column is the tip's, since another is it and what a spring gives way by.

    Parameters
    ----------
    tip_m, force_n : (n,) arrays
        Columns of the export, with the signs that make both grow in the indentation [m, N].
    stiffness_n_m : float
        Of what is between the drive and the tip.
    """
    rows = np.column_stack([tip_m, force_n / stiffness_n_m, np.ones(len(tip_m))])
    for one, column in zip(export.headers, export.values.T, strict=True):
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


def numbers_of(columns: Sequence[NDArray]) -> tuple[list[NDArray], int]:
    """Columns without the rows where one has no number, and how many those are."""
    right = np.isfinite(columns).all(axis=0)
    return [column[right] for column in columns], int((~right).sum())
