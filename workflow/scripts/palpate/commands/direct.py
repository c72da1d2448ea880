"""The command ``palpate direct``: E and nu of captures."""

import argparse
import json
import logging
import sys
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from palpate.capture.devices import add_devices
from palpate.units import KILOPASCALS


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


def add(commands: Any) -> None:
    """Add the command to a parser's."""
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
    direct.add_argument("--json", action="store_true", help="for programs")
    direct.set_defaults(work=_direct)
