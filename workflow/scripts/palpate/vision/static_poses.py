"""Static poses of a recording: moments at which the target rests, and the wrench at them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from palpate.vision.force import block_mean, wrenches
from palpate.vision.probe import marker_transforms

# An operator who holds a probe still trembles by less; frames farther off are of another pose.
STILL_DEG = 2.0
SHORTEST_S, LARGEST_GAP_S = 1.0, 0.5
# The operator comes to rest and leaves; clocks are apart by less.
MARGIN_S = 0.1
# A tremor is felt for so long: means over it are independent.
BLOCK_S = 0.1


@dataclass(frozen=True)
class StaticPoses:
    """Poses at rest and the mean readings at them.

    Attributes
    ----------
    names : sequence of str
        What errors call them.
    turns : (n, 3, 3) array
        Rotations camera_from_marker.
    wrench : (n, 6) array
        Of the force sensor [N, Nm].
    noise : (6,) array or None, optional
        Standard deviation of each channel's mean, where it is known; of one that does not leave a
        step of its numbers, at least that of a number that is rounded to it.
    """

    names: Sequence[str]
    turns: NDArray
    wrench: NDArray
    noise: NDArray | None = None


def static_poses(table: pd.DataFrame, record: pd.DataFrame, probe: Mapping) -> StaticPoses:
    """Poses of a second and more, in which the target stays within two degrees.

    Parameters
    ----------
    table : DataFrame
        Of `palpate.vision.follow.board_followed`.
    record : DataFrame
        force.csv of the recording.
    probe : mapping
        With ``gauge`` where the record is volts.

    Raises
    ------
    ValueError
        If there is no such pose that has a force, or forces or torques never change, or as
        `palpate.vision.force.wrenches` does.
    """
    _, wrench = wrenches(record, probe)
    time_s, frame_s = (of["time_s"].to_numpy(float) for of in (record, table))
    turns, frame = marker_transforms(table)[:, :3, :3], table["frame"].to_numpy()
    steps, size = _steps(wrench), max(1, round(BLOCK_S / float(np.median(np.diff(time_s)))))
    found, shakes = [], []
    for first, last in _still(frame_s, turns):
        start, end = frame_s[first] + MARGIN_S, frame_s[last] - MARGIN_S
        inside = wrench[(time_s >= start) & (time_s <= end)]
        means = block_mean(inside, size)
        if len(means) > 1:
            turn = Rotation.from_matrix(turns[first : last + 1]).mean().as_matrix()
            square = means.var(axis=0, ddof=1) / len(means)
            shakes.append(inside.std(axis=0))
            name = f"frames {frame[first]} to {frame[last]}"
            found.append((name, turn, means.mean(axis=0), square))
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
    least = np.where(coarse, steps / np.sqrt(12), 0)
    noise = np.maximum(np.sqrt(np.mean(squares, axis=0)), least)
    return StaticPoses(names, np.array(rotations), np.array(readings), noise)


def _steps(wrench: NDArray) -> NDArray:
    """Smallest step of each channel, (6,); of one that never changes, the largest of its kind."""
    changes = (np.diff(np.unique(channel)) for channel in wrench.T)
    each = np.array([found.min() if len(found) else 0.0 for found in changes]).reshape(2, 3)
    return np.where(each > 0, each, each.max(axis=1, keepdims=True)).ravel()


def _still(time_s: NDArray, turns: NDArray) -> list[tuple[int, int]]:
    """First and last frame of each rest: those near the mean of those before, until one is not."""
    parts, begin = [], 0
    for k in range(1, len(time_s) + 1):
        if k < len(time_s) and time_s[k] - time_s[k - 1] <= LARGEST_GAP_S:
            mean = Rotation.from_matrix(turns[begin:k]).mean()
            away = (mean.inv() * Rotation.from_matrix(turns[k])).magnitude()
            if np.degrees(away) <= STILL_DEG:
                continue
        parts.append((begin, k - 1))
        begin = k
    return [(first, last) for first, last in parts if time_s[last] - time_s[first] >= SHORTEST_S]
