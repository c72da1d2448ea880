"""Poses of a board as other programs or a run's probe_pose.csv state them."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from palpate.capture.tables import columns_of, read_table
from palpate.vision.probe import MARKER, QUATERNION

UNITS = {"m": 1.0, "cm": 0.01, "mm": 0.001}
# Files are rounded by whoever writes them.
TOLERANCE = 1e-3


def read_poses(source: Path, unit: str = "m") -> tuple[Sequence[str], NDArray]:
    """Names and poses camera_from_marker (n, 4, 4) of a folder of matrices, or of a table.

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
        That names file and field, if there is no pose or a wrong one, or a table's board lies
        behind the camera; of what else tracks a board, z may point anywhere.
    """
    names, poses = _matrices(source, unit) if source.is_dir() else _rows(source)
    for name, pose in zip(names, poses, strict=True):
        turn = pose[:3, :3]
        rigid = np.allclose(turn @ turn.T, np.eye(3), atol=TOLERANCE) and np.linalg.det(turn) > 0
        if not rigid or not np.allclose(pose[3], [0, 0, 0, 1]):
            raise ValueError(f"{source}: {name}: expected a rotation and a shift, found another")
    return names, poses


def _matrices(folder: Path, unit: str) -> tuple[Sequence[str], NDArray]:
    paths = sorted(folder.glob("*.txt"))
    if not paths:
        expected = "files *.txt of 4 x 4 numbers, or a film's frames.csv"
        raise ValueError(f"{folder}: poses: expected {expected}, found none")
    poses = np.array([_matrix(path) for path in paths])
    poses[:, :3, 3] *= UNITS[unit]
    return [path.stem for path in paths], poses


def _matrix(path: Path) -> NDArray:
    try:
        pose = np.loadtxt(path, ndmin=2)
    except ValueError:
        raise ValueError(f"{path}: pose: expected 4 x 4 numbers, found others") from None
    if pose.shape != (4, 4) or not np.isfinite(pose).all():
        found = " x ".join(map(str, pose.shape))
        raise ValueError(f"{path}: pose: expected 4 x 4 finite numbers, found {found}")
    return pose


def _rows(path: Path) -> tuple[Sequence[str], NDArray]:
    table = read_table(path)
    if "detected" in table:
        table = table[table["detected"] == 1]
    try:
        poses = np.tile(np.eye(4), (len(table), 1, 1))
        poses[:, :3, :3] = turns_of(table)
        poses[:, :3, 3] = columns_of(table, MARKER)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None
    if (behind := np.flatnonzero(poses[:, 2, 3] <= 0)).size:
        raise ValueError(
            f"{path}: {MARKER[2]}: expected a board before the camera, above 0, found"
            f" {poses[behind[0], 2, 3]:g} in row {behind[0]} (camera from board, or the other way?)"
        )
    names = table["frame"] if "frame" in table else range(len(table))
    return [str(name) for name in names], poses


def turns_of(table: pd.DataFrame) -> NDArray:
    """Rotations camera_from_marker of a pose table, (n, 3, 3).

    Raises
    ------
    ValueError
        If there are none, or a quaternion is not of length 1.
    """
    turns = columns_of(table, QUATERNION)
    lengths = np.linalg.norm(turns, axis=1)
    if (wrong := np.flatnonzero(np.abs(lengths - 1) > TOLERANCE)).size:
        found = f"found {lengths[wrong[0]]:g} in row {wrong[0]}"
        raise ValueError(f"{QUATERNION[0]}: expected quaternions of length 1, {found}")
    if not len(turns):
        raise ValueError(f"{QUATERNION[0]}: expected rows, found none")
    return Rotation.from_quat(turns).as_matrix()
