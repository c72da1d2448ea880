"""The command ``palpate board``: a board to print to scale, and what a probe's file says of it."""

import argparse
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray

from palpate.capture.files import whole_file
from palpate.commands.help import add_verb
from palpate.config.probe import TargetFile
from palpate.units import MILLIMETRES
from palpate.vision.board import FlatBoard
from palpate.vision.board_picture import Print
from palpate.vision.marker import board_of

MARGIN_MM, TEXT_MM = 10.0, 16.0
# The ruler is as long as this, or as the board allows in whole steps.
RULER_MM, STEP_MM = 100, 10
MM_PER_INCH = 25.4
KINDS = (".pdf", ".svg")
# The same sheet has the same bytes.
TIMELESS = {
    "pdf": {"CreationDate": None, "Creator": None},
    "svg": {"Date": None, "Creator": None},
    "png": {"Software": None},
}
# Of a square: margins wide enough for the corners, cells large enough to be read.
TAG_SHARE = 0.75
FAMILIES = {"charuco": "4X4_50", "aprilgrid": "APRILTAG_36H11"}

ABOUT = """\
Write a board to print, to scale and with a ruler on it, and print the block `marker` of the probe's
file. Print at 100 %, measure the ruler, and glue the sheet onto something flat. A board with tags
(charuco, aprilgrid) may be hidden in part; a checkerboard may not.
"""


def _board(options: argparse.Namespace) -> None:
    """Write the sheet, and print the block."""
    marker = _marker(options)
    if not options.output.parent.is_dir():
        raise ValueError(f"--output: expected a folder for it, found none: {options.output.parent}")
    if options.output.suffix.lower() not in KINDS:
        raise ValueError(
            f"--output: expected a file that ends with {' or '.join(KINDS)}, found {options.output}"
        )
    TargetFile.read({"marker": marker}, "board")
    with whole_file(options.output) as part:
        draw_sheet(board_of(marker), _title(marker), part, options.output.suffix.lower()[1:])
    block = yaml.safe_dump({"marker": marker}, sort_keys=False, default_flow_style=None)
    print(f"# {options.output}: written; for the probe's file:\n{block}", end="")


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
    sides = [
        f"{key[:-2]} {value * MILLIMETRES:g} mm"
        for key, value in marker.items()
        if key.endswith("_m")
    ]
    counts = next(marker[key] for key in ("inner_corners", "squares", "tags") if key in marker)
    kind = marker.get("kind", "checkerboard, inner corners")
    family = [marker["dictionary"]] if "dictionary" in marker else []
    return ", ".join([f"{kind} {counts[0]} x {counts[1]}", *sides, *family])


def draw_sheet(board: FlatBoard, title: str, path: Path, form: str) -> None:
    """Draw a board on a sheet of its size.

    Parameters
    ----------
    board : FlatBoard
    title : str
        What stands below it.
    path : Path
    form : {"pdf", "svg", "png"}
    """
    import matplotlib.pyplot as plt
    from matplotlib.collections import PolyCollection

    low_mm, high_mm = board.outline_m * MILLIMETRES
    width_mm, height_mm = high_mm - low_mm + 2 * MARGIN_MM + [0, TEXT_MM]
    settings = {"svg.hashsalt": "palpate", "pdf.fonttype": 42, "font.family": "DejaVu Sans"}
    with plt.rc_context(settings):
        figure = plt.figure(figsize=(width_mm / MM_PER_INCH, height_mm / MM_PER_INCH))
        axes = figure.add_axes((0, 0, 1, 1))
        axes.set_axis_off()
        axes.set_xlim(low_mm[0] - MARGIN_MM, high_mm[0] + MARGIN_MM)
        axes.set_ylim(high_mm[1] + MARGIN_MM + TEXT_MM, low_mm[1] - MARGIN_MM)
        fields = np.array(list(black_fields(board.print, board.outline_m / board.unit_m)))
        fields = fields * board.unit_m * MILLIMETRES
        axes.add_collection(PolyCollection(fields, facecolors="black", linewidths=0))
        _ruler(axes, low_mm[0], high_mm[1] + MARGIN_MM, high_mm[0] - low_mm[0])
        y = high_mm[1] + MARGIN_MM + TEXT_MM - 3
        size = min(7.0, 1.6 * (high_mm[0] - low_mm[0]) / len(title) * 72 / MM_PER_INCH)
        axes.text(low_mm[0], y, title, fontsize=size, va="bottom")
        figure.savefig(path, format=form, metadata=TIMELESS[form])
        plt.close(figure)


def _ruler(axes: Any, x_mm: float, y_mm: float, board_mm: float) -> None:
    """A ruler from a place to the right, with what it has to measure."""
    length_mm = int(np.clip(board_mm // STEP_MM * STEP_MM, STEP_MM, RULER_MM))
    look = {"color": "black", "lw": 0.5, "solid_capstyle": "butt"}
    axes.plot([x_mm, x_mm + length_mm], [y_mm, y_mm], **look)
    for step in range(0, length_mm + 1, STEP_MM):
        axes.plot([x_mm + step, x_mm + step], [y_mm, y_mm - 2.5], **look)
    text = f"{length_mm} mm"
    axes.text(x_mm, y_mm + 0.8, text, fontsize=6, va="top")


def black_fields(printed: Print, outline: NDArray) -> Iterable[NDArray]:
    """Corners (4, 2) of the black rectangles of a print, along rows and along columns [units].

    Each field is covered twice, so that no hairline is left between two.
    """
    u = np.unique(np.concatenate([outline[:, 0], printed.u]))
    v = np.unique(np.concatenate([outline[:, 1], printed.v]))
    middle_u, middle_v = (u[1:] + u[:-1]) / 2, (v[1:] + v[:-1]) / 2
    x, y = np.meshgrid(middle_u, middle_v)
    black = printed.at(x.ravel(), y.ravel()).reshape(x.shape) < 0.5
    for fields, first, second, turned in ((black, u, v, False), (black.T, v, u, True)):
        for k, row in enumerate(fields):
            ends = np.flatnonzero(np.diff(np.concatenate([[0], row.astype(int), [0]])))
            for start, stop in ends.reshape(-1, 2):
                a, b, c, d = first[start], first[stop], second[k], second[k + 1]
                corners = np.array([[a, c], [b, c], [b, d], [a, d]])
                yield corners[:, ::-1] if turned else corners


def _counts(text: str) -> tuple[int, int]:
    """Two numbers like 7x5."""
    parts = text.lower().split("x")
    if len(parts) != 2 or not all(part.strip().isdigit() for part in parts):
        raise argparse.ArgumentTypeError(f"expected two counts like 7x5, found {text}")
    return int(parts[0]), int(parts[1])


def add(commands: Any) -> None:
    """Add the command to a parser's."""
    verb = add_verb(
        commands,
        "board",
        "a board to print, to scale",
        _board,
        about=ABOUT,
        example="palpate board charuco --squares 7x5 --square-mm 15 --output board.pdf",
    )
    verb.add_argument("kind", choices=("charuco", "aprilgrid", "checkerboard"))
    verb.add_argument("--squares", type=_counts, metavar="7x5", help="along x and y")
    verb.add_argument("--tags", type=_counts, metavar="4x3", help="of an aprilgrid, along x and y")
    verb.add_argument("--square-mm", type=float, help="side of a square")
    verb.add_argument("--tag-mm", type=float, help="side of a tag (charuco: 0.75 of a square's)")
    verb.add_argument("--gap-mm", type=float, help="between tags of an aprilgrid")
    verb.add_argument("--dictionary", help="family of tags (4X4_50, APRILTAG_36H11)")
    verb.add_argument("--output", type=Path, required=True, help="a .pdf or .svg")
