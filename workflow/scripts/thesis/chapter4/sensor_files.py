"""A file of each sensor of which there is an experiment."""

from collections.abc import Callable, Sequence
from typing import Any

import pandas as pd


def by_sensor(names: Sequence[str], paths: Sequence[str], read: Callable = pd.read_csv) -> dict:
    """Read a file of each sensor, a table by default."""
    return {name: read(path) for name, path in zip(names, paths, strict=True)}


def provenances(params: Any) -> set[str]:
    """Whether the recordings are simulated, recorded or both."""
    return set(params.provenance.values())
