"""Whether a capture's pictures show the board, the object and plausible depths."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import cv2
import numpy as np
import pandas as pd
from numpy.typing import NDArray

from palpate.capture.depth import depth_of
from palpate.capture.examine_order import (
    board_corners,
    examine_order,
    grey_frame,
)
from palpate.capture.findings import Findings
from palpate.capture.images import read_image
from palpate.capture.tables import FRAMES, image_streams

# Frames in a row in which a hidden board is bridged.
LONGEST_LOST = 2
# A frame's grey levels.
DARKEST, BRIGHTEST = 15, 240
# Grey levels that tell a thing from the background, and parts of the picture it takes.
CHANGED, BLUR_PX = 20, 7
LEAST_CHANGED, MOST_CHANGED = 0.003, 0.6
# Times the usual time between frames.
LONGEST_GAP = 3.0
LEAST_DEPTH_SHARE = 0.3


def examine_frames(
    folder: Path,
    frames: pd.DataFrame,
    sensor: Mapping,
    *,
    marker: Mapping,
    background: NDArray | None,
) -> Findings:
    """Look into a capture's frames.

    Parameters
    ----------
    folder : Path
        ``raw/<object>/<sensor>/<capture>``.
    frames : DataFrame
        Its frames.csv, whose images are right by their size and kind.
    sensor : mapping
        The sensor's specification.
    marker : mapping
        Of the probe's specification.
    background : (h, w) uint8 array or None
        A grey frame of the background.

    Returns
    -------
    Findings
    """
    stream = next(iter(image_streams(sensor)))
    greys = [grey_frame(folder / name, sensor) for name in frames[stream]]
    corners = [board_corners(grey, marker) for grey in greys]
    found = _timing(folder, frames, greys[0].shape)
    found += _board(folder, corners, marker) + _light(folder, greys[0])
    if background is not None:
        found += _against_background(folder, greys[0], background)
    if "depth" in frames:
        found += _depths(folder, frames["depth"], sensor)
    return found + examine_order(folder, frames, corners, sensor, marker)


def _timing(folder: Path, frames: pd.DataFrame, shape: tuple[int, int]) -> Findings:
    time = frames["time_s"].to_numpy(float)
    steps = np.diff(time)
    usual, longest = float(np.median(steps)), float(steps.max())
    doubts = ()
    if longest > LONGEST_GAP * usual:
        expected = f"frames about {usual:.3f} s apart"
        doubts = (
            f"{folder / FRAMES}: time_s: expected {expected}, found a gap of {longest:.2f} s",
        )
    seconds = f"{time[-1] - time[0]:.2f} s"
    text = f"{len(frames)} frames over {seconds} ({1 / usual:.1f} Hz), {shape[1]} x {shape[0]} px"
    return Findings(doubts=doubts, found=(text,))


def _board(folder: Path, corners: Sequence[NDArray | None], marker: Mapping) -> Findings:
    """In how many frames the probe's checkerboard is seen whole."""
    size, seen = marker["inner_corners"], [found is not None for found in corners]
    text = f"board in {sum(seen)} of {len(seen)} frames"
    expected = f"the probe's board ({size[0]} x {size[1]} inner corners) whole"
    if not any(seen):
        line = f"{folder}: frames: expected {expected}, found it in none of {len(seen)}"
        return Findings((line,), found=(text,))
    doubts = [
        f"{folder}: frames: expected {expected} in the {end} frame, found none"
        for end, there in (("first", seen[0]), ("last", seen[-1]))
        if not there
    ]
    longest = max(len(run) for run in "".join("x."[there] for there in seen).split("."))
    if longest > LONGEST_LOST:
        found = f"none in {longest} frames in a row"
        doubts.append(f"{folder}: frames: expected {expected} in most frames, found {found}")
    return Findings(doubts=tuple(doubts), found=(text,))


def _light(folder: Path, grey: NDArray) -> Findings:
    level = float(grey.mean())
    if DARKEST <= level <= BRIGHTEST:
        return Findings()
    expected = f"grey levels of {DARKEST} to {BRIGHTEST} on average"
    return Findings(doubts=(f"{folder}: frames: expected {expected}, found {level:.0f}",))


def _against_background(folder: Path, grey: NDArray, background: NDArray) -> Findings:
    """Whether the first frame shows something new, and the scene is the background's."""
    smooth = [cv2.blur(image, (BLUR_PX, BLUR_PX)).astype(int) for image in (grey, background)]
    share = float((np.abs(smooth[0] - smooth[1]) > CHANGED).mean())
    if share < LEAST_CHANGED:
        expected = "object and probe, which the background must not hold"
        line = f"{folder}: frames: expected {expected}, found {share:.2%} of the picture changed"
        return Findings(doubts=(line,))
    if share > MOST_CHANGED:
        expected = "the background's scene (same place, same light)"
        line = f"{folder}: frames: expected {expected}, found {share:.0%} of the picture changed"
        return Findings(doubts=(line,))
    return Findings(found=(f"{share:.0%} of the picture new",))


def _depths(folder: Path, names: Sequence[str], sensor: Mapping) -> Findings:
    """Depths of the first frame's middle against the sensor's range."""
    depth = depth_of(
        read_image(folder / names.iloc[0], sensor["depth"]["encoding"]), sensor["depth"]
    )
    h, w = depth.shape
    middle = depth[h // 4 : -(h // 4), w // 4 : -(w // 4)]
    known = np.isfinite(middle)
    low, high = sensor["range_m"]
    if not known.any():
        return Findings((f"{folder}: depth: expected readings in the middle, found none",))
    typical, share = float(np.median(middle[known])), float(known.mean())
    if not low <= typical <= high:
        expected = f"{low:g} to {high:g} m (the sensor's range_m)"
        line = f"{folder}: depth: expected {expected}, found {typical:.3g} m in the middle"
        return Findings((f"{line} (what does a count stand for?)",))
    doubts = ()
    if share < LEAST_DEPTH_SHARE:
        expected = f"readings in {LEAST_DEPTH_SHARE:.0%} of the middle or more"
        doubts = (f"{folder}: depth: expected {expected}, found {share:.0%}",)
    return Findings(doubts=doubts, found=(f"depth in {share:.0%}, {typical:.2f} m",))
