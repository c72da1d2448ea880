"""What the documents quote of finished runs, held to the files that it is from.

    python tools/quoted.py [--write]

A table that quotes follows a comment that names a file, says which of its rows count, and how each
is written, once or in several lines; cells without a number are empty, and no row is left out:

    <!-- quoted: results/tables/accuracy.csv where recommended=True
    | %(object)s, %(sensor)s | %(youngs_modulus_kpa).0f |
    -->

Beside the file's columns there are those in kPa and mm. Prints each row that the file has
otherwise, and ends with status 1 if there is one; with --write the documents get the files' rows.
"""

import math
import re
import sys
from io import StringIO
from pathlib import Path

import pandas as pd
from palpate.report.style import sensor_name
from palpate.units import KILOPASCALS, MILLIMETRES

ROOT = Path(__file__).resolve().parents[1]
DOCUMENTS = ("README.md", "docs/trust.md", "docs/start_here.md")
MARK = re.compile(
    r"<!-- quoted: (?P<file>\S+)(?: where (?P<column>\w+)=(?P<value>\S+))?\n"
    r"(?P<rows>(?:\|.*\n)+)-->\n+(?P<header>\|.*\n\|[-:| ]+\n)(?P<table>(?:\|.*\n?)+)"
)
SCALED = {"_pa": ("_kpa", KILOPASCALS), "_m": ("_mm", MILLIMETRES)}


def differences(text: str, root: Path) -> list[str]:
    """Rows of a document that their files have otherwise, a line each."""
    found = []
    if (unread := text.count("<!-- quoted") - len(MARK.findall(text))) > 0:
        found.append(f"{unread} marks that no table follows as it should")
    for mark in MARK.finditer(text):
        path = root / mark["file"]
        if not path.is_file():
            found.append(f"{mark['file']}: expected what the document quotes, found no file")
            continue
        written = {first_cell(row): row for row in rows_of(path, mark)}
        for row in mark["table"].splitlines():
            now = written.pop(first_cell(row), "no such row")
            if now != row.strip():
                found.append(f"{mark['file']}: quoted {row.strip()}\n  found {now}")
        found += [f"{mark['file']}: left out {row}" for row in written.values()]
    return found


def rewritten(text: str, root: Path) -> str:
    """A document with the rows that its files have now, where they are there."""

    def table(mark: re.Match) -> str:
        if not (root / mark["file"]).is_file():
            return mark[0]
        rows = "".join(f"{row}\n" for row in rows_of(root / mark["file"], mark))
        return mark[0].removesuffix(mark["table"]) + rows

    return MARK.sub(table, text)


def rows_of(path: Path, mark: re.Match) -> list[str]:
    """All rows of a file as a document writes them, each once."""
    text, separator = path.read_text(encoding="utf-8"), ","
    if path.suffix == ".md":
        rows = [line.strip("| ") for line in text.splitlines() if line.startswith("| ")]
        text, separator = "\n".join(rows), r" *\| *"
    read_as = {"point": str, "capture": str}
    table = pd.read_csv(StringIO(text), sep=separator, engine="python", dtype=read_as, comment="#")
    if mark["column"]:
        table = table[table[mark["column"]].astype(str) == mark["value"]]
    wanted = set(re.findall(r"%\((.*?)\)", mark["rows"]))
    # A run that pressed less deep has fewer columns.
    values = [dict.fromkeys(wanted, math.nan) | as_read(row) for row in table.to_dict("records")]
    lines = [line % each for each in values for line in mark["rows"].splitlines()]
    return list(dict.fromkeys(re.sub(r"[^|]*\bnan\b[^|]*", " ", line) for line in lines))


def as_read(row: dict) -> dict:
    """A row with names as people read them, and its lengths and moduli in mm and kPa."""
    names = {"object": str(row.get("object")).replace("_", " ")}
    names["sensor"] = sensor_name(str(row.get("sensor")))
    scaled = {
        name.removesuffix(end) + new: scale * value
        for end, (new, scale) in SCALED.items()
        for name, value in row.items()
        if name.endswith(end) and not isinstance(value, str)
    }
    return row | names | scaled


def first_cell(row: str) -> str:
    """What a table names a row by."""
    return row.split("|")[1].strip()


def main(*options: str) -> int:
    """Print what differs in each document, or write it."""
    texts = {path: path.read_text(encoding="utf-8") for path in (ROOT / n for n in DOCUMENTS)}
    if options == ("--write",):
        for path, text in texts.items():
            path.write_text(rewritten(text, ROOT), encoding="utf-8")
        return 0
    each = {path.name: differences(text, ROOT) for path, text in texts.items()}
    found = [f"{name}: {line}\n" for name, lines in each.items() for line in lines]
    sys.stdout.write("".join(found))
    return int(bool(found))


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
