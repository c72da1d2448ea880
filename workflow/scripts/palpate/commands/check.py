"""The command ``palpate check``: all that is wrong with objects' captures."""

import argparse
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from palpate.capture.devices import PLACES, Devices, add_devices, raw_folder, read_devices
from palpate.capture.discover import object_folders, sensor_folders
from palpate.commands.help import add_verb, stage
from palpate.commands.project import Project
from palpate.yaml_files import load_yaml

ABOUT = """\
Say all that is wrong with objects' folders, a line each, and what they hold where all is right;
what is left to fill in, too.
"""


def _check(options: argparse.Namespace) -> int:
    raw = raw_folder(options.raw)
    objects = options.folders or object_folders(raw)
    if not objects:
        print(f"{raw}: folder: expected objects (<object>/object.yaml), found none")
        return 1
    status, used, wrong = 0, set(), {}
    for folder in objects:
        spec, places = {}, sensor_folders(folder)
        sensors = [place.folder.name for place in places]
        with suppress(ValueError):
            spec = load_yaml(folder / "object.yaml")
        spec = spec if isinstance(spec, Mapping) else {}
        try:
            devices = _devices(folder, spec, sensors, options)
        except ValueError as error:
            print(error)
            status = 1
            continue
        for of in devices.values():
            wrong |= {of.folder / f"{name}.yaml": lines for name, lines in of.problems.items()}
        files = [devices["sensors"].folder / f"{name}.yaml" for name in sensors]
        files += [devices["probes"].folder / f"{spec.get('probe')}.yaml"]
        used |= set(files)
        lines = [line for path in files for line in wrong.get(path, ())]
        empty = "curves" not in spec and not any(place.captures for place in places)
        status |= _checked(folder, spec, sensors, devices, lines, empty)
    for path in sorted(wrong.keys() - used):
        first, more = wrong[path][0], len(wrong[path]) - 1
        print(f"worth a look: {first}{f', and {more} more' * bool(more)} (not used here)")
    return status


def _devices(
    folder: Path, spec: Mapping, sensors: list[str], options: argparse.Namespace
) -> dict[str, Devices]:
    """Files of sensors and of probes that stand nearest to an object; curves alone need none."""
    if not folder.is_dir():
        found = "a file" if folder.is_file() else "nothing"
        raise ValueError(f"{folder}: folder: expected an object's, with object.yaml, found {found}")
    found, missing = {}, []
    for name, place in PLACES.items():
        try:
            found[name] = read_devices(name, getattr(options, name), folder)
        except ValueError as error:
            missing.append(str(error))
            found[name] = Devices({}, {}, place)
    if missing and (sensors or "curves" not in spec or "probe" in spec):
        raise ValueError("\n".join(missing))
    return found


def _checked(
    folder: Path, spec: Mapping, sensors: list[str], devices: Mapping, lines: list[str], empty: bool
) -> int:
    """Say what an object's folder holds; 1 when anything is wrong with it or its devices' files."""
    from palpate.capture.findings import Findings
    from palpate.examine import examine_object

    project, places = Project.near(folder), {name: devices[name].folder for name in PLACES}
    specs, config = [devices[name].specs for name in PLACES], project.config(None)
    if (probe := devices["probes"].specs.get(spec.get("probe"))) is not None:
        lines += _missing_recordings(project, folder, sensors, probe, places["probes"])
    findings = Findings(tuple(lines))
    with stage(f"{folder}: template, images, forces"):
        findings += examine_object(folder, *specs, config, project.optics, project.calibrations)
    so_far = f", and no capture yet: expected in {folder}/<sensor>/<point>" if empty else ""
    lines = list(findings.wrong) or [f"{folder}: nothing wrong{so_far}"]
    if places != PLACES:
        lines.append(f"  sensors and probes: of {places['sensors']} and {places['probes']}")
    lines += [f"  {line}" for line in findings.found]
    lines += [f"worth a look: {line}" for line in findings.warnings]
    print("\n".join(lines))
    return 1 if findings.wrong else 0


def _missing_recordings(
    project: Project, folder: Path, sensors: list[str], probe: Mapping, probes: Path
) -> list[str]:
    """What a run would miss of the recordings that an object's probe asks for, as lines."""
    from palpate.workflow.configuration_checks import missing_films
    from palpate.workflow.places import CONFIGURATION, LAB

    # Without a configuration nobody says which probe was recorded.
    recorded = probe["probe"] if project.folder is None else ""
    for path in CONFIGURATION:
        recorded = (project.read(path).get("experiments") or {}).get("probe", recorded)
    used = {(folder.name, sensor): probe for sensor in sensors}
    paths = {"raw": folder.parent, "probes": probes}
    return missing_films(used, project.read(LAB), paths, recorded)


def add(commands: Any) -> None:
    """Add the command to a parser's."""
    short, example = "say all that is wrong with objects' captures", "palpate check raw/sponge"
    check = add_verb(commands, "check", short, _check, about=ABOUT, example=example)
    check.add_argument("folders", type=Path, nargs="*", help="raw/<object>; else all in raw/")
    check.add_argument("--raw", type=Path, help="folder of all objects; else raw beside config")
    add_devices(check)
