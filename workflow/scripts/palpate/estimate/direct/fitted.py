"""What an estimate makes of its captures, in a file."""

from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path

import numpy as np

from palpate.estimate.direct.estimate import CaptureFit
from palpate.npz import read_arrays

CAPTURES = "captures"
NAMES = tuple(field.name for field in fields(CaptureFit))


def save_fitted(path: str | Path, fitted: Mapping[str, CaptureFit]) -> None:
    """Write what each capture shows and what the estimate makes of it, as NPZ, by capture."""
    arrays = {
        f"{capture}/{name}": getattr(one, name) for capture, one in fitted.items() for name in NAMES
    }
    with Path(path).open("wb") as stream:
        np.savez_compressed(stream, **{CAPTURES: np.array(list(fitted))} | arrays)


def load_fitted(path: str | Path) -> dict[str, CaptureFit]:
    """Read what `save_fitted` wrote.

    Raises
    ------
    ValueError
        If the file is none, or lacks an array.
    """
    captures = read_arrays(path, [CAPTURES])[CAPTURES].tolist()
    arrays = read_arrays(path, [f"{capture}/{name}" for capture in captures for name in NAMES])
    return {
        capture: CaptureFit(**{name: arrays[f"{capture}/{name}"] for name in NAMES})
        for capture in captures
    }
