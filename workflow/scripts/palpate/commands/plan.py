"""The command ``palpate plan``: what a rig can determine of an object, before it is recorded."""

import argparse
import json
import sys
from collections.abc import Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.capture.devices import add_devices
from palpate.capture.files import whole_file
from palpate.commands.help import add_verb, check_figure, stage
from palpate.commands.project import Project, calibrated_devices, device_files, stated_devices
from palpate.config.object import ObjectSpec
from palpate.modulus import BOUNDED, IDENTIFIED, LABELS, NOT_IDENTIFIED
from palpate.units import MILLIMETRES, PERCENT
from palpate.yaml_files import load_yaml

if TYPE_CHECKING:
    from palpate.plan import Forecast, Noise, Planned, Protocol

ABOUT = """\
Say how narrow the intervals of E* and E and of Poisson's ratio are going to be, before anything is
recorded: for a protocol and for others that differ in one thing, from the indentation table of a
point, the rig's noise and a guess of E. The table is made once and kept.
"""
EXAMPLE = "palpate plan raw/sponge --sensor d435 --modulus-kpa 30"
# Of the maximum depth that the table has.
USUAL_PART = 0.8
# Where nothing is said [mm]; and the most that a plan is drawn up for.
DISTANCE_MM, LARGEST = 700.0, 1e9
MOST = {"frame_rate_hz": 300, "captures": 100}
# Options, fields of `palpate.plan.Noise`, and units in an SI one.
NOISES = {
    "tip_noise_mm": ("tip_m", MILLIMETRES),
    "surface_noise_mm": ("surface_m", MILLIMETRES),
    "force_noise_n": ("force_n", 1.0),
}
OF_NU = {
    IDENTIFIED: "is going to be identified",
    BOUNDED: "is going to be bounded only",
    NOT_IDENTIFIED: "is not going to be identified",
}
SHOWN = ("effective_reduced_modulus_pa", "reduced_modulus_pa", "youngs_modulus_pa")
NU, E = "poisson_ratio", "youngs_modulus_pa"
HEADINGS = ("protocol", *(LABELS[name] for name in (*SHOWN, NU)), "nu is", "E is limited by")


def _plan(options: argparse.Namespace) -> int:
    """Table, three sentences and a figure."""
    check_figure(options.figure)
    _check_options(options)
    planned = _planned(options)
    with stage("forecasts of the protocols"):
        rows = dict(planned.varied(_protocol(options, planned)))
    if options.figure:
        from palpate.report.plan_figure import plan_figure

        with whole_file(options.figure) as part:
            plan_figure(rows).savefig(part)
    if options.json:
        rig = {"noise": vars(planned.noise), "youngs_modulus_pa": planned.youngs_modulus_pa}
        rig |= {"poisson_ratio": planned.poisson_ratio}
        forecasts = [{"change": text} | one.to_dict() for text, one in rows.items()]
        print(json.dumps(rig | {"forecasts": forecasts}, indent=2))
        return 0
    print("\n".join([*_table(rows), "", *_sentences(rows, planned.noise)]))
    return 0


def _check_options(options: argparse.Namespace) -> None:
    for name in (*NOISES, "modulus_kpa", "depth_mm", "distance_mm", *MOST):
        value, shown, most = getattr(options, name), f"--{name.replace('_', '-')}", MOST.get(name)
        if value is not None and not 0 < value <= (most or LARGEST):
            ends = f"above 0 and up to {most}" if most else "above 0"
            raise ValueError(f"{shown}: expected a number {ends}, found {value:g}")
    if not 0 <= options.nu < 0.5:
        raise ValueError(f"--nu: expected from 0 to below 0.5, found {options.nu:g}")
    if options.camera_mm and options.distance_mm:
        raise ValueError("--distance-mm: expected none beside --camera-mm, found one")


def _planned(options: argparse.Namespace) -> "Planned":
    """What files say of object, sensor and probe, with the table of the point."""
    from palpate.commands.tables import TablePoint
    from palpate.noise import BASELINE_M, Noise, baseline_of
    from palpate.plan import Planned
    from palpate.solid.support import read_support
    from palpate.surface.template import read_template

    folder = options.folder
    declared = load_yaml(path := folder / "object.yaml")
    ObjectSpec.read(declared, str(path))
    declared = ObjectSpec.plain(declared)
    name = options.probe or declared.get("probe")
    if name is None:
        raise ValueError(f"{folder}/object.yaml: probe: expected one (or --probe), found none")
    sensor, probe = _devices(options, name)
    point = options.point or next(iter(declared["points"]))
    if point not in declared["points"]:
        expected = f"one of {', '.join(declared['points'])}"
        raise ValueError(f"--point: expected {expected}, found {point}")
    project = Project.near(folder)
    config = project.config(None)
    deepest_m = declared.get("deepest_m", config.direct.model.deepest_m)
    if options.depth_mm and options.depth_mm > deepest_m * MILLIMETRES:
        expected = f"up to the {deepest_m * MILLIMETRES:g} mm of the table (deepest_m)"
        raise ValueError(f"--depth-mm: expected {expected}, found {options.depth_mm:g}")
    path = _template(folder, declared, project)
    template = read_template(path, unit=declared["template"]["unit"])
    of_object = folder, declared, path, template, read_support(declared["support"])
    of_point = point, probe["indenter"]["radius_m"], config.direct.model
    begin = partial(stage, lasting=True)
    table = TablePoint(*of_object, *of_point).table(project, begin)
    away_m = (options.distance_mm or DISTANCE_MM) / MILLIMETRES
    if options.camera_mm:
        away_m = float(np.linalg.norm(np.array(options.camera_mm) / MILLIMETRES - table.point_m))
    noise = vars(Noise.expected(sensor, probe, away_m))
    if not options.surface_noise_mm and not baseline_of(sensor):
        assumed = f"{BASELINE_M * MILLIMETRES:g} mm assumed, for the noise of the surface"
        print(f"{options.sensor}: no baseline_m of the depth camera: {assumed}", file=sys.stderr)
    for name, (field, scale) in NOISES.items():
        if (value := getattr(options, name)) is not None:
            noise[field] = value / scale
    rig, guess = (sensor, probe, Noise(**noise)), (options.modulus_kpa * 1e3, options.nu)
    fit, observation = config.direct.fit, config.direct.observation
    return Planned(table, *of_object[3:], *rig, *guess, options=fit, observation=observation)


def _devices(options: argparse.Namespace, probe: str) -> tuple[Mapping, Mapping]:
    """Sensor and probe as a run calibrated them, or as stated where none has yet."""
    stated = stated_devices(files := device_files(options, options.folder, probe))
    try:
        return calibrated_devices(files, Project.near(options.folder))
    except ValueError as error:
        print(f"{error}; planned with the numbers of the file", file=sys.stderr)
        return stated


def _template(folder: Path, declared: Mapping, project: Project) -> Path:
    """The template's file, or the one that a run made of scans."""
    path = project.results(declared["object"], "template.ply")
    if file := declared["template"].get("file"):
        path = folder / file
    if not path or not path.is_file():
        expected = "a closed surface (of scans a run makes one first)"
        raise ValueError(f"{folder}/object.yaml: template: expected {expected}, found no {path}")
    return path


def _protocol(options: argparse.Namespace, planned: "Planned") -> "Protocol":
    """The protocol that is asked for, the camera where it stands or where it does best."""
    from palpate.plan import Protocol

    rate_hz = options.frame_rate_hz or planned.sensor["frame_rate_hz"]
    usual_m, depth_m = USUAL_PART * float(planned.table.depth_m[-1]), options.depth_mm
    depth_m = depth_m / MILLIMETRES if depth_m else usual_m
    camera_m = np.array(options.camera_mm or (0, 0, 0), dtype=float) / MILLIMETRES
    protocol = Protocol(depth_m, rate_hz, planned.table.radius_m, camera_m, options.captures)
    if options.camera_mm:
        return protocol
    return planned.best_camera(protocol, (options.distance_mm or DISTANCE_MM) / MILLIMETRES)


def _table(rows: Mapping[str, "Forecast"]) -> Iterator[str]:
    """Half-widths of the intervals (95 %), a line for each protocol."""
    cells = [HEADINGS]
    for text, one in rows.items():
        widths = [f"+-{PERCENT * one.half_width[name]:.0f} %" for name in SHOWN]
        nu = f"+-{one.half_width[NU]:.2f}", one.verdict[NU]
        cells.append((text, *widths, *nu, one.limit[E]))
    sizes = [max(map(len, column)) for column in zip(*cells, strict=True)]
    for row in cells:
        yield "  ".join(cell.ljust(size) for cell, size in zip(row, sizes, strict=True)).rstrip()


def _sentences(rows: Mapping[str, "Forecast"], noise: "Noise") -> Iterator[str]:
    """What was planned, what comes out, whether nu is determined, and what helps most."""
    (_, planned), *others = rows.items()
    how = planned.protocol
    yield (
        f"Planned: {MILLIMETRES * how.depth_m:.1f} mm deep, {how.captures} captures,"
        f" {how.frame_rate_hz:g} frames/s, a ball of {MILLIMETRES * how.radius_m:.1f} mm radius;"
        " half-widths are those of 95 % intervals."
    )
    place = ", ".join(f"{MILLIMETRES * x:.0f}" for x in planned.protocol.camera_m)
    yield (
        f"E to within {PERCENT * planned.half_width[E]:.0f} %, with the camera at {place} mm"
        f" of the object's frame and a noise of {MILLIMETRES * noise.tip_m:.2g} mm of the tip,"
        f" {noise.force_n:.2g} N of the force and {MILLIMETRES * noise.surface_m:.2g} mm of the"
        " surface (palpate noise measures it)."
    )
    yield f"Poisson's ratio {OF_NU[planned.verdict[NU]]} (half-width {planned.half_width[NU]:.2f})."
    text, best = min(others, key=lambda row: row[1].half_width[E])
    helps = f"what helps most: {text} (E to within {PERCENT * best.half_width[E]:.0f} %, nu to"
    helps += f" within {best.half_width[NU]:.2f})"
    if best.half_width[E] >= planned.half_width[E]:
        helps = "none of the changes above narrows it"
    yield f"What limits E: {planned.limit[E]}; {helps}."


def add(commands: Any) -> None:
    """Add the command to a parser's."""
    short = "what a rig can determine, before it is recorded"
    verb = add_verb(commands, "plan", short, _plan, about=ABOUT, example=EXAMPLE)
    option, number = verb.add_argument, partial(verb.add_argument, type=float)
    option("folder", type=Path, metavar="OBJECT", help="raw/<object>")
    option("--sensor", required=True, help="its name in config/sensors")
    option("--probe", help="its name in config/probes; else that of object.yaml")
    option("--point", help="of object.yaml; else its first")
    number("--modulus-kpa", required=True, help="a guess of E, within a factor of ten")
    number("--nu", default=0.3, help="a guess of Poisson's ratio (0.3)")
    number("--depth-mm", help="maximum depth; else 0.8 of the table's")
    option("--captures", type=int, default=3, help="at this point, or at others like it (3)")
    number("--frame-rate-hz", help="else the sensor's")
    text = "where the camera stands in the object's frame; else the best of four sides"
    number("--camera-mm", nargs=3, metavar=("X", "Y", "Z"), help=text)
    number("--distance-mm", help="of the camera from the contact (700)")
    text = "of the tip along the indentation, each frame; else by target and optics"
    number("--tip-noise-mm", help=text)
    text = "of a piece of surface, each frame; else by optics and distance"
    number("--surface-noise-mm", help=text)
    number("--force-noise-n", help="of the force, each frame (0.01)")
    option("--figure", type=Path, help="draw the intervals (.png, .svg, .pdf)")
    option("--json", action="store_true", help="for programs")
    add_devices(verb)
