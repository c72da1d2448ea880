"""Check recordings about a sensor: ``raw/sensors/<sensor>/<experiment>/``."""

from collections.abc import Mapping
from pathlib import Path

from palpate.capture.check import check_capture, check_frames, check_numbers, read_columns
from palpate.capture.discover import folders
from palpate.capture.tables import image_streams

FEWEST_REPEATS, FEWEST_PAIRS = 2, 6
GRID = ["point", "row", "column", "x_m", "y_m"]
BOARD = ["columns", "rows", "square_m"]


def check_experiment(folder: str | Path, sensor: Mapping) -> list[str]:
    """Check one recording about a sensor.

    Parameters
    ----------
    folder : path
        ``raw/sensors/<sensor>/<experiment>``.
    sensor : mapping
        The sensor's specification.

    Returns
    -------
    list of str
        One line for each problem; empty when all is right.
    """
    folder = Path(folder)
    if folder.name not in CHECKS:
        known = ", ".join(sorted(CHECKS))
        return [f"{folder}: experiment: expected one of {known}, found {folder.name}"]
    return CHECKS[folder.name](folder, sensor)


def _calibration(folder: Path, sensor: Mapping) -> list[str]:
    """Grey pairs of the colour and the infrared camera, and the board's sizes."""
    if "depth" not in sensor:
        return [f"{folder}: sensor: expected one with an infrared camera, found {sensor['sensor']}"]
    path = folder / "board.csv"
    table, problems = read_columns(path, BOARD)
    if table is not None:
        problems += check_numbers(path, table, BOARD)
    if table is not None and not problems and (table[BOARD].iloc[0] <= 0).any():
        found = ", ".join(f"{value:g}" for value in table[BOARD].iloc[0])
        problems.append(f"{path}: board: expected sizes above 0, found {found}")
    blocks = {"color": sensor["color"], "infrared": sensor["depth"]}
    streams = {name: dict(block) | {"encoding": "mono8"} for name, block in blocks.items()}
    return problems + check_frames(folder, streams, fewest=FEWEST_PAIRS)[0]


def _workspace(folder: Path, sensor: Mapping) -> list[str]:
    """Grey frames of the resting tip on each point of a grid."""
    path = folder / "grid.csv"
    table, problems = read_columns(path, GRID)
    if table is None:
        return problems
    problems += check_numbers(path, table, GRID)
    if problems:
        return problems
    stream, block = next(iter(image_streams(sensor).items()))
    streams = {stream: dict(block) | {"encoding": "mono8"}}
    for point in table["point"]:
        place = folder / f"{int(point):02d}"
        problems += check_frames(place, streams, fewest=FEWEST_REPEATS)[0]
    return problems


def _cd_case(folder: Path, sensor: Mapping) -> list[str]:
    """Film of the tip around the case, and of the empty scene."""
    streams = image_streams(sensor)
    return [
        problem
        for name in ("trace", "background")
        for problem in check_frames(folder / name, streams, fewest=FEWEST_REPEATS)[0]
    ]


def _planes(folder: Path, sensor: Mapping) -> list[str]:
    """Flat boards at several distances."""
    path = folder / "planes.csv"
    table, problems = read_columns(path, ["plane", "distance_m"])
    if table is None:
        return problems
    for place in folders(folder):
        problems += check_frames(place, image_streams(sensor), fewest=1)[0]
    return problems


CHECKS = {
    "calibration": _calibration,
    "workspace": _workspace,
    "cd_case": _cd_case,
    "loading": check_capture,
    "planes": _planes,
}
