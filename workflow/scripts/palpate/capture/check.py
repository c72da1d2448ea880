"""Check what people drop into ``raw/``: everything that is wrong, one line each."""

import hashlib
import os
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from palpate.capture.check_capture import check_capture, read_columns
from palpate.capture.curves.curve import Curve, read_curve
from palpate.capture.discover import (
    BACKGROUND,
    CAPTURE_NAME,
    CAPTURE_WORDS,
    MESHES,
    SensorFolder,
    curve_files,
    object_fault,
    sensor_folder,
    sensor_folders,
)
from palpate.capture.poses import POSES
from palpate.capture.tables import FORCE, FRAMES, GAUGE_COLUMNS, force_columns
from palpate.config.model import problems
from palpate.config.object import ObjectSpec
from palpate.yaml_files import is_file, load_yaml, mismatch, one_line

# Options of the command, as messages of curves name them.
OPTION = re.compile("--(depth|force|stiffness)-(column|unit|n-m)")


@dataclass(frozen=True)
class Checked:
    """What a check of an object's folder comes to."""

    problems: tuple[str, ...]  # one line for each
    listed: tuple[SensorFolder, ...]  # what stood in the folder
    # Captures and backgrounds whose files are right by their format, of those that were opened.
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
        Specifications by name; None of a file that is wrong, with which nothing is compared.
    files : bool, optional
        False: of captures only what can be determined without opening their tables and images.

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
    """Like `check_object`, with what was listed; of captures ``only`` this one, if it is given."""
    folder = Path(folder)
    problems, spec = _check_object_file(folder, probes)
    probe = probes.get(spec.get("probe"))
    listed, right = sensor_folders(folder), set()
    if only is not None:
        listed = (replace(sensor_folder(only.parent), captures=(only,)),)
    elif spec:
        problems += _check_curves(folder, spec, files=files, probe=probe)
    for place in listed:
        of_names = list(_check_sensor(place, sensors, spec.get("points")))
        problems += of_names
        sensor = sensors.get(place.folder.name)
        if sensor is None:
            continue
        for capture in place.contents:
            if not files:
                problems += _check_tables_are_there(capture, probe)
                continue
            lines = check_capture(capture, sensor, probe)
            problems += _check_gauge(capture, probe) + lines
            if not (lines or any(line.startswith(f"{capture}: ") for line in of_names)):
                right.add(capture)
        problems += check_twice(place.captures) if files else []
    return Checked(tuple(map(one_line, problems)), listed, frozenset(right))


def _check_object_file(folder: Path, probes: Mapping) -> tuple[list[str], Mapping]:
    """What is wrong with object.yaml, and what it says if it is right by its model."""
    path = folder / "object.yaml"
    try:
        spec = load_yaml(path)
    except ValueError as error:
        return [str(error)], {}
    if lines := problems(ObjectSpec, spec, str(path)):
        if not any(line.startswith((f"{path}: template", f"{path}: content")) for line in lines):
            lines += _check_template(folder, path, spec["template"])
        return lines, {}
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
    path, kind = folder / name, Path(name).suffix.lower()
    if Path(name).name != name:
        return [f"{source}: template.{key}: expected a name in this folder, found {name}"]
    if key == "scans":
        there = any(path.glob("*.ply"))
        return [] if there else [f"{path}: scans: expected PLY files, found none"]
    if kind not in MESHES:
        return [f"{source}: template.file: expected a file {', '.join(MESHES)}, found {name}"]
    if not is_file(path):
        return [f"{path}: template: expected a closed surface, found nothing"]
    with path.open("rb") as stream:
        if kind == ".ply" and stream.read(3) != b"ply":
            return [f"{path}: template: expected a PLY mesh, found something else"]
    return []


def _check_sensor(place: SensorFolder, sensors: Mapping, points: Mapping | None) -> Iterator[str]:
    if (name := place.folder.name) not in sensors:
        yield f"{place.folder}: sensor: expected one of {', '.join(sorted(sensors))}, found {name}"
        return
    # Clouds do without one; of a wrong file nobody knows what it is.
    needed = sensors[name] is None or sensors[name]["kind"] != "cloud"
    if not place.has_background and needed:
        yield f"{place.background}: folder: expected background frames, found nothing"
    for capture in place.captures:
        yield from _check_name(capture, capture.name, points)


def check_twice(captures: Iterable[Path]) -> Iterator[str]:
    """A recording that is there under two names would count twice: a line for each."""
    known, expected = {}, "expected another recording than the other captures'"
    for path in (capture / FORCE for capture in captures):
        if path.is_file():
            other = known.setdefault(hashlib.sha256(path.read_bytes()).digest(), path.parent)
            if other != path.parent:
                yield f"{path}: content: {expected}, found that of {other.name}"


def _check_tables_are_there(capture: Path, probe: Mapping | None) -> list[str]:
    names = [FRAMES] if capture.name == BACKGROUND else [FRAMES, FORCE]
    if capture.name != BACKGROUND and probe is not None and "marker" not in probe:
        names.append(POSES)
    missing = [capture / name for name in names if not (capture / name).is_file()]
    return [f"{path}: file: expected a CSV table, found nothing" for path in missing]


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


def _check_curves(
    folder: Path, spec: Mapping, *, files: bool, probe: Mapping | None
) -> Iterator[str]:
    """Check the curves of an object that declares some, without opening them if not ``files``."""
    found = curve_files(folder) if "curves" in spec else []
    if "curves" in spec and not found:
        yield f"{folder / 'object.yaml'}: curves: expected {folder}/<point>.csv, found none"
    for curve in found:
        yield from (lines := _check_name(curve, curve.stem, spec["points"]))
        if files and not lines:
            try:
                declared_curve(curve, spec, probe)
            except ValueError as error:
                yield str(error)


def _check_name(path: Path, name: str, points: Mapping | None) -> list[str]:
    """What is wrong with a capture's or a curve's name: its form, or a point not declared."""
    if not CAPTURE_NAME.fullmatch(name):
        return [f"{path}: capture: expected {CAPTURE_WORDS}, found {name}"]
    point = name.partition("-")[0]
    if points is None or point in points:
        return []
    known = ", ".join(sorted(points))
    return [f"{path}: point: expected one of {known}, found {point}"]


def declared_curve(path: str | Path, spec: Mapping, probe: Mapping | None = None) -> Curve:
    """Read a curve by what object.yaml says of its columns, and by the probe's file.

    Raises
    ------
    ValueError
        Naming file, column and remedy, if it is no curve.
    """
    probe = probe or {}
    given = {
        "stiffness_n_m": probe.get("stiffness_n_m"),
        "radius_m": probe.get("indenter", {}).get("radius_m"),
    }
    given |= {name: value for name, value in spec["curves"].items() if name != "poisson_ratio"}
    if isinstance(given["stiffness_n_m"], str):
        expected = "a number in curves, which no camera calibrates, or in the probe's file"
        raise mismatch("curves.stiffness_n_m", expected, given["stiffness_n_m"])
    try:
        curve = read_curve(path, **given)
    except ValueError as error:
        raise ValueError(_as_field(str(error))) from None
    return replace(curve, warnings=tuple(map(_as_field, curve.warnings)))


def _as_field(line: str) -> str:
    """A line about options of the command as one about the fields of object.yaml."""
    return OPTION.sub(lambda found: f"curves.{found[0][2:].replace('-', '_')}", line)


def poisson_ratios(spec: Mapping) -> tuple[float, float]:
    """Least and greatest Poisson's ratio that are declared for an object's curves."""
    given = spec["curves"]["poisson_ratio"]
    low, high = given if isinstance(given, list) else (given, given)
    return float(low), float(high)
