"""Command line of the capture format: ``check`` an object, ``import`` a recording."""

import argparse
import sys
from pathlib import Path

from palpate.capture.check import SCHEMA, check_object
from palpate.capture.discover import BACKGROUND, NOT_SENSORS, folders
from palpate.capture.importing import command
from palpate.capture.schema import load_yaml, validate
from palpate.capture.tables import read_force, read_frames


def main(arguments: list[str] | None = None) -> int:
    """Check an object's folder or import a recording; the exit status is 1 if that fails."""
    options = _parser().parse_args(arguments)
    return options.work(options)


def _check(options: argparse.Namespace) -> int:
    sensors, problems = _specifications(options.sensors, "sensor")
    probes, more = _specifications(options.probes, "probe")
    problems += more
    # Captures are held to their sensor's file; with a wrong one there is nothing to hold them to.
    problems = problems or check_object(options.folder, sensors, probes)
    print("\n".join(problems or _found(options.folder)))
    return 1 if problems else 0


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


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m palpate.capture")
    commands = parser.add_subparsers(required=True)
    check = commands.add_parser("check", help="say all that is wrong with an object's captures")
    check.add_argument("folder", type=Path, help="raw/<object>")
    check.add_argument("--sensors", type=Path, default=Path("config/sensors"))
    check.add_argument("--probes", type=Path, default=Path("config/probes"))
    check.set_defaults(work=_check)
    recording = commands.add_parser("import", help="make a capture of a recording")
    command.add_options(recording)
    recording.set_defaults(work=_import)
    return parser


def _found(folder: Path) -> list[str]:
    """Describe what is there, a line for each capture."""
    lines = [f"{folder}: nothing wrong"]
    for sensor in folders(folder):
        if sensor.name in NOT_SENSORS:
            continue
        for capture in folders(sensor):
            frames = read_frames(capture)
            seconds = frames["time_s"].iloc[-1] - frames["time_s"].iloc[0]
            line = f"  {sensor.name}/{capture.name}: {len(frames)} frames over {seconds:.2f} s"
            if capture.name != BACKGROUND:
                line += f", {len(read_force(capture))} force samples"
            lines.append(line)
    return lines


if __name__ == "__main__":
    sys.exit(main())
