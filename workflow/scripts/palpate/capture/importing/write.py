"""Make a capture of a recording: whole, checked, or not at all."""

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace
from hashlib import sha256
from itertools import pairwise
from pathlib import Path

import numpy as np
import pandas as pd
import yaml
from numpy.typing import NDArray

from palpate.capture.check_capture import (
    FEWEST_BACKGROUND_FRAMES,
    FEWEST_FRAMES,
    check_capture,
    check_images,
)
from palpate.capture.discover import BACKGROUND
from palpate.capture.experiments import check_tracked
from palpate.capture.files import whole_folder, write_text
from palpate.capture.images import count_m, write_image
from palpate.capture.importing.optics import sensor_of
from palpate.capture.importing.pixels import METRES
from palpate.capture.importing.pose_files import Poses
from palpate.capture.importing.recording import (
    NANOSECONDS,
    NS_PER_MS,
    Content,
    ForceTable,
    Pairs,
    Recording,
    Request,
    frames_of,
    is_capture,
    progress,
)
from palpate.capture.importing.transforms import placed
from palpate.capture.poses import write_poses
from palpate.capture.tables import write_force, write_frames
from palpate.yaml_files import mismatch

LARGEST_COUNT = 65535
# Between camera and bench lies so much.
BENCH_M = (0.2, 1.5)
# One of so many rows and columns is enough for the median depth.
EVERY = 4


def import_recording(
    recording: Recording,
    request: Request,
    force: ForceTable | None = None,
    poses: Poses | None = None,
) -> list[str]:
    """Write a recording as a capture: what was found and written, and what left out, a line each.

    Force is the table of force.csv and notes on it, if the recording itself holds no wrench;
    without any, the capture has none. Poses are the probe's, in place of a target in the images.

    Raises
    ------
    ValueError
        If the recording makes no capture; nothing is left behind then.
    """
    kept = "" if request.folder.name == BACKGROUND else BACKGROUND
    whole = whole_folder(request.folder, replace=False, kept=kept)
    with _leaving_nothing(request.folder), whole as part:
        content = recording.survey()
        table, notes = force or (content.force, ())
        if table is not None and request.force_offset_s:
            table = table.assign(time_s=table["time_s"] + request.force_offset_s)
        covers = {} if table is None else {"force": table["time_s"].to_numpy()}
        covers |= {} if poses is None else {"poses": poses.record.time_s}
        frames, covered = frames_of(content, covers, request.pairing_ms)
        times_ns = content.color.times_ns[frames.color]
        if len(times_ns) < 2:
            raise mismatch("frames", "at least 3 pairs of images", len(times_ns))
        block, placed_so = placed(poses, content.frame) if poses else ({}, ())
        if content.cameras and block:
            content = replace(content, cameras=content.cameras | {"base": block})
        sensor, text = sensor_of(request, content, NANOSECONDS / np.median(np.diff(times_ns)))
        if poses:
            covered += [*poses.notes, *placed_so]
            write_poses(part, poses.record)
        captured = is_capture(request.folder)
        if block and "base" not in sensor and captured:
            offered = yaml.safe_dump(block, default_flow_style=True, width=np.inf).strip()
            raise mismatch(f"{request.sensor_file}: base", f"where it is, like {offered}", "none")
        frames, left = _write(part, recording, content, frames, sensor)
        if table is not None:
            write_force(part, table)
        if table is not None and (captured or not poses):
            problems = check_capture(part, sensor)
        else:
            problems = check_images(part, sensor, fewest=FEWEST_BACKGROUND_FRAMES)
        if poses and not captured:  # whatever the base is
            problems += check_tracked(part, has_force=table is not None)
        if problems:
            raise ValueError(problems[0].replace(str(part), str(request.folder)))
        if text:
            write_text(request.sensor_file, text)
    times_s = content.color.times_ns[frames.color] / NANOSECONDS
    headline = f"{request.folder}: {len(times_s)} frames over {times_s[-1] - times_s[0]:.2f} s"
    headline += f" ({content.color.name}, {content.depth.name};"
    headline += f" stamps apart by at most {frames.farthest_ns / NS_PER_MS:.1f} ms)"
    headline += "" if table is None else f", {len(table)} force samples"
    made = [f"{request.sensor_file}: written, from the recording's optics"] if text else []
    return [headline, *content.notes, *notes, *covered, *left, *made]


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


def _write(
    part: Path, recording: Recording, content: Content, frames: Pairs, sensor: dict
) -> tuple[Pairs, list[str]]:
    """Write frames.csv and the images; gives the frames that were kept, and notes on others."""
    count, far_m = len(frames.color), LARGEST_COUNT * count_m(sensor["depth"])
    names = {kind: [f"{kind}/{k:06d}.png" for k in range(count)] for kind in ("color", "depth")}
    digests, beyond, depth_m = _write_images(part, recording, content, frames, names, sensor)
    if depth_m > far_m:
        found = f"{depth_m:.4g} (is it in mm? --depth-unit 0.001)"
        raise mismatch("depth", f"a median of up to {far_m:.3g} m", found)
    # A camera that lost an image may hand out its last again.
    same = {
        kind: np.array([False, *(one == other != b"" for one, other in pairwise(found))])
        for kind, found in digests.items()
    }
    repeats = same["color"] | same["depth"]
    kept = int(count - repeats.sum())
    if kept < FEWEST_FRAMES and kept < count:
        expected = f"at least {FEWEST_FRAMES} that differ from the one before"
        raise mismatch("frames", expected, f"{kept} of {count}")
    for files in map(np.array, names.values()):
        for file in files[repeats]:
            (part / file).unlink()
        for file, before in zip(files, files[~repeats], strict=False):
            (part / before).rename(part / file)
    times_s = content.color.times_ns[frames.color] / NANOSECONDS
    columns = {kind: files[:kept] for kind, files in names.items()}
    table = {"frame": np.arange(kept), "time_s": times_s[~repeats], **columns}
    write_frames(part, pd.DataFrame(table))
    notes = []
    if repeats.any():
        first = int(np.argmax(repeats))
        kinds = " and ".join(kind for kind, found in same.items() if found[first])
        notes.append(f"frames: {repeats.sum()} of {count} repeat an image of the frame before,"
                     f" left out, the first ({kinds}) at {times_s[first]:.3f} s")  # fmt: skip
    notes += _depth_notes(content, int(beyond[~repeats].sum()), depth_m, sensor)
    return replace(frames, color=frames.color[~repeats], depth=frames.depth[~repeats]), notes


def _write_images(
    part: Path, recording: Recording, content: Content, frames: Pairs, names: dict, sensor: dict
) -> tuple[dict[str, list[bytes]], NDArray, float]:
    """Write images; gives their digests, depths beyond 16 bits in each, and the median [m]."""
    count = len(frames.color)
    frame_of = {
        kind: {index: k for k, index in enumerate(getattr(frames, kind).tolist())} for kind in names
    }
    digests = {kind: [b""] * count for kind in names}
    beyond, medians = np.zeros(count, dtype=int), np.zeros(count)
    for kind in names:
        (part / kind).mkdir()
    with progress("writing", 2 * count) as bar:
        for kind, index, pixels in recording.pictures():
            if (k := frame_of[kind].get(index)) is None:
                continue
            if kind == "depth":
                few = pixels[::EVERY, ::EVERY]
                seen = few[np.isfinite(few) & (few > 0)]
                medians[k] = np.median(seen) if seen.size else 0
                pixels, beyond[k] = _counted(pixels, content.depth_unit_m, count_m(sensor["depth"]))
            digests[kind][k] = sha256(np.ascontiguousarray(pixels)).digest()
            write_image(part / names[kind][k], pixels, getattr(content, kind).form.stored)
            bar.update()
    return digests, beyond, float(np.median(medians)) * content.depth_unit_m


def _counted(depth: NDArray, unit_m: float, step_m: float) -> tuple[NDArray, int]:
    """Depth in whole counts, 0 where there is none, and how many are beyond 16 bits (0 too)."""
    if depth.dtype == np.uint16 and unit_m == step_m:
        return depth, 0
    values = depth.astype(float) * (unit_m / step_m)
    rounded = np.rint(np.where(np.isfinite(values) & (values > 0), values, 0))
    beyond = rounded > LARGEST_COUNT
    return np.where(beyond, 0, rounded).astype(np.uint16), int(beyond.sum())


def _depth_notes(content: Content, beyond: int, depth_m: float, sensor: dict) -> Iterator[str]:
    """Say what a count was taken as, what was lost, and whether the median depth is plausible."""
    step_m, unit_m = count_m(sensor["depth"]), content.depth_unit_m
    floats = content.depth.form.encoding == METRES
    if floats or unit_m < step_m:
        found = "floating-point depths" if floats else f"{1e6 * unit_m:g} um"
        yield f"depth: {found} were rounded to counts of {1e6 * step_m:g} um"
    if beyond:
        yield f"depth: {beyond} pixels beyond {LARGEST_COUNT * step_m:.3f} m, left out (0)"
    said = f"{1e3 * unit_m:.4g} mm ({content.depth_unit_from})"
    yield f"depth: one count is {said}, which makes a median of {depth_m:.3g} m"
    if not BENCH_M[0] <= depth_m <= BENCH_M[1]:
        others = "a D405 may count 0.1 mm, an L515 0.25 mm, a folder 1000 in a metre"
        said = "depth: worth a look: few benches are so far"
        yield f"{said}; {others} (--depth-unit)"
    near_m, far_m = sensor["range_m"]
    if not near_m <= depth_m <= far_m:
        yield f"depth: that is not in the sensor's range_m, {near_m:g} to {far_m:g} m"
