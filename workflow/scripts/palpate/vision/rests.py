"""Moments at which a film's board is at rest, and what the force sensor says at them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from palpate.vision.force import block_mean, wrenches
from palpate.vision.probe import marker_transforms

# A hand that holds a probe still trembles by less; frames farther off are of another pose.
STILL_DEG = 2.0
SHORTEST_S, LARGEST_GAP_S = 1.0, 0.5
# The hand comes to rest and leaves; clocks are apart by less.
MARGIN_S = 0.1
# A hand's tremor is felt for so long: means over it are independent.
BLOCK_S = 0.1


@dataclass(frozen=True)
class Rests:
    """Poses at rest and the mean readings at them.

    Attributes
    ----------
    names : sequence of str
    turns : (n, 3, 3) array
        Rotations camera_from_marker.
    wrench : (n, 6) array
        Of the force sensor [N, Nm].
    noise : (6,) array
        Standard deviation of each channel's mean; of one that does not leave a step of its numbers,
        at least that of a number that is rounded to it.
    """

    names: Sequence[str]
    turns: NDArray
    wrench: NDArray
    noise: NDArray


def film_rests(table: pd.DataFrame, record: pd.DataFrame, probe: Mapping) -> Rests:
    """Rests of a film, of the poses that `palpate.vision.follow.board_followed` gives.

    Raises
    ------
    ValueError
        As `find_rests` and `palpate.vision.force.wrenches` do.
    """
    _, wrench = wrenches(record, probe)
    times = table["frame"].to_numpy(), table["time_s"].to_numpy(float)
    turns = marker_transforms(table)[:, :3, :3]
    return find_rests(*times, turns, record["time_s"].to_numpy(float), wrench)


def find_rests(
    frame: NDArray, frame_time_s: NDArray, turns: NDArray, time_s: NDArray, wrench: NDArray
) -> Rests:
    """Rests of a second and more, in which the board stays within two degrees.

    Parameters
    ----------
    frame : (n,) array
        Numbers of the frames that show the board.
    frame_time_s : (n,) array
    turns : (n, 3, 3) array
        Rotations camera_from_marker.
    time_s : (m,) array
        Of the samples, on the same clock.
    wrench : (m, 6) array

    Raises
    ------
    ValueError
        If there is no rest that has a force, or forces or torques never change.
    """
    steps, size = _steps(wrench), max(1, round(BLOCK_S / float(np.median(np.diff(time_s)))))
    found, shakes = [], []
    for part in _still(frame_time_s, turns):
        start, end = frame_time_s[part[0]] + MARGIN_S, frame_time_s[part[-1]] - MARGIN_S
        inside = wrench[(time_s >= start) & (time_s <= end)]
        means = block_mean(inside, size)
        if len(means) > 1:
            mean = Rotation.from_matrix(turns[part]).mean().as_matrix()
            square = means.var(axis=0, ddof=1) / len(means)
            shakes.append(inside.std(axis=0))
            found.append(
                (f"frames {frame[part[0]]} to {frame[part[-1]]}", mean, means.mean(axis=0), square)
            )
    if not found:
        raise ValueError(
            f"poses: expected the probe to be held still for {SHORTEST_S:g} s, within"
            f" {STILL_DEG:g} degrees and with a force, found no such moment"
        )
    if not steps.all():
        kind = "torques" if steps[0] else "forces"
        raise ValueError(f"force: expected {kind} that change with the pose, found one value")
    names, rotations, readings, squares = zip(*found, strict=True)
    # Noise that takes a channel over its steps makes the mean finer than one of them.
    coarse = np.median(shakes, axis=0) < steps / 2
    floor = np.where(coarse, steps / np.sqrt(12), 0)
    noise = np.maximum(np.sqrt(np.mean(squares, axis=0)), floor)
    return Rests(names, np.array(rotations), np.array(readings), noise)


def _steps(wrench: NDArray) -> NDArray:
    """Smallest step of each channel, (6,); of one that never changes, the largest of its kind."""
    changes = (np.diff(np.unique(channel)) for channel in wrench.T)
    each = np.array([found.min() if len(found) else 0.0 for found in changes]).reshape(2, 3)
    return np.where(each > 0, each, each.max(axis=1, keepdims=True)).ravel()


def _still(time_s: NDArray, turns: NDArray) -> list[NDArray]:
    """Frames of each rest: those near the first one's neighbours, until one is not."""
    parts, begin = [], 0
    for k in range(1, len(time_s) + 1):
        if k < len(time_s) and time_s[k] - time_s[k - 1] <= LARGEST_GAP_S:
            mean = Rotation.from_matrix(turns[begin:k]).mean()
            away = (mean.inv() * Rotation.from_matrix(turns[k])).magnitude()
            if np.degrees(away) <= STILL_DEG:
                continue
        parts.append(np.arange(begin, k))
        begin = k
    return [part for part in parts if time_s[part[-1]] - time_s[part[0]] >= SHORTEST_S]
