"""The command ``palpate calibrate stiffness``: what a probe gives way by, of a rigid press."""

import argparse
from collections.abc import Iterator, Sequence
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any

from palpate.capture.tables import FRAMES
from palpate.commands.help import add_columns, add_verb
from palpate.commands.rig import (
    add_devices,
    board_file,
    check_output,
    film_table,
    needed,
    sensor_file,
    sure,
    write_json,
)
from palpate.units import MILLIMETRES

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from palpate.vision.bending import Bending

ABOUT = """\
Find what the probe gives way by between its board and its ball, along its axis: press the ball on
something rigid, a steel block on a table, slowly to 5 N and back within ten seconds.
It takes a film (a folder with frames.csv and force.csv) with the files of sensor and probe, or a
table in the order of time, as palpate hertz reads curves: how far the tip went along the probe's
axis by the board's poses (depth_m, growing in the press, from any zero), and the force along it
(force_n), at the same moments. Units stand in the names of the columns, or are said.
"""
EXAMPLE = "palpate calibrate stiffness press.csv"


def _stiffness(options: argparse.Namespace) -> None:
    """Print what was found, and write it."""
    from palpate.vision.bending import find_bending
    from palpate.vision.bending_json import bending_fields

    check_output(options.output, options.source)
    if not (isfinite(options.contact_n) and options.contact_n >= 0):
        raise ValueError(f"--contact-n: expected 0 or more, found {options.contact_n:g}")
    if not options.source.exists():
        raise ValueError(f"{options.source}: source: expected a film or a table, found none")
    probe = None if options.board is None else board_file(options.board).get("probe")
    read, doubts, (way_m, force_n) = (_film if options.source.is_dir() else _columns)(options)
    try:
        found = find_bending(way_m, force_n, contact_n=options.contact_n)
    except ValueError as error:
        raise ValueError(f"{options.source}: {error}") from None
    lines = [*_lines(options.source, read, found), *(f"  doubtful: {line}" for line in doubts)]
    print("\n".join([*lines, *_block(found)]))
    if options.output is not None:
        write_json(options.output, bending_fields(found, probe))


def _film(options: argparse.Namespace) -> tuple[str, tuple[str, ...], Sequence["NDArray"]]:
    """What was read of a film, no doubts, way [m] and force [N]."""
    from palpate.capture.tables import read_force
    from palpate.vision.options import Force
    from palpate.vision.rigid_press import way_and_force

    source = options.source
    if not (source / FRAMES).is_file():
        raise ValueError(f"{source}: frames.csv: expected a film's, found none")
    needed(options, "sensor", "board")
    sensor, probe = sensor_file(options.sensor), board_file(options.board)
    for key in ("marker_from_force", "force_from_tip"):
        if key not in probe:
            raise ValueError(f"{options.board}: {key}: expected the probe's, found none")
    table = film_table(source, sensor, probe["marker"], force=True)
    try:
        columns = way_and_force(
            table, read_force(source), probe, Force(), contact_n=options.contact_n
        )
    except ValueError as error:
        raise ValueError(f"{source}: {error}") from None
    return f"{len(table)} frames that show the board", (), columns


def _columns(options: argparse.Namespace) -> tuple[str, tuple[str, ...], Sequence["NDArray"]]:
    """How the table was read, doubts of that, way [m] and force [N] with the table's signs.

    A curve's signs are found by its shape; a way that is all noise has none.
    """
    from palpate.capture.curves.columns import DEPTH, FORCE, Asked, column_of, numbers_of
    from palpate.capture.curves.export import read_export

    export = read_export(options.source)
    way_m, of_way = column_of(export, DEPTH, Asked(options.depth_column, options.depth_unit))
    force_n, of_force = column_of(export, FORCE, Asked(options.force_column, options.force_unit))
    columns, left_out = numbers_of([way_m, force_n])
    read = [*export.read, of_way.text, of_force.text]
    read += [f"{left_out} rows without a number left out"] if left_out else []
    # Those of the way warn of what is measured here, that something gives way before the tip.
    return ", ".join(read), (*export.doubts, *of_force.doubts), columns


def _lines(source: Path, read: str, found: "Bending") -> Iterator[str]:
    from palpate.vision.bending_json import verdict

    per_newton = found.compliance_m_n * MILLIMETRES, found.compliance_std_m_n * MILLIMETRES
    low, high = found.force_n
    yield f"{source}: {found.samples} samples in contact, {low:.2g} to {high:.2g} N"
    yield f"  read: {read}"
    yield f"  gives way by {sure(*per_newton)} mm per newton"
    yield f"  bows by {_departure(found.bow_m)}"
    if isfinite(found.gap_m[0]):
        yield f"  unloading lies {_departure(found.gap_m)} from loading"
    else:
        yield "  loading or unloading alone: whether they are alike is not told"
    residual_mm = round(found.rms_m * MILLIMETRES, 5)
    yield f"  residual: {residual_mm:.2g} mm (root mean square)"
    yield f"  {verdict(found)}"


def _departure(value: tuple[float, float]) -> str:
    return f"{sure(*(part * MILLIMETRES for part in value))} mm"


def _block(found: "Bending") -> Iterator[str]:
    """Lines for the probe's file; of a probe that is stiffer than is told the second alone."""
    from palpate.vision.bending_json import digits

    if found.told:
        yield f"stiffness_n_m: {digits(found.stiffness_n_m, 3)}"
    yield f"compliance_std_m_n: {found.file_std_m_n:.1e}"


def add(parts: Any) -> None:
    """Add the part to the command's."""
    verb = add_verb(
        parts,
        "stiffness",
        "what the probe gives way by",
        _stiffness,
        about=ABOUT,
        example=EXAMPLE,
    )
    verb.add_argument("source", type=Path, metavar="PRESS", help="film, or table of way and force")
    add_devices(verb)
    verb.add_argument(
        "--contact-n", type=float, default=0.5, metavar="N", help="forces above it count (0.5)"
    )
    add_columns(verb)
    verb.add_argument("--output", type=Path, metavar="FILE", help="write stiffness.json there too")
