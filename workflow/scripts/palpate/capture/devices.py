"""Files of sensors and probes: where they stand, and what they say."""

import argparse
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from palpate.capture.discover import sensor_fault
from palpate.config.model import problems
from palpate.config.probe import ProbeSpec
from palpate.config.sensor import SensorSpec
from palpate.yaml_files import load_yaml

MODELS = {"sensors": SensorSpec, "probes": ProbeSpec}
CONFIG = Path("config/config.yaml")
PLACES = {"sensors": Path("config/sensors"), "probes": Path("config/probes")}


@dataclass(frozen=True)
class Devices:
    """Files of a folder of sensors, or of probes, by name."""

    specs: Mapping[str, Mapping | None]  # None of a wrong one
    problems: Mapping[str, tuple[str, ...]]  # lines of each wrong one
    folder: Path


def add_devices(parser: argparse.ArgumentParser, *names: str) -> None:
    """Add the options that say where the files of sensors and probes are."""
    for name in names or PLACES:
        text = f"folder of their files; else the nearest {PLACES[name]} above the object, or here"
        parser.add_argument(f"--{name}", type=Path, help=text)


def found_folder(name: str, given: Path | None, near: Path) -> Path | None:
    """Where files of ``sensors`` or of ``probes`` stand, by the current folder; None if nowhere.

    The folder that is given, as it is; else that of ``paths`` in config/config.yaml, or `PLACES`:
    the first that exists going up from ``near``, an object's or a capture's folder, then from here.
    """
    if given is not None:
        return given
    for start in map(Path, (os.path.abspath(near), os.getcwd())):
        for folder in (start, *start.parents):
            content = load_yaml(folder / CONFIG) if (folder / CONFIG).is_file() else None
            paths = content.get("paths") if isinstance(content, Mapping) else None
            stated = paths.get(name) if isinstance(paths, Mapping) else None
            place = folder / (stated or PLACES[name])
            if os.path.isdir(place):
                return Path(os.path.relpath(place))
    return None


def device_folder(name: str, given: Path | None, near: Path) -> Path:
    """Like `found_folder`.

    Raises
    ------
    ValueError
        That says where it looked, if there is none.
    """
    folder = found_folder(name, given, near)
    if folder is None:
        looked = f"in {os.path.abspath(near)}, in {os.getcwd()} and above them"
        expected = f"a folder of {name[:-1]} files {looked} (or --{name})"
        raise ValueError(f"{PLACES[name]}: folder: expected {expected}, found none")
    return folder


def raw_folder(given: Path | None) -> Path:
    """Folder of the objects: that asked for, else the one here, else beside ``config``."""
    if given is not None or os.path.isdir("raw"):
        return given or Path("raw")
    above = [Path.cwd(), *Path.cwd().parents]
    marks = CONFIG, PLACES["sensors"]
    beside = (one for one in above if any(os.path.exists(one / mark) for mark in marks))
    return Path(os.path.relpath(next(beside, above[0]) / "raw"))


def read_devices(name: str, given: Path | None, near: Path) -> Devices:
    """Read the files of sensors or of probes, right and wrong ones; see `found_folder`.

    Raises
    ------
    ValueError
        If there are none.
    """
    folder = device_folder(name, given, near)
    files = folder.glob("*.yaml") if os.path.isdir(folder) else ()
    read = {path.stem: read_device(path, name) for path in sorted(files)}
    if not read:
        raise ValueError(f"{folder}: folder: expected a {name[:-1]} file (*.yaml), found none")
    problems = {key: lines for key, (_, lines) in read.items() if lines}
    specs = {key: None if lines else spec for key, (spec, lines) in read.items()}
    return Devices(specs, problems, folder)


def read_device(path: Path, name: str) -> tuple[Mapping | None, tuple[str, ...]]:
    """What a file of sensors or of probes says, and what is wrong with it, as lines."""
    kind = name[:-1]
    try:
        spec = load_yaml(path)
    except ValueError as error:
        return None, (str(error),)
    if lines := problems(MODELS[name], spec, str(path)):
        return spec, tuple(lines)
    spec = MODELS[name].plain(spec)
    if spec[kind] != path.stem:
        lines.append(f"{path}: {kind}: expected {path.stem}, found {spec[kind]}")
    lines += [f"{path}: {kind}: {fault}"] if (fault := sensor_fault(path.stem)) else []
    return spec, tuple(lines)
