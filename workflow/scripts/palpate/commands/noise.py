"""The command ``palpate noise``: the noise floor of a rig, beside what its files state."""

import argparse
import json
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import yaml

from palpate.capture.devices import CONFIG, add_devices, raw_folder
from palpate.capture.files import whole_file, write_text
from palpate.commands.help import add_verb, check_figure, stage
from palpate.commands.project import Project, calibrated_devices, device_files
from palpate.units import MILLIMETRES
from palpate.workflow.configuration_checks import OF_NOISE, is_simulated

if TYPE_CHECKING:
    from palpate.noise import Quantity

ABOUT = """\
Measure the noise floor of tip, force and surface, beside what the files of sensor and probe and the
options state. Either of two recordings will do for its part:
  rest   nothing moves for twenty seconds: the probe in a clamp, unloaded, its target in view, and
         a flat surface with a pattern
  plate  a rigid flat plate with a pattern that fills the middle of the picture, at rest for five
         frames or more, then moved by hand by up to 10 mm to and fro and tilted a little; with the
         a second print of the target on it the camera's scale is determined too
They stand in raw/sensors/<sensor>/rest and raw/sensors/<sensor>/plate.
"""
EXAMPLE = "palpate noise d435 bench_probe --figure noise.png"
# What people read of an SI unit.
READ = {"m": ("mm", 1e3), "N": ("mN", 1e3), "rad": ("mrad", 1e3), "": ("%", 100)}
# Fields that take a value: of the sensor's file, and of the options.
FIELDS = ("base.", "direct.")
FRAME_FORCES = [f"f{k}, each frame" for k in "xyz"]


def _noise(options: argparse.Namespace) -> None:
    check_figure(options.figure)
    project, files = Project.near(Path()), device_files(options, Path(), options.probe)
    sensor, probe = calibrated_devices(files, project)
    folders, config = _recordings(options, sensor), project.config(options.config)
    from palpate.noise import measure

    with stage(f"{', '.join(map(str, folders.values()))}: poses, forces, clouds"):
        found = measure(sensor, probe, **folders, config=config)
    if options.figure:
        from palpate.report.noise_figure import noise_figure

        simulated = any(map(is_simulated, folders.values()))
        with whole_file(options.figure) as part:
            noise_figure(found, simulated=simulated).savefig(part, dpi=300)
    if options.json:
        print(json.dumps([vars(one) | {"ratio": one.ratio} for one in found.quantities], indent=2))
    else:
        print(f"{options.sensor}, {options.probe}: {', '.join(map(str, folders.values()))}")
        print("\n".join(_lines(found.quantities)))
        print(f"for palpate plan: {' '.join(_for_plan(found.quantities))}")
    of_options = options.config or (project.folder or Path()) / CONFIG
    for one in (k for k in found.quantities if k.exceeds and k.source.startswith(FIELDS)):
        path = files["sensors"] if one.source.startswith(FIELDS[0]) else of_options
        # Without an exponent, which YAML takes for text where a number has no point.
        value = np.format_float_positional(float(f"{one.value:.2g}"), trim="-")
        done = options.write and _written(path, one.source, value)
        was = f"{one.stated:g} till now; {'written' if done else 'to be put there'}"
        out = sys.stderr if options.json else sys.stdout
        print(f"{path}: {one.source}: {value} ({was})", file=out)


def _recordings(options: argparse.Namespace, sensor: Mapping) -> dict[str, Path]:
    """Folders of the recordings that there are, each right."""
    beside = raw_folder(None) / "sensors" / options.sensor
    found = {name: getattr(options, name) or beside / name for name in OF_NOISE}
    found = {k: path for k, path in found.items() if getattr(options, k) or path.is_dir()}
    if not found:
        raise ValueError(f"{beside}: folder: expected rest, plate or both in it, found neither")
    lines = [line for name, path in found.items() for line in OF_NOISE[name](path, sensor)]
    if lines:
        raise ValueError("\n".join(lines))
    return found


def _lines(quantities: list["Quantity"]) -> Iterator[str]:
    """A row for each quantity, and what is said of it."""
    yield f"  {'':36}{'measured':>11}{'stated':>11}{'ratio':>7}"
    for one in quantities:
        unit, scale = READ[one.unit]
        measured, beside = f"{scale * one.value:.3g} {unit}", f"{'':18}  {one.source}"
        if one.ratio is not None:
            said = "exceeds" if one.exceeds else "within"
            stated = f"{scale * one.stated:.3g} {unit}"
            beside = f"{stated:>11}{one.ratio:7.2f}  {said}: {one.source}"
        yield f"  {one.name:36}{measured:>11}{beside}"


def _for_plan(quantities: list["Quantity"]) -> Iterator[str]:
    """Options of `palpate plan` that were measured; the tip's is its pose's, which rest hides."""
    known = {one.name: one.value for one in quantities}
    if surface_m := known.get("displacement, each sample and frame"):
        yield f"--surface-noise-mm {MILLIMETRES * surface_m:.2g}"
    if forces_n := [value for name, value in known.items() if name in FRAME_FORCES]:
        yield f"--force-noise-n {max(forces_n):.2g}"


def _written(path: Path, field: str, value: str) -> bool:
    """Put a number in the place of one in a YAML file, whose comments stay; whether it is there."""
    text = path.read_text(encoding="utf-8") if path.is_file() else ""
    node = yaml.compose(text)
    for key in field.split("."):
        pairs = node.value if isinstance(node, yaml.MappingNode) else ()
        node = next((inner for name, inner in pairs if name.value == key), None)
    if not isinstance(node, yaml.ScalarNode):
        return False
    write_text(path, text[: node.start_mark.index] + value + text[node.end_mark.index :])
    return True


def add(commands: Any) -> None:
    """Add the command to a parser's."""
    short = "noise of tip, force and surface"
    verb = add_verb(commands, "noise", short, _noise, about=ABOUT, example=EXAMPLE)
    verb.add_argument("sensor", help="its name, like d435")
    verb.add_argument("probe", help="its name, like bench_probe")
    for name in OF_NOISE:
        verb.add_argument(f"--{name}", type=Path, help="recording that stands elsewhere")
    verb.add_argument("--figure", type=Path, help="draw it (.png, .svg, .pdf)")
    verb.add_argument("--json", action="store_true", help="for programs")
    verb.add_argument("--write", action="store_true", help="put into the files what has a field")
    verb.add_argument("--config", type=Path, help="options of all steps; else config/config.yaml")
    add_devices(verb)
