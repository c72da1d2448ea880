"""Commands of the capture format: ``check`` objects, ``import`` a recording."""

import argparse
import sys
from pathlib import Path
from typing import Any

from palpate.capture.check import SCHEMA
from palpate.capture.discover import NOT_OBJECTS, folders
from palpate.capture.examine import examine_object
from palpate.capture.importing import command
from palpate.capture.schema import load_yaml, validate


def _check(options: argparse.Namespace) -> int:
    sensors, problems = _specifications(options.sensors, "sensor")
    probes, more = _specifications(options.probes, "probe")
    problems += more
    # Captures are held to their sensor's file; with a wrong one there is nothing to hold them to.
    if problems:
        print("\n".join(problems))
        return 1
    objects = options.folders or _objects(options.raw)
    if not objects:
        print(f"{options.raw}: folder: expected objects (<object>/object.yaml), found none")
        return 1
    return max(_checked(folder, sensors, probes) for folder in objects)


def _checked(folder: Path, sensors: dict, probes: dict) -> int:
    """Say what an object's folder holds; 1 when anything is wrong with it."""
    findings = examine_object(folder, sensors, probes)
    lines = list(findings.wrong) or [f"{folder}: nothing wrong"]
    lines += [f"  {line}" for line in findings.found]
    lines += [f"worth a look: {line}" for line in findings.doubts]
    print("\n".join(lines))
    return 1 if findings.wrong else 0


def _objects(raw: Path) -> list[Path]:
    return [folder for folder in folders(raw) if folder.name not in NOT_OBJECTS]


def _import(options: argparse.Namespace) -> int:
    try:
        print("\n".join(command.run(options)))
    except (ValueError, OSError) as error:
        print(" ".join(str(error).split()), file=sys.stderr)
        return 1
    return 0


def _specifications(folder: Path, kind: str) -> tuple[dict, list[str]]:
    """Specifications of a folder by name, and what is wrong with them."""
    found, problems = {}, []
    for path in sorted(folder.glob("*.yaml")):
        try:
            found[path.stem] = load_yaml(path)
        except ValueError as error:
            problems.append(str(error))
            continue
        schema = SCHEMA.with_name(f"{kind}.schema.yaml")
        problems += validate(found[path.stem], schema, str(path))
    if not found and not problems:
        problems.append(f"{folder}: folder: expected a {kind} file (*.yaml), found none")
    return found, problems


def add_commands(commands: Any) -> None:
    """Add the commands ``check`` and ``import`` to a parser's."""
    check = commands.add_parser("check", help="say all that is wrong with objects' captures")
    check.add_argument("folders", type=Path, nargs="*", help="raw/<object>; else all in raw/")
    check.add_argument("--raw", type=Path, default=Path("raw"))
    add_devices(check)
    check.set_defaults(work=_check)
    recording = commands.add_parser("import", help="make a capture of a recording")
    command.add_options(recording)
    recording.set_defaults(work=_import)


def add_devices(parser: argparse.ArgumentParser) -> None:
    """Add the options that say where the files of sensors and probes are."""
    parser.add_argument("--sensors", type=Path, default=Path("config/sensors"))
    parser.add_argument("--probes", type=Path, default=Path("config/probes"))
