"""Arrays of an NPZ file, checked before they are used."""

import struct
import zipfile
import zlib
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

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


def read_arrays(path: str | Path, names: Sequence[str]) -> dict[str, NDArray]:
    """Read arrays of numbers from an NPZ file.

    Parameters
    ----------
    path : path
    names : sequence of str

    Returns
    -------
    dict

    Raises
    ------
    ValueError
        If the file is none, was cut short, holds Python objects or lacks an array.
    """
    try:
        with np.load(path, allow_pickle=False) as data:
            missing = [name for name in names if name not in data.files]
            arrays = {} if missing else {name: data[name] for name in names}
        if wrong := [name for name, one in arrays.items() if not isinstance(one, np.ndarray)]:
            raise ValueError(f"{wrong[0]} is no array")
    except NO_ARCHIVE as error:
        reason = " ".join(str(error).split())
        raise ValueError(f"{path}: file: expected an NPZ file of arrays, found {reason}") from None
    if missing:
        raise ValueError(f"{path}: {missing[0]}: expected an array, found none")
    return arrays
