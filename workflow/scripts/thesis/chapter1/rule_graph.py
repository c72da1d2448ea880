"""Figure 1.1: the way from a capture to its parameters, by the workflow's rules."""

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
BOX_WIDTH, BOX_HEIGHT = 0.9, 0.7
ROW_IN, LONG_NAME = 0.8, 13
TINY, NAME = 5.6, 7.2
# Characters that fill a box; a few more are drawn smaller.
LINE = 19
CENTRED = {"ha": "center", "va": "center", "zorder": 4}


def direct_edges(reads: Mapping[str, set[str]]) -> set[tuple[str, str]]:
    """Edges (from, to) between which no longer way leads (transitive reduction)."""

    def before(name: str) -> set[str]:
        return reads[name] | {far for near in reads[name] for far in before(near)}

    return {
        (one, name)
        for name in reads
        for one in reads[name]
        if not any(one in before(other) for other in reads[name] - {one})
    }


def figure_1_1(rules: Sequence[Mapping]) -> Figure:
    """Overview of the workflow from a capture to its parameters (Fig. 1.1).

    Parameters
    ----------
    rules : sequence of mapping
        ``rule``, ``stage``, ``recorded`` (list), ``reads`` (rule to list of files) and ``wanted``
        (list of its files that nobody reads) of each rule.

    Raises
    ------
    ValueError
        If there is none, or one reads what none of them writes.
    """
    reads = {rule["rule"]: set(rule["reads"]) for rule in rules}
    if unknown := set().union(*reads.values()) - set(reads):
        raise ValueError(f"rules: expected known rules, found {min(unknown)}")
    if not rules:
        raise ValueError("rules: expected at least one, found none")
    figure = plt.figure(figsize=(PAGE_IN, ROW_IN * (DEPTH + 1.6)))
    axes = figure.add_axes((0, 0, 1, 1))
    axes.set(xlim=(-0.06, WIDTH + 0.06), ylim=(DEPTH + 1.08, -0.52))
    axes.set_axis_off()
    for title, colour, start, width in STAGES.values():
        lane = (start + 0.02, -0.42), width - 0.04, DEPTH + 0.98
        axes.add_patch(Rectangle(*lane, fc=colour, alpha=0.09))
        axes.text(start + width / 2, -0.22, title, weight="bold", fontsize=NAME, **CENTRED)
    cells = dict(PLACES)
    for rule in rules:
        _, _, column, _ = STAGES[rule["stage"]]
        free = ((column, row) for row in range(DEPTH) if (column, row) not in cells.values())
        cells.setdefault(rule["rule"], next(free))
    places = {name: (column + 0.5, row + 0.5) for name, (column, row) in cells.items()}
    direct = direct_edges(reads)
    for name, others in reads.items():
        for other in sorted(others):
            _draw_edge(axes, places[other], places[name], (other, name) in direct)
    for rule in rules:
        taken = {file for other in rules for file in other["reads"].get(rule["rule"], ())}
        _draw_rule(axes, rule, sorted(taken | set(rule["wanted"])), places[rule["rule"]])
    for name in sorted(set(reads).difference(*reads.values())):
        _draw_result(axes, places[name])
    _draw_legend(axes, DEPTH)
    return figure


def _draw_edge(
    axes: Axes, start: tuple[float, float], stop: tuple[float, float], direct: bool
) -> None:
    """Arrow from under one box to above another, or round the boxes that stand between them."""
    half = BOX_HEIGHT / 2
    if start[0] == stop[0] and stop[1] - start[1] > 1.5:
        side = 1 if int(start[1]) % 2 else -1
        near, far = (start[0] + side * reach for reach in (BOX_WIDTH / 2, BOX_WIDTH / 2 + 0.035))
        line = [(near, start[1]), (far, start[1]), (far, stop[1]), (near, stop[1])]
    else:
        lean = 0.22 * np.tanh(stop[0] - start[0])
        line = [(start[0] + lean, start[1] + half), (stop[0] - lean, stop[1] - half)]
    look = ARROW | {"arrowstyle": "-|>,head_width=1.4,head_length=3", "mutation_scale": 1}
    look |= {"color": BLACK, "lw": 0.9} if direct else {"color": "0.72", "lw": 0.6}
    axes.add_patch(FancyArrowPatch(path=Path(line), zorder=2 if direct else 1, **look))


def _draw_rule(
    axes: Axes, rule: Mapping, writes: Sequence[str], place: tuple[float, float]
) -> None:
    """Box of a rule: what it reads of the recordings, its name, what it writes."""
    _, colour, _, _ = STAGES[rule["stage"]]
    _box(axes, place, BOX_HEIGHT, fc="white", ec=colour)
    name, recorded = rule["rule"], rule["recorded"]
    name = name.replace("_", "_\n", 1) if len(name) > LONG_NAME else name
    parts = [(fill(", ".join(recorded), LINE + 3), -0.215, TINY, "0.4", "normal")]
    parts += [(name, 0.0 if recorded else -0.08, NAME, BLACK, "bold")]
    parts += [("\n".join(writes), 0.23, TINY, BLACK, "normal")]
    for text, down, size, ink, weight in parts:
        longest = max(map(len, text.split("\n")))
        size = size * min(1, LINE / max(longest, 1))
        look = CENTRED | {"fontsize": size, "color": ink, "weight": weight, "linespacing": 1.05}
        axes.text(place[0], place[1] + down, text, **look)


def _box(axes: Axes, place: tuple[float, float], height: float, **look) -> None:
    size = np.array([BOX_WIDTH, height])
    style = "round,pad=0,rounding_size=0.05"
    corner = np.array(place) - size / 2
    axes.add_patch(FancyBboxPatch(corner, *size, boxstyle=style, lw=1.2, zorder=3, **look))


def _draw_result(axes: Axes, place: tuple[float, float]) -> None:
    """What the workflow is for, under a rule that ends the way."""
    column, row = place
    result = column, DEPTH + 0.36
    _draw_edge(axes, (column, row), (column, result[1] + BOX_HEIGHT / 2 - 0.13), True)
    _box(axes, result, 0.26, fc=BLACK, ec=BLACK)
    look = CENTRED | {"color": "white", "weight": "bold", "fontsize": NAME}
    axes.text(*result, r"$E$ and $\nu$", **look)


def _draw_legend(axes: Axes, depth: int) -> None:
    text = "box: recordings that a rule reads (grey), its name, its files that others read\n"
    text += "arrow: who reads them; grey: who gets there by a longer way too"
    axes.text(0.05, depth + 0.83, text, va="center", fontsize=6.2, linespacing=1.3)


def make_figure_1_1(inputs: Any, params: Any) -> Figure:
    """The figure from the way that the workflow tells."""
    return figure_1_1(params.rules)
