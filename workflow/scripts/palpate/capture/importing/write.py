"""Make a capture of a recording: whole, checked, or not at all."""

from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from tqdm import tqdm

from palpate.capture.check_capture import (
    FEWEST_BACKGROUND_FRAMES,
    FEWEST_FRAMES,
    check_capture,
    check_frames,
)
from palpate.capture.discover import BACKGROUND
from palpate.capture.files import whole_folder
from palpate.capture.images import count_m, write_image
from palpate.capture.importing.pairing import Pairs, paired
from palpate.capture.importing.pixels import LARGEST_COUNT, METRES, counted
from palpate.capture.importing.recording import (
    NANOSECONDS,
    Content,
    Picture,
    Recording,
    Stream,
)
from palpate.capture.importing.repeats import digest, left_out, notes_on, repeating
from palpate.capture.importing.sensor_file import RANGE_M, sensor_of, write_sensor
from palpate.capture.tables import image_streams, write_force, write_frames

LOWEST_FORCE_RATE_HZ = 100
NS_PER_MS = 1_000_000
# Between camera and bench lies so much.
BENCH_M = (0.2, 1.5)
# Of so many rows and columns one tells the median depth.
EVERY = 4
# Table of force.csv, and notes on it.
ForceTable = tuple[pd.DataFrame, tuple[str, ...]]


@dataclass(frozen=True)
class Target:
    """Where a capture is to stand.

    Parameters
    ----------
    folder : Path
        ``raw/<object>/<sensor>/<capture>`` or ``.../background``, or a film of the probe,
        ``raw/sensors/<sensor>/<film>``; must not exist.
    sensor_file : Path
        ``config/sensors/<sensor>.yaml``; made if it does not exist.
    background : bool
        Whether the frames have no force: of the scene without object and probe, or of a film.
    range_m : pair of floats
        Nearest and farthest depth of a new sensor file [m].
    trusted : bool
        Whether optics of an existing sensor file are right whatever the recording states.
    """

    folder: Path
    sensor_file: Path
    background: bool = False
    range_m: tuple[float, float] = RANGE_M
    trusted: bool = False


def import_recording(
    recording: Recording,
    target: Target,
    *,
    force: ForceTable | None = None,
    force_offset_s: float = 0.0,
    pairing_ms: float | None = None,
) -> list[str]:
    """Write a recording as a capture.

    Parameters
    ----------
    recording : Recording
    target : Target
    force : table of force.csv and notes on it, optional
        If the recording itself holds no wrench.
    force_offset_s : float, optional
        What brings the force's clock to that of the images [s]; it is added.
    pairing_ms : float, optional
        How far apart a frame's colour and depth may be [ms]; half a frame if not given.

    Returns
    -------
    list of str
        What was found and written, and what was left out and why, a line each.

    Raises
    ------
    ValueError
        If the recording makes no capture; nothing is left behind then.
    """
    kept = "" if target.folder.name == BACKGROUND else BACKGROUND
    whole = whole_folder(target.folder, replace=False, kept=kept)
    with _leaving_nothing(target.folder), whole as part:
        content = _surveyed(recording)
        table, notes = force or (content.force, ())
        table = None if target.background else table
        if table is not None and force_offset_s:
            table = table.assign(time_s=table["time_s"] + force_offset_s)
        frames, covered = _frames(content, table, pairing_ms)
        rate_hz = _rate_hz(content.color.times_ns[frames.color])
        sensor, new = sensor_of(
            target.sensor_file, content, rate_hz, range_m=target.range_m, trusted=target.trusted
        )
        frames, left = _write(part, recording, content, frames, sensor)
        if table is not None:
            write_force(part, table)
        _require_right(part, target, sensor)
        if new:
            write_sensor(target.sensor_file, sensor)
    made = [f"{target.sensor_file}: written, from the recording's optics"] if new else []
    notes = [*content.notes, *notes, *covered, *left]
    return [_headline(target, content, frames, table), *notes, *made]


def _surveyed(recording: Recording) -> Content:
    with _bar("looking", recording.messages()) as bar:
        return recording.survey(bar.update)


def _frames(
    content: Content, force: pd.DataFrame | None, pairing_ms: float | None
) -> tuple[Pairs, list[str]]:
    """Pairs of images that make the frames, and notes on what makes none."""
    pairs, notes = _pairs(content, pairing_ms)
    if force is None:
        return pairs, notes
    times_s = content.color.times_ns[pairs.color] / NANOSECONDS
    start_s, end_s = force["time_s"].iloc[[0, -1]]
    kept = (times_s >= start_s) & (times_s <= end_s)
    if len(kept) and not kept.any():
        expected = f"samples during the frames' {times_s[0]:.3f} to {times_s[-1]:.3f} s"
        raise ValueError(
            f"force: time_s: expected {expected}, found {start_s:.3f} to {end_s:.3f} s"
        )
    if not kept.all():
        before, after = int((times_s < start_s).sum()), int((times_s > end_s).sum())
        notes.append(f"frames: {before} before the first and {after} after the last force sample,"
                     " left out")  # fmt: skip
    rate_hz = (len(force) - 1) / (end_s - start_s) if end_s > start_s else 0.0
    if rate_hz < LOWEST_FORCE_RATE_HZ:
        notes.append(f"force: {rate_hz:.3g} samples a second; below {LOWEST_FORCE_RATE_HZ} the"
                     " force of a frame is poorly known")  # fmt: skip
    return replace(pairs, color=pairs.color[kept], depth=pairs.depth[kept]), notes


def _pairs(content: Content, pairing_ms: float | None) -> tuple[Pairs, list[str]]:
    """Pairs of images, and notes on those without a partner."""
    within_ns = None if pairing_ms is None else round(pairing_ms * NS_PER_MS)
    pairs = paired(content.color.times_ns, content.depth.times_ns, within_ns)
    within = f"within half a frame ({pairs.within_ns / NS_PER_MS:.1f} ms)"
    within = within if pairing_ms is None else f"within {pairing_ms:g} ms"
    missed = _missed(pairs)
    if len(pairs.color) < FEWEST_FRAMES:
        expected = f"at least {FEWEST_FRAMES} pairs of images {within}"
        raise ValueError(f"frames: expected {expected}, found {len(pairs.color)}{missed}")
    notes = [
        *_unpaired(content.color, pairs.color, f"depth image {within}"),
        *_unpaired(content.depth, pairs.depth, f"color image {within}"),
    ]
    return pairs, [line + missed for line in notes]


def _unpaired(stream: Stream, used: NDArray, partner: str) -> Iterator[str]:
    left = np.setdiff1d(np.arange(len(stream.times_ns)), used)
    if len(left):
        first_s = stream.times_ns[left[0]] / NANOSECONDS
        count = f"{len(left)} of {len(stream.times_ns)} images"
        yield f"{stream.name}: {count} have no {partner}, left out, the first at {first_s:.3f} s"


def _missed(pairs: Pairs) -> str:
    """Say how far apart the pairs are that only a wider window would take."""
    if not len(pairs.missed_ns):
        return ""
    # Rounded up: the number that is told is one that takes them.
    tenths = np.ceil(10 * np.sort(pairs.missed_ns) / NS_PER_MS) / 10
    low, high = (f"{tenths[k]:.1f}" for k in (0, -1))
    apart = high if low == high else f"{low} to {high}"
    return f"; of {len(tenths)} the nearest is {apart} ms away (--pairing-ms)"


def _write(
    part: Path, recording: Recording, content: Content, frames: Pairs, sensor: dict
) -> tuple[Pairs, list[str]]:
    """Write frames.csv and the images; gives the frames that were kept, and notes on others."""
    count, step_m = len(frames.color), count_m(sensor["depth"])
    names = {kind: [f"{kind}/{k:06d}.png" for k in range(count)] for kind in ("color", "depth")}
    times_s = content.color.times_ns[frames.color] / NANOSECONDS
    digests, beyond, depth_m = _write_pictures(part, recording, content, frames, names, step_m)
    if depth_m > (far_m := LARGEST_COUNT * step_m):
        expected = f"expected a median of up to {far_m:.3g} m, found {depth_m:.4g}"
        raise ValueError(f"depth: {expected} (is it in mm? --depth-unit 0.001)")
    repeats = repeating(digests)
    left_out(part, names, repeats)
    kept = int(count - repeats.sum())
    if kept < FEWEST_FRAMES and kept < count:
        raise ValueError(f"frames: expected at least {FEWEST_FRAMES} that differ from the one"
                         f" before, found {kept} of {count}")  # fmt: skip
    columns = {kind: files[:kept] for kind, files in names.items()}
    table = {"frame": np.arange(kept), "time_s": times_s[~repeats], **columns}
    write_frames(part, pd.DataFrame(table))
    notes = list(notes_on(repeats, digests, times_s))
    notes += _depth_notes(content, int(beyond[~repeats].sum()), step_m)
    said = f"{1e3 * content.depth_unit_m:.4g} mm ({content.depth_unit_from})"
    notes.append(f"depth: one count is {said}, which makes a median of {depth_m:.3g} m")
    if not BENCH_M[0] <= depth_m <= BENCH_M[1]:
        others = "a D405 may count 0.1 mm, an L515 0.25 mm, a folder 1000 in a metre"
        said = "depth: worth a look: few benches are so far"
        notes.append(f"{said}; {others} (--depth-unit, --depth-factor)")
    near_m, far_m = sensor["range_m"]
    if not near_m <= depth_m <= far_m:
        notes.append(f"depth: that is not in the sensor's range_m, {near_m:g} to {far_m:g} m")
    return replace(frames, color=frames.color[~repeats], depth=frames.depth[~repeats]), notes


def _write_pictures(
    part: Path,
    recording: Recording,
    content: Content,
    frames: Pairs,
    names: dict[str, list[str]],
    step_m: float,
) -> tuple[dict[str, list[bytes]], NDArray, float]:
    """Write the images.

    Returns
    -------
    digests : dict
    beyond : (n,) array
        How many depths of each are beyond 16 bits.
    depth_m : float
        Median depth [m].
    """
    count = len(frames.color)
    place = {
        kind: dict(zip(used.tolist(), range(count), strict=True))
        for kind, used in (("color", frames.color), ("depth", frames.depth))
    }
    for kind in names:
        (part / kind).mkdir()
    digests = {kind: [b""] * count for kind in names}
    beyond, medians = np.zeros(count, dtype=int), np.zeros(count)
    with _bar("writing", 2 * count) as bar:
        for picture in _chosen(recording.pictures(), place):
            kind, k = picture.stream, place[picture.stream][picture.index]
            pixels = picture.pixels
            if kind == "depth":
                few = pixels[::EVERY, ::EVERY]
                seen = few[np.isfinite(few) & (few > 0)]
                medians[k] = np.median(seen) if seen.size else 0
                pixels, beyond[k] = counted(pixels, content.depth_unit_m, step_m)
            digests[kind][k] = digest(pixels)
            write_image(part / names[kind][k], pixels, getattr(content, kind).form.stored)
            bar.update()
    return digests, beyond, float(np.median(medians)) * content.depth_unit_m


def _chosen(pictures: Iterable[Picture], place: dict[str, dict[int, int]]) -> Iterator[Picture]:
    return (picture for picture in pictures if picture.index in place[picture.stream])


def _require_right(part: Path, target: Target, sensor: dict) -> None:
    """Hold what was written to the capture format before it gets its name."""
    if target.background:
        fewest = FEWEST_BACKGROUND_FRAMES
        problems, _ = check_frames(part, image_streams(sensor), fewest=fewest)
    else:
        problems = check_capture(part, sensor)
    if problems:
        raise ValueError(problems[0].replace(str(part), str(target.folder)))


@contextmanager
def _leaving_nothing(folder: Path) -> Iterator[None]:
    """Take the folders above away again that an import made and left empty."""
    missing = [parent for parent in folder.parents if not parent.exists()]
    try:
        yield
    except BaseException:
        with suppress(OSError):
            for parent in missing:
                parent.rmdir()
        raise


def _bar(doing: str, total: int) -> tqdm:
    """Progress on a terminal, and on nothing else."""
    return tqdm(total=total or None, desc=doing, unit="", disable=None, leave=False)


def _rate_hz(times_ns: NDArray) -> float:
    if len(times_ns) < 2:
        raise ValueError(f"frames: expected at least 3 pairs of images, found {len(times_ns)}")
    return float(NANOSECONDS / np.median(np.diff(times_ns)))


def _depth_notes(content: Content, beyond: int, step_m: float) -> list[str]:
    floats = content.depth.form.encoding == METRES
    notes = []
    if floats or content.depth_unit_m < step_m:
        found = "floating-point depths" if floats else f"{1e6 * content.depth_unit_m:g} um"
        notes = [f"depth: {found} were rounded to counts of {1e6 * step_m:g} um"]
    if beyond:
        far = LARGEST_COUNT * step_m
        notes += [f"depth: {beyond} pixels beyond {far:.3f} m, left out (0)"]
    return notes


def _headline(target: Target, content: Content, frames: Pairs, force: pd.DataFrame | None) -> str:
    times_s = content.color.times_ns[frames.color] / NANOSECONDS
    line = f"{target.folder}: {len(times_s)} frames over {times_s[-1] - times_s[0]:.2f} s"
    line += f" ({content.color.name}, {content.depth.name};"
    line += f" stamps apart by at most {frames.farthest_ns / NS_PER_MS:.1f} ms)"
    return line if force is None else f"{line}, {len(force)} force samples"
