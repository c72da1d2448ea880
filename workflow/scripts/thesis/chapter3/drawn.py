"""Diagrams without data, which the project holds as they are: Figures 3.1 and 3.2."""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from shutil import copyfile
from typing import Any


def make_drawn(inputs: Any, params: Any) -> dict[str, Callable[[Path], object]]:
    """The figure's files."""
    return {name: partial(copyfile, inputs[name]) for name in ("png", "svg")}
