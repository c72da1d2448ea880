"""Numbers of JSON files between the stages, named where they are not what they should be."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray


def read_json(path: str | Path) -> Any:
    """Read a JSON file; a `ValueError` that names it if it is none."""
    try:
        return json.loads(Path(path).read_text(encoding="utf-8"))
    except (ValueError, RecursionError) as error:
        raise ValueError(f"{path}: file: expected JSON, found none ({error})") from None


def read_fields(path: str | Path) -> dict:
    """Read a JSON file's fields; a `ValueError` if it is no JSON, or has none."""
    content = read_json(path)
    if not isinstance(content, dict):
        raise ValueError(f"{path}: file: expected fields, found {type(content).__name__}")
    return content


def numbers_of(path: str | Path, fields: Mapping, name: str, shape: tuple[int, ...]) -> NDArray:
    """Finite numbers of a field; a `ValueError` that names file and field where there are none."""
    try:
        values = np.array(fields[name], dtype=float)
    except KeyError:
        raise ValueError(f"{path}: {name}: expected a value, found none") from None
    except (TypeError, ValueError):
        raise ValueError(f"{path}: {name}: expected numbers, found others") from None
    if values.shape != shape or not np.isfinite(values).all():
        expected = f"finite numbers of shape {shape}"
        found = "others" if values.shape == shape else f"shape {values.shape}"
        raise ValueError(f"{path}: {name}: expected {expected}, found {found}")
    return values


def read_all(paths: Sequence[str]) -> list[Any]:
    """Read JSON files; see `read_json`."""
    return [read_json(path) for path in paths]


def minima_by_key(captures: Sequence[Mapping], errors: Sequence[str], paths: Sequence[str]) -> dict:
    """Minima by (object, sensor, capture, error); the paths go by capture, then by error."""
    keys = [(c["object"], c["sensor"], c["capture"], e) for c in captures for e in errors]
    return dict(zip(keys, read_all(paths), strict=True))


def read_by_folder(paths: Sequence[str]) -> dict[str, dict]:
    """Read JSON files by the names of their folders, such as each object's material.json."""
    return {Path(path).parent.name: read_json(path) for path in paths}


def read_one(path: str | Sequence[str]) -> dict | None:
    """Read a JSON file that a rule may do without."""
    return read_json(path) if path else None
