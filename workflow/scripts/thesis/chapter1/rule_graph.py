"""Figure 1.1: the path from a capture to its parameters, by the workflow's rules."""

from collections.abc import Mapping, Sequence
from textwrap import fill
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import FancyArrowPatch, FancyBboxPatch, Rectangle
from matplotlib.path import Path
from palpate.report.style import ARROW, BLACK, BLUE, GREEN, GREY, ORANGE, PAGE_IN

# Stages side by side: title, colour, first column and number of columns.
STAGES = {
    "calibration": ("calibration", GREY, 0, 1),
    "preprocess": ("seeing and force", BLUE, 1, 3),
    "surface": ("surface\ntracking", GREEN, 4, 1),
    "hertz": ("Hertz\nmodel", ORANGE, 5, 1),
    "elasticity": ("error\nminimisation", "#CC79A7", 6, 1),
}
# Column and row of each rule: a row below all that it reads. Others, like those that calibrate a
# probe, get the next free row of their stage's first column.
PLACES = {
    "camera_calibration": (0, 0),
    "background_model": (1, 0),
    "mask": (1, 1),
    "support_plane": (2, 1),
    "probe_pose": (3, 1),
    "force": (3, 2),
    "clouds": (3, 3),
    "template": (4, 0),
    "solid_mesh": (4, 1),
    "align": (4, 4),
    "track": (4, 5),
    "hertz": (5, 5),
    "minimise": (6, 6),
}
WIDTH, DEPTH = 7, 7
# Lengths of the drawing: one is the width of a column, and the height of a row.
BOX_WIDTH, BOX_HEIGHT, ROW_IN = 0.92, 0.82, 0.84
NAME_PT, FILE_PT = 7.5, 6.0
# Characters that fill a box; longer lines are broken, longer words drawn smaller.
LINE, LONG_NAME = 17, 13
CENTRED = {"ha": "center", "va": "center", "zorder": 4}
NOTE = "box: recordings that a rule reads (grey), its name, its files that others read\n"
NOTE += "arrow: who reads them; left out where a longer path leads there too"


def direct_edges(reads: Mapping[str, set[str]]) -> set[tuple[str, str]]:
    """Edges (from, to) between which no longer path leads (transitive reduction)."""

    def before(name: str) -> set[str]:
        return reads[name] | {far for near in reads[name] for far in before(near)}

    return {
        (one, name)
        for name in reads
        for one in reads[name]
        if not any(one in before(other) for other in reads[name] - {one})
    }


def figure_1_1(inputs: Any, params: Any) -> Figure:
    """Overview of the workflow from a capture to its parameters (Fig. 1.1).

    Its rules are those of `path_to_moduli`.
    """
    rules = params.rules
    reads = {rule["rule"]: set(rule["reads"]) for rule in rules}
    figure = plt.figure(figsize=(PAGE_IN, ROW_IN * (DEPTH + 1.6)))
    axes = figure.add_axes((0, 0, 1, 1))
    axes.set(xlim=(-0.06, WIDTH + 0.06), ylim=(DEPTH + 1.08, -0.52))
    axes.set_axis_off()
    for title, colour, start, width in STAGES.values():
        lane = (start + 0.02, -0.42), width - 0.04, DEPTH + 0.98
        axes.add_patch(Rectangle(*lane, fc=colour, alpha=0.09))
        axes.text(start + width / 2, -0.22, title, weight="bold", fontsize=NAME_PT, **CENTRED)
    places = _places(rules)
    for start, stop in sorted(direct_edges(reads)):
        _arrow(axes, places[start], places[stop])
    for rule in rules:
        taken = {file for other in rules for file in other["reads"].get(rule["rule"], ())}
        _box(axes, rule, sorted(taken | set(rule["wanted"])), places[rule["rule"]])
    for name in sorted(set(reads).difference(*reads.values())):
        end = places[name][0], DEPTH + 0.36
        _arrow(axes, places[name], end, half=0.13)
        look = {"boxstyle": "round,pad=0.45", "fc": BLACK, "ec": BLACK}
        text = CENTRED | {"color": "white", "fontsize": NAME_PT, "bbox": look}
        axes.text(*end, r"$\mathbf{E}$ and $\mathbf{\nu}$", **text)
    axes.text(0.05, DEPTH + 0.83, NOTE, va="center", fontsize=FILE_PT, linespacing=1.3)
    return figure


def _places(rules: Sequence[Mapping]) -> dict[str, tuple[float, float]]:
    """Middle of each rule's box; one without a place of its own gets a free one of its stage."""
    cells = dict(PLACES)
    for rule in rules:
        _, _, column, _ = STAGES[rule["stage"]]
        free = ((column, row) for row in range(DEPTH) if (column, row) not in cells.values())
        cells.setdefault(rule["rule"], next(free))
    return {name: (column + 0.5, row + 0.5) for name, (column, row) in cells.items()}


def _arrow(axes: Axes, start: tuple, stop: tuple, *, half: float = BOX_HEIGHT / 2) -> None:
    """Arrow from under one box to above another, or round the boxes that stand between them."""
    if start[0] == stop[0] and stop[1] - start[1] > 1.5:
        near, far = (start[0] + side * BOX_WIDTH / 2 for side in (1, 1.075))
        line = [(near, start[1]), (far, start[1]), (far, stop[1]), (near, stop[1])]
    else:
        aside = 0.22 * np.tanh(stop[0] - start[0])
        line = [(start[0] + aside, start[1] + BOX_HEIGHT / 2), (stop[0] - aside, stop[1] - half)]
    look = ARROW | {"arrowstyle": "-|>,head_width=1.4,head_length=3", "mutation_scale": 1}
    axes.add_patch(FancyArrowPatch(path=Path(line), zorder=2, **look))


def _box(axes: Axes, rule: Mapping, writes: Sequence[str], place: tuple) -> None:
    """What a rule reads of the recordings, its name, what it writes."""
    corner = place[0] - BOX_WIDTH / 2, place[1] - BOX_HEIGHT / 2
    look = {"boxstyle": "round,pad=0,rounding_size=0.05", "lw": 1.2, "zorder": 3, "fc": "white"}
    look["ec"] = STAGES[rule["stage"]][1]
    axes.add_patch(FancyBboxPatch(corner, BOX_WIDTH, BOX_HEIGHT, **look))
    name, recorded = rule["rule"], rule["recorded"]
    name = name.replace("_", "_\n", 1) if len(name) > LONG_NAME else name
    for text, down, size, ink, weight in (
        (fill(", ".join(recorded), LINE), -0.235, FILE_PT, "0.35", "normal"),
        (name, 0.04 if recorded else -0.08, NAME_PT, BLACK, "bold"),
        ("\n".join(writes), 0.285, FILE_PT, BLACK, "normal"),
    ):
        longest = max(map(len, text.split("\n")))
        look = {"fontsize": size * min(1, LINE / max(longest, 1)), "color": ink, "weight": weight}
        axes.text(place[0], place[1] + down, text, linespacing=1.0, **CENTRED | look)
