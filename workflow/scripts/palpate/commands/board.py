"""The command ``palpate board``: a target to print to scale, and a probe's block ``marker``."""

import argparse
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from palpate.capture.files import whole_file
from palpate.commands.help import add_verb, counts
from palpate.config.probe import TargetFile
from palpate.units import MILLIMETRES
from palpate.vision.board import FlatBoard
from palpate.vision.marker import board_of

MARGIN_MM, TEXT_MM = 10.0, 16.0
# The ruler is as long as this, or as the target allows in whole steps.
RULER_MM, STEP_MM = 100, 10
MM_PER_INCH = 25.4
# Kinds of files, and metadata without which the same sheet has the same bytes.
KINDS = {".pdf": {"CreationDate": None, "Creator": None}, ".svg": {"Date": None, "Creator": None}}
# Of a square: margins wide enough for the corners, cells large enough to be read.
TAG_SHARE = 0.75
FAMILIES = {"charuco": "4X4_50", "aprilgrid": "APRILTAG_36H11"}

ABOUT = """\
Write a target to print, to scale and with a ruler on it, and print the block `marker` of the
probe's file. Print at 100 %, measure the ruler, and glue the sheet onto something flat. A target
with tags (charuco, aprilgrid) may be hidden in part; a checkerboard may not.
"""
EXAMPLE = "palpate board charuco --squares 7x5 --square-mm 15 --output board.pdf"


def _board(options: argparse.Namespace) -> None:
    """Write the sheet, and print the block."""
    marker, output = _marker(options), options.output
    if not output.parent.is_dir():
        raise ValueError(f"--output: expected a folder for it, found none: {output.parent}")
    if output.suffix.lower() not in KINDS:
        kinds = " or ".join(KINDS)
        raise ValueError(f"--output: expected a file that ends with {kinds}, found {output}")
    TargetFile.read({"marker": marker}, "board")
    with whole_file(output) as part:
        draw_sheet(board_of(marker), _title(marker), part)
    block = yaml.safe_dump({"marker": marker}, sort_keys=False, default_flow_style=None)
    print(f"# {output}: written; for the probe's file:\n{block}", end="")


def _marker(options: argparse.Namespace) -> dict:
    """Block ``marker`` of a probe's file."""
    mm = {name: getattr(options, f"{name}_mm") for name in ("square", "tag", "gap")}
    if options.kind == "charuco" and mm["tag"] is None and mm["square"] is not None:
        mm["tag"] = TAG_SHARE * mm["square"]
    sides = {f"{k}_m": round(v / MILLIMETRES, 9) for k, v in mm.items() if v is not None}
    counts = "tags" if options.kind == "aprilgrid" else "squares"
    if getattr(options, counts) is None:
        raise ValueError(f"--{counts}: expected two counts, found none")
    if options.kind == "checkerboard":
        columns, rows = options.squares
        return {"inner_corners": [columns - 1, rows - 1]} | sides
    family = {"dictionary": options.dictionary or FAMILIES[options.kind]}
    return {"kind": options.kind, counts: list(getattr(options, counts))} | sides | family


def _title(marker: Mapping) -> str:
    """What the sheet says of itself."""
    columns, rows = next(value for value in marker.values() if isinstance(value, list))
    kind, sides = marker.get("kind", "checkerboard, inner corners"), marker.items()
    sizes = [f"{key[:-2]} {of * MILLIMETRES:g} mm" for key, of in sides if key.endswith("_m")]
    family = [marker["dictionary"]] if "dictionary" in marker else []
    return ", ".join([f"{kind} {columns} x {rows}", *sizes, *family])


def draw_sheet(board: FlatBoard, title: str, path: Path) -> None:
    """Draw a target on a sheet of its size, a title below it, into a .pdf or an .svg."""
    import matplotlib.pyplot as plt
    from matplotlib.patches import PathPatch

    low_mm, high_mm = board.outline_m * MILLIMETRES
    board_mm = high_mm[0] - low_mm[0]
    width_mm, height_mm = high_mm - low_mm + 2 * MARGIN_MM + [0, TEXT_MM]
    settings = {"svg.hashsalt": "palpate", "pdf.fonttype": 42, "font.family": "DejaVu Sans"}
    with plt.rc_context(settings):
        figure = plt.figure(figsize=(width_mm / MM_PER_INCH, height_mm / MM_PER_INCH))
        axes = figure.add_axes((0, 0, 1, 1))
        axes.set_axis_off()
        axes.set_xlim(low_mm[0] - MARGIN_MM, high_mm[0] + MARGIN_MM)
        axes.set_ylim(high_mm[1] + MARGIN_MM + TEXT_MM, low_mm[1] - MARGIN_MM)
        axes.add_patch(PathPatch(_black(board), facecolor="black", linewidth=0, snap=False))
        _ruler(axes, low_mm[0], high_mm[1] + MARGIN_MM, board_mm)
        size = min(7.0, 1.6 * board_mm / len(title) * 72 / MM_PER_INCH)
        y_mm = high_mm[1] + MARGIN_MM + TEXT_MM - 3
        axes.text(low_mm[0], y_mm, title, fontsize=size, va="bottom")
        figure.savefig(path, metadata=KINDS.get(path.suffix.lower()))
        plt.close(figure)


def _black(board: FlatBoard) -> Any:
    """All black rectangles of a target [mm] as one path: between two of them is no hairline."""
    from matplotlib.path import Path as Outline

    printed, ends = board.print, board.outline_m / board.unit_m
    u, v = np.union1d(printed.u, ends[:, 0]), np.union1d(printed.v, ends[:, 1])
    middles = np.meshgrid((u[1:] + u[:-1]) / 2, (v[1:] + v[:-1]) / 2)
    k, i = np.nonzero(printed.at(*middles) < 0.5)
    corners = (u[i], v[k]), (u[i + 1], v[k]), (u[i + 1], v[k + 1]), (u[i], v[k + 1])
    rectangles = np.moveaxis(np.array(corners), 2, 0) * board.unit_m * MILLIMETRES
    return Outline.make_compound_path_from_polys(rectangles)


def _ruler(axes: Any, x_mm: float, y_mm: float, board_mm: float) -> None:
    """A ruler from a place to the right, with what it has to measure."""
    length_mm = int(np.clip(board_mm // STEP_MM * STEP_MM, STEP_MM, RULER_MM))
    look = {"color": "black", "lw": 0.5, "solid_capstyle": "butt"}
    axes.plot([x_mm, x_mm + length_mm], [y_mm, y_mm], **look)
    for step in range(0, length_mm + 1, STEP_MM):
        axes.plot([x_mm + step, x_mm + step], [y_mm, y_mm - 2.5], **look)
    axes.text(x_mm, y_mm + 0.8, f"{length_mm} mm", fontsize=6, va="top")


def add(commands: Any) -> None:
    """Add the command to a parser's."""
    short = "a target to print, to scale"
    verb = add_verb(commands, "board", short, _board, about=ABOUT, example=EXAMPLE)
    verb.add_argument("kind", choices=("charuco", "aprilgrid", "checkerboard"))
    verb.add_argument("--squares", type=counts, metavar="7x5", help="along x and y")
    verb.add_argument("--tags", type=counts, metavar="4x3", help="of an aprilgrid, along x and y")
    verb.add_argument("--square-mm", type=float, help="side of a square")
    verb.add_argument("--tag-mm", type=float, help="side of a tag (charuco: 0.75 of a square's)")
    verb.add_argument("--gap-mm", type=float, help="between tags of an aprilgrid")
    verb.add_argument("--dictionary", help="family of tags (4X4_50, APRILTAG_36H11)")
    verb.add_argument("--output", type=Path, required=True, help="a .pdf or .svg")
