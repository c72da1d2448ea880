"""Arrays of a film's frames in one NPZ file, written and read a frame at a time."""

import io
import zipfile
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palpate.capture.files import whole_file
from palpate.npz import NO_ARCHIVE


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
