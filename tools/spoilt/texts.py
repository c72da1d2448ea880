"""YAML that is none, that grows when it is read, or that wants to be more than values."""

import json
import os

import yaml

from spoilt.place import Mutation, Place


def _laughs() -> str:
    """Nine lists, each of nine times the one before."""
    rows, before = ['a: &a ["lol"]'], "a"
    for name in "bcdefghij":
        rows.append(f"{name}: &{name} [{', '.join([f'*{before}'] * 9)}]")
        before = name
    return "\n".join(rows) + "\n"


def _merges() -> str:
    """Mappings merged into one another, doubling each time."""
    rows = ["a0: &a0 {k: 1}"]
    for k in range(1, 40):
        rows.append(f"a{k}: &a{k} {{<<: [*a{k - 1}, *a{k - 1}]}}")
    return "\n".join(rows) + "\n"


ADDED = {
    "billion laughs": _laughs(),
    "merges without end": _merges(),
    "a list in itself": "points: &a [*a]\n",
    "a mapping in itself": "extra: &a {again: *a}\n",
    "python object": "extra: !!python/object/apply:os.system ['touch escaped']\n",
    "python name": "extra: !!python/name:os.system\n",
    "unknown tag": "extra: !probe {a: 1}\n",
    "a date that is none": "extra: 2020-13-45\n",
    "a date": "extra: 2020-01-02\n",
    "a float that is none": "extra: !!float abc\n",
    "an integer that is none": "extra: !!int ''\n",
    "a truth that is none": "extra: !!bool maybe\n",
    "binary that is none": "extra: !!binary '*'\n",
    "an integer of 5000 digits": f"extra: {'9' * 5000}\n",
    "a float of 1e400": "extra: 1e400\n",
    "a key of 100 kB": f"{'k' * 100_000}: 1\n",
    "a value of 100 kB": f"extra: {'v' * 100_000}\n",
    "nested 20000 deep": "extra: " + "[" * 20_000 + "]" * 20_000 + "\n",
    "100000 keys": "extra:\n" + "".join(f"  k{i}: {i}\n" for i in range(100_000)),
    "a list for a key": "? [1, 2]\n: 3\n",
    "a mapping for a key": "? {a: 1}\n: 3\n",
    "nothing for a key": "? \n: 3\n",
    "two documents": "---\nextra: 1\n",
    "a tab for indentation": "extra:\n\tvalue: 1\n",
    "control characters": "extra: a\x01b\n",
    "a newline in a key": '"a\\nb": 1\n',
    "an escape sequence in a key": '"\\e[31mred": 1\n',
    "an unknown alias": "extra: *nowhere\n",
    "a surrogate": 'extra: "\\ud800"\n',
}
WHOLE = {
    "zero bytes": b"",
    "null": b"null\n",
    "a list": b"[1, 2]\n",
    "a text": b"foam\n",
    "a number": b"42\n",
    "UTF-16": "object: foam_block\n".encode("utf-16"),
    "Latin-1": "object: f\xf6am\n".encode("latin-1"),
    "NUL bytes": bytes(4000),
    "JSON cut short": b'{"object": "foam_block", "probe"',
    "binary garbage": bytes(range(256)) * 8,
    "30 MB of dashes": b"- 1\n" * 7_500_000,
}
FILES = ["object.yaml", "sensors/kinect.yaml", "probes/nano25_sphere.yaml"]


def path_of(place: Place, file: str):
    """Where a file of people stands in a place."""
    return place.object / file if file == "object.yaml" else place.folder / file


def corpus() -> list[Mutation]:
    """Mutations of whole YAML files."""
    found = []
    for file in FILES:
        for name, text in ADDED.items():

            def add(place: Place, file=file, text=text) -> None:
                path = path_of(place, file)
                place.write(path, path.read_text() + text)

            found.append(Mutation("YAML", f"{file} with {name}", file, add))
        for name, content in WHOLE.items():

            def replace(place: Place, file=file, content=content) -> None:
                place.write(path_of(place, file), content)

            found.append(Mutation("YAML", f"{file} is {name}", file, replace))
        found += _written(file)
    return found


def _written(file: str) -> list[Mutation]:
    def crlf(place: Place) -> None:
        path = path_of(place, file)
        place.write(path, path.read_bytes().replace(b"\n", b"\r\n"))

    def bom(place: Place) -> None:
        path = path_of(place, file)
        place.write(path, b"\xef\xbb\xbf" + path.read_bytes())

    def twice(place: Place) -> None:
        path = path_of(place, file)
        text = path.read_text()
        first = next(row for row in text.splitlines() if row and not row.startswith("#"))
        place.write(path, text + first + "\n")

    def quoted(place: Place) -> None:
        place.yaml(path_of(place, file), _numbers_as_texts)

    def as_json(place: Place) -> None:
        path = path_of(place, file)
        place.write(path, json.dumps(yaml.safe_load(path.read_text())))

    def linked(place: Place) -> None:
        path = path_of(place, file)
        path.unlink()
        path.symlink_to("/etc/passwd")

    def folder(place: Place) -> None:
        path = path_of(place, file)
        path.unlink()
        path.mkdir()

    def pipe(place: Place) -> None:
        path = path_of(place, file)
        path.unlink()
        os.mkfifo(path)

    cases = {"with CRLF": crlf, "with a BOM": bom, "with its first key twice": twice,
             "with numbers in quotes": quoted, "as JSON": as_json, "linked to /etc/passwd": linked,
             "a folder": folder, "a pipe": pipe}  # fmt: skip
    return [Mutation("YAML", f"{file} {name}", file, change) for name, change in cases.items()]


def _numbers_as_texts(value):
    if isinstance(value, dict):
        return {k: _numbers_as_texts(v) for k, v in value.items()}
    if isinstance(value, list):
        return [_numbers_as_texts(v) for v in value]
    return str(value) if isinstance(value, int | float) else value
