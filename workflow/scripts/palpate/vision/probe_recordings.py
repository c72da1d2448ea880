"""Poses of a probe by itself: of other programs or a run's probe_pose.csv, tracked, at rest."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import compress
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from palpate.capture.poses import POSES, read_poses
from palpate.capture.tables import WRENCH_COLUMNS, columns_of, read_table
from palpate.vision.force import block_mean, wrenches
from palpate.vision.probe import MARKER, QUATERNION, marker_columns, marker_transforms
from palpate.yaml_files import mismatch

UNITS = {"m": 1.0, "cm": 0.01, "mm": 0.001}
# Files are rounded by whoever writes them.
TOLERANCE = 1e-3
# An operator's probe changes its pose by little in it; a robot's record says more often.
STEP_S = 0.03
# Upwards in a base frame, unless another direction is given.
BASE_UP = np.array([0.0, 0.0, 1.0])
# An operator who holds a probe still trembles by less; frames farther off are of another pose.
STILL_DEG = 2.0
SHORTEST_S, LARGEST_GAP_S = 1.0, 0.5
# The operator comes to rest and leaves; clocks are apart by less.
MARGIN_S = 0.1
# A tremor is felt for so long: means over it are independent.
BLOCK_S = 0.1


def tracked_table(folder: str | Path, probe: Mapping) -> pd.DataFrame | None:
    """Poses of probe_poses.csv in a folder, as `palpate.vision.follow.board_followed` has them.

    They are of the tracked frame in the base frame, not those of a target in a camera's; of a
    record with more than some thirty in a second not all. None where there is no such file.

    Raises
    ------
    ValueError
        If they are of another frame than the probe's file names, or it names none but has a
        target; if there is no file and no target; or as `read_poses` does.
    """
    path = Path(folder) / POSES
    if not path.is_file():
        if "marker" not in probe:
            expected = f"poses (probe {probe['probe']} without marker)"
            raise mismatch(f"{path}: file", expected, "nothing")
        return None
    if "marker" in probe and "tracked" not in probe:
        expected = "a probe whose file names the tracked frame (tracked)"
        raise ValueError(f"{path}: tracked: expected {expected}, found a target's (marker)")
    record = read_poses(folder)
    if record.tracked and probe.get("tracked", record.tracked) != record.tracked:
        found = f"expected {probe['tracked']}, as the probe's file has it, found {record.tracked}"
        raise ValueError(f"{path}: tracked: {found} (poses of another tool?)")
    step = max(1, int(STEP_S / np.median(np.diff(record.time_s))))
    poses = marker_columns(record.base_from_tracked[::step])
    rows = {"frame": range(0, len(record.time_s), step), "time_s": record.time_s[::step]}
    return pd.DataFrame(rows).assign(detected=1).join(poses)


def stated_poses(source: Path, unit: str = "m") -> tuple[list[str], NDArray, list[str]]:
    """Names and poses camera_from_marker (n, 4, 4) of a folder of matrices, or of a table.

    Trackers write no numbers, or zeros, where they lost their target: the third are the names of
    those that are left out for it. Their z may point away from the target.

    Parameters
    ----------
    source : path
        Folder of text files with a matrix of 4 x 4 numbers in each, in the order of their names;
        or a CSV table with the columns of the marker's pose that probe_pose.csv has. Its rows are
        named by ``frame``, if it has that, and those with ``detected`` 0 are left out.
    unit : {"m", "cm", "mm"}
        Of the matrices' shifts; a table is in metres, as its columns say.

    Raises
    ------
    ValueError
        That names file and field, if there is no pose or a wrong one.
    """
    names, poses = _matrices(source, unit) if source.is_dir() else _rows(source)
    seen = np.isfinite(poses).all(axis=(1, 2)) & poses[:, :3, :3].any(axis=(1, 2))
    left_out = [*compress(names, ~seen)]
    names, poses = [name for name in names if name not in left_out], poses[seen]
    if not names:
        raise ValueError(f"{source}: poses: expected some, found {len(left_out)} that were lost")
    for name, pose in zip(names, poses, strict=True):
        turn = pose[:3, :3]
        rigid = np.allclose(turn @ turn.T, np.eye(3), atol=TOLERANCE) and np.linalg.det(turn) > 0
        if not rigid or not np.allclose(pose[3], [0, 0, 0, 1]):
            raise ValueError(f"{source}: {name}: expected a rotation and a shift, found another")
    return names, poses, left_out


def _matrices(folder: Path, unit: str) -> tuple[list[str], NDArray]:
    paths, poses = sorted(folder.glob("*.txt")), []
    if not paths:
        expected = "files *.txt of 4 x 4 numbers, or a recording's frames.csv"
        raise ValueError(f"{folder}: poses: expected {expected}, found none")
    for path in paths:
        try:
            pose = np.loadtxt(path, ndmin=2)
        except ValueError:
            raise ValueError(f"{path}: pose: expected 4 x 4 numbers, found others") from None
        if pose.shape != (4, 4):
            raise mismatch(f"{path}: pose", "4 x 4 numbers", " x ".join(map(str, pose.shape)))
        pose[:3, 3] *= UNITS[unit]
        poses.append(pose)
    return [path.stem for path in paths], np.array(poses)


def _rows(path: Path) -> tuple[list[str], NDArray]:
    table = read_table(path)
    if "detected" in table:
        table = table[table["detected"] == 1]
    names = table["frame"] if "frame" in table else range(len(table))
    poses, turns = np.full((len(table), 4, 4), np.nan), table.reindex(columns=QUATERNION)
    seen = ~(turns.isna().all(axis=1) | (turns == 0).all(axis=1)).to_numpy()
    try:
        poses[seen, :3, 3] = columns_of(table[seen], MARKER)
        if seen.any() or not len(seen):
            poses[seen, :3, :3] = _turns(table[seen])
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None
    poses[seen, 3] = [0, 0, 0, 1]
    return [str(name) for name in names], poses


def _turns(table: pd.DataFrame) -> NDArray:
    """Rotations camera_from_marker of a pose table, (n, 3, 3), at least one."""
    turns = columns_of(table, QUATERNION)
    lengths = np.linalg.norm(turns, axis=1)
    if (wrong := np.flatnonzero(np.abs(lengths - 1) > TOLERANCE)).size:
        found = f"found {lengths[wrong[0]]:g} in row {wrong[0]}"
        raise ValueError(f"{QUATERNION[0]}: expected quaternions of length 1, {found}")
    if not len(turns):
        raise ValueError(f"{QUATERNION[0]}: expected rows, found none")
    return Rotation.from_quat(turns).as_matrix()


@dataclass(frozen=True)
class StaticPoses:
    """Poses at rest and the mean readings at them."""

    names: Sequence[str]  # what errors call them
    turns: NDArray  # (n, 3, 3), rotations camera_from_marker
    wrench: NDArray  # (n, 6), of the force sensor [N, Nm]
    # (6,), standard deviation of each channel's mean, where it is known; of one that does not leave
    # a step of its numbers, at least that of a number that is rounded to it
    noise: NDArray | None = None


def static_poses(table: pd.DataFrame, record: pd.DataFrame, probe: Mapping) -> StaticPoses:
    """Poses of a second and more, in which the target stays within two degrees.

    Parameters
    ----------
    table, record : DataFrame
        Of `palpate.vision.follow.board_followed`, and force.csv of the recording.
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
    # Smallest step of each channel; of one that never changes, the largest of its kind.
    changes = (np.diff(np.unique(channel)) for channel in wrench.T)
    each = np.array([of.min() if len(of) else 0.0 for of in changes]).reshape(2, 3)
    steps = np.where(each > 0, each, each.max(axis=1, keepdims=True)).ravel()
    size = max(1, round(BLOCK_S / float(np.median(np.diff(time_s)))))
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
        still = f"the probe to be held still for {SHORTEST_S:g} s, within {STILL_DEG:g} degrees"
        raise mismatch("poses", f"{still} and with a force", "no such moment")
    if not steps.all():
        kind = "torques" if steps[0] else "forces"
        raise ValueError(f"force: expected {kind} that change with the pose, found one value")
    names, rotations, readings, squares = zip(*found, strict=True)
    # Noise that takes a channel over its steps makes the mean finer than one of them.
    coarse = np.median(shakes, axis=0) < steps / 2
    least = np.where(coarse, steps / np.sqrt(12), 0)
    noise = np.maximum(np.sqrt(np.mean(squares, axis=0)), least)
    return StaticPoses(names, np.array(rotations), np.array(readings), noise)


def stated_static_poses(path: Path) -> StaticPoses:
    """Poses of a table with a row for each: the target's rotation, and a wrench [N, Nm].

    Raises
    ------
    ValueError
        As `read_table` and `columns_of` do, or if there is no row, or a quaternion of another
        length than 1.
    """
    table = read_table(path)
    names = [f"row {k}" for k in range(1, len(table) + 1)]
    return StaticPoses(names, _turns(table), columns_of(table, WRENCH_COLUMNS))


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
