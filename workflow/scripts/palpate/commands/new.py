"""The command ``palpate new``: the files of an object, its camera and its probe, to fill in."""

import argparse
import os
import textwrap
from collections.abc import Iterator, Mapping
from copy import deepcopy
from functools import reduce
from inspect import getdoc
from operator import getitem
from pathlib import Path
from typing import Any, get_args, get_origin

import yaml

from palpate.capture.devices import PLACES, add_devices, found_folder, raw_folder
from palpate.capture.discover import BACKGROUND, object_fault, sensor_fault, sensor_folders
from palpate.capture.files import write_text
from palpate.commands.help import add_verb
from palpate.config.model import (
    ABSENT,
    FILL_IN,
    Model,
    blank_fields,
    field_at,
    members,
    missing_fields,
)
from palpate.config.object import ObjectSpec
from palpate.config.probe import ProbeSpec
from palpate.config.sensor import SensorSpec

WIDTH, INDENT = 100, "  "
MODELS = {"object": ObjectSpec, "sensor": SensorSpec, "probe": ProbeSpec}
# What may be left out and is worth a thought, shown behind a #.
OFFERED = {
    "object": (("support", "contact"), ("deepest_m",)),
    "sensor": (("clock_offset_std_s",), ("depth", "count_m"), ("depth", "baseline_m")),
    "probe": (("stiffness_n_m",), ("load",), ("gauge",)),
}
# Encodings of each kind of sensor; an import fills them in.
ENCODINGS = {
    "depth": {"color": {"encoding": FILL_IN}, "depth": {"encoding": FILL_IN}},
    "structured_light": {"depth": {"encoding": "kinect_disparity"}},
    "stereo": {},
    "cloud": {},
}
NO_BOARD = "none"
BOARDS = ("checkerboard", "charuco", "aprilgrid", NO_BOARD)

ABOUT = """\
Begin an object: write its file, its camera's and its probe's, to fill in, and say what to do next.
Files that are there already are used as they are.
"""


def _new(options: argparse.Namespace) -> None:
    """Write the files, and say what to do next."""
    folder = raw_folder(options.raw) / options.object
    there = [place.folder.name for place in sensor_folders(folder)]
    sensor = options.sensor or next(iter(there), "camera")
    path = folder / "object.yaml"
    faults = {"object": object_fault(options.object), "sensor": sensor_fault(sensor)}
    faults["probe"] = sensor_fault(options.probe)
    if lines := [f"{path}: {name}: {fault}" for name, fault in faults.items() if fault]:
        raise ValueError("\n".join(lines))
    if os.path.lexists(path):
        raise ValueError(f"{path}: file: expected none yet, found one (it is left as it is)")
    sensors, probes = (
        found_folder(name, getattr(options, name), folder) or PLACES[name] for name in PLACES
    )
    stored = deepcopy(ENCODINGS[options.kind])
    camera, probe = {"marker": {}}, {"marker": {}, "exclusion": {"board_radius_m": FILL_IN}}
    if options.board == NO_BOARD or options.kind == "cloud":
        camera, probe = {"base": {"name": FILL_IN}}, {"tracked": FILL_IN}
    elif options.board != BOARDS[0]:
        probe["marker"]["kind"] = options.board
    files = [
        (sensors / f"{sensor}.yaml", {"sensor": sensor, "kind": options.kind, **stored, **camera}),
        (probes / f"{options.probe}.yaml", {"probe": options.probe, **probe}),
        (path, dict(object=options.object, probe=options.probe, template={"file": "template.ply"})),
    ]
    if files[0][0] == files[1][0]:
        raise ValueError(f"--probe: expected a file apart from the sensor's, found {files[0][0]}")
    # The object's comes last: what came before a failure is there already when one tries again.
    for (file, known), kind in zip(files, ("sensor", "probe", "object"), strict=True):
        lines.append(_written(file, kind, known))
    (folder / sensor).mkdir(exist_ok=True)
    blanks = [str(file) for file, _ in files if FILL_IN in file.read_text()]
    print("\n".join([*lines, *_next_steps(folder, folder / sensor, blanks)]))


def _next_steps(folder: Path, captures: Path, blanks: list[str]) -> Iterator[str]:
    yield "next:"
    yield f"  1. replace each {FILL_IN} in {', '.join(blanks)} (an import fills in the camera's)"
    yield f"  2. put the object's closed surface into {folder / 'template.ply'}"
    yield (
        f"  3. record the empty scene into {captures / BACKGROUND} and each indentation into"
        f" {captures}/<point>, or import them: palpate import <recording> {captures} --background;"
        f" palpate import <recording> {captures}/<point>"
    )
    yield f"  4. palpate check {folder}"
    yield f"  5. palpate direct {folder}; with tables, figures and a page:"
    yield f"     .venv/bin/snakemake -j2 --config only={folder.name}"


def _written(path: Path, kind: str, known: Mapping) -> str:
    """Write a file that is not there yet, as YAML in the model's order, a comment at each field."""
    if os.path.lexists(path):
        return f"{path}: there already, and used as it is"
    blank = _blank(kind, known)
    head = f"Put your values in place of each {FILL_IN}; `palpate check` says what is left."
    head += " What is behind a # may be left out; to use it, remove one # of each line."
    write_text(path, "\n".join([*_comment(head), "", *_lines(kind, (), blank, set()), ""]))
    return f"{path}: written, {len(blank_fields(blank))} fields to fill in"


def _blank(kind: str, known: Mapping) -> dict:
    """What is known, and in all other fields that are asked for an example, a default or a mark."""
    spec = deepcopy(dict(known))
    while missing := missing_fields(MODELS[kind], spec):
        for field in missing:
            reduce(getitem, field[:-1], spec)[field[-1]] = _value(kind, field)
    return spec


def _value(kind: str, place: tuple[str, ...]) -> Any:
    """What stands for a field that nobody has filled in."""
    kinds, field = field_at([MODELS[kind]], place)
    if field.examples:
        return deepcopy(field.examples[0])
    if isinstance(field.default, str | float) and field.default is not ABSENT:
        return field.default
    for one in kinds:
        if isinstance(one, type) and issubclass(one, Model):
            needed = [name for name, field in one.model_fields.items() if field.is_required()]
            return {name: _value(kind, (*place, name)) for name in needed}
    return _marks(kinds[0])


def _marks(kind: Any) -> Any:
    """As many marks as a value of a type has parts."""
    (kind,) = members([kind])
    return list(map(_marks, get_args(kind))) if get_origin(kind) is tuple else FILL_IN


def _lines(kind: str, place: tuple[str, ...], spec: Mapping, said: set[str]) -> Iterator[str]:
    """Lines of a mapping: its fields in the model's order, then those that people name."""
    kinds = field_at([MODELS[kind]], place)[0]
    known = [name for one in kinds for name in getattr(one, "model_fields", ())]
    for key in dict.fromkeys([*known, *spec]):
        field = (*place, key)
        if key in spec:
            yield from _field(kind, field, spec[key], said)
        elif field in OFFERED[kind]:
            yield from (f"# {line}" for line in _field(kind, field, _value(kind, field), said))


def _field(kind: str, place: tuple[str, ...], value: Any, said: set[str]) -> Iterator[str]:
    """Lines of a field; what was said of another one is not said again."""
    (kinds, field), key = field_at([MODELS[kind]], place), place[-1]
    block = next((getdoc(one) for one in kinds if hasattr(one, "model_fields")), "")
    text = (field and (field.description or block)) or ""
    yield from [] if text in said else _comment(text)
    said.add(text)
    if isinstance(value, Mapping):
        yield f"{key}:" if key.isidentifier() else f'"{key}":'
        yield from (INDENT + line for line in _lines(kind, place, value, said))
    else:
        flow = None if isinstance(value, list) else False
        yield from yaml.safe_dump({key: value}, default_flow_style=flow, width=WIDTH).splitlines()


def _comment(text: str) -> list[str]:
    return textwrap.wrap(text, WIDTH - 10, initial_indent="# ", subsequent_indent="# ")


def add(commands: Any) -> None:
    """Add the command to a parser's."""
    short = "begin an object: its files, to fill in"
    example = "palpate new sponge --sensor d435 --probe bench_probe"
    new = add_verb(commands, "new", short, _new, about=ABOUT, example=example)
    new.add_argument("object", help="its name, like red_sponge")
    new.add_argument("--sensor", help="the camera's name (camera)")
    new.add_argument("--probe", default="probe", help="the probe's name (probe)")
    text = "probe's (checkerboard); none: it is followed by a robot or a tracker"
    new.add_argument("--board", choices=BOARDS, default=BOARDS[0], help=text)
    new.add_argument("--kind", choices=ENCODINGS, default="depth", help="of camera (depth)")
    new.add_argument("--raw", type=Path, help="folder of all objects; else raw beside config")
    add_devices(new)
