"""Which captures are the lab's to make, and that it never takes over what people dropped."""

from collections import defaultdict
from collections.abc import Iterable, Mapping
from pathlib import Path

from palpate.capture.discover import CaptureId
from palpate.yaml_files import load_yaml

# Snakemake leaves it in each folder that a rule wrote.
MADE_BY_A_RULE = ".snakemake_timestamp"


def recordings(
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
    folders = [raw / name / c.sensor / c.capture for c in found]
    if all((folder / MADE_BY_A_RULE).is_file() for folder in folders):
        return True
    problems.append(f"{path}: file: expected a file, found none")
    return False


def dropped_among(
    made: Mapping[str, set], there: defaultdict[str, set[CaptureId]], paths: Mapping
) -> list[str]:
    """Captures that people dropped into an object of the lab, which would pass for simulated."""
    strange = sorted(c for name in made for c in there[name] - made[name])
    folders = [Path(paths["raw"], c.object, c.sensor, c.capture) for c in strange]
    return [
        f"{folder}: capture: expected the lab's alone in an object that {paths['lab']} makes,"
        " found another (give recordings an object of their own)"
        for folder in folders
        if not (folder / MADE_BY_A_RULE).is_file()
    ]


def still_the_labs(made: set[CaptureId], there: set[CaptureId]) -> bool:
    """Whether the lab alone fills an object's folder, or has still to complete it."""
    return bool(made) and (there <= made or bool(made - there))


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
