"""The command ``palpate hertz``: E* of curves of force against depth."""

import argparse
import json
import re
import sys
from collections.abc import Iterator, Mapping
from functools import partial
from math import inf, isfinite, radians
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pandas as pd

from palpate.capture.curves.curve import Curve, read_curve
from palpate.capture.files import whole_file
from palpate.capture.tables import write_table
from palpate.commands.help import add_columns, add_verb, check_figure, stage
from palpate.modulus import modulus_text
from palpate.units import readable

if TYPE_CHECKING:
    from palpate.estimate.hertz.curve_fit import HertzFit
    from palpate.estimate.hertz.curve_setup import Setup

ABOUT = """\
Fit E* and the contact to curves of force against depth, in text files as instruments write them.
Columns, units, delimiter, preamble, signs and the part that is loading are found and stated; what
can't be found is asked for by the option that says it.
"""
EXAMPLE = "palpate hertz curve.csv --radius-mm 6.22"
# Bounds of options of numbers above 0, and what parts of a setup are called as options.
BELOW = {"radius_mm": inf, "thickness_mm": inf, "stiffness_n_m": inf, "half_angle_deg": 90.0}
OPTIONS = {
    "depth_m": "--depth-unit",
    "radius_m": "--radius-mm",
    "object_radius_m": "--object-radius-mm",
    "thickness_m": "--thickness-mm",
    "half_angle_rad": "--half-angle-deg",
    "poisson_ratio": "--nu",
    "indenter": "--indenter",
    "base": "--base",
}
# Drawn beside each other, more could not be read.
MOST_DRAWN = 12


def _hertz(options: argparse.Namespace) -> int:
    """E* of each curve; 1 if one of them has none."""
    check_figure(options.figure)
    setup = _setup(options)
    found, failed = [], 0
    for path in options.curves:
        try:
            with stage(path):
                found.append(_fitted(path, setup, options))
        except ValueError as error:
            line, shown = str(error), "standard input" if path == "-" else path
            failed, line = 1, line if line.startswith((shown, "--")) else f"{shown}: {line}"
            print(f"error: {line}", file=sys.stderr)
    if not found:
        return failed
    rows = [_row(*of) for of in found]
    if options.table:
        write_table(options.table, pd.DataFrame(map(_cells, rows)))
    if options.figure:
        _draw(options.figure, [(curve.path, fit) for curve, fit in found])
    if options.json:
        print(json.dumps(rows if len(options.curves) > 1 else rows[0], indent=2))
    else:
        print("\n".join(line for of in found for line in _lines(*of)))
    return failed


def _setup(options: argparse.Namespace) -> "Setup":
    """What all curves are fitted with."""
    from palpate.estimate.hertz.curve_setup import Setup

    for name, most in BELOW.items():
        found = getattr(options, name)
        if found is not None and not 0 < found < most:
            below = f" and below {most:g}" if isfinite(most) else ""
            option = f"--{name.replace('_', '-')}"
            raise ValueError(f"{option}: expected a number above 0{below}, found {found:g}")
    lengths = ("radius", "object_radius", "thickness")
    given = {f"{name}_m": _metres(getattr(options, f"{name}_mm")) for name in lengths}
    given |= {"poisson_ratio": options.nu, "baseline": options.baseline, "base": options.base}
    angle, indenter = options.half_angle_deg, options.indenter
    if angle is not None:
        given["half_angle_rad"], indenter = radians(angle), indenter or "cone"
    try:
        return Setup(**given, indenter=indenter)
    except ValueError as error:
        raise ValueError(_as_option(str(error))) from None


def _metres(value_mm: float | None) -> float | None:
    return None if value_mm is None else value_mm / 1e3


def _as_option(line: str) -> str:
    """A line about parts of the setup as one about the options that say them."""
    name, colon, rest = line.partition(": ")
    rest = re.sub(r"\w+_\w+", lambda word: OPTIONS.get(word[0], word[0]), rest)
    return f"{OPTIONS.get(name, name)}{colon}{rest}"


def _fitted(path: str, setup: "Setup", options: argparse.Namespace) -> tuple[Curve, "HertzFit"]:
    from palpate.estimate.hertz.curve_fit import fit_curve

    names = ("depth_column", "force_column", "depth_unit", "force_unit", "stiffness_n_m")
    curve = read_curve(
        path,
        **{name: getattr(options, name) for name in names},
        range_m=options.range_mm and tuple(map(_metres, options.range_mm)),
        radius_m=_metres(options.radius_mm),
    )
    try:
        return curve, fit_curve(*curve.loading(), setup)
    except ValueError as error:
        raise ValueError(f"{curve.path}: {_as_option(str(error))}") from None


def _lines(curve: Curve, fit: "HertzFit") -> Iterator[str]:
    scale, length = readable(max(abs(fit.contact_m), fit.press_m), "m")
    nu, place = fit.setup.poisson_ratio, scale * curve.depth_sign * fit.contact_m
    youngs = modulus_text(fit.youngs_modulus_pa(nu), fit.youngs_modulus_interval_pa(nu))
    yield curve.path
    yield from (f"  warning: {line}" for line in (*curve.warnings, *fit.warnings))
    yield f"  read: {curve.read}"
    yield f"  E* {fit.modulus_text}"
    yield f"  E  {youngs} for nu {nu:g}"
    contact = f"contact at {place:.4g} +- {scale * fit.contact_std_m:.2g} {length}"
    yield f"  {contact}, {scale * fit.press_m:.4g} {length} deep; {fit.quality}"
    yield f"  law: {_law(fit)}"
    if fit.assumes:
        yield f"  assumes {fit.assumes}"
    yield from (f"  depends on: {line}" for line in fit.depends_on)


def _law(fit: "HertzFit") -> str:
    """What was fitted, and why where that was not asked for."""
    support = fit.support.replace("_", " ")
    support = "half-space" if fit.support == "half_space" else f"layer, {support}"
    scale, unit = readable(fit.baseline_n, "N")
    level = f" ({scale * fit.baseline_n:.3g} {unit})" if fit.baseline else ""
    baseline = fit.chosen.get("baseline", "as asked" if fit.baseline else "none, as asked")
    return f"{fit.chosen.get('indenter', fit.indenter)}; {support}; baseline {baseline}{level}"


def _row(curve: Curve, fit: "HertzFit") -> dict:
    """All that went in and came out, but the samples."""
    row = {"curve": curve.path, "read": curve.read, "depth_sign": curve.depth_sign} | fit.row()
    return row | {"warnings": [*curve.warnings, *row["warnings"]]}


def _cells(row: Mapping[str, Any]) -> dict:
    """A row's values as cells: ends of intervals apart, lists as text."""
    cells = {}
    for name, value in row.items():
        if name.endswith("_interval_pa"):
            stem = name.removesuffix("_interval_pa")
            cells |= {f"{stem}_low_pa": value[0], f"{stem}_high_pa": value[1]}
        elif name == "setup":
            cells |= {f"asked_{key}": one for key, one in value.items()}
        elif isinstance(value, Mapping):
            cells[name] = "; ".join(f"{key}: {one}" for key, one in value.items())
        else:
            cells[name] = "; ".join(value) if isinstance(value, tuple | list) else value
    return cells


def _draw(path: Path, fits: list[tuple[str, "HertzFit"]]) -> None:
    from palpate.report.hertz_figures import figure_of_curves

    with whole_file(path) as part:
        figure_of_curves(fits[:MOST_DRAWN]).savefig(part)
    if len(fits) > MOST_DRAWN:
        print(f"{path}: the first {MOST_DRAWN} curves of {len(fits)}", file=sys.stderr)


def add(commands: Any) -> None:
    """Add the command to a parser's."""
    short = "E* of curves of force against depth"
    verb = add_verb(commands, "hertz", short, _hertz, about=ABOUT, example=EXAMPLE)
    option, number = verb.add_argument, partial(verb.add_argument, type=float)
    option("curves", nargs="+", metavar="CURVE", help="text file; - is standard input")
    number("--radius-mm", help="of the sphere, or of a flat punch")
    number("--object-radius-mm", help="of a curved object at the contact, negative if hollow")
    number("--half-angle-deg", help="of a cone or pyramid, between axis and side or face")
    indenters = ("parabola", "sneddon", "cone", "pyramid", "flat")
    option("--indenter", choices=indenters, help="a sphere by depth, else")
    number("--thickness-mm", help="of a layer on a rigid base")
    text = "of a layer (bonded)"
    option("--base", choices=("bonded", "not_bonded"), default="bonded", help=text)
    number("--stiffness-n-m", help="between drive and tip: of a cantilever, a load cell")
    number("--nu", default=0.33, help="Poisson's ratio that E and a layer's law assume (0.33)")
    baseline = "fit a constant force too; else where an approach determines it"
    option("--baseline", action=argparse.BooleanOptionalAction, help=baseline)
    ends = {"nargs": 2, "metavar": ("FROM", "TO")}
    number("--range-mm", **ends, help="of the depth's column, as it counts")
    add_columns(verb)
    option("--figure", type=Path, help="draw the fits (.png, .svg, .pdf)")
    option("--table", type=Path, help="write a CSV table, a row for each curve")
    option("--json", action="store_true", help="print all that went in and came out")
