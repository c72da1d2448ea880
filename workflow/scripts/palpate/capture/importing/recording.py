"""What every kind of recording gives, times, forms and optics first; which images make frames."""

import argparse
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Protocol

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from tqdm import tqdm

from palpate.capture.check_capture import FEWEST_FRAMES
from palpate.capture.discover import BACKGROUND, NOT_OBJECTS
from palpate.capture.importing.pixels import Form
from palpate.capture.tables import WRENCH_COLUMNS, sampled_s
from palpate.yaml_files import mismatch, one_line

NANOSECONDS = 1_000_000_000
NS_PER_MS = 1_000_000
LOWEST_FORCE_RATE_HZ = 100
SAMPLES = {"force": "force sample", "poses": "pose"}
LONGEST_NAME = 100
# Table of force.csv, and notes on it.
ForceTable = tuple[pd.DataFrame, tuple[str, ...]]
# Options of `palpate import`, where None is what the recording states, or is found; beside them the
# folder that is made and the sensor's file, which is made if it does not exist.
Request = argparse.Namespace


@dataclass(frozen=True)
class Images:
    """Images of one camera, in the order of the recording."""

    name: str  # topic or file, for messages
    form: Form  # of all of them
    times_ns: NDArray  # (n,) int64: their stamps [ns]


@dataclass(frozen=True)
class Content:
    """What a first look at a recording finds."""

    color: Images
    depth: Images
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


def is_capture(folder: Path) -> bool:
    """Whether a folder to make is a capture's, and no background's or a sensor's recording."""
    return folder.name != BACKGROUND and folder.parents[1].name != NOT_OBJECTS[0]


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


@dataclass(frozen=True)
class Pairs:
    """Images that were taken together."""

    color: NDArray  # (n,) ints: places in the streams, by the time of the colour image
    depth: NDArray
    within_ns: float  # how far apart they may be [ns]
    farthest_ns: int  # how far apart they are at most [ns]
    # (k,) ints: how far apart those are that are each other's nearest, but not within that [ns].
    missed_ns: NDArray


def frames_of(
    content: Content, covers: Mapping[str, NDArray], pairing_ms: float | None
) -> tuple[Pairs, list[str]]:
    """Pairs of images that make the frames, and notes on what makes none.

    Parameters
    ----------
    content : Content
        What the recording holds.
    covers : mapping
        Times [s] by the clock of the images of ``force`` and ``poses``, where there are such:
        frames before and after them are left out.
    pairing_ms : float or None
        How far apart a frame's images may be [ms]; half a frame if None.

    Raises
    ------
    ValueError
        If there are too few pairs, or none while forces were recorded, or a stream has fewer than
        two images or stamps that do not move.
    """
    color, depth = content.color, content.depth
    within_ns = None if pairing_ms is None else round(pairing_ms * NS_PER_MS)
    pairs = _paired(color.times_ns, depth.times_ns, within_ns)
    half = f"half a frame ({pairs.within_ns / NS_PER_MS:.1f} ms)"
    within = half if pairing_ms is None else f"{pairing_ms:g} ms"
    missed = _missed(pairs)
    if len(pairs.color) < FEWEST_FRAMES:
        expected = f"at least {FEWEST_FRAMES} pairs of images within {within}"
        raise mismatch("frames", expected, f"{len(pairs.color)}{missed}")
    notes = [
        *_unpaired(color, pairs.color, f"depth image within {within}", missed),
        *_unpaired(depth, pairs.depth, f"color image within {within}", missed),
    ]
    for name, known_s in covers.items():
        times_s = color.times_ns[pairs.color] / NANOSECONDS
        early, late = times_s < known_s[0], times_s > known_s[-1]
        kept = ~(early | late)
        if not kept.any():
            expected = f"samples during the frames' {times_s[0]:.3f} to {times_s[-1]:.3f} s"
            found = f"{known_s[0]:.3f} to {known_s[-1]:.3f} s (--{name}-offset)"
            raise mismatch(f"{name}: time_s", expected, found)
        if not kept.all():
            notes.append(f"frames: {early.sum()} before the first and {late.sum()} after the last"
                         f" {SAMPLES[name]}, left out")  # fmt: skip
        rate_hz = (len(known_s) - 1) / max(known_s[-1] - known_s[0], 1e-9)
        if name == "force" and rate_hz < LOWEST_FORCE_RATE_HZ:
            notes.append(f"force: {rate_hz:.3g} samples a second; below {LOWEST_FORCE_RATE_HZ} the"
                         " force of a frame is poorly known")  # fmt: skip
        pairs = replace(pairs, color=pairs.color[kept], depth=pairs.depth[kept])
    return pairs, notes


def _paired(color_ns: NDArray, depth_ns: NDArray, within_ns: float | None) -> Pairs:
    """Pair images that are each other's nearest, by stamps (n,) and (m,) in any order [ns]."""
    # A frame lasts as long as the median interval of the faster stream.
    half_ns = min(_interval(color_ns, "color"), _interval(depth_ns, "depth")) / 2
    within_ns = half_ns if within_ns is None else within_ns
    # Halfway between two, one side takes the later and the other the earlier: they still agree.
    to_depth = _nearest(color_ns, depth_ns, later=True)
    to_color = _nearest(depth_ns, color_ns, later=False)
    apart = np.abs(depth_ns[to_depth] - color_ns)
    mutual = to_color[to_depth] == np.arange(len(color_ns))
    color = np.flatnonzero(mutual & (apart <= within_ns))
    color = color[np.argsort(color_ns[color], kind="stable")]
    farthest = int(apart[color].max()) if len(color) else 0
    return Pairs(color, to_depth[color], within_ns, farthest, apart[mutual & (apart > within_ns)])


def _interval(times_ns: NDArray, name: str) -> float:
    if len(times_ns) < 2:
        raise mismatch(name, "at least 2 images", len(times_ns))
    steps = np.diff(np.unique(times_ns))
    if not len(steps):
        raise mismatch(f"{name}: stamps", "times that move", f"{times_ns[0]} ns only")
    return float(np.median(steps))


def _nearest(times: NDArray, others: NDArray, *, later: bool) -> NDArray:
    """Place of the nearest other time for each time; of one stamp's images, the first."""
    ordered, place = np.unique(others, return_index=True)
    after = np.clip(np.searchsorted(ordered, times), 1, len(ordered) - 1)
    nearer = (times - ordered[after - 1]) - (ordered[after] - times)
    return place[np.where((nearer > 0) | ((nearer == 0) & later), after, after - 1)]


def _unpaired(stream: Images, used: NDArray, partner: str, missed: str) -> Iterator[str]:
    """Note on the images without a partner."""
    left = np.setdiff1d(np.arange(len(stream.times_ns)), used)
    if len(left):
        first = f"the first at {stream.times_ns[left[0]] / NANOSECONDS:.3f} s{missed}"
        count = f"{len(left)} of {len(stream.times_ns)} images"
        yield f"{stream.name}: {count} have no {partner}, left out, {first}"


def _missed(pairs: Pairs) -> str:
    """Say how far apart the pairs are that only a wider window would take."""
    if not len(pairs.missed_ns):
        return ""
    # Rounded up: a window of the stated size takes them.
    tenths = np.ceil(10 * np.sort(pairs.missed_ns) / NS_PER_MS) / 10
    low, high = (f"{tenths[k]:.1f}" for k in (0, -1))
    apart = high if low == high else f"{low} to {high}"
    return f"; of {len(tenths)} the nearest is {apart} ms away (--pairing-ms)"
