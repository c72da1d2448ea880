"""What is wrong with the recordings about sensors, a line for each thing."""

from collections.abc import Mapping
from pathlib import Path

from palpate.capture.discover import folders
from palpate.capture.experiments import check_experiment
from palpate.run.lab_captures import says_simulated


def dropped_experiments(folder: Path, sensors: Mapping, lab: Mapping | None) -> list[str]:
    """What is wrong with the recordings about sensors that the lab does not make itself."""
    made = (lab or {}).get("experiments", {})
    lines = []
    for place in folders(folder):
        if place.name not in sensors:
            known = ", ".join(sorted(sensors))
            lines.append(f"{place}: sensor: expected one of {known}, found {place.name}")
            continue
        for experiment in folders(place):
            if experiment.name not in made or not says_simulated(experiment):
                lines += check_experiment(experiment, sensors[place.name])
    return lines


def missing_calibrations(
    used: set[str], sensors: Mapping, lab: Mapping | None, paths: Mapping
) -> list[str]:
    """Sensors whose optics are to come from pictures of a board that nobody took."""
    made = (lab or {}).get("experiments", {}).get("calibration", {"sensors": []})["sensors"]
    lines = []
    for name in sorted(used & set(sensors)):
        folder = Path(paths["raw"]) / "sensors" / name / "calibration"
        asked = sensors[name].get("optics") == "calibration"
        place = Path(paths["sensors"]) / f"{name}.yaml"
        if asked and "depth" not in sensors[name]:
            # Its images are rectified: the camera that they show is none of those before the board.
            expected = "stated, those of `palpate calibrate camera --kind stereo`"
            lines.append(f"{place}: optics: expected {expected}, found calibration")
        elif asked and name not in made and not folder.is_dir():
            lines.append(f"{place}: optics: expected pictures of a board in {folder}, found none")
    return lines


def unknown_probe(name: str, probes: Mapping, source: str) -> list[str]:
    """A probe of the recordings about sensors that no file describes."""
    if name in probes:
        return []
    known = ", ".join(sorted(probes))
    return [f"{source}: experiments.probe: expected one of {known}, found {name}"]
