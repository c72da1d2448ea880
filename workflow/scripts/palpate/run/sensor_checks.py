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
            if sensors.get(place.name) is None:
                continue
            if experiment.name not in made or not says_simulated(experiment):
                lines += check_experiment(experiment, sensors[place.name])
    return lines


def unknown_probe(name: str, probes: Mapping, source: str) -> list[str]:
    """A probe of the recordings about sensors that no file describes."""
    if name in probes:
        return []
    known = ", ".join(sorted(probes))
    return [f"{source}: experiments.probe: expected one of {known}, found {name}"]
