"""What every kind of recording gives: times, forms and optics first, then image after image."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from palpate.capture.force_record import WRENCH_COLUMNS
from palpate.capture.importing.pixels import Form

NANOSECONDS = 1_000_000_000
Progress = Callable[[], object]


@dataclass(frozen=True)
class Stream:
    """Images of one camera, in the order of the recording.

    Parameters
    ----------
    name : str
        Topic or file, for messages.
    form : Form
        Size and encoding of all of them.
    times_ns : (n,) int64 array
        Their stamps [ns].
    """

    name: str
    form: Form
    times_ns: NDArray


@dataclass(frozen=True)
class Content:
    """What a first look at a recording finds.

    Parameters
    ----------
    color, depth : Stream
    depth_unit_m : float
        What one count of a depth image is [m].
    force : DataFrame or None
        ``time_s`` [s] and the wrench [N, Nm], by time; None for a background.
    cameras : dict or None
        ``color`` and ``depth`` blocks of the sensor's file; None if the recording states none.
    notes : tuple of str
        What a person should know.
    """

    color: Stream
    depth: Stream
    depth_unit_m: float
    force: pd.DataFrame | None
    cameras: dict | None
    notes: tuple[str, ...] = field(default=())


@dataclass(frozen=True)
class Picture:
    """One image: ``color`` or ``depth``, its place in the stream, and its pixels."""

    stream: str
    index: int
    pixels: NDArray


class Recording(Protocol):
    """A recording that can be read twice."""

    def survey(self, tick: Progress) -> Content:
        """Look through it once, without decoding images; ``tick`` is called for each message."""

    def pictures(self) -> Iterator[Picture]:
        """All images one by one; none is kept."""

    def messages(self) -> int:
        """How often `survey` will call ``tick``, about."""


def force_table(times_ns: NDArray, wrench: NDArray) -> tuple[pd.DataFrame, tuple[str, ...]]:
    """Table of force.csv.

    Parameters
    ----------
    times_ns : (n,) int64 array
        Stamps [ns].
    wrench : (n, 6) array
        Force [N] and torque [Nm], as the sensor reports them.

    Returns
    -------
    table : DataFrame
        By increasing time; of samples of one stamp, the first.
    notes : tuple of str
        What was put in order.
    """
    kept = np.unique(times_ns, return_index=True)[1]
    notes = []
    if len(kept) < len(times_ns):
        notes.append(f"force: {len(times_ns) - len(kept)} samples repeat a stamp, left out")
    elif np.any(np.diff(times_ns) < 0):
        notes.append("force: samples were not in order of their stamps, sorted")
    table = pd.DataFrame(wrench[kept], columns=list(WRENCH_COLUMNS))
    table.insert(0, "time_s", times_ns[kept] / NANOSECONDS)
    return table, tuple(notes)
