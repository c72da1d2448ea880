"""Arrays of NPZ files, of a film a frame at a time, or a line that says why a file is none."""

import io
import struct
import zipfile
import zlib
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

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

    ``what`` was expected, for the message of the `ValueError` if the file is none, was cut short,
    holds Python objects or promises more than there is.
    """
    try:
        with np.load(path, allow_pickle=False) as data:
            arrays = {name: data[name] for name in data.files}
        if wrong := [name for name, one in arrays.items() if not isinstance(one, np.ndarray)]:
            raise ValueError(f"{wrong[0]} is no array")
        return arrays
    except NO_ARCHIVE as error:
        reason = " ".join(str(error).split())
        raise ValueError(f"{path}: file: expected {what}, found none ({reason})") from None


def read_arrays(path: str | Path, names: Sequence[str]) -> dict[str, NDArray]:
    """Read arrays from an NPZ file as `read_npz` does; a `ValueError` if one is missing."""
    _require(path, arrays := read_npz(path), names)
    return arrays


def read_shaped(
    path: str | Path, shapes: Mapping[str, tuple[int | str, ...]], *, what: str
) -> dict[str, NDArray]:
    """Read arrays of given shapes from an NPZ file; see `read_npz`.

    Shapes are by name; a side is a number, or a word that is the same number wherever it stands. A
    `ValueError` if an array is missing or of another shape.
    """
    arrays = read_npz(path, what=what)
    _require(path, arrays, shapes)
    sizes: dict[str, int] = {}
    for name, wanted in shapes.items():
        found = arrays[name].shape
        sides = zip(found, wanted, strict=False)
        fits = (n == (of if isinstance(of, int) else sizes.setdefault(of, n)) for n, of in sides)
        if len(found) != len(wanted) or not all(fits):
            raise ValueError(f"{path}: {name}: expected shape {wanted}, found {found}")
    return {name: arrays[name] for name in shapes}


def _require(path: str | Path, arrays: Mapping[str, NDArray], names: Iterable[str]) -> None:
    if missing := [name for name in names if name not in arrays]:
        raise ValueError(f"{path}: {missing[0]}: expected an array, found none")


def write_film(path: str | Path, frames: Iterable[Mapping[str, NDArray]]) -> None:
    """Write each frame's arrays as they come, the file whole or not at all.

    An NPZ file with ``<frame>/<name>`` for each array.
    """
    with whole_file(path) as part, zipfile.ZipFile(part, "w", zipfile.ZIP_DEFLATED) as archive:
        for k, arrays in enumerate(frames):
            for name, array in arrays.items():
                with archive.open(f"{_place(k, name)}.npy", "w") as stream:
                    np.lib.format.write_array(stream, np.ascontiguousarray(array))


class Film(Sequence):
    """Frames that are read when they are asked for.

    Parameters
    ----------
    path : path
        Of `write_film`.
    names : sequence of str
        Arrays that each frame must have.
    make : callable
        What a frame is, of its arrays in the order of the names; what it finds wrong is raised
        with the file and the frame before it.

    Raises
    ------
    ValueError
        If the file is none, or lacks an array; on reading a frame, if it is damaged.
    """

    def __init__(self, path: str | Path, names: Sequence[str], make: Callable[..., Any]) -> None:
        self.path, self.names, self.make = path, names, make
        self._data = self._read(lambda: np.load(path, allow_pickle=False))
        found = set(self._read(lambda: self._data.files))
        self.count = len({name.partition("/")[0] for name in found})
        wanted = (_place(k, name) for k in range(self.count) for name in names)
        if not found or (missing := [name for name in wanted if name not in found]):
            expected = missing[0] if found else _place(0, names[0])
            raise ValueError(f"{path}: {expected}: expected an array, found none")

    def __len__(self) -> int:
        return self.count

    def __getitem__(self, k: Any) -> Any:
        """A frame, or those of a slice as a list."""
        if isinstance(k, slice):
            return [self[i] for i in range(*k.indices(self.count))]
        if not -self.count <= k < self.count:
            raise IndexError(f"frame {k} of {self.count}")
        k %= self.count
        arrays = self._read(lambda: [self._array(_place(k, name)) for name in self.names])
        try:
            return self.make(*arrays)
        except ValueError as error:
            raise ValueError(f"{self.path}: frame {k}: {error}") from None

    def _array(self, place: str) -> NDArray:
        """An array, whose whole content is read, so that its checksum is compared."""
        content = io.BytesIO(self._data.zip.read(f"{place}.npy"))
        return np.lib.format.read_array(content, allow_pickle=False)

    def _read(self, read: Callable[[], Any]) -> Any:
        try:
            return read()
        except NO_ARCHIVE as error:
            reason = " ".join(str(error).split())
            line = f"file: expected an NPZ file of frames, found none ({reason})"
            if "CRC" in reason:
                line = f"{reason.split(chr(39))[1]}: expected what was written, found it damaged"
            raise ValueError(f"{self.path}: {line}") from None


class Mapped(Sequence):
    """What a function makes of each of a sequence's items, when it is asked for."""

    def __init__(self, items: Sequence, function: Callable[[Any], Any]) -> None:
        self.items, self.function = items, function

    def __len__(self) -> int:
        return len(self.items)

    def __getitem__(self, k: int) -> Any:
        return self.function(self.items[k])


def _place(k: int, name: str) -> str:
    return f"{k:06}/{name}"
