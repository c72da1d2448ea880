"""What is wrong with a configuration beside its options' own bounds, a line for each thing.

Also which captures the lab makes: it never takes over those that people dropped into its folders.
"""

from collections import defaultdict
from collections.abc import Collection, Iterable, Mapping
from itertools import product
from pathlib import Path

from palpate.capture.check_capture import check_images
from palpate.capture.discover import CaptureId, folders
from palpate.capture.experiments import check_experiment, check_with_force
from palpate.config.probe import PARTS
from palpate.config.sensor import HAND_EYE, asks_for_base
from palpate.yaml_files import load_yaml

LONGEST_PATH = 1000
# Recordings that `palpate noise` takes, and no run.
OF_NOISE = {"rest": check_with_force, "plate": check_images}
# Snakemake leaves it in each folder that a rule wrote.
MADE_BY_A_RULE = ".snakemake_timestamp"


def path_problems(paths: Mapping, source: str) -> list[str]:
    """Say what is wrong with ``paths`` of the configuration, by what they hold."""
    lines = [
        f"{source}: paths.{key}: expected printable characters, at most {LONGEST_PATH}, found"
        f" {value[:60]!a}"
        for key, value in paths.items()
        if value is not None and not (value.isprintable() and len(value) <= LONGEST_PATH)
    ]
    if lines:
        return lines
    # Results in raw/ would be written over captures that nobody can make again.
    results = Path(paths["results"]).resolve()
    return [
        f"{source}: paths.results: expected a folder outside paths.{key}, {paths[key]}, found"
        f" {paths['results']}"
        for key in ("raw", "sensors", "probes", "meshes")
        if results.is_relative_to(Path(paths[key]).resolve())
    ]


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
    objects, blocks = ((lab or {}).get(key, {}).values() for key in ("objects", "experiments"))
    sensors = {name for spec in objects for name in (*spec["recordings"], *spec["cameras"])}
    probes = {one["probe"] for one in (*(o["object"] for o in objects), *blocks) if "probe" in one}
    return {"sensors": sensors.union(*(block["sensors"] for block in blocks)), "probes": probes}


def recorded_by(lab: Mapping | None, experiment: str) -> Collection[str]:
    """Sensors of which the lab records an experiment."""
    return (lab or {}).get("experiments", {}).get(experiment, {"sensors": []})["sensors"]


def missing_calibrations(
    used: set[str], sensors: Mapping, lab: Mapping | None, paths: Mapping
) -> list[str]:
    """Sensors whose optics, or base, are to come from a recording that nobody took, a line each."""
    made, lines = recorded_by(lab, "calibration"), []
    for name in sorted(used):
        spec, place = sensors.get(name) or {}, Path(paths["raw"], "sensors", name)
        file, hand_eye = f"{Path(paths['sensors']) / name}.yaml", place / HAND_EYE
        if asks_for_base(spec) and not hand_eye.is_dir():
            expected = f"expected a recording of a target in {hand_eye}"
            lines.append(f"{file}: base.camera_from_base: {expected}, found none")
        if spec.get("optics") != "calibration":
            continue
        if "depth" not in spec:
            # Its images are rectified: the camera that they show is none of those before the board.
            expected = "stated, those of `palpate calibrate camera --kind stereo`"
            lines.append(f"{file}: optics: expected {expected}, found calibration")
        elif name not in made and not (folder := place / "calibration").is_dir():
            lines.append(f"{file}: optics: expected pictures of a board in {folder}, found none")
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


def lab_captures(
    name: str, spec: Mapping, source: str, sensors: Mapping, probes: Mapping, problems: list[str]
) -> set[CaptureId]:
    """Captures that the lab makes of one of its objects."""
    named = ("object.probe", probes, [spec["object"]["probe"]])
    problems += [
        f"{source}: objects.{name}.{field}: expected one of {', '.join(sorted(known))}, found {one}"
        for field, known, ones in (named, ("recordings", sensors, spec["recordings"]))
        for one in ones
        if one not in known
    ]
    return {
        CaptureId(name, sensor, str(capture))
        for sensor, captures in spec["recordings"].items()
        for capture in captures
    }


def is_the_labs(name: str, raw: Path, found: set[CaptureId], problems: list[str]) -> bool:
    """Whether the lab may write an object's folder: never one that people filled.

    It is the lab's when its object.yaml says so, or when there is none and every capture there
    carries the mark of a rule's output.
    """
    path = raw / name / "object.yaml"
    if path.is_file():
        try:
            return (load_yaml(path) or {}).get("provenance") == "simulated"
        except (ValueError, AttributeError):
            return False
    places = [raw / name / c.sensor / c.capture for c in found]
    made = all((place / MADE_BY_A_RULE).is_file() for place in places)
    problems += [f"{path}: file: expected a file, found none"] * (not made)
    return made


def dropped_among(
    made: Mapping[str, set], there: defaultdict[str, set[CaptureId]], paths: Mapping
) -> list[str]:
    """Captures that people dropped into an object of the lab, which would pass for simulated."""
    strange = sorted(c for name in made for c in there[name] - made[name])
    places = [Path(paths["raw"], c.object, c.sensor, c.capture) for c in strange]
    return [
        f"{place}: capture: expected the lab's alone in an object that {paths['lab']} makes,"
        " found another (give recordings an object of their own)"
        for place in places
        if not (place / MADE_BY_A_RULE).is_file()
    ]


def by_object(captures: Iterable[CaptureId]) -> defaultdict[str, set[CaptureId]]:
    """Captures by the name of their object."""
    groups = defaultdict(set)
    for capture in captures:
        groups[capture.object].add(capture)
    return groups


def says_simulated(folder: Path) -> bool:
    """Whether the lab may write a folder of an experiment: it is not there, or says simulated."""
    return not folder.exists() or is_simulated(folder)


def is_simulated(folder: str | Path) -> bool:
    """Whether an experiment's recording.yaml says that the lab made it."""
    try:
        text = (Path(folder) / "recording.yaml").read_text(encoding="utf-8")
    except OSError:
        return False
    return "provenance: simulated" in text.splitlines()
