"""Check what people drop into ``raw/``: everything that is wrong, one line each."""

import hashlib
import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import pandas as pd

from palpate.capture.check_curves import check_curves, check_name
from palpate.capture.columns import all_finite, check_increasing, check_numbers, read_columns
from palpate.capture.discover import (
    BACKGROUND,
    MESHES,
    SensorFolder,
    object_fault,
    sensor_folder,
    sensor_folders,
)
from palpate.capture.force_record import GAUGE_COLUMNS, force_columns, sampled_s
from palpate.capture.pictures import check_frames, check_repeated
from palpate.capture.tables import (
    FORCE,
    FRAMES,
    image_streams,
    number_text,
)
from palpate.config.model import problems
from palpate.config.object import ObjectSpec
from palpate.yaml_files import is_file, load_yaml, one_line

FEWEST_FRAMES = 3
# Each is held against what the others say, whose deviations three tell at the least.
FEWEST_BACKGROUND_FRAMES = 4
FEWEST_FORCE_SAMPLES = 10
MISSING_TABLE = "{}: file: expected a CSV table, found nothing"


@dataclass(frozen=True)
class Checked:
    """What a check of an object's folder comes to.

    Attributes
    ----------
    problems : tuple of str
        One line for each.
    listed : tuple of SensorFolder
        What stood in the folder.
    right : frozenset of Path
        Captures and backgrounds whose files are right by their format, of those that were opened.
    """

    problems: tuple[str, ...]
    listed: tuple[SensorFolder, ...]
    right: frozenset[Path]


def check_object(
    folder: str | Path, sensors: Mapping, probes: Mapping, *, files: bool = True
) -> list[str]:
    """Check all that was dropped in for one object.

    Parameters
    ----------
    folder : path
        ``raw/<object>``.
    sensors, probes : mapping
        Specifications by name; None of a file that is wrong, to which nothing is held.
    files : bool, optional
        False: of captures only what can be told without opening their tables and images.

    Returns
    -------
    list of str
        One line for each problem; empty when all is right.

    Examples
    --------
    >>> from palpate.yaml_files import load_yaml
    >>> sensors = {
    ...     name: load_yaml(f"tests/sample/sensors/{name}.yaml") for name in ("kinect", "bumblebee")
    ... }
    >>> probes = {"nano25_sphere": load_yaml("config/probes/nano25_sphere.yaml")}
    >>> check_object("tests/sample/raw/foam_block", sensors, probes, files=False)
    []
    """
    return list(checked_object(folder, sensors, probes, files=files).problems)


def checked_object(
    folder: str | Path,
    sensors: Mapping,
    probes: Mapping,
    *,
    files: bool = True,
    only: Path | None = None,
) -> Checked:
    """Check all that was dropped in for one object, and hand on what was listed for it.

    See `check_object` for the parameters; ``only`` is a capture whose neighbours are passed over.
    """
    folder = Path(folder)
    problems, spec = _check_object_file(folder, probes)
    probe = probes.get((spec or {}).get("probe"))
    listed, right = sensor_folders(folder), set()
    if only is not None:
        listed = (replace(sensor_folder(only.parent), captures=(only,)),)
    elif spec is not None:
        probe = probes.get(spec.get("probe"))
        problems += check_curves(folder, spec, files=files, probe=probe)
    for place in listed:
        names = _check_sensor(place, sensors, (spec or {}).get("points"))
        problems += names
        if sensors.get(place.folder.name) is None:
            continue
        for capture in place.contents:
            if not files:
                problems += _check_tables_are_there(capture)
                continue
            lines = check_capture(capture, sensors[place.folder.name])
            problems += _check_gauge(capture, probe) + lines
            misnamed = any(line.startswith(f"{capture}: ") for line in names)
            right |= set() if lines or misnamed else {capture}
        problems += check_twice(place.captures) if files else []
    return Checked(tuple(map(one_line, problems)), listed, frozenset(right))


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
        if frames is not None and not problems:
            problems += check_repeated(folder, frames, image_streams(sensor))
        problems += _check_force(folder, frames)
    return [one_line(problem) for problem in problems]


def _check_object_file(folder: Path, probes: Mapping) -> tuple[list[str], Mapping | None]:
    path = folder / "object.yaml"
    try:
        spec = load_yaml(path)
    except ValueError as error:
        return [str(error)], None
    lines = problems(ObjectSpec, spec, str(path))
    if lines:
        if not any(line.startswith((f"{path}: template", f"{path}: content")) for line in lines):
            lines += _check_template(folder, path, spec["template"])
        return lines, None
    expected = Path(os.path.abspath(folder)).name
    if spec["object"] != expected:
        lines.append(f"{path}: object: expected {expected}, found {spec['object']}")
    # Curves alone need no board.
    needed = sensor_folders(folder) or "radius_m" not in spec.get("curves", {})
    if spec.get("probe") not in probes and (needed or "probe" in spec):
        known, found = ", ".join(sorted(probes)), spec.get("probe", "none")
        known += ", or curves.radius_m" if "curves" in spec and "probe" not in spec else ""
        lines.append(f"{path}: probe: expected one of {known}, found {found}")
    if fault := object_fault(spec["object"]):
        lines.append(f"{path}: object: {fault}")
    return lines + _check_template(folder, path, spec["template"]), spec


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
    if path.suffix.lower() not in MESHES:
        expected = f"a file {', '.join(MESHES)}"
        return [f"{source}: template.file: expected {expected}, found {name}"]
    if not is_file(path):
        return [f"{path}: template: expected a closed surface, found nothing"]
    with path.open("rb") as stream:
        if path.suffix.lower() == ".ply" and stream.read(3) != b"ply":
            return [f"{path}: template: expected a PLY mesh, found something else"]
    return []


def _check_sensor(place: SensorFolder, sensors: Mapping, points: Mapping | None) -> list[str]:
    name = place.folder.name
    if name not in sensors:
        known = ", ".join(sorted(sensors))
        return [f"{place.folder}: sensor: expected one of {known}, found {name}"]
    problems = []
    if not place.has_background:
        problems.append(f"{place.background}: folder: expected background frames, found nothing")
    for capture in place.captures:
        problems += check_name(capture, capture.name, points)
    return problems


def check_twice(captures: Iterable[Path]) -> list[str]:
    """A recording that is there under two names would count twice: a line for each."""
    problems, known = [], {}
    for capture in captures:
        path = capture / FORCE
        if not path.is_file():
            continue
        content = hashlib.sha256(path.read_bytes()).digest()
        other = known.setdefault(content, capture)
        if other is not capture:
            expected = "expected another recording than the other captures'"
            problems.append(f"{path}: content: {expected}, found that of {other.name}")
    return problems


def _check_tables_are_there(capture: Path) -> list[str]:
    names = [FRAMES] if capture.name == BACKGROUND else [FRAMES, FORCE]
    return [MISSING_TABLE.format(path) for name in names if not (path := capture / name).is_file()]


def _check_gauge(capture: Path, probe: Mapping | None) -> list[str]:
    """Volts say nothing without the gauges' calibration."""
    if capture.name == BACKGROUND or probe is None or "gauge" in probe:
        return []
    path = capture / FORCE
    table, _ = read_columns(path, ["time_s"])
    if table is None or force_columns(table.columns, probe) != GAUGE_COLUMNS:
        return []
    expected = f"fx_n..tz_nm (probe {probe['probe']} states no gauge)"
    return [f"{path}: columns: expected {expected}, found v0..v5"]


def _check_force(folder: Path, frames: pd.DataFrame | None) -> list[str]:
    path = folder / FORCE
    table, problems = read_columns(path, ["time_s"])
    if table is None:
        return problems
    columns = force_columns(table.columns)
    if columns is None:
        found = ", ".join(map(str, table.columns))
        return [f"{path}: columns: expected time_s and v0..v5 or fx_n..tz_nm, found {found}"]
    if len(table) < FEWEST_FORCE_SAMPLES:
        problems.append(
            f"{path}: rows: expected at least {FEWEST_FORCE_SAMPLES}, found {len(table)}"
        )
    problems += check_numbers(path, table, ["time_s", *sorted(columns)])
    if all_finite(table["time_s"]):
        table["time_s"] = sampled_s(table["time_s"].to_numpy(float))[0]
    problems += check_increasing(path, table, "time_s")
    return problems or _check_overlap(path, table, frames)


def _check_overlap(path: Path, force: pd.DataFrame, frames: pd.DataFrame | None) -> list[str]:
    if frames is None or not len(frames) or not all_finite(frames["time_s"]):
        return []
    first, last = frames["time_s"].iloc[[0, -1]]
    start, end = force["time_s"].iloc[[0, -1]]
    if start <= first and end >= last:
        return []
    expected = f"a record that covers the frames' {number_text(first)} to {number_text(last)} s"
    return [
        f"{path}: time_s: expected {expected}, found {number_text(start)} to {number_text(end)} s"
    ]
