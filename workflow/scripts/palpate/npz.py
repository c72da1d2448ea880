"""Arrays of an NPZ file, or a line that says why it is none; for all rooms."""

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


def read_npz(path: str | Path, *, what: str = "an NPZ file of arrays") -> dict[str, NDArray]:
    """Read all arrays of an NPZ file; never a Python object.

    Parameters
    ----------
    path : path
    what : str, optional
        What was expected, for the message.

    Returns
    -------
    dict
        By name.

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
    missing = [name for name in names if name not in arrays]
    if missing:
        raise ValueError(f"{path}: {missing[0]}: expected an array, found none")
    return arrays
