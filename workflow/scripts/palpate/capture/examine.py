"""A long look into an object's folder: all that is wrong, what is doubtful, what is there.

`palpate.capture.check` holds the files to the format, which the workflow does before each run.
This looks at what they hold: template, board, force, depth.
"""

from collections.abc import Mapping
from pathlib import Path

from numpy.typing import NDArray

from palpate.capture.check import checked_object
from palpate.capture.check_curves import declared_curve
from palpate.capture.discover import CURVE_END, SensorFolder, curve_files
from palpate.capture.examine_force import examine_force
from palpate.capture.examine_frames import examine_frames
from palpate.capture.examine_order import grey_frame
from palpate.capture.examine_template import examine_template
from palpate.capture.findings import Findings
from palpate.capture.schema import load_yaml
from palpate.capture.tables import WRENCH_COLUMNS, image_streams, read_force, read_frames

# Texts that a person may take for curves.
TEXTS = (".txt", ".dat", ".tsv", ".asc")


def examine_object(folder: str | Path, sensors: Mapping, probes: Mapping) -> Findings:
    """Look into all that was dropped in for one object.

    Parameters
    ----------
    folder : path
        ``raw/<object>``.
    sensors, probes : mapping
        Specifications by name; None of a file that is wrong, to which nothing is held.

    Returns
    -------
    Findings
        Lines on contents just of those files that are right by their format.
    """
    folder = Path(folder)
    checked = checked_object(folder, sensors, probes)
    result = Findings(checked.problems)
    of_sensors = tuple(str(place.folder) for place in checked.listed)
    if any(not line.startswith(of_sensors) for line in checked.problems):
        return result
    spec = load_yaml(folder / "object.yaml")
    result += examine_template(folder, spec)
    result += _curves(folder, spec)
    for place in checked.listed:
        sensor, probe = sensors.get(place.folder.name), probes[spec["probe"]]
        if sensor is not None and probe is not None:
            result += _sensor(place, checked.right, sensor, probe)
    return result


def _curves(folder: Path, spec: Mapping) -> Findings:
    """What an object's curves hold; those that nothing is declared of are doubtful."""
    found = curve_files(folder)
    if "curves" not in spec:
        lone = [path for path in found if path.stem.partition("-")[0] in spec["points"]]
        line = "not used: object.yaml declares no curves"
        return Findings(doubts=tuple(f"{path}: {line}" for path in lone))
    curves = {path: declared_curve(path, spec) for path in found}
    doubts = [f"{path}: {line}" for path, one in curves.items() for line in one.doubts]
    others = [path for path in folder.iterdir() if path.suffix in TEXTS and path.is_file()]
    for path in sorted(others):
        if path.stem.partition("-")[0] in spec["points"]:
            doubts.append(f"{path}: not used: a curve's name ends with {CURVE_END}")
    told = tuple(f"curve {path.stem}: {one.read}" for path, one in curves.items())
    return Findings(doubts=tuple(doubts), found=told)


def _sensor(
    place: SensorFolder, right: frozenset[Path], sensor: Mapping, probe: Mapping
) -> Findings:
    """Look into one sensor's background and captures, as far as they are right by their format."""
    background, result = None, Findings()
    if place.background in right:
        try:
            background = _background(place.background, sensor)
        except ValueError as error:
            result += Findings((str(error),))
    if not place.captures:
        result += Findings((f"{place.folder}: folder: expected captures, found none",))
    for capture in place.captures:
        if capture in right:
            result += _capture(capture, sensor, probe, background)
    return result


def _capture(folder: Path, sensor: Mapping, probe: Mapping, background: NDArray | None) -> Findings:
    frames, force, marker = read_frames(folder), read_force(folder), probe["marker"]
    try:
        found = examine_frames(folder, frames, sensor, marker=marker, background=background)
    except ValueError as error:  # of an image that can't be decoded
        found = Findings((str(error),))
    # Volts without the gauges' calibration are a fault of format.
    if "gauge" in probe or WRENCH_COLUMNS[0] in force.columns:
        found += examine_force(folder, force, frames["time_s"].to_numpy(float), probe)
    text = f"{folder.parent.name}/{folder.name}: {', '.join(found.found)}"
    return Findings(found.wrong, found.doubts, (text,))


def _background(folder: Path, sensor: Mapping) -> NDArray:
    """One grey frame of a background."""
    stream = next(iter(image_streams(sensor)))
    return grey_frame(folder / read_frames(folder)[stream].iloc[0], sensor)
