"""The command ``palpate new``: the files of an object, its camera and its probe, to fill in."""

import argparse
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from palpate.capture.blanks import blank, blank_text
from palpate.capture.devices import PLACES, add_devices, found_folder, raw_folder
from palpate.capture.discover import BACKGROUND, object_fault, sensor_fault, sensor_folders
from palpate.capture.files import write_text
from palpate.commands.help import add_verb
from palpate.config.model import FILL_IN, blank_fields

# What a depth image of each kind of sensor holds.
ENCODINGS = {"depth": "millimetre", "structured_light": "kinect_disparity", "stereo": None}

BOARDS = ("checkerboard", "charuco", "aprilgrid")

ABOUT = """\
Begin an object: write its file, its camera's and its probe's, to fill in, and say what to do next.
Files that are there already are used as they are.
"""


def _new(options: argparse.Namespace) -> None:
    """Write the files, and say what to do next."""
    folder = raw_folder(options.raw) / options.object
    sensor = options.sensor or _there_already(folder) or "camera"
    path = folder / "object.yaml"
    _require_names(path, options.object, sensor, options.probe)
    if os.path.lexists(path):
        raise ValueError(f"{path}: file: expected none yet, found one (it is left as it is)")
    sensors, probes = (
        found_folder(name, getattr(options, name), folder) or PLACES[name] for name in PLACES
    )
    known = {"object": options.object, "probe": options.probe}
    marker = {"marker": {"kind": options.board}} if options.board != BOARDS[0] else {}
    files = {
        sensors / f"{sensor}.yaml": ("sensor", _known_of_sensor(sensor, options.kind)),
        probes / f"{options.probe}.yaml": ("probe", {"probe": options.probe} | marker),
        path: ("object", known | {"template": {"file": "template.ply"}}),
    }
    # The object's comes last: what came before a failure is there already when one tries again.
    told = [_written(*item) for item in files.items()]
    (folder / sensor).mkdir(exist_ok=True)
    blanks = [path for path, line in zip(files, told, strict=True) if FILL_IN in path.read_text()]
    print("\n".join(told + _next(folder, sensor, blanks)))


def _there_already(folder: Path) -> str | None:
    """A sensor that has captures of the object."""
    return next((place.folder.name for place in sensor_folders(folder)), None)


def _require_names(path: Path, subject: str, sensor: str, probe: str) -> None:
    faults = {"object": object_fault(subject), "sensor": sensor_fault(sensor)}
    faults["probe"] = sensor_fault(probe)
    lines = [f"{path}: {name}: {fault}" for name, fault in faults.items() if fault]
    if lines:
        raise ValueError("\n".join(lines))


def _known_of_sensor(name: str, kind: str) -> dict:
    depth = {"depth": {"encoding": ENCODINGS[kind]}} if ENCODINGS[kind] else {}
    return {"sensor": name, "kind": kind, **depth}


def _written(path: Path, content: tuple[str, Mapping]) -> str:
    if os.path.lexists(path):
        return f"{path}: there already, and used as it is"
    write_text(path, blank_text(*content))
    return f"{path}: written, {len(blank_fields(blank(*content)))} fields to fill in"


def _next(folder: Path, sensor: str, files: list[Path]) -> list[str]:
    """What is to be done now, numbered."""
    captures = folder / sensor
    steps = [
        f"replace each {FILL_IN} in {', '.join(map(str, files))}",
        f"put the object's closed surface into {folder / 'template.ply'}",
        f"record the empty scene into {captures / BACKGROUND} and each press into"
        f" {captures}/<point>, or make them of recordings (this fills in the camera's file too):"
        f" palpate import <recording> {captures}/<point>",
        f"palpate check {folder}",
        f".venv/bin/snakemake -j2 --config only={folder.name}",
    ]
    return ["next:", *(f"  {number}. {step}" for number, step in enumerate(steps, 1))]


def add(commands: Any) -> None:
    """Add the command to a parser's."""
    new = add_verb(
        commands,
        "new",
        "begin an object: its files, to fill in",
        _new,
        about=ABOUT,
        example="palpate new sponge --sensor d435 --probe bench_probe",
    )
    new.add_argument("object", help="its name, like red_sponge")
    new.add_argument("--sensor", help="the camera's name (camera)")
    new.add_argument("--probe", default="probe", help="the probe's name (probe)")
    new.add_argument("--board", choices=BOARDS, default=BOARDS[0], help="probe's (checkerboard)")
    new.add_argument("--kind", choices=ENCODINGS, default="depth", help="of camera (depth)")
    new.add_argument("--raw", type=Path, help="folder of all objects; else raw beside config")
    add_devices(new)
