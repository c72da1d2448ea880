"""What every kind of recording gives: times, forms and optics first, then image after image."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from palpate.capture.importing.pixels import Form
from palpate.capture.tables import WRENCH_COLUMNS, sampled_s

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
    depth_unit_from : str
        Who says so, in words.
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
    depth_unit_from: str
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
        By increasing time; of samples of one stamp the first, but where they come in bursts.
    notes : tuple of str
        What was put in order.
    """
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
    table = pd.DataFrame(wrench[order][first], columns=list(WRENCH_COLUMNS))
    table.insert(0, "time_s", times_ns[order[0]] / NANOSECONDS + since_s[first])
    return table, tuple(notes)
