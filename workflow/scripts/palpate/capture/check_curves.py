"""What is wrong with an object's curves: force and position without a camera."""

import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from palpate.capture.curves.curve import Curve, read_curve
from palpate.capture.discover import CAPTURE_NAME, CAPTURE_WORDS, curve_files

OPTION = re.compile("--(depth|force|stiffness)-(column|unit|n-m)")


def check_curves(
    folder: Path, spec: Mapping, *, files: bool, probe: Mapping | None = None
) -> list[str]:
    """Check the curves of an object that declares some: one line for each problem.

    Parameters
    ----------
    folder : Path
        ``raw/<object>``.
    spec : mapping
        object.yaml.
    files : bool
        False: without opening them.
    probe : mapping, optional
        The object's probe.
    """
    if "curves" not in spec:
        return []
    found, path = curve_files(folder), folder / "object.yaml"
    if not found:
        return [f"{path}: curves: expected {folder}/<point>.csv, found none"]
    problems = []
    for curve in found:
        lines = check_name(curve, curve.stem, spec["points"])
        problems += lines
        if files and not lines:
            try:
                declared_curve(curve, spec, probe)
            except ValueError as error:
                problems.append(str(error))
    return problems


def check_name(path: Path, name: str, points: Mapping | None) -> list[str]:
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
        found = f"expected {expected}, found {given['stiffness_n_m']}"
        raise ValueError(f"curves.stiffness_n_m: {found}")
    try:
        curve = read_curve(path, **given)
    except ValueError as error:
        raise ValueError(_as_field(str(error))) from None
    return replace(curve, doubts=tuple(map(_as_field, curve.doubts)))


def _as_field(line: str) -> str:
    """A line about options of the command as one about the fields of object.yaml."""
    return OPTION.sub(lambda found: f"curves.{found[0][2:].replace('-', '_')}", line)


def poisson_ratios(spec: Mapping) -> tuple[float, float]:
    """Least and greatest Poisson's ratio that are declared for an object's curves."""
    given = spec["curves"]["poisson_ratio"]
    low, high = given if isinstance(given, list) else (given, given)
    return float(low), float(high)
