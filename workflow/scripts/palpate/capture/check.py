"""Check what people drop into ``raw/``: everything that is wrong, one line each."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pandas as pd

from palpate.capture.discover import BACKGROUND, CAPTURE_NAME, NOT_SENSORS, folders
from palpate.capture.images import png_problem
from palpate.capture.schema import load_yaml, validate
from palpate.capture.tables import (
    FORCE,
    FRAMES,
    GAUGE_COLUMNS,
    WRENCH_COLUMNS,
    image_streams,
    number_text,
    read_table,
)

SCHEMA = Path(__file__).resolve().parents[4] / "config" / "schemas" / "object.schema.yaml"
FEWEST_FRAMES = 3
# The background model takes its statistics from one half, its thresholds from the other.
FEWEST_BACKGROUND_FRAMES = 4
FEWEST_FORCE_SAMPLES = 10
MISSING_TABLE = "{}: file: expected a CSV table, found nothing"


def check_object(
    folder: str | Path, sensors: Mapping, probes: Mapping, *, files: bool = True
) -> list[str]:
    """Check all that was dropped in for one object.

    Parameters
    ----------
    folder : path
        ``raw/<object>``.
    sensors, probes : mapping
        Specifications by name.
    files : bool, optional
        False: of captures only what can be told without opening their tables and images.

    Returns
    -------
    list of str
        One line for each problem; empty when all is right.
    """
    folder = Path(folder)
    problems, spec = _check_object_file(folder, probes)
    probe = probes.get((spec or {}).get("probe"))
    for sensor_folder in folders(folder):
        if sensor_folder.name in NOT_SENSORS:
            continue
        problems += _check_sensor(sensor_folder, sensors, (spec or {}).get("points"))
        if sensor_folder.name in sensors:
            check = _check_content if files else _check_tables_are_there
            for capture in folders(sensor_folder):
                problems += check(capture, sensors[sensor_folder.name], probe)
    return problems


def check_capture(folder: str | Path, sensor: Mapping) -> list[str]:
    """Check one capture's folder against its sensor.

    Parameters
    ----------
    folder : path
        ``raw/<object>/<sensor>/<capture>``, or a background, which has no force.
    sensor : mapping
        The sensor's specification.

    Returns
    -------
    list of str
        One line for each problem; empty when all is right.
    """
    folder = Path(folder)
    fewest = FEWEST_BACKGROUND_FRAMES if folder.name == BACKGROUND else FEWEST_FRAMES
    problems, frames = check_frames(folder, image_streams(sensor), fewest=fewest)
    if folder.name != BACKGROUND:
        problems += _check_force(folder, frames)
    return problems


def _check_object_file(folder: Path, probes: Mapping) -> tuple[list[str], Mapping | None]:
    path = folder / "object.yaml"
    try:
        spec = load_yaml(path)
    except ValueError as error:
        return [str(error)], None
    problems = validate(spec, SCHEMA, str(path))
    if problems:
        return problems, None
    if spec["object"] != folder.absolute().name:
        expected = folder.absolute().name
        problems.append(f"{path}: object: expected {expected}, found {spec['object']}")
    if spec["probe"] not in probes:
        known = ", ".join(sorted(probes))
        problems.append(f"{path}: probe: expected one of {known}, found {spec['probe']}")
    if not any(spec["support"]["plane_normal"]):
        problems.append(f"{path}: support.plane_normal: expected a direction, found zeros")
    problems += _check_template(folder, path, spec["template"])
    return problems, spec


def _check_template(folder: Path, source: Path, template: Mapping) -> list[str]:
    key = "file" if "file" in template else "scans"
    name = template[key]
    path = folder / name
    if Path(name).name != name:
        return [f"{source}: template.{key}: expected a name in this folder, found {name}"]
    if key == "scans":
        if not any(path.glob("*.ply")):
            return [f"{path}: scans: expected PLY files, found none"]
        return []
    if not path.is_file():
        return [f"{path}: template: expected a closed surface, found nothing"]
    with path.open("rb") as stream:
        if path.suffix.lower() == ".ply" and stream.read(3) != b"ply":
            return [f"{path}: template: expected a PLY mesh, found something else"]
    return []


def _check_sensor(folder: Path, sensors: Mapping, points: Mapping | None) -> list[str]:
    if folder.name not in sensors:
        known = ", ".join(sorted(sensors))
        return [f"{folder}: sensor: expected one of {known}, found {folder.name}"]
    problems = []
    if not (folder / BACKGROUND).is_dir():
        problems.append(f"{folder / BACKGROUND}: folder: expected background frames, found nothing")
    for capture in folders(folder):
        if capture.name != BACKGROUND:
            problems += _check_name(capture, points)
    return problems


def _check_content(capture: Path, sensor: Mapping, probe: Mapping | None) -> list[str]:
    gauge = [] if capture.name == BACKGROUND else _check_gauge(capture, probe)
    return gauge + check_capture(capture, sensor)


def _check_tables_are_there(capture: Path, _: Mapping, __: Mapping | None) -> list[str]:
    names = [FRAMES] if capture.name == BACKGROUND else [FRAMES, FORCE]
    return [MISSING_TABLE.format(path) for name in names if not (path := capture / name).is_file()]


def _check_name(capture: Path, points: Mapping | None) -> list[str]:
    if not CAPTURE_NAME.fullmatch(capture.name):
        return [f"{capture}: capture: expected a name like 08 or 08-a03, found {capture.name}"]
    point = capture.name.partition("-")[0]
    if points is None or point in points:
        return []
    known = ", ".join(sorted(points))
    return [f"{capture}: point: expected one of {known}, found {point}"]


def _check_gauge(capture: Path, probe: Mapping | None) -> list[str]:
    """Volts say nothing without the gauges' calibration."""
    if probe is None or "gauge" in probe:
        return []
    path = capture / FORCE
    table, _ = read_columns(path, ["time_s"])
    if table is None or not set(GAUGE_COLUMNS) <= set(table.columns):
        return []
    expected = f"fx_n..tz_nm (probe {probe['probe']} states no gauge)"
    return [f"{path}: columns: expected {expected}, found v0..v5"]


def check_frames(
    folder: Path, streams: Mapping[str, Mapping], *, fewest: int
) -> tuple[list[str], pd.DataFrame | None]:
    """Check frames.csv and the images of its streams: problems, and the table if it can be read."""
    path = folder / FRAMES
    table, problems = read_columns(path, ["frame", "time_s", *streams])
    if table is None:
        return problems, None
    if len(table) < fewest:
        problems.append(f"{path}: rows: expected at least {fewest}, found {len(table)}")
    problems += check_numbers(path, table, ["frame", "time_s"])
    problems += _check_whole(path, table, "frame")
    problems += _check_increasing(path, table, "frame")
    problems += _check_increasing(path, table, "time_s")
    for stream, spec in streams.items():
        problems += _check_filled(path, table, stream)
        names = [str(name) for name in table[stream].dropna()]
        problems += _check_stream(folder, path, stream, names, spec)
    return problems, table


def _check_stream(
    folder: Path, source: Path, stream: str, names: list[str], spec: Mapping
) -> list[str]:
    """Check a stream's images; what is wrong with many of them alike is one line."""
    alike: dict[str, list[str]] = {}
    root = folder.resolve()
    for name in names:
        problem = _image_problem(folder, root, name, spec)
        if problem:
            alike.setdefault(problem, []).append(name)
    lines = []
    for problem, wrong in alike.items():
        more = f" (and {len(wrong) - 1} more)" if len(wrong) > 1 else ""
        place = source if "files of this folder" in problem else folder / wrong[0]
        lines.append(f"{place}: {stream}: {problem}{more}")
    return lines


def _image_problem(folder: Path, root: Path, name: str, spec: Mapping) -> str | None:
    path = folder / name
    if not path.resolve().is_relative_to(root):
        return f"expected files of this folder, found {name}"
    if not path.is_file():
        return "expected an image, found nothing"
    return png_problem(path, spec["width_px"], spec["height_px"], spec["encoding"])


def _check_force(folder: Path, frames: pd.DataFrame | None) -> list[str]:
    path = folder / FORCE
    table, problems = read_columns(path, ["time_s"])
    if table is None:
        return problems
    sets = [set(GAUGE_COLUMNS), set(WRENCH_COLUMNS)]
    columns = next((names for names in sets if names <= set(table.columns)), None)
    if columns is None:
        found = ", ".join(map(str, table.columns))
        return [f"{path}: columns: expected time_s and v0..v5 or fx_n..tz_nm, found {found}"]
    if len(table) < FEWEST_FORCE_SAMPLES:
        problems.append(
            f"{path}: rows: expected at least {FEWEST_FORCE_SAMPLES}, found {len(table)}"
        )
    problems += check_numbers(path, table, ["time_s", *sorted(columns)])
    problems += _check_increasing(path, table, "time_s")
    return problems or _check_overlap(path, table, frames)


def _check_overlap(path: Path, force: pd.DataFrame, frames: pd.DataFrame | None) -> list[str]:
    if frames is None or not len(frames) or not _all_finite(frames["time_s"]):
        return []
    first, last = frames["time_s"].iloc[[0, -1]]
    start, end = force["time_s"].iloc[[0, -1]]
    if start <= first and end >= last:
        return []
    expected = f"a record that covers the frames' {number_text(first)} to {number_text(last)} s"
    return [
        f"{path}: time_s: expected {expected}, found {number_text(start)} to {number_text(end)} s"
    ]


def read_columns(path: Path, columns: list[str]) -> tuple[pd.DataFrame | None, list[str]]:
    """Read a table that must have some columns: the table or None, and what is wrong."""
    try:
        table = read_table(path)
    except ValueError as error:
        return None, [str(error)]
    missing = [name for name in columns if name not in table.columns]
    if missing:
        found = ", ".join(map(str, table.columns))
        return None, [f"{path}: columns: expected {', '.join(missing)}, found {found}"]
    return table, []


def check_numbers(path: Path, table: pd.DataFrame, columns: list[str]) -> list[str]:
    """One line for each of some columns that holds anything but finite numbers."""
    problems = []
    for name in columns:
        values = pd.to_numeric(table[name], errors="coerce").to_numpy(dtype=float)
        wrong = np.flatnonzero(~np.isfinite(values))
        if len(wrong):
            row, found = wrong[0], table[name].iloc[wrong[0]]
            problems.append(
                f"{path}: {name}: expected finite numbers, found {found} in data row {row + 1}"
                f" ({len(wrong)} such)"
            )
    return problems


def _check_whole(path: Path, table: pd.DataFrame, name: str) -> list[str]:
    if not _all_finite(table[name]):
        return []
    values = pd.to_numeric(table[name]).to_numpy(dtype=float)
    wrong = np.flatnonzero(values != np.round(values))
    if not len(wrong):
        return []
    row = wrong[0]
    found = f"{number_text(values[row])} in data row {row + 1}"
    return [f"{path}: {name}: expected whole numbers, found {found}"]


def _check_filled(path: Path, table: pd.DataFrame, name: str) -> list[str]:
    blank = np.flatnonzero(table[name].isna())
    if not len(blank):
        return []
    return [f"{path}: {name}: expected a file, found nothing in data row {blank[0] + 1}"]


def _check_increasing(path: Path, table: pd.DataFrame, name: str) -> list[str]:
    if not _all_finite(table[name]):
        return []
    values = pd.to_numeric(table[name]).to_numpy(dtype=float)
    wrong = np.flatnonzero(np.diff(values) <= 0)
    if not len(wrong):
        return []
    row = wrong[0]
    before, after = number_text(values[row]), number_text(values[row + 1])
    found = f"{before} then {after} in data row {row + 2}"
    return [f"{path}: {name}: expected increasing values, found {found}"]


def _all_finite(column: pd.Series) -> bool:
    return bool(np.isfinite(pd.to_numeric(column, errors="coerce").to_numpy(dtype=float)).all())
