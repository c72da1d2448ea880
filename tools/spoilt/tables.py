"""Tables of a capture: how they are written, and what stands in them."""

import numpy as np
import pandas as pd

from spoilt.place import GAUGES, WRENCH, Mutation, Place


def _text(name: str, change):
    def spoil(place: Place) -> None:
        path = place.capture / name
        place.write(path, change(path.read_bytes()))

    return spoil


def _cell(name: str, column: str, row: int, value):
    def spoil(place: Place) -> None:
        def change(table: pd.DataFrame) -> pd.DataFrame:
            table = table.astype(object)
            table.loc[row, column] = value
            return table

        place.csv(place.capture / name, change)

    return spoil


def _table(name: str, change):
    return lambda place: place.csv(place.capture / name, change)


def _lines(content: bytes, change) -> bytes:
    head, *rows = content.decode().splitlines()
    return "\n".join(change(head, rows)).encode() + b"\n"


def _row(index: int, change):
    def spoil(head, rows):
        rows = list(rows)
        rows[index] = change(rows[index])
        return [head, *rows]

    return lambda content: _lines(content, spoil)


WRITTEN = {
    "BOM": lambda c: b"\xef\xbb\xbf" + c,
    "CRLF": lambda c: c.replace(b"\n", b"\r\n"),
    "CR": lambda c: c.replace(b"\n", b"\r"),
    "no last newline": lambda c: c.rstrip(b"\n"),
    "blank lines": lambda c: c.replace(b"\n", b"\n\n"),
    "semicolons": lambda c: c.replace(b",", b";"),
    "semicolons and decimal commas": lambda c: c.replace(b",", b";").replace(b".", b","),
    "tabs": lambda c: c.replace(b",", b"\t"),
    "decimal commas": lambda c: c.replace(b".", b",", 5),
    "every cell quoted": lambda c: b'"' + c.strip().replace(b",", b'","').replace(b"\n", b'"\n"')
    + b'"\n',
    "a quote left open": lambda c: c.replace(b"\n", b'\n"', 1),
    "UTF-16": lambda c: c.decode().encode("utf-16"),
    "UTF-16 without BOM": lambda c: c.decode().encode("utf-16-le"),
    "Latin-1 umlaut in the header": lambda c: c.replace(b"time_s", b"time_s\xe4", 1),
    "spaces after commas": lambda c: c.replace(b",", b", "),
    "a comma at the end of rows": lambda c: c.replace(b"\n", b",\n"),
    "a comma at the end of data rows": lambda c: c.replace(b"\n", b",\n").replace(b",\n", b"\n", 1),
    "an index column without a name": lambda c: _lines(
        c, lambda head, rows: [head, *(f"{k},{row}" for k, row in enumerate(rows))]
    ),
    "an index column": lambda c: _lines(
        c, lambda head, rows: [f",{head}", *(f"{k},{row}" for k, row in enumerate(rows))]
    ),
    "comment lines": lambda c: b"# made by hand\n" + c,
    "no header": lambda c: c.split(b"\n", 1)[1],
    "header twice": lambda c: c.split(b"\n", 1)[0] + b"\n" + c,
    "header in capitals": lambda c: _lines(c, lambda head, rows: [head.upper(), *rows]),
    "time_s twice": lambda c: _lines(
        c, lambda head, rows: [f"{head},time_s", *(f"{row},0" for row in rows)]
    ),
    "a column more": lambda c: _lines(
        c, lambda head, rows: [f"{head},note", *(f"{row},x" for row in rows)]
    ),
    "zero bytes": lambda c: b"",
    "one newline": lambda c: b"\n",
    "NUL bytes": lambda c: c[:200] + bytes(50) + c[250:],
    "binary garbage": lambda c: np.random.default_rng(3).bytes(4000),
    "a field of 2 MB": lambda c: c.replace(b"\n", b"\n" + b"9" * 2_000_000 + b",", 1),
    "a field of 2 MB of letters": _row(2, lambda row: "x" * 2_000_000 + row),
    "cut in a row": lambda c: c[: int(len(c) * 0.6)],
    "a row lacks cells": _row(4, lambda row: row.rsplit(",", 1)[0]),
    "a row has more cells": _row(4, lambda row: f"{row},1,2"),
    "an empty row of commas": _row(4, lambda row: "," * row.count(",")),
    "rows doubled": lambda c: _lines(
        c, lambda head, rows: [head, *(r for row in rows for r in (row, row))]
    ),
    "rows reversed": lambda c: _lines(c, lambda head, rows: [head, *rows[::-1]]),
    "header alone": lambda c: c.split(b"\n", 1)[0] + b"\n",
    "100000 columns": lambda c: _lines(
        c, lambda head, rows: [head + ",c" * 100_000, *(row + "," * 100_000 for row in rows[:12])]
    ),
}  # fmt: skip
VALUES = ["nan", "NaN", "inf", "-inf", "", "abc", "1e400", "1,5", "0x10", "1_000", "--3", "True",
          " ", "1e", "None", "٣"]  # fmt: skip


def corpus() -> list[Mutation]:
    """Mutations of frames.csv and force.csv, but for those of their physics."""
    found = []
    for name in ("frames.csv", "force.csv"):
        for words, change in WRITTEN.items():
            found.append(Mutation("table", f"{name} {words}", name, _text(name, change)))
    for column, row in (("time_s", 5), ("v2", 1700), ("v5", 0)):
        for value in VALUES:
            what = f"force.csv {column} is {value!r}"
            found.append(
                Mutation("table", what, "force.csv", _cell("force.csv", column, row, value))
            )
    for column in ("frame", "time_s", "color", "depth"):
        for value in VALUES:
            what = f"frames.csv {column} is {value!r}"
            found.append(
                Mutation("table", what, "frames.csv", _cell("frames.csv", column, 4, value))
            )
    return found + _rows() + _columns()


def _rows() -> list[Mutation]:
    cases = {
        "third frame is missing": ("frames.csv", lambda t: t.drop(index=2)),
        "fifth and sixth frame are missing": ("frames.csv", lambda t: t.drop(index=[5, 6])),
        "last frame is missing": ("frames.csv", lambda t: t.iloc[:-1]),
        "first frame is missing": ("frames.csv", lambda t: t.iloc[1:]),
        "frames start at the press": ("frames.csv", lambda t: t.iloc[6:]),
        "frame numbers of 10^12": ("frames.csv", lambda t: t.assign(frame=t["frame"] + 10**12)),
        "frame numbers of 10^30": ("frames.csv", lambda t: t.assign(frame=t["frame"] * 1e30)),
        "negative frame numbers": ("frames.csv", lambda t: t.assign(frame=t["frame"] - 50)),
        "files permuted": ("frames.csv", _permuted(["color", "depth"])),
        "colour files permuted": ("frames.csv", _permuted(["color"])),
        "depth files permuted": ("frames.csv", _permuted(["depth"])),
        "files reversed": ("frames.csv", _reversed(["color", "depth"])),
        "one file in two rows": ("frames.csv", _repeated(4, 5)),
        "colour and depth exchanged": (
            "frames.csv",
            lambda t: t.rename(columns={"color": "depth", "depth": "color"}),
        ),
        "colour for depth too": ("frames.csv", lambda t: t.assign(depth=t["color"])),
        "every tenth force sample": ("force.csv", lambda t: t.iloc[::10]),
        "every 500th force sample": ("force.csv", lambda t: t.iloc[::500]),
        "half a second of force is missing": ("force.csv", lambda t: t.drop(t.index[2000:2500])),
        "force ends early": ("force.csv", lambda t: t.iloc[:2500]),
        "force starts late": ("force.csv", lambda t: t.iloc[600:]),
    }
    told = {"every tenth force sample": "fewer readings have more noise, far below the interval"}
    return [
        Mutation("table", words, name, _table(name, change), told=told.get(words, ""))
        for words, (name, change) in cases.items()
    ]


def _permuted(columns):
    def change(table):
        order = np.random.default_rng(5).permutation(len(table))
        table[columns] = table[columns].to_numpy()[order]

    return change


def _reversed(columns):
    def change(table):
        table[columns] = table[columns].to_numpy()[::-1]

    return change


def _repeated(source, target):
    def change(table):
        for column in ("color", "depth"):
            table.loc[target, column] = table.loc[source, column]

    return change


def _columns() -> list[Mutation]:
    found = []
    for column in ("frame", "time_s", "color", "depth"):
        drop = _table("frames.csv", lambda t, c=column: t.drop(columns=c))
        found.append(Mutation("table", f"frames.csv without {column}", "frames.csv", drop))
    for column in ("time_s", "v0", "v5"):
        drop = _table("force.csv", lambda t, c=column: t.drop(columns=c))
        found.append(Mutation("table", f"force.csv without {column}", "force.csv", drop))

    def both(place: Place) -> None:
        place.csv(
            place.capture / "force.csv",
            lambda t: t.assign(**{name: 1e3 * k for k, name in enumerate(WRENCH)}),
        )

    found.append(Mutation("table", "volts and another wrench beside", "force.csv", both))

    def named_as_wrench(place: Place) -> None:
        rename = dict(zip(GAUGES, WRENCH, strict=True))
        place.csv(place.capture / "force.csv", lambda t: t.rename(columns=rename))

    found.append(Mutation("table", "volts under the wrench's names", "force.csv", named_as_wrench))

    def shuffled(place: Place) -> None:
        place.csv(place.capture / "force.csv", lambda t: t[["v3", *t.columns.drop("v3")]])

    found.append(Mutation("table", "columns in another order", "force.csv", shuffled))
    return found
