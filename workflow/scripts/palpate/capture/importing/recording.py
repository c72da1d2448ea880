"""What every kind of recording gives: times, forms and optics first, then image after image."""

import argparse
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from tqdm import tqdm

from palpate.capture.tables import WRENCH_COLUMNS, sampled_s
from palpate.yaml_files import one_line

if TYPE_CHECKING:
    from palpate.capture.importing.pixels import Form

NANOSECONDS = 1_000_000_000
LONGEST_NAME = 100
# Table of force.csv, and notes on it.
ForceTable = tuple[pd.DataFrame, tuple[str, ...]]
# Options of `palpate import`, where None is what the recording states, or is found; beside them the
# folder that is made and the sensor's file, which is made if it does not exist.
Request = argparse.Namespace


@dataclass(frozen=True)
class Stream:
    """Images of one camera, in the order of the recording."""

    name: str  # topic or file, for messages
    form: "Form"  # of all of them
    times_ns: NDArray  # (n,) int64: their stamps [ns]


@dataclass(frozen=True)
class Content:
    """What a first look at a recording finds."""

    color: Stream
    depth: Stream
    depth_unit_m: float  # what one count of a depth image is [m]
    depth_unit_from: str  # who says so, in words
    # ``time_s`` [s] and the wrench [N, Nm], by time; None if the recording holds none.
    force: pd.DataFrame | None
    # Blocks ``color`` and ``depth`` of the sensor's file; None if the recording states none.
    cameras: dict | None
    notes: tuple[str, ...] = ()  # what a person should know
    frame: str = ""  # name of the colour camera's optical frame, if anything names it


class Recording(Protocol):
    """A recording that can be read twice."""

    def survey(self) -> Content:
        """Look through it once, without decoding images."""

    def pictures(self) -> Iterator[tuple[str, int, NDArray]]:
        """``color`` or ``depth``, place in the stream and pixels of each image; none is kept."""


def force_table(times_ns: Sequence[int], wrench: Sequence[float]) -> ForceTable:
    """Table of force.csv.

    Parameters
    ----------
    times_ns : (n,) ints
        Stamps [ns].
    wrench : (n, 6) or (6 n,) floats
        Force [N] and torque [Nm] of each sample, as the sensor reports them.

    Returns
    -------
    table : DataFrame
        By increasing time; of samples of one stamp the first, but where they come in bursts.
    notes : tuple of str
        What was put in order.
    """
    times_ns, wrench = np.array(times_ns, dtype=np.int64), np.array(wrench, dtype=float)
    order = np.argsort(times_ns, kind="stable")
    # In float64 seconds since 1970 are no finer than a quarter of a microsecond.
    since_s, burst = sampled_s((times_ns[order] - times_ns[order[0]]) / NANOSECONDS)
    first = np.diff(since_s, prepend=-1) > 0
    notes = []
    if burst > 1:
        notes.append(f"force: stamps come in bursts of {burst:.0f} samples, spread")
    if not first.all():
        notes.append(f"force: {(~first).sum()} samples repeat a stamp, left out")
    elif np.any(np.diff(times_ns) < 0):
        notes.append("force: samples were not in order of their stamps, sorted")
    table = pd.DataFrame(wrench.reshape(-1, 6)[order][first], columns=list(WRENCH_COLUMNS))
    table.insert(0, "time_s", times_ns[order[0]] / NANOSECONDS + since_s[first])
    return table, tuple(notes)


def shown(text: object) -> str:
    """A name out of a recording as it can be printed: no control characters, and not too long."""
    plain = "".join(letter if letter.isprintable() else "?" for letter in str(text))
    return plain if len(plain) <= LONGEST_NAME else plain[:LONGEST_NAME] + "..."


def mismatch(field: object, expected: object, found: object) -> ValueError:
    """Error to raise where a field of a recording is not as expected."""
    return ValueError(f"{field}: expected {expected}, found {found}")


@contextmanager
def named(path: Path | str, *within: str) -> Iterator[None]:
    """Name a file, and a place within it, in errors that don't begin with the file's name."""
    try:
        yield
    except ValueError as error:
        text = str(error)
        if not text.startswith(f"{path}: "):
            text = ": ".join([str(path), *within, text])
        raise ValueError(one_line(text)) from None


def progress(doing: str, total: int, items: Iterable | None = None) -> tqdm:
    """Progress on a terminal, and on nothing else."""
    return tqdm(items, total=total, desc=doing, unit="", disable=None, leave=False)
