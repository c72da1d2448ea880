"""Check recordings about a sensor: ``raw/sensors/<sensor>/<experiment>/``."""

from collections.abc import Callable, Iterable, Mapping
from pathlib import Path

import numpy as np
import pandas as pd

from palpate.capture.check_capture import (
    FEWEST_FRAMES,
    FEWEST_REPEATS,
    check_capture,
    check_force,
    check_frames,
    check_images,
    check_numbers,
    check_poses,
    read_columns,
)
from palpate.capture.discover import BACKGROUND
from palpate.capture.poses import POSES, read_poses
from palpate.capture.tables import FORCE, image_streams, read_table
from palpate.config.model import problems
from palpate.config.probe import SIDE, TargetFile
from palpate.yaml_files import load_yaml, one_line

FEWEST_PAIRS = 6
GRID = ["point", "row", "column", "x_m", "y_m"]
PLANES = ["plane", "distance_m"]
MOST_POINTS = 1000
BOARD = ["columns", "rows", "square_m"]
# Cameras that are calibrated together, by columns of frames.csv; an infrared camera gives depth.
STEREO, DEPTH = ("left", "right"), ("infrared", "color")


def check_experiment(folder: str | Path, sensor: Mapping) -> list[str]:
    """Check ``raw/sensors/<sensor>/<experiment>`` against its sensor, a line for each problem."""
    folder = Path(folder)
    if folder.name not in CHECKS:
        known = ", ".join(sorted(CHECKS))
        return [f"{folder}: experiment: expected one of {known}, found {folder.name}"]
    return list(map(one_line, _recording(folder) + CHECKS[folder.name](folder, sensor)))


def calibrated_streams(columns: Iterable[str]) -> tuple[str, str]:
    """Which two cameras a calibration's frames.csv, by its columns, has pictures of."""
    return STEREO if set(STEREO) <= set(columns) else DEPTH


def _recording(folder: Path) -> list[str]:
    """Who made it, if a file says so."""
    path = folder / "recording.yaml"
    if not path.is_file():
        return []
    try:
        found = load_yaml(path)
    except ValueError as error:
        return [str(error)]
    if isinstance(found, Mapping) and found.get("provenance") in ("simulated", "recorded"):
        return []
    return [f"{path}: provenance: expected recorded or simulated, found {found}"]


def _calibration(folder: Path, sensor: Mapping) -> list[str]:
    """Grey pairs of the sensor's two cameras, and the target's sizes."""
    if lines := _without_pictures(folder, sensor):
        return lines
    if "depth" in sensor:
        blocks = {"color": sensor["color"], "infrared": sensor["depth"]}
    else:
        blocks = dict.fromkeys(STEREO, sensor["color"])
    streams = {name: {**block, "encoding": "mono8"} for name, block in blocks.items()}
    return _target(folder) + check_frames(folder, streams, fewest=FEWEST_PAIRS)[0]


def _without_pictures(folder: Path, sensor: Mapping) -> list[str]:
    """A line where a sensor has clouds in place of the pictures of a target."""
    line = f"{folder}: sensor: expected one with pictures, found kind {sensor['kind']}"
    return [] if "color" in sensor else [line]


def _target(folder: Path) -> list[str]:
    """What is wrong with the file of a recording's target."""
    described = _described(folder)
    if described is None:
        return _board(folder / "board.csv")
    return problems(TargetFile, load_yaml(described), str(described))


def _described(folder: Path) -> Path | None:
    """A recording's file with a block ``marker``."""
    paths = (folder / name for name in ("target.yaml", "board.yaml"))
    return next((path for path in paths if path.is_file()), None)


def _board(path: Path) -> list[str]:
    """What is wrong with a table of one checkerboard."""
    table, lines = _filled(path, BOARD)
    if lines:
        return lines
    if len(table) > 1:
        return [f"{path}: rows: expected one board, found {len(table)}"]
    columns, rows, square_m = table[BOARD].iloc[0]
    if min(columns, rows) < 3 or columns % 1 or rows % 1:
        expected = "whole numbers of inner corners >= 3"
        return [f"{path}: columns, rows: expected {expected}, found {columns:g} x {rows:g}"]
    if not SIDE["ge"] <= square_m <= SIDE["le"]:
        expected = f"{SIDE['ge']:g} to {SIDE['le']:g} metres"
        hint = " (millimetres?)" if square_m > SIDE["le"] else ""
        return [f"{path}: square_m: expected {expected}, found {square_m:g}{hint}"]
    return []


def read_marker(folder: Path) -> dict:
    """Target of a calibration's folder, as the ``marker`` block of a probe's file."""
    if described := _described(folder):
        return TargetFile.plain(load_yaml(described))["marker"]
    columns, rows, square_m = read_table(folder / "board.csv")[BOARD].iloc[0]
    return {"inner_corners": [int(columns), int(rows)], "square_m": float(square_m)}


def _workspace(folder: Path, sensor: Mapping) -> list[str]:
    """Grey frames of the resting tip on each point of a grid."""
    path = folder / "grid.csv"
    table, lines = _filled(path, GRID)
    if lines:
        return lines
    points = table["point"].to_numpy(dtype=float)
    if not (np.isin(points, np.arange(1, MOST_POINTS)).all() and len(set(points)) == len(points)):
        return [f"{path}: point: expected whole numbers from 1, each once, found {points.tolist()}"]
    stream, block = next(iter(image_streams(sensor).items()))
    streams = {stream: {**block, "encoding": "mono8"}}
    for point in points:
        lines += check_frames(folder / f"{point:02.0f}", streams, fewest=FEWEST_REPEATS)[0]
    return lines


def _planes(folder: Path, sensor: Mapping) -> list[str]:
    """Flat boards at several distances."""
    path = folder / "planes.csv"
    table, lines = _filled(path, PLANES)
    if lines:
        return lines
    if not (table["distance_m"] > 0).all():
        return [f"{path}: distance_m: expected above 0, found {table['distance_m'].min():g}"]
    for plane in table["plane"]:
        lines += check_images(folder / f"{int(plane):02d}", sensor, fewest=1)
    return lines


def _cd_case(folder: Path, sensor: Mapping) -> list[str]:
    """Frames of the tip around the case, and of the empty scene."""
    return check_images(folder / "trace", sensor) + check_images(folder / BACKGROUND, sensor)


def _load(folder: Path, sensor: Mapping) -> list[str]:
    """Frames and forces of the probe held free, and the empty table, which gives the vertical."""
    return check_capture(folder, sensor) + check_images(folder / BACKGROUND, sensor)


def check_hand_eye(folder: Path, sensor: Mapping, *, has_target: bool = True) -> list[str]:
    """Check images of a target on a tracked frame, its poses, and the target's file, if needed."""
    if lines := _without_pictures(folder, sensor):
        return lines
    stream, block = next(iter(image_streams(sensor).items()))
    lines = _target(folder) if has_target else []
    lines += check_frames(folder, {stream: block}, fewest=FEWEST_FRAMES)[0]
    return list(map(one_line, lines + check_tracked(folder, has_force=False)))


def check_tracked(folder: Path, *, has_force: bool) -> list[str]:
    """Check a recording of a probe by its poses, and by its forces where it has some."""
    lines = check_force(folder / FORCE, None) if has_force else []
    try:
        read_poses(folder)
    except ValueError as error:
        lines.append(str(error))
    return lines


def _pivot(folder: Path, sensor: Mapping) -> list[str]:
    """Check images of a target on a probe, and that the sensor's file says how it is found."""
    return check_poses(folder, None, sensor, None) or check_images(folder, sensor)


def _of_probe(check: Callable[..., list[str]], *, has_force: bool = True) -> Callable:
    """A check of a recording of a probe with a target, or of one that is tracked."""

    def checked(folder: Path, sensor: Mapping) -> list[str]:
        if (folder / POSES).is_file():
            return check_tracked(folder, has_force=has_force)
        return check(folder, sensor)

    return checked


def _filled(path: Path, columns: list[str]) -> tuple[pd.DataFrame | None, list[str]]:
    """A table with some columns of numbers and at least one row, and what is wrong."""
    table, lines = read_columns(path, columns)
    if table is None:
        return None, lines
    if not len(table):
        return table, [f"{path}: rows: expected at least one, found none"]
    return table, check_numbers(path, table, columns)


# Of a probe with a target, or of one that is tracked: without forces, and with them.
check_pivot, check_with_force = _of_probe(_pivot, has_force=False), _of_probe(check_capture)
CHECKS = {
    "calibration": _calibration,
    "workspace": _workspace,
    "cd_case": _cd_case,
    "loading": check_capture,
    "planes": _planes,
    "hand_eye": check_hand_eye,
    "pivot": check_pivot,
    "load": _of_probe(_load),
    "stiffness": check_with_force,
}
