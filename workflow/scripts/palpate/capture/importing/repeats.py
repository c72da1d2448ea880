"""Images that repeat the one before: a camera that lost one may hand out its last again."""

from collections.abc import Iterator, Mapping, Sequence
from hashlib import sha256
from pathlib import Path

import numpy as np
from numpy.typing import NDArray


def digest(pixels: NDArray) -> bytes:
    """Digest of an image's pixels."""
    return sha256(np.ascontiguousarray(pixels)).digest()


def repeating(digests: Mapping[str, Sequence[bytes]]) -> NDArray:
    """Which frames have an image that is that of the frame before, byte for byte.

    Parameters
    ----------
    digests : mapping
        Of the images of each stream, a digest for each of n frames.

    Returns
    -------
    (n,) bool array
    """
    streams = [
        [False, *(one == other != b"" for one, other in zip(found[1:], found, strict=False))]
        for found in digests.values()
    ]
    return np.any(streams, axis=0)


def left_out(folder: Path, names: Mapping[str, Sequence[str]], repeats: NDArray) -> None:
    """Take the images of repeating frames away, and let those behind move up."""
    for files in names.values():
        for name in np.array(files)[repeats]:
            (folder / name).unlink()
        for name, old in zip(files, np.array(files)[~repeats], strict=False):
            (folder / old).rename(folder / name)


def notes_on(
    repeats: NDArray, digests: Mapping[str, Sequence[bytes]], times_s: NDArray
) -> Iterator[str]:
    """Say how many frames were left out, and which was the first."""
    if repeats.any():
        first = int(np.argmax(repeats))
        kinds = [kind for kind, found in digests.items() if found[first] == found[first - 1]]
        which = f"the first ({' and '.join(kinds)}) at {times_s[first]:.3f} s"
        count = f"{repeats.sum()} of {len(repeats)}"
        yield f"frames: {count} repeat an image of the frame before, left out, {which}"
