"""Arrays of an NPZ file, or a line that says why it is none; for all rooms."""

import struct
import zipfile
import zlib
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from palpate.capture.files import whole_file

# What NumPy and zipfile raise over a file that is none, or whose headers promise what is not there.
NO_ARCHIVE = (
    zipfile.BadZipFile,
    zlib.error,
    struct.error,
    EOFError,
    ValueError,
    TypeError,
    AttributeError,
    LookupError,
    SyntaxError,
    MemoryError,
    ArithmeticError,
    RuntimeError,
)


def write_npz(path: str | Path, arrays: Mapping[str, ArrayLike]) -> None:
    """Write arrays by name, whole or not at all."""
    with whole_file(path) as part, part.open("wb") as stream:
        np.savez_compressed(stream, **arrays)


def read_npz(path: str | Path, *, what: str = "an NPZ file of arrays") -> dict[str, NDArray]:
    """Read all arrays of an NPZ file by name; never a Python object.

    ``what`` was expected, for the message.

    Raises
    ------
    ValueError
        If the file is none, was cut short, holds Python objects or promises more than there is.
    """
    try:
        with np.load(path, allow_pickle=False) as data:
            arrays = {name: data[name] for name in data.files}
        wrong = [name for name, array in arrays.items() if not isinstance(array, np.ndarray)]
        if wrong:
            raise ValueError(f"{wrong[0]} is no array")
        return arrays
    except NO_ARCHIVE as error:
        reason = " ".join(str(error).split())
        raise ValueError(f"{path}: file: expected {what}, found none ({reason})") from None


def read_arrays(path: str | Path, names: Sequence[str]) -> dict[str, NDArray]:
    """Read arrays that must be there from an NPZ file; see `read_npz`.

    Raises
    ------
    ValueError
        If the file is none, or lacks an array.
    """
    arrays = read_npz(path)
    _require(path, arrays, names)
    return arrays


def read_shaped(
    path: str | Path, shapes: Mapping[str, tuple[int | str, ...]], *, what: str
) -> dict[str, NDArray]:
    """Read arrays of given shapes from an NPZ file; see `read_npz`.

    Shapes are by name; a side is a number, or a word that is the same number wherever it stands.

    Raises
    ------
    ValueError
        If the file is none, or an array is missing or of another shape.
    """
    arrays = read_npz(path, what=what)
    _require(path, arrays, shapes)
    sizes: dict[str, int] = {}
    for name, wanted in shapes.items():
        found = arrays[name].shape
        fits = len(found) == len(wanted) and all(
            size == (side if isinstance(side, int) else sizes.setdefault(side, size))
            for size, side in zip(found, wanted, strict=True)
        )
        if not fits:
            raise ValueError(f"{path}: {name}: expected shape {wanted}, found {found}")
    return {name: arrays[name] for name in shapes}


def _require(path: str | Path, arrays: Mapping[str, NDArray], names: Iterable[str]) -> None:
    missing = [name for name in names if name not in arrays]
    if missing:
        raise ValueError(f"{path}: {missing[0]}: expected an array, found none")
