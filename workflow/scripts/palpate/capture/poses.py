"""Poses of a tracked frame in a base frame: probe_poses.csv of a robot or an optical tracker."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Self

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import Akima1DInterpolator
from scipy.spatial.transform import Rotation, Slerp

from palpate.capture.tables import first_frame_s, number_text, read_table, write_table
from palpate.yaml_files import mismatch

POSES = "probe_poses.csv"
TIME, PLACE, QUATERNION = "time_s", ["x_m", "y_m", "z_m"], ["qw", "qx", "qy", "qz"]
NUMBERS = [TIME, *PLACE, *QUATERNION]
STD, VALID, NAMES = "std_m", "valid", ("base", "tracked")
FEWEST_POSES = 2
# Of quaternions rounded to three digits; ones that are none are farther off.
LENGTH_TOLERANCE = 0.01
# No arm and no tracker reaches farther [m].
FARTHEST_M = 30.0
# Poses that are farther apart say too little of the tip's path between them [s].
LARGEST_GAP_S = 0.1


@dataclass(frozen=True)
class PoseRecord:
    """Poses over time, at their own rate."""

    time_s: NDArray  # (n,), increasing [s]; of a capture, from its first frame
    base_from_tracked: NDArray  # (n, 4, 4), pose of the tracked frame in the base frame [m]
    # (n,), standard error of each pose's place [m] as the tracker says it; NaN where nobody does.
    std_m: NDArray
    base: str = ""  # names of both frames; empty where they are not named
    tracked: str = ""

    def filled(self, std_m: float) -> Self:
        """The record, with a standard error of the place [m] where it says none."""
        return replace(self, std_m=np.where(np.isfinite(self.std_m), self.std_m, std_m))

    def at(self, time_s: ArrayLike, *, largest_gap_s: float) -> tuple[NDArray, NDArray]:
        """Interpolate poses: places by straight lines, turns by SLERP.

        Parameters
        ----------
        time_s : (k,) array
            Times [s].
        largest_gap_s : float
            Between neighbours that are farther apart nothing is interpolated [s].

        Returns
        -------
        base_from_tracked : (k, 4, 4) array
            NaN inside a longer gap.
        std_m : (k,) array
            Standard error of the place [m]: the neighbours', and by how much a curve through the
            record leaves the straight line; NaN where the record has none, and inside a gap.

        Raises
        ------
        ValueError
            If a time is outside of the record: nothing is extrapolated.
        """
        times, known = np.atleast_1d(np.asarray(time_s, dtype=float)), self.time_s
        if len(times) and not (known[0] <= times.min() and times.max() <= known[-1]):
            found = f"{span(known)} s (nothing is extrapolated)"
            raise mismatch(TIME, f"poses that cover {span(times)} s", found)
        after = np.clip(np.searchsorted(known, times), 1, len(known) - 1)
        start, end = known[after - 1], known[after]
        lost = (end - start > largest_gap_s) & (times != start) & (times != end)
        places = self.base_from_tracked[:, :3, 3]
        poses = np.tile(np.eye(4), (len(times), 1, 1))
        turns = Slerp(known, Rotation.from_matrix(self.base_from_tracked[:, :3, :3]))
        poses[:, :3, :3] = turns(times).as_matrix()
        poses[:, :3, 3] = np.transpose([np.interp(times, known, axis) for axis in places.T])
        off_m = Akima1DInterpolator(known, places)(times) - poses[:, :3, 3]
        std_m = np.hypot(np.interp(times, known, self.std_m), np.linalg.norm(off_m, axis=1))
        poses[lost], std_m[lost] = np.nan, np.nan
        return poses, std_m


def read_poses(folder: str | Path) -> PoseRecord:
    """Read a folder's probe_poses.csv, without the rows that are not valid or have no numbers.

    Times count from the first frame where the folder has a frames.csv, as those of its frames and
    forces do.

    Raises
    ------
    ValueError
        That says in a line what is wrong: no table, columns, too few poses, times that do not
        increase, places that are no metres, quaternions that are not of length 1, two frames.
    """
    path = Path(folder) / POSES
    table = read_table(path, NUMBERS)

    def fault(column: str, expected: str, found: object) -> ValueError:
        return mismatch(f"{path}: {column}", expected, found)

    columns = [name for name in (*NUMBERS, STD, VALID) if name in table.columns]
    numbers = table[columns].apply(pd.to_numeric, errors="coerce").astype(float)
    for row, column in np.argwhere((numbers.isna() & table[columns].notna()).to_numpy())[:1]:
        name = columns[column]
        raise fault(name, "numbers, or nothing", f"{table[name][row]} in data row {row + 1}")
    used = np.isfinite(numbers[NUMBERS]).all(axis=1)
    used &= numbers[VALID] == 1 if VALID in columns else True
    rows, kept = np.flatnonzero(used) + 1, numbers[used]
    if len(kept) < FEWEST_POSES:
        raise fault("rows", f"at least {FEWEST_POSES} valid poses", len(kept))
    time_s, places, turns = (kept[name].to_numpy() for name in (TIME, PLACE, QUATERNION))
    for k in np.flatnonzero(np.diff(time_s) <= 0)[:1]:
        pair = " then ".join(map(number_text, time_s[k : k + 2]))
        raise fault(TIME, "increasing values", f"{pair} in data row {rows[k + 1]}")
    for k, axis in np.argwhere(np.abs(places) > FARTHEST_M)[:1]:
        words = f"metres, up to {FARTHEST_M:g}"
        raise fault(PLACE[axis], words, f"{places[k, axis]:g} in data row {rows[k]} (millimetres?)")
    length = np.linalg.norm(turns, axis=1)
    for k in np.flatnonzero(np.abs(length - 1) > LENGTH_TOLERANCE)[:1]:
        raise fault(", ".join(QUATERNION), "length 1", f"{length[k]:.4g} in data row {rows[k]}")
    std_m = kept[STD].to_numpy() if STD in columns else np.full(len(kept), np.nan)
    for k in np.flatnonzero(std_m <= 0)[:1]:
        raise fault(STD, "numbers above 0, or nothing", f"{std_m[k]:g} in data row {rows[k]}")
    named = {}
    for name in NAMES:
        found = table[name][used].dropna().map(str).unique() if name in table.columns else []
        if len(found) > 1:
            raise fault(name, "one frame in all rows", f"{found[0]} and {found[1]}")
        named[name] = str(found[0]) if len(found) else ""
    poses = np.tile(np.eye(4), (len(kept), 1, 1))
    poses[:, :3, :3] = Rotation.from_quat(turns, scalar_first=True).as_matrix()
    poses[:, :3, 3] = places
    return PoseRecord(time_s - first_frame_s(folder), poses, std_m, **named)


def write_poses(folder: str | Path, record: PoseRecord) -> None:
    """Write a record as probe_poses.csv into a folder, its times as they are."""
    turns = Rotation.from_matrix(record.base_from_tracked[:, :3, :3])
    numbers = [record.base_from_tracked[:, :3, 3], turns.as_quat(canonical=True, scalar_first=True)]
    table = pd.DataFrame(np.hstack(numbers), columns=[*PLACE, *QUATERNION])
    table.insert(0, TIME, record.time_s)
    if np.isfinite(record.std_m).any():
        table[STD] = record.std_m
    for name in NAMES:
        if getattr(record, name):
            table[name] = getattr(record, name)
    write_table(Path(folder) / POSES, table)


def span(time_s: NDArray) -> str:
    """First and last of increasing times, as messages name them."""
    return f"{number_text(np.min(time_s))} to {number_text(np.max(time_s))}"
