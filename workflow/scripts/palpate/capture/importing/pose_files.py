"""Poses out of text: NDI's, OptiTrack's and Vicon's exports, TUM's lines and probe_poses.csv."""

import csv
import re
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import accumulate, islice, pairwise, takewhile
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform, Rotation

from palpate.capture.importing.recording import Request, named, shown
from palpate.capture.poses import FEWEST_POSES, LENGTH_TOLERANCE, NUMBERS, PLACE, POSES, PoseRecord
from palpate.yaml_files import mismatch

if TYPE_CHECKING:
    from palpate.capture.importing.transforms import Tree

# What a column holds: a quaternion or a rotation vector, and a place.
XYZW, VECTOR, SHIFT = ["qx", "qy", "qz", "qw"], ["rx", "ry", "rz"], ["tx", "ty", "tz"]
# Columns of probe_poses.csv and of Vicon, and patterns of NDI's, as what they hold.
OWN = dict(zip(PLACE, SHIFT, strict=True))
OWN |= {"time_s": "time", "std_m": "error", "valid": "state", "tracked": "name"}
VICON = dict(zip((*VECTOR, "rw"), XYZW, strict=True))
NDI = {r"time(stamp)?[\W_]*(s|sec|seconds)?\W*": "time", r"(transform ?)?(state|status)": "state"}
NDI |= {r"(tool ?(info|name|handle)?|port.*)": "name", "q0": "qw", "frame.*": "frame"}
# As Motive and Vicon write them.
LENGTHS = {"mm": 1e-3, "cm": 0.01, "m": 1.0}
MOTIVE = {"Millimeters": "mm", "Centimeters": "cm", "Meters": "m"}
ANGLES = {"deg": np.pi / 180, "rad": 1.0}
# What stands in place of numbers, and what trackers say of poses that count.
LOST, GOOD = ("", "missing", "nan", "-", "n/a"), ("", "ok", "enabled", "valid", "true", "1", "1.0")
MOST_HEAD = 20
Rows = list[list[str]]


@dataclass(frozen=True)
class Poses:
    """Poses that an import found, notes on them, and all frames if they are of a bag."""

    record: PoseRecord
    notes: tuple[str, ...]
    tree: "Tree | None" = None


@dataclass(frozen=True)
class Sheet:
    """Cells of a text, what each column holds, whose it is, and units; one reader takes them."""

    rows: Rows
    roles: list[str]
    whose: list[str]
    metre: float = 1.0
    radian: float = 1.0
    rate_hz: float | None = None

    def tools(self) -> dict[str, pd.DataFrame]:
        """Texts of each tool by name, columns by what they hold."""
        width = len(self.roles)
        rows = [(row + [""] * width)[:width] for row in self.rows if any(row)]
        cells, found = pd.DataFrame(rows, columns=range(width), dtype=str), {}
        for tool in dict.fromkeys(self.whose):
            own = [k for k, one in enumerate(self.whose) if one == tool]
            # Whose times stand apart.
            own += [k for k, role in enumerate(self.roles) if role in ("time", "frame")]
            table = cells[own].set_axis([self.roles[k] for k in own], axis=1)
            table = table.loc[:, ~table.columns.duplicated()]
            if {"tx", "ty", "tz"} <= {*table.columns}:
                names = [one for one in table.get("name", pd.Series()).unique() if one]
                found |= {name: table[table["name"] == name] for name in names} or {tool: table}
        return found


def read_pose_file(path: Path, request: Request) -> Poses:
    """Poses of one tool of a tracker's export, of a TUM trajectory or of a probe_poses.csv.

    Of the request, ``tracked`` names the tool where there are several, ``base`` the base frame.

    Raises
    ------
    ValueError
        If it is none of them, a unit is not named, the tool is not there, or its poses are none.
    """
    with named(path):
        rows = _rows(path)
        sheet = _own(rows) or _ndi(rows) or _motive(rows) or _vicon(rows) or _tum(rows)
        if sheet is None:
            known = f"{POSES}, an export of NDI, Motive or Vicon with its header, or lines of"
            raise mismatch("file", f"{known} timestamp tx ty tz qx qy qz qw", "none of them")
        tools = sheet.tools()
        tool = _tool(list(tools), request.tracked)
        table = tools[tool]
        turn = XYZW if "qw" in table else VECTOR
        if missing := sorted({*turn} - {*table.columns}):
            raise mismatch(f"columns of {shown(tool)}", "a quaternion", f"no {missing[0]}")
        bases = sorted({*table.get("base", ())} - {""})
        base = request.base or "".join(bases[:1])
        if bases and bases != [base]:
            raise mismatch("base", f"{base} (--base)", ", ".join(map(shown, bases)))
        values = _numbers(table[[*turn, *SHIFT]])
        # A lost tool is written as zeros, too.
        values[~values.any(axis=1)] = np.nan
        if "state" in table:
            values[~table["state"].str.lower().isin(GOOD).to_numpy()] = np.nan
        turns, shifts = values[:, :-3], values[:, -3:] * sheet.metre
        if turn is VECTOR:
            known = np.isfinite(turns).all(axis=1)
            vectors, turns = turns[known] * sheet.radian, np.full((len(turns), 4), np.nan)
            turns[known] = Rotation.from_rotvec(vectors).as_quat()
        std_m = _numbers(table[["error"]])[:, 0] * sheet.metre if "error" in table else None
        time_s = _seconds(sheet, table, request.poses_rate_hz)
        return pose_record(time_s, np.hstack([turns, shifts]), base, request.tracked or tool, std_m)


def pose_record(
    time_s: NDArray, values: NDArray, base: str, tracked: str, std_m: NDArray | None = None
) -> Poses:
    """Poses in the order of their times, without those that a tracker lost.

    Parameters
    ----------
    time_s : (n,) array
        Times [s].
    values : (n, 7) array
        x, y, z, w of the quaternion and the place [m] in the base frame; NaN where it was lost.
    base, tracked : str
        Names of the frames.
    std_m : (n,) array, optional
        Standard error of the place [m], where the tracker says it.

    Raises
    ------
    ValueError
        If too few are left, or a quaternion is none.
    """
    known = np.flatnonzero(np.isfinite(time_s) & np.isfinite(values).all(axis=1))
    if len(known) < FEWEST_POSES:
        found = f"{len(known)} of {len(time_s)} rows"
        raise mismatch("poses", f"at least {FEWEST_POSES} that were not lost", found)
    times, first = np.unique(time_s[known], return_index=True)
    kept = known[first]
    std_m = np.full(len(time_s), np.nan) if std_m is None else np.where(std_m > 0, std_m, np.nan)
    record = PoseRecord(times, rigid(values[kept]), std_m[kept], base, tracked)
    notes = [f"poses: {len(kept)} of {shown(tracked) or 'one frame'} in {shown(base) or 'a base'}"]
    if lost := len(time_s) - len(known):
        notes.append(f"poses: {lost} of {len(time_s)} lost or flagged by the tracker, left out")
    if twice := len(known) - len(kept):
        notes.append(f"poses: {twice} repeat a stamp, left out")
    return Poses(record, tuple(notes))


def rigid(values: NDArray) -> NDArray:
    """Transforms (n, 4, 4) of (n, 7) numbers: x, y, z, w of quaternions and shifts [m].

    Raises
    ------
    ValueError
        If a quaternion is not of length 1, or a number is not finite.
    """
    turns, shifts = values[:, :4], values[:, 4:]
    length = np.linalg.norm(turns, axis=1)
    wrong = ~(np.isfinite(shifts).all(axis=1) & (np.abs(length - 1) <= LENGTH_TOLERANCE))
    for k in np.flatnonzero(wrong)[:1]:
        found = f"length {length[k]:g}, {shifts[k]} (normalise what the columns hold, if right)"
        raise mismatch("transform", "a unit quaternion and metres", found)
    return RigidTransform.from_components(shifts, Rotation.from_quat(turns)).as_matrix()


def _rows(path: Path) -> Rows:
    """Cells of each line that is no comment, whatever separates them."""
    try:
        text = path.read_text(encoding="utf-8-sig").splitlines()
        lines = [one for one in text if "Q0" in one or not one.startswith("#")]
        head = "".join(lines[:MOST_HEAD])
        mark = max("\t;,", key=head.count)
        if mark not in head:
            return [line.split() for line in lines]
        cells = csv.reader(lines, delimiter=mark)
        return [[cell.strip().lstrip("#").replace(",", ".") for cell in row] for row in cells]
    except (UnicodeDecodeError, csv.Error):
        raise mismatch("file", "text", "other bytes") from None


def _numbers(texts: pd.DataFrame) -> NDArray:
    """Columns as numbers, (n, k), NaN where a cell says that there is none."""
    numbers = texts.apply(pd.to_numeric, errors="coerce").to_numpy(dtype=float, copy=True)
    for row, column in np.argwhere(np.isnan(numbers)):
        if (found := texts.iat[row, column]).lower() not in LOST:
            raise mismatch(f"pose {row + 1}", "numbers, or nothing", shown(found))
    return numbers


def _seconds(sheet: Sheet, table: pd.DataFrame, given_hz: float | None) -> NDArray:
    """Times [s]: as they are stated, or of frames at a rate."""
    if "time" in table:
        return _numbers(table[["time"]])[:, 0]
    rate_hz = sheet.rate_hz or given_hz or 0.0
    if "frame" not in table or not 0 < rate_hz < np.inf:
        expected = "a column of seconds, or --poses-rate (60 of a Polaris, 40 of an Aurora)"
        raise mismatch("time", expected, "frames without their rate")
    return _numbers(table[["frame"]])[:, 0] / rate_hz


def _tool(tools: list[str], tracked: str | None) -> str:
    """The tool that was asked for, or the only one."""
    found = [one for one in tools if tracked in (None, one, one.rpartition(":")[2])]
    found = found or [one for one in tools if not one]
    if len(found) != 1:
        wanted = f"{tracked} (--tracked)" if tracked else "one, named by --tracked"
        raise mismatch("tools", wanted, ", ".join(map(shown, tools)) or "none")
    return found[0]


def _unit(text: str, known: Mapping[str, float], remedy: str) -> float:
    """What one of a named unit is."""
    if text not in known:
        raise mismatch("unit", f"{' or '.join(known)} ({remedy})", shown(text) or "none named")
    return known[text]


def _own(rows: Rows) -> Sheet | None:
    """probe_poses.csv of the capture format."""
    head = rows[0] if rows else []
    if not set(NUMBERS) <= set(head):
        return None
    return Sheet(rows[1:], [OWN.get(name, name) for name in head], [""] * len(head))


def _ndi(rows: Rows) -> Sheet | None:
    """NDI's Track, ToolBox and API: columns for each tool, or rows of them, in millimetres."""
    heads = [[cell.lower() for cell in row] for row in rows[:MOST_HEAD]]
    first = next((k for k, row in enumerate(heads) if "q0" in row), None)
    if first is None:
        return None
    roles = [
        next((role for one, role in NDI.items() if re.fullmatch(one, cell)), cell)
        for cell in heads[first]
    ]
    # A tool's columns begin with the first name after the quaternion of the one before.
    whose, last = [0], ""
    for role in roles:
        whose.append(whose[-1] + (role == "name" != last))
        last = role if role in ("name", "qw") else last
    return Sheet(rows[first + 1 :], roles, list(map(str, whose[1:])), LENGTHS["mm"])


def _motive(rows: Rows) -> Sheet | None:
    """OptiTrack Motive: types, names and parts above the row ``Frame,Time (Seconds)``."""
    if not rows or rows[0][:1] != ["Format Version"]:
        return None
    stated = dict(pairwise(rows[0]))
    if (turn := stated.get("Rotation Type", "none")) != "Quaternion":
        raise mismatch("Rotation Type", "Quaternion (export it so)", shown(turn))
    unit = stated.get("Length Units", "")
    metre = _unit(MOTIVE.get(unit, unit), LENGTHS, "Length Units in the first row")
    axis = next((k for k, row in enumerate(rows) if row[:1] == ["Frame"]), 0)
    kind = next((k for k, row in enumerate(rows[:axis]) if "Rigid Body" in row), axis)
    above = zip(rows[kind], rows[kind + 1], rows[axis - 1], rows[axis], strict=False)
    roles, whose = ["frame", "time"], ["", ""]
    for of, name, part, side in islice(above, 2, None):
        role = {"Rotation": "q", "Position": "t"}.get(part, "error ") + side.lower()
        roles.append(role.strip() if of == "Rigid Body" else "")
        whose.append(name if of == "Rigid Body" else "")
    return Sheet(rows[axis + 1 :], roles, whose, metre)


def _vicon(rows: Rows) -> Sheet | None:
    """Vicon Tracker's objects and Nexus's segments: names, columns and units in three rows."""
    heads = [[cell.lower() for cell in row] for row in rows]
    found = (k for k, row in enumerate(heads) if row[:1] == ["frame"] and {"rx", "tx"} <= {*row})
    if not (first := next(found, 0)):
        return None
    head, units = heads[first], rows[first + 1]
    names = [*accumulate(rows[first - 1] + [""] * len(head), lambda before, name: name or before)]
    if euler := [name for name in names if "euler" in name.lower()]:
        raise mismatch("angles", "quaternions or helical angles (export so)", shown(euler[0]))
    # Tracker calls an object Global Angle (Quaternion) probe:probe.
    plain = (re.sub(r"^Global Angle \(.*?\) *", "", name) for name in names)
    whose = [re.sub(r"^(.+):\1$", r"\1", name) for name in plain]
    below = "in the row below RX and TX"
    unit = dict(zip(head, units, strict=False))
    radian = 1.0 if "rw" in head else _unit(unit.get("rx", ""), ANGLES, below)
    roles = [VICON.get(one, one) if "rw" in head else one for one in head]
    rate_hz = np.nan_to_num(pd.to_numeric(rows[max(first - 2, 0)][:1], errors="coerce"))
    # A blank row ends a section.
    body = list(takewhile(any, rows[first + 2 :]))
    metre = _unit(unit.get("tx", ""), LENGTHS, below)
    return Sheet(body, roles, whose[: len(head)], metre, radian, *rate_hz)


def _tum(rows: Rows) -> Sheet | None:
    """Trajectories of the TU Munich: timestamp tx ty tz qx qy qz qw in seconds and metres."""
    first = pd.to_numeric(next(filter(None, rows), []), errors="coerce")
    roles = ["time", *SHIFT, *XYZW]
    return Sheet(rows, roles, [""] * 8) if len(first) == 8 and not np.isnan(first).any() else None
