"""What is wrong with a configuration beside its options' own bounds, a line for each thing."""

from collections.abc import Collection, Mapping
from itertools import product
from pathlib import Path

from palpate.capture.check_capture import check_images
from palpate.capture.discover import folders
from palpate.capture.experiments import check_experiment, check_with_force
from palpate.config.probe import PARTS
from palpate.config.sensor import HAND_EYE, asks_for_base
from palpate.workflow.lab_captures import says_simulated

LONGEST_PATH = 1000
# Recordings that `palpate noise` takes, and no run.
OF_NOISE = {"rest": check_with_force, "plate": check_images}


def path_problems(paths: Mapping, source: str) -> list[str]:
    """Say what is wrong with ``paths`` of the configuration, by what they hold.

    Results in raw/ would be written over captures that nobody can make again.
    """
    lines = [
        f"{source}: paths.{key}: expected printable characters, at most {LONGEST_PATH}, found"
        f" {value[:60]!a}"
        for key, value in paths.items()
        if value is not None and not (value.isprintable() and len(value) <= LONGEST_PATH)
    ]
    if lines:
        return lines
    results = Path(paths["results"]).resolve()
    for key in ("raw", "sensors", "probes", "meshes"):
        if results.is_relative_to(Path(paths[key]).resolve()):
            expected = f"a folder outside paths.{key}, {paths[key]}"
            lines.append(f"{source}: paths.results: expected {expected}, found {paths['results']}")
    return lines


def dropped_experiments(folder: Path, sensors: Mapping, lab: Mapping | None) -> list[str]:
    """What is wrong with the recordings about sensors that the lab does not make itself."""
    made, places = (lab or {}).get("experiments", {}), folders(folder)
    lines = [
        f"{place}: sensor: expected one of {', '.join(sorted(sensors))}, found {place.name}"
        for place in places
        if place.name not in sensors
    ]
    return lines + [
        line
        for place in places
        if (spec := sensors.get(place.name)) is not None
        for experiment in folders(place)
        if experiment.name not in made or not says_simulated(experiment)
        for line in OF_NOISE.get(experiment.name, check_experiment)(experiment, spec)
    ]


def lab_devices(lab: Mapping | None) -> dict[str, set[str]]:
    """Names of the sensors and probes that a lab records with, whatever is asked for."""
    objects = (lab or {}).get("objects", {}).values()
    blocks = (lab or {}).get("experiments", {}).values()
    sensors = [name for spec in objects for name in (*spec["recordings"], *spec["cameras"])]
    sensors += [name for block in blocks for name in block["sensors"]]
    probes = [spec["object"]["probe"] for spec in objects]
    probes += [block["probe"] for block in blocks if "probe" in block]
    return {"sensors": set(sensors), "probes": set(probes)}


def recorded_by(lab: Mapping | None, experiment: str) -> Collection[str]:
    """Sensors of which the lab records an experiment."""
    return (lab or {}).get("experiments", {}).get(experiment, {"sensors": []})["sensors"]


def missing_calibrations(
    used: set[str], sensors: Mapping, lab: Mapping | None, paths: Mapping
) -> list[str]:
    """Sensors whose optics, or base, are to come from a recording that nobody took, a line each."""
    made, lines = recorded_by(lab, "calibration"), []
    for name in sorted(used):
        spec = sensors.get(name) or {}
        hand_eye = Path(paths["raw"]) / "sensors" / name / HAND_EYE
        if asks_for_base(spec) and not hand_eye.is_dir():
            field = f"{Path(paths['sensors']) / name}.yaml: base.camera_from_base"
            lines.append(f"{field}: expected a recording of a target in {hand_eye}, found none")
        if spec.get("optics") != "calibration":
            continue
        folder = Path(paths["raw"]) / "sensors" / name / "calibration"
        field = f"{Path(paths['sensors']) / name}.yaml: optics"
        if "depth" not in spec:
            # Its images are rectified: the camera that they show is none of those before the board.
            expected = "stated, those of `palpate calibrate camera --kind stereo`"
            lines.append(f"{field}: expected {expected}, found calibration")
        elif name not in made and not folder.is_dir():
            lines.append(f"{field}: expected pictures of a board in {folder}, found none")
    return lines


def missing_films(
    used: Mapping[tuple[str, str], Mapping], lab: Mapping | None, paths: Mapping, filmed: str
) -> list[str]:
    """Probes whose file asks for what a recording shows that nobody took, a line each.

    ``used`` has the probe's file by object and sensor; ``filmed`` is the probe of the recordings.
    """
    lines = []
    for key, part in product(sorted(used), PARTS):
        sensor, probe = key[1], used[key]
        if (field := part.asking(probe)) is None:
            continue
        folder = Path(paths["raw"]) / "sensors" / sensor / part.recording
        place = f"{Path(paths['probes']) / probe['probe']}.yaml"
        if sensor not in recorded_by(lab, part.recording) and not folder.is_dir():
            expected = f"a recording of {part.shows} in {folder}"
            lines.append(f"{place}: {field}: expected {expected}, found none")
        elif filmed != probe["probe"]:
            expected = f"a recording of {probe['probe']} (experiments.probe, in config/config.yaml)"
            lines.append(f"{place}: {field}: expected {expected}, found one of {filmed or 'none'}")
    return list(dict.fromkeys(lines))
