"""What the study's scripts share: fits and minima in the order of the captures."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from palpate.json_fields import read_json


def read_all(paths: Sequence[str]) -> list[Any]:
    """Read JSON files.

    Raises
    ------
    ValueError
        If a file is damaged; the message names it.
    """
    return [read_json(path) for path in paths]


def minima_by_key(captures: Sequence[Mapping], errors: Sequence[str], paths: Sequence[str]) -> dict:
    """Minima by (object, sensor, capture, error); the paths go by capture, then by error."""
    keys = [
        (capture["object"], capture["sensor"], capture["capture"], error)
        for capture in captures
        for error in errors
    ]
    return dict(zip(keys, read_all(paths), strict=True))


def read_by_folder(paths: Sequence[str]) -> dict[str, dict]:
    """Read JSON files by the names of their folders, such as each object's material.json."""
    names = [Path(path).parent.name for path in paths]
    return dict(zip(names, read_all(paths), strict=True))


def read_one(path: str | Sequence[str]) -> dict | None:
    """Read a JSON file that a rule may do without."""
    return read_json(path) if path else None
