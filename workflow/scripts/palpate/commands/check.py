"""The command ``palpate check``: all that is wrong with objects' captures."""

import argparse
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from palpate.capture.devices import PLACES, Devices, add_devices, raw_folder, read_devices
from palpate.capture.discover import NOT_OBJECTS, folders, sensor_folders
from palpate.capture.findings import Findings
from palpate.commands.found import Project
from palpate.commands.help import add_verb
from palpate.yaml_files import load_yaml

ABOUT = """\
Say all that is wrong with objects' folders, a line each, and what they hold where all is right;
what is left to fill in, too.
"""


def _check(options: argparse.Namespace) -> int:
    raw = raw_folder(options.raw)
    objects = options.folders or _objects(raw)
    if not objects:
        print(f"{raw}: folder: expected objects (<object>/object.yaml), found none")
        return 1
    status, used, others = 0, set(), {}
    for folder in objects:
        if not folder.is_dir():
            found = "a file" if folder.is_file() else "nothing"
            print(f"{folder}: folder: expected an object's, with object.yaml, found {found}")
            status = 1
            continue
        devices, missing = _devices(folder, options)
        if missing:
            print("\n".join(missing))
            status = 1
            continue
        wrong = _wrong_files(devices)
        needed = {path: wrong[path] for path in _files_of(folder, devices) if path in wrong}
        status |= _checked(folder, devices, [line for lines in needed.values() for line in lines])
        used, others = used | needed.keys(), others | wrong
    for path in sorted(others.keys() - used):
        print(f"worth a look: {_first(others[path])} (not used here)")
    return status


def _devices(folder: Path, options: argparse.Namespace) -> tuple[dict[str, Devices], list[str]]:
    """Files of sensors and of probes that stand nearest to an object, and what is not there."""
    found, missing = {}, []
    spec = _object_file(folder)
    curves_alone = "curves" in spec and "probe" not in spec and not sensor_folders(folder)
    for name, place in PLACES.items():
        try:
            found[name] = read_devices(name, getattr(options, name), folder)
        except ValueError as error:
            missing += [] if curves_alone else [str(error)]
            found[name] = Devices({}, {}, place)
    return found, missing


def _checked(folder: Path, devices: Mapping[str, Devices], lines: list[str]) -> int:
    """Say what an object's folder holds; 1 when anything is wrong with it or its devices' files."""
    from palpate.examine import examine_object

    project = Project.near(folder)
    config = project.config(None)
    specs = (devices[name].specs for name in PLACES)
    probe = devices["probes"].specs.get(_object_file(folder).get("probe"))
    lines += project.missing_films(folder, probe, devices["probes"].folder)
    findings = Findings(tuple(lines))
    findings += examine_object(folder, *specs, config, project.optics, project.calibrations)
    lines = list(findings.wrong) or [f"{folder}: nothing wrong"]
    places = {name: devices[name].folder for name in PLACES}
    if places != PLACES:
        lines.append(f"  sensors and probes: of {places['sensors']} and {places['probes']}")
    lines += [f"  {line}" for line in findings.found]
    lines += [f"worth a look: {line}" for line in findings.doubts]
    print("\n".join(lines))
    return 1 if findings.wrong else 0


def _wrong_files(devices: Mapping[str, Devices]) -> dict[Path, tuple[str, ...]]:
    """What is wrong with the files of sensors and probes, by file."""
    return {
        one.folder / f"{key}.yaml": lines
        for one in devices.values()
        for key, lines in one.problems.items()
    }


def _files_of(folder: Path, devices: Mapping[str, Devices]) -> list[Path]:
    """Files of the sensors and of the probe that an object names, there or not."""
    names = {"sensors": [place.folder.name for place in sensor_folders(folder)]}
    names["probes"] = [_object_file(folder).get("probe")]
    return [devices[kind].folder / f"{name}.yaml" for kind in PLACES for name in names[kind]]


def _object_file(folder: Path) -> Mapping:
    """What object.yaml says; nothing where it is none."""
    try:
        spec = load_yaml(folder / "object.yaml")
    except ValueError:
        return {}
    return spec if isinstance(spec, Mapping) else {}


def _first(lines: tuple[str, ...]) -> str:
    more = len(lines) - 1
    return lines[0] + (f", and {more} more" if more else "")


def _objects(raw: Path) -> list[Path]:
    return [folder for folder in folders(raw) if folder.name not in NOT_OBJECTS]


def add(commands: Any) -> None:
    """Add the command to a parser's."""
    check = add_verb(
        commands,
        "check",
        "say all that is wrong with objects' captures",
        _check,
        about=ABOUT,
        example="palpate check raw/sponge",
    )
    check.add_argument("folders", type=Path, nargs="*", help="raw/<object>; else all in raw/")
    check.add_argument("--raw", type=Path, help="folder of all objects; else raw beside config")
    add_devices(check)
