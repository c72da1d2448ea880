"""The command ``palpate``: what the workflow does, for single captures and curves."""

import argparse
import json
import logging
import sys
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from palpate.capture.commands import add_commands, add_devices
from palpate.units import KILOPASCALS


def main(arguments: list[str] | None = None) -> int:
    """Run a command; the exit status is 1 where it fails, with one line on what is wrong."""
    options = _parser().parse_args(arguments)
    try:
        return options.work(options) or 0
    except (ValueError, OSError) as error:
        for line in str(error).splitlines():
            print(f"error: {line}", file=sys.stderr)
        return 1


def _hertz(options: argparse.Namespace) -> None:
    """E* of a curve."""
    from palpate import hertz

    thickness = None if options.thickness_mm is None else options.thickness_mm / 1e3
    found = hertz.fit(
        *hertz.read_curve(options.curve),
        radius_m=options.radius_mm / 1e3,
        thickness_m=thickness,
        poisson_ratio=options.nu,
    )
    if options.json:
        print(json.dumps(asdict(found), indent=2))
        return
    low, high = (KILOPASCALS * end for end in found.reduced_modulus_interval_pa)
    print(f"E* {KILOPASCALS * found.reduced_modulus_pa:.4g} kPa (95 %: {low:.4g} to {high:.4g})")
    print(f"E {KILOPASCALS * found.youngs_modulus_pa(options.nu):.4g} kPa for nu {options.nu:g}")
    print(f"contact at {1e3 * found.contact_m:.3f} mm; {found.indenter}, {found.support}")


def _direct(options: argparse.Namespace) -> None:
    """E and nu of captures."""
    from palpate import direct
    from palpate.capture.capture import open_capture
    from palpate.estimate.direct.result import described_law
    from palpate.measurement import measure

    devices = {"sensors": options.sensors, "probes": options.probes}
    captures = [open_capture(folder, **devices) for folder in options.captures]
    if len({capture.folder.parent for capture in captures}) > 1:
        raise ValueError("captures: expected those of one object and sensor, found others too")
    _tell_progress()
    measured = []
    for capture in captures:
        logging.info("%s: masks, probe, forces, clouds, motion", capture.folder)
        measured.append(measure(capture, optics=options.optics))
    tables = _tables(measured, options)
    found = direct.estimate(measured, [tables[one.capture.point] for one in measured])
    if options.json:
        told = {name: asdict(interval) for name, interval in found.moduli.items()}
        print(json.dumps(told | described_law(found) | {"budget": found.budget.rows()}, indent=2))
        return
    for name, interval in found.moduli.items():
        print(f"{name.removesuffix('_pa')}: {_said(name, interval)}")
    at, largest = 1e3 * found.quantities.depth_m, found.budget.sources[0].name
    print(f"95 % intervals; largest source of E*'s: {largest}")
    print(f"to compare objects: equivalent E*, at {at:.1f} mm; to compute with: E and nu")
    for which, law in described_law(found)["law"].items():
        text = f"{law['value']:+.2f} +- {law['std']:.2f}"
        print(f"law of the {which}: {text} (0: neo-Hooke's, 1: Blatz and Ko's)")


def _said(name: str, interval: Any) -> str:
    scale, unit, places = (KILOPASCALS, " kPa", 1) if name.endswith("_pa") else (1.0, "", 2)
    value, low, high = (scale * one for one in (interval.value, interval.low, interval.high))
    return f"{value:.{places}f}{unit} ({low:.{places}f} to {high:.{places}f}), {interval.verdict}"


def _tell_progress() -> None:
    """Say on standard error what is being done; of libraries only what is wrong."""
    logging.basicConfig(stream=sys.stderr, level=logging.INFO, format="%(message)s", force=True)
    logging.getLogger("skfem").setLevel(logging.ERROR)


def _tables(measured: Sequence[Any], options: argparse.Namespace) -> dict[str, Any]:
    """Indentation table of each pressed point: kept, or made of one solid and kept."""
    from palpate.capture.files import whole_file
    from palpate.measurement import indentation_table, solid_of
    from palpate.solid.indentation import load_indentation, save_indentation

    found, solid = {}, None
    for one in {one.capture.point: one for one in measured}.values():
        point = one.capture.point
        path = options.tables / f"indentation-{point}.npz" if options.tables else None
        if path and path.is_file():
            found[point] = load_indentation(path)
            continue
        logging.info("indentation table of point %s: made now, which takes minutes", point)
        solid = solid or solid_of(one, options.solid)
        found[point] = indentation_table(one, solid)
        if path:
            path.parent.mkdir(parents=True, exist_ok=True)
            with whole_file(path) as part:
                save_indentation(part, found[point])
    return found


def _version(options: argparse.Namespace) -> None:
    """Version of the package."""
    from palpate import __version__

    print(__version__)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="palpate", description="Elastic moduli of soft objects: captures, curves, estimates."
    )
    commands = parser.add_subparsers(required=True, metavar="command")
    add_commands(commands)
    hertz = commands.add_parser("hertz", help="fit E* to a curve of force against depth")
    hertz.add_argument("curve", type=Path, help="CSV with depth_m and force_n")
    hertz.add_argument("--radius-mm", type=float, required=True, help="of the sphere")
    hertz.add_argument("--thickness-mm", type=float, help="of a layer on a rigid base")
    hertz.add_argument("--nu", type=float, default=0.33, help="Poisson's ratio assumed (0.33)")
    _may_be_json(hertz, _hertz)
    direct = commands.add_parser("direct", help="estimate E and nu of captures")
    direct.add_argument("captures", type=Path, nargs="+", help="raw/<object>/<sensor>/<capture>")
    add_devices(direct)
    direct.add_argument("--solid", type=Path, help="kept mesh of the object (VTU); else made anew")
    direct.add_argument(
        "--tables",
        type=Path,
        help="folder of indentation tables: taken from it, or made and kept there (delete them when"
        " the object, its solid or the probe change)",
    )
    direct.add_argument("--optics", type=Path, help="calibration.json of the sensor")
    _may_be_json(direct, _direct)
    commands.add_parser("version", help="say it").set_defaults(work=_version)
    return parser


def _may_be_json(parser: argparse.ArgumentParser, work: Any) -> None:
    parser.add_argument("--json", action="store_true", help="for programs")
    parser.set_defaults(work=work)


if __name__ == "__main__":
    sys.exit(main())
