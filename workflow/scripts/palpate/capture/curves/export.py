"""Tables of numbers as instruments write them: any delimiter, preamble, encoding, and units."""

import codecs
import csv
import re
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product, zip_longest
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from palpate.yaml_files import mismatch, one_line

# In metres; letters of either case, since no instrument counts in megametres.
LENGTHS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "micron": 1e-6, "microns": 1e-6,
           "nm": 1e-9, "pm": 1e-12, "in": 0.0254, "inch": 0.0254}  # fmt: skip
# In newtons.
FORCES = {"MN": 1e6, "kn": 1e3, "n": 1.0, "cn": 1e-2, "mn": 1e-3, "un": 1e-6, "nn": 1e-9,
          "pn": 1e-12, "kgf": 9.80665, "gf": 9.80665e-3, "kg": 9.80665, "g": 9.80665e-3,
          "lbf": 4.4482216152605}  # fmt: skip
# Stiffnesses in newtons per metre; a bare number is in those, as in files of AFMs.
PER_M = {"1": 1.0, "n/m": 1.0, "mn/m": 1e-3, "nn/nm": 1.0, "pn/nm": 1e-3}
# Of other columns, in a row of units.
OTHERS = {"", "-", "s", "ms", "sec", "min", "v", "mv", "%", "1", "n/m", "hz", "mm/s", "mm/min",
          "pa", "kpa", "mpa", "deg", "\N{DEGREE SIGN}c"}  # fmt: skip
UNIT_LIKE = re.compile(r"[\w%/^*.\N{DEGREE SIGN}-]{0,8}")
MICRO = str.maketrans({"\N{MICRO SIGN}": "u", "\N{GREEK SMALL LETTER MU}": "u"})
# As people write them, where that is not in small letters.
UNITS = {"um": "\N{MICRO SIGN}m", "kn": "kN", "n": "N", "cn": "cN", "mn": "mN",
         "un": "\N{MICRO SIGN}N", "nn": "nN", "pn": "pN"}  # fmt: skip
# Units that small letters would make others of: a torque a length, meganewtons millinewtons.
CASED = ("Nm", "MN")
# Behind a name: in brackets, after a slash, a comma, "in" or a blank, or as the last part of it.
BEHIND = re.compile(r"^(?P<name>.*?)\s*(?:[\[({<]\s*(?P<a>[^\[\](){}<>]*?)\s*[\])}>]"
                    r"|(?:/|,|\bin\b|\s|_)\s*(?P<b>[^\s\[\]()_/,]+))\s*$")  # fmt: skip
# Of a force beside another: what ends the name of the one, as F_n beside F_t, is no unit.
DIRECTION = re.compile(r"_[a-z]", re.IGNORECASE)
LARGEST_BYTES = 2**28
MARKS = {codecs.BOM_UTF8: "utf-8-sig", codecs.BOM_UTF16_LE: "utf-16", codecs.BOM_UTF16_BE: "utf-16"}
DELIMITERS = {"\t": "tabs", ";": ";", ",": ",", "|": "|", " ": "blanks"}
COMMENTS = "#%!*/'\""
# Lines by which delimiter and first row are found; and how many make a table.
LOOKED_AT, FEWEST_ROWS = 2000, 3
# Before a decimal sign another sign and three digits are thousands and nothing else.
NUMBER = {
    sign: re.compile(
        rf"[+-]?(\d{{1,3}}(\{other}\d{{3}})+\{sign}\d*|\d+\{sign}?\d*|\{sign}\d+)([ed][+-]?\d+)?"
        "|[+-]?nan",
        re.IGNORECASE,
    )
    for sign, other in ((".", ","), (",", "."))
}
# Of rows with blanks between; there a unit in brackets follows its name after one.
CELLS, NAMES = re.compile(r'"[^"]*"|\S+'), re.compile(r"\s+(?![\[(])")
# JPK's files say what their comments are.
LABEL = re.compile(r"(columns|fancyNames|units):\s*", re.IGNORECASE)
# Numbers with separators of thousands, from which a decimal comma does not always differ.
THOUSANDS = re.compile(r"[+-]?[1-9]\d{0,2}([,. ]\d{3})+([.,]\d*)?")
GROUP = re.compile(r"\d[,. ]\d{3}(?!\d)")
LONGEST_SHOWN = 60
SPRINGS = "spring[ _]?constant|(?:cantilever|spring)[ _](?:stiffness|k)"
# In a preamble: Tip radius (um) 27.5; Spring Constant: 0.04 N/m; k (N/m) 0.019.
STATED = {
    "radius_m": ("(?:tip|probe|indenter|sphere|bead)[ _]?radius", "[munc]?m", LENGTHS),
    "stiffness_n_m": (f"k|{SPRINGS}", "[mnp]?N/n?m", PER_M),
}
STATES = (
    r"(?i)\b(?P<word>{words})\W*?(?P<before>{unit})?\W*?"
    r"(?P<value>\d+\.?\d*(?:e[+-]?\d+)?)\s*(?P<behind>{unit})?(?![\w.]|,\d)"
)


@dataclass(frozen=True)
class Header:
    """Name of a column without its unit; the unit, as `plain` has it, if it is known.

    ``marked`` is what stands in brackets or behind a slash at the end, known or not.
    """

    name: str
    unit: str = ""
    marked: str = ""


def plain(unit: str) -> str:
    """A unit in small letters, without brackets."""
    bare = unit.strip("[](){}<> \t").translate(MICRO)
    return bare if bare in CASED else bare.lower()


def are_units(cells: Sequence[str]) -> bool:
    """Whether cells are a row of units, one of a length or a force among them."""
    found = [plain(cell) for cell in cells]
    length, force = (any(unit in known for unit in found) for known in (LENGTHS, FORCES))
    if all(unit in LENGTHS or unit in FORCES or unit in OTHERS for unit in found):
        return length or force
    # Of others, like mm/mm, no list is whole.
    return length and force and all(map(UNIT_LIKE.fullmatch, found))


def header(text: str, others: Sequence[str] = ()) -> Header:
    """Name and unit of a column, whose header stands among others."""
    found = BEHIND.match(text)
    if not found:
        return Header(text)
    in_brackets = found["a"] is not None
    unit, name, end = found["a"] if in_brackets else found["b"], found["name"], text[found.end(1) :]
    marked = unit if in_brackets or re.match(r"\s+/", end) else ""
    beside = [one[len(name) :] for one in others if one != text and one.startswith(name)]
    index = end.lower() in ("_n", "_g") and (
        (end.islower() and len(name) == 1) or any(map(DIRECTION.fullmatch, beside))
    )
    # Where all is in capitals, MN is mN as likely.
    if plain(unit) == "MN" and "".join([text, *others]).isupper():
        return Header(name, "", unit)
    known = plain(unit) in LENGTHS or plain(unit) in FORCES
    if not known or index or end.lower() == "_in":
        return Header(text, "", marked)
    return Header(name, plain(unit), marked)


@dataclass(frozen=True)
class Export:
    """Columns of numbers of a text file."""

    path: str  # for messages
    names: tuple[str, ...]  # of the columns in the header, units with them; empty without one
    values: NDArray  # (n, k), NaN where a cell has no number
    read: tuple[str, ...]  # how the file was read, where that is no plain CSV
    warnings: tuple[str, ...]  # what of that may be otherwise
    stated: Mapping[str, float]  # in the preamble, of the indenter: radius_m, stiffness_n_m

    @property
    def headers(self) -> list[Header]:
        """Name and unit of each column."""
        if not self.names:
            return [Header(f"column {k + 1}") for k in range(self.values.shape[1])]
        return [header(name, self.names) for name in self.names]


@dataclass(frozen=True)
class Layout:
    """How cells are separated, and how many a row has."""

    delimiter: str
    decimal: str = "."
    cells: int = 0

    def split(self, line: str) -> list[str]:
        """Cells of a line."""
        if self.delimiter == " ":
            return [cell.strip('"') for cell in CELLS.findall(line)]
        cells = next(csv.reader([line], delimiter=self.delimiter), [])
        cells = [cell.strip() for cell in cells]
        return cells[:-1] if len(cells) > 1 and not cells[-1] else cells

    def is_number(self, cell: str) -> bool:
        """Whether a cell is a number."""
        return NUMBER[self.decimal].fullmatch(cell) is not None

    def number(self, cell: str) -> float:
        """Number of a cell, NaN of others."""
        plain = cell.replace("." if self.decimal == "," else ",", "").replace(",", ".")
        return float(plain.lower().replace("d", "e")) if self.is_number(cell) else np.nan

    def row(self, line: str) -> list[float] | None:
        """Numbers of a line of the table; None of other lines."""
        values = [self.number(cell) for cell in self.split(line)]
        if len(values) > self.cells or np.isfinite(values).sum() < min(2, self.cells - 1):
            return None
        return values + [np.nan] * (self.cells - len(values))

    def counts(self, line: str) -> tuple[int, int] | None:
        """How many cells a line has, and how many are numbers; None where fewer than two are."""
        cells = self.split(line)
        numbers = sum(map(self.is_number, cells))
        return (len(cells), numbers) if numbers >= 2 else None


def fault(path: str, field: str, expected: str, found: object) -> ValueError:
    """Error of a file, on one line."""
    return ValueError(one_line(str(mismatch(f"{path}: {field}", expected, found))))


def read_export(path: str | Path) -> Export:
    """Read the table of numbers that a text file, or ``-`` for standard input, holds.

    Lines before it are its preamble, of which the last may name the columns and their units; so may
    the lines of a comment. Tables that other lines part, like the segments of one curve, are read
    as one.

    Raises
    ------
    ValueError
        If there is no such file, or no table of at least two columns of numbers in it.
    """
    shown = "standard input" if str(path) == "-" else str(path)
    text, encoding = _text(path, shown)
    lines = text.replace("\r\n", "\n").replace("\r", "\n").split("\n")
    found = _layout(lines[:LOOKED_AT])
    if found is None:
        first = next((line.strip() for line in lines if line.strip()), "nothing")
        expected = f"a text table of {FEWEST_ROWS} or more rows with two or more numbers"
        raise fault(shown, "file", f"{expected} (export it as text or CSV)", first[:LONGEST_SHOWN])
    layout, begins = found
    before = [line for line in lines[:begins] if line.strip()]
    after = [(line, layout.row(line)) for line in lines[begins:] if line.strip()]
    rows = [row for _, row in after if row]
    warnings = _check_thousands(shown, layout, [line for line, row in after if row])
    names, named = _names(layout, before)
    preamble, others = len(before) - named, len(after) - len(rows)
    unusual = {
        encoding: encoding not in ("utf-8", "utf-8-sig"),
        f"{DELIMITERS[layout.delimiter]} as delimiter": layout.delimiter != ",",
        "decimal commas": layout.decimal == ",",
        f"{preamble} lines of preamble": preamble,
        f"{others} lines between or after the rows left out": others,
    }
    read = tuple(line for line, there in unusual.items() if there)
    values = np.reshape(rows, (-1, layout.cells))
    return Export(shown, names, values, read, warnings, _stated(before))


def _text(path: str | Path, shown: str) -> tuple[str, str]:
    """Text of a file and its encoding: by its mark, UTF-8, or Western Europe's of Windows."""
    if str(path) == "-":
        content = sys.stdin.buffer.read(LARGEST_BYTES + 1)
    elif not Path(path).is_file():
        found = "a folder" if Path(path).is_dir() else "nothing"
        raise fault(shown, "file", "a table of a curve", found)
    else:
        with Path(path).open("rb") as stream:
            content = stream.read(LARGEST_BYTES + 1)
    if len(content) > LARGEST_BYTES:
        raise fault(shown, "file", f"at most {LARGEST_BYTES >> 20} MB", "more")
    encodings = [name for mark, name in MARKS.items() if content.startswith(mark)]
    if not encodings and content[:200].count(0) > len(content[:200]) / 4:
        encodings = ["utf-16-le" if content[1:2] == b"\0" else "utf-16-be"]
    for encoding in encodings or ["utf-8", "cp1252"]:
        try:
            text = content.decode(encoding).replace("\N{MINUS SIGN}", "-")
        except UnicodeDecodeError:
            continue
        if "\0" not in text:
            return text, encoding
    raise fault(shown, "file", "text", "other bytes (export the curve as text or CSV)")


def _layout(lines: Sequence[str]) -> tuple[Layout, int] | None:
    """Delimiter and decimal sign that make the most rows of numbers, and the first such row."""
    best, found = (0.0, 0.0), None
    for delimiter, decimal in product(DELIMITERS, NUMBER):
        counts = [Layout(delimiter, decimal).counts(line) for line in lines]
        for wanted in {count for count in counts if count is not None}:
            rows = [k for k, count in enumerate(counts) if count == wanted]
            # Of a line of text that a delimiter makes as many cells of, few are numbers.
            share = wanted[1] / wanted[0]
            score = len(rows) * share, share
            if len(rows) >= FEWEST_ROWS and score > best:
                begin = rows[0]
                # Rows right before it with fewer numbers are of the table too.
                while begin and counts[begin - 1] and counts[begin - 1][0] <= wanted[0]:
                    begin -= 1
                best, found = score, (Layout(delimiter, decimal, wanted[0]), begin)
    return found


def _check_thousands(shown: str, layout: Layout, lines: Sequence[str]) -> tuple[str, ...]:
    """Reject separators of thousands, and warn of what may be some: a factor of a thousand.

    A column counts as one with such where all its signs stand before exactly three digits, some
    after a digit other than a leading zero, and some of its numbers have none; or where a number
    has two kinds of sign.
    """
    if not any(map(GROUP.search, lines)):
        return ()
    warnings = []
    for column in zip_longest(*map(layout.split, lines), fillvalue=""):
        signed = [cell for cell in column if set(cell) & {",", "."}]
        grouped = [cell for cell in signed if THOUSANDS.fullmatch(cell)]
        mixed = [cell for cell in grouped if not layout.is_number(cell)]
        bare = len(signed) < len(column) - column.count("")
        whole = bool(grouped) and len(grouped) == len(signed)
        if mixed or (whole and (bare or layout.delimiter == layout.decimal)):
            expected = "numbers without separators of thousands (export them without)"
            raise fault(shown, "rows", expected, (mixed or grouped)[0])
        if whole and (layout.delimiter == ";" or layout.decimal == ","):
            sign = "points" if layout.decimal == "." else "commas"
            numbers = f"numbers like {grouped[0]} have {sign} as of thousands"
            warnings.append(f"{numbers}: taken for decimal ones (export without them)")
    return tuple(warnings[:1])


def _names(layout: Layout, before: Sequence[str]) -> tuple[tuple[str, ...], int]:
    """Names of the columns, units with them, and of how many lines before the table they are."""
    rows = []
    for line in reversed(before):
        cells = _header_cells(layout, line)
        if cells is None:
            break
        rows.append(cells)
        if not are_units(cells):
            break
    if not rows:
        return (), 0
    units = rows[-2] if len(rows) > 1 else [""] * layout.cells
    names = (
        f"{name} [{unit.strip('[](){} ')}]" if unit else name
        for name, unit in zip(rows[-1], units, strict=True)
    )
    return tuple(names), len(rows)


def _header_cells(layout: Layout, line: str) -> list[str] | None:
    """Cells of a header, by the table's delimiter or another; None where none makes as many."""
    plain = LABEL.sub("", line.strip().lstrip(COMMENTS).strip())
    ways = [layout.split, *(Layout(delimiter).split for delimiter in DELIMITERS), NAMES.split]
    for split, text in product(ways, (line, plain)):
        cells = [cell.strip().lstrip(COMMENTS).strip() for cell in split(text)]
        # LabVIEW's header ends with a name that rows have no cell of.
        extra = split == layout.split and layout.delimiter != " "
        if extra and len(cells) == layout.cells + 1:
            cells = cells[:-1]
        if len(cells) == layout.cells and not np.isfinite([*map(layout.number, cells)]).any():
            return cells
    return None


def _stated(preamble: Sequence[str]) -> dict[str, float]:
    """What the lines before a table state of the indenter, in SI units."""
    found = {}
    for line, (name, (words, unit, units)) in product(preamble, STATED.items()):
        match = re.search(STATES.format(words=words, unit=unit), line.translate(MICRO))
        if match and float(match["value"]) > 0:
            # A letter k alone may be anything's.
            bare = "" if match["word"].lower() == "k" else "1"
            unit = (match["before"] or match["behind"] or bare).lower()
            if unit in units:
                found.setdefault(name, float(match["value"]) * units[unit])
    return found
