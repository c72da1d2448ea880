"""The command ``palpate hertz``: E* of curves of force against depth."""

import argparse
import json
import re
import sys
from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from math import inf, isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any

from palpate.commands.help import add_columns, add_verb, check_figure
from palpate.units import readable

if TYPE_CHECKING:
    from palpate.capture.curves.curve import Curve
    from palpate.estimate.hertz.curve_fit import HertzFit

    Fits = Sequence[tuple[Curve, HertzFit]]

ABOUT = """\
Fit E* and the contact to curves of force against depth, in text files as instruments write them.
Columns, units, delimiter, preamble, signs and the part that is loading are found and told; what
can't be found is asked for by the option that says it.
"""
EXAMPLE = "palpate hertz curve.csv --radius-mm 6.22"
# Options of numbers above 0, and what parts of a setup are called as options.
ABOVE_ZERO = ("radius_mm", "effective_radius_mm", "thickness_mm", "stiffness_n_m")
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
            found.append(_fitted(path, setup, options))
        except ValueError as error:
            failed = 1
            print(f"error: {_naming(path, str(error))}", file=sys.stderr)
    if not found:
        return failed
    if options.table:
        _write_table(options.table, found)
    if options.figure:
        _write_figure(options.figure, found)
    if options.json:
        rows = [_row(*of) for of in found]
        print(json.dumps(rows if len(options.curves) > 1 else rows[0], indent=2))
    else:
        print("\n".join(line for of in found for line in _lines(*of)))
    return failed


def _setup(options: argparse.Namespace) -> Any:
    """What all curves are fitted with."""
    import numpy as np

    from palpate.estimate.hertz.curve_setup import Setup

    _check_numbers(options)
    given = {
        f"{name}_m": None if (found := getattr(options, f"{name}_mm")) is None else found / 1e3
        for name in ("radius", "thickness", "object_radius")
    }
    indenter, angle = options.indenter, options.half_angle_deg
    if options.effective_radius_mm is not None:
        if options.radius_mm is not None or options.object_radius_mm is not None:
            raise ValueError("--effective-radius-mm: expected no other radius, found one")
        given["radius_m"] = options.effective_radius_mm / 1e3
        indenter = indenter or "parabola"
    try:
        return Setup(
            **given,
            indenter=indenter or ("cone" if angle is not None else None),
            half_angle_rad=None if angle is None else float(np.radians(angle)),
            poisson_ratio=options.nu,
            baseline=options.baseline,
            residual=options.residual,
            base=options.base,
        )
    except ValueError as error:
        raise ValueError(_as_option(str(error))) from None


def _check_numbers(options: argparse.Namespace) -> None:
    """Hold numbers to their bounds, in the units of the options."""
    bounds = dict.fromkeys(ABOVE_ZERO, inf) | {"half_angle_deg": 90.0}
    for name, most in bounds.items():
        found = getattr(options, name)
        if found is not None and not 0 < found < most:
            below = f" and below {most:g}" if isfinite(most) else ""
            option = f"--{name.replace('_', '-')}"
            raise ValueError(f"{option}: expected a number above 0{below}, found {found:g}")


def _as_option(line: str) -> str:
    """A line about parts of the setup as one about the options that say them."""
    name, colon, rest = line.partition(": ")
    rest = re.sub(r"\w+_\w+", lambda word: OPTIONS.get(word[0], word[0]), rest)
    return f"{OPTIONS.get(name, name)}{colon}{rest}"


def _fitted(path: str, setup: Any, options: argparse.Namespace) -> tuple["Curve", "HertzFit"]:
    from palpate.capture.curves.curve import read_curve
    from palpate.estimate.hertz.curve_fit import fit_curve

    curve = read_curve(
        path,
        depth_column=options.depth_column,
        force_column=options.force_column,
        depth_unit=options.depth_unit,
        force_unit=options.force_unit,
        weights_column=options.weights,
        range_m=options.range_mm and tuple(end / 1e3 for end in options.range_mm),
        stiffness_n_m=options.stiffness_n_m,
        radius_m=options.radius_mm and options.radius_mm / 1e3,
    )
    try:
        return curve, fit_curve(*curve.loading(), setup, curve.weights)
    except ValueError as error:
        raise ValueError(f"{curve.path}: {_as_option(str(error))}") from None


def _naming(path: str, line: str) -> str:
    """A line with the file that it is about."""
    shown = "standard input" if path == "-" else path
    return line if line.startswith((shown, "--")) else f"{shown}: {line}"


def _lines(curve: "Curve", fit: "HertzFit") -> Iterator[str]:
    from palpate.modulus import modulus_text

    way, length = readable(max(abs(fit.contact_m), fit.press_m), "m")
    nu = fit.setup.poisson_ratio
    youngs = modulus_text(fit.youngs_modulus_pa(nu), fit.youngs_modulus_interval_pa(nu))
    yield curve.path
    yield from (f"  doubtful: {line}" for line in (*curve.doubts, *fit.doubts))
    yield f"  read: {curve.read}"
    yield f"  E* {fit.modulus_text}"
    yield f"  E  {youngs} for nu {nu:g}"
    place = way * curve.depth_sign * fit.contact_m
    contact = f"contact at {place:.4g} +- {way * fit.contact_std_m:.2g} {length}"
    yield f"  {contact}, {way * fit.press_m:.4g} {length} deep; {fit.quality}"
    yield f"  law: {_law(fit)}"
    if fit.assumes:
        yield f"  assumes {fit.assumes}"
    yield from (f"  depends on: {line}" for line in fit.hangs_on)


def _law(fit: "HertzFit") -> str:
    """What was fitted, and why where that was not asked for."""
    support = fit.support.replace("_", " ")
    support = "half-space" if fit.support == "half_space" else f"layer, {support}"
    chosen = dict(fit.chosen)
    scale, unit = readable(fit.baseline_n, "N")
    level = f" ({scale * fit.baseline_n:.3g} {unit})" if fit.baseline else ""
    baseline = chosen.get("baseline", "as asked" if fit.baseline else "none, as asked")
    return f"{chosen.get('indenter', fit.indenter)}; {support}; baseline {baseline}{level}"


def _row(curve: "Curve", fit: "HertzFit") -> dict:
    """All that went in and came out, but the samples."""
    of_file = {"curve": curve.path, "read": curve.read, "depth_sign": curve.depth_sign}
    told = fit.told()
    return of_file | told | {"doubts": [*curve.doubts, *told["doubts"]]}


def _write_table(path: Path, found: "Fits") -> None:
    import pandas as pd

    from palpate.capture.tables import write_table

    write_table(path, pd.DataFrame([_cells(_row(*of)) for of in found]))


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


def _write_figure(path: Path, found: "Fits") -> None:
    from palpate.capture.files import whole_file
    from palpate.report.curve_figure import figure_of_curves

    figure = figure_of_curves([(curve.path, fit) for curve, fit in found[:MOST_DRAWN]])
    with whole_file(path) as part:
        figure.savefig(part)
    if len(found) > MOST_DRAWN:
        print(f"{path}: the first {MOST_DRAWN} curves of {len(found)}", file=sys.stderr)


def add(commands: Any) -> None:
    """Add the command to a parser's."""
    verb = add_verb(
        commands, "hertz", "E* of curves of force against depth", _hertz, about=ABOUT,
        example=EXAMPLE,
    )  # fmt: skip
    verb.add_argument("curves", nargs="+", metavar="CURVE", help="text file; - is standard input")
    number = partial(verb.add_argument, type=float)
    number("--radius-mm", help="of the sphere, or of a flat punch")
    number("--object-radius-mm", help="of a curved object at the contact, negative if hollow")
    number("--effective-radius-mm", help="of both, in place of the two")
    number("--half-angle-deg", help="of a cone or pyramid, between axis and side or face")
    indenters = ("parabola", "sneddon", "cone", "pyramid", "flat")
    verb.add_argument("--indenter", choices=indenters, help="a sphere by depth, else")
    number("--thickness-mm", help="of a layer on a rigid base")
    verb.add_argument(
        "--base", choices=("bonded", "not_bonded"), default="bonded", help="of a layer (bonded)"
    )
    number("--stiffness-n-m", help="between drive and tip: of a cantilever, a load cell")
    number("--nu", default=0.33, help="Poisson's ratio that E and a layer's law assume (0.33)")
    verb.add_argument(
        "--baseline",
        action=argparse.BooleanOptionalAction,
        help="fit a constant force too; else where an approach tells it",
    )
    verb.add_argument(
        "--residual",
        choices=("force", "force_two_thirds"),
        default="force",
        help="compared: the force, or its power 2/3",
    )
    number(
        "--range-mm", nargs=2, metavar=("FROM", "TO"), help="of the depth's column, as it counts"
    )
    verb.add_argument("--weights", metavar="COLUMN", help="column of weights of the samples")
    add_columns(verb)
    verb.add_argument("--figure", type=Path, help="draw the fits (.png, .svg, .pdf)")
    verb.add_argument("--table", type=Path, help="write a CSV table, a row for each curve")
    verb.add_argument("--json", action="store_true", help="print all that went in and came out")
