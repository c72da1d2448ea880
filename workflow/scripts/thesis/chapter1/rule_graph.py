"""Figure 1.1: the way from a capture to its parameters, laid out from the workflow's rules."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import FancyArrowPatch, FancyBboxPatch, Rectangle
from matplotlib.path import Path
from palpate.report.style import ARROW, BLACK, BLUE, GREEN, GREY, ORANGE, PAGE_IN
from scipy.optimize import linear_sum_assignment

TITLES = {
    "calibration": "calibration",
    "preprocess": "seeing and force",
    "surface": "surface tracking",
    "hertz": "Hertz model",
    "elasticity": "error minimisation",
}
COLOURS = (GREY, BLUE, GREEN, ORANGE, "#CC79A7", "#E69F00")
# Lengths of the drawing: one is the width of a column, and the height of a layer.
BOX_WIDTH, BOX_HEIGHT = 0.9, 0.7
LAYER_IN, LONG_NAME = 0.8, 13
TINY, NAME = 5.6, 7.2
SWEEPS = 8


@dataclass(frozen=True)
class Step:
    """A rule on the way.

    Attributes
    ----------
    name : str
        The rule's.
    stage : str
        File of rules that it stands in.
    recorded : tuple of str
        What it reads of the recordings.
    reads : mapping
        Files that it reads, by the rule that writes them.
    writes : tuple of str
        Those of its files that another step reads, or that are wanted.
    """

    name: str
    stage: str
    recorded: tuple[str, ...]
    reads: Mapping[str, tuple[str, ...]]
    writes: tuple[str, ...]


def steps_of(rules: Sequence[Mapping]) -> list[Step]:
    """Steps from what the workflow says of its rules.

    Parameters
    ----------
    rules : sequence of mapping
        ``rule``, ``stage``, ``recorded`` (list), ``reads`` (rule to list of files) and ``wanted``
        (list of its files that nobody reads) of each rule.

    Returns
    -------
    list of Step

    Raises
    ------
    ValueError
        If there is none, or one reads what none of them writes.
    """
    if not rules:
        raise ValueError("rules: expected at least one, found none")
    names = {rule["rule"] for rule in rules}
    for rule in rules:
        if unknown := set(rule["reads"]) - names:
            raise ValueError(f"rules: {rule['rule']}: expected known rules, found {min(unknown)}")
    steps = []
    for rule in rules:
        taken = {f for other in rules for f in other["reads"].get(rule["rule"], ())}
        reads = {name: tuple(files) for name, files in rule["reads"].items()}
        writes = tuple(sorted(taken | set(rule["wanted"])))
        steps.append(Step(rule["rule"], rule["stage"], tuple(rule["recorded"]), reads, writes))
    return steps


def layers_of(steps: Sequence[Step]) -> dict[str, int]:
    """Layer of each step, the length of the longest way to it.

    Raises
    ------
    ValueError
        If the steps go in a circle.
    """
    by_name = {step.name: step for step in steps}
    found: dict[str, int] = {}

    def layer(name: str, above: tuple[str, ...]) -> int:
        if name in above:
            raise ValueError(f"rules: expected no circle, found one through {name}")
        if name not in found:
            reads = by_name[name].reads
            found[name] = 1 + max((layer(other, (*above, name)) for other in reads), default=-1)
        return found[name]

    for step in steps:
        layer(step.name, ())
    return found


def direct_edges(steps: Sequence[Step]) -> set[tuple[str, str]]:
    """Edges (from, to) between which no longer way leads (transitive reduction)."""
    reads = {step.name: set(step.reads) for step in steps}

    def before(name: str) -> set[str]:
        return reads[name] | {far for near in reads[name] for far in before(near)}

    return {
        (one, name)
        for name in reads
        for one in reads[name]
        if not any(one in before(other) for other in reads[name] - {one})
    }


def columns_of(steps: Sequence[Step]) -> tuple[dict[str, float], list[tuple[str, int, int]]]:
    """Column of each step, and stages with their first column and number of columns.

    Stages stand side by side in the order in which they are passed; within a stage steps of one
    layer stand side by side, near to what they read and to what reads them.
    """
    layers = layers_of(steps)
    stages = sorted({step.stage for step in steps}, key=lambda s: _passed(s, steps, layers))
    lanes, start, columns = [], 0, {}
    for stage in stages:
        rows = _rows(stage, steps, layers)
        width = max(len(row) for row in rows)
        for row in rows:
            for k, name in enumerate(row):
                columns[name] = start + (k + 0.5) * width / len(row)
        lanes.append((stage, start, width))
        start += width
    for _ in range(SWEEPS):
        for lane in lanes:
            _settle_lane(lane, steps, layers, columns)
    return columns, lanes


def figure_1_1(rules: Sequence[Mapping]) -> Figure:
    """Overview of the workflow from a capture to its parameters (Fig. 1.1).

    Parameters
    ----------
    rules : sequence of mapping
        See `steps_of`.
    """
    steps = steps_of(rules)
    layers, (columns, lanes) = layers_of(steps), columns_of(steps)
    depth, width = max(layers.values()) + 1, sum(lane[2] for lane in lanes)
    figure = plt.figure(figsize=(PAGE_IN, LAYER_IN * (depth + 1.6)))
    axes = figure.add_axes((0, 0, 1, 1))
    axes.set(xlim=(-0.06, width + 0.06), ylim=(depth + 1.08, -0.52))
    axes.set_axis_off()
    colours = {stage: COLOURS[k % len(COLOURS)] for k, (stage, _, _) in enumerate(lanes)}
    for lane in lanes:
        _draw_lane(axes, lane, depth, colours[lane[0]])
    places = {step.name: (columns[step.name], layers[step.name] + 0.5) for step in steps}
    direct = direct_edges(steps)
    for step in steps:
        for other in step.reads:
            _draw_edge(axes, places[other], places[step.name], (other, step.name) in direct)
    for step in steps:
        _draw_step(axes, step, places[step.name], colours[step.stage])
    _draw_results(axes, steps, places, depth)
    _draw_legend(axes, depth)
    return figure


def _passed(stage: str, steps: Sequence[Step], layers: Mapping[str, int]) -> tuple[float, str]:
    found = [layers[step.name] for step in steps if step.stage == stage]
    return float(np.mean(found)), stage


def _rows(stage: str, steps: Sequence[Step], layers: Mapping[str, int]) -> list[list[str]]:
    """Names of a stage's steps, a list for each layer in which it has any."""
    rows: dict[int, list[str]] = {}
    for step in sorted(steps, key=lambda step: step.name):
        if step.stage == stage:
            rows.setdefault(layers[step.name], []).append(step.name)
    return [rows[layer] for layer in sorted(rows)]


def _settle_lane(
    lane: tuple[str, int, int],
    steps: Sequence[Step],
    layers: Mapping[str, int],
    columns: dict[str, float],
) -> None:
    """Give each step of a stage the free column nearest to its neighbours' mean, layer by layer."""
    _, start, width = lane
    slots = start + 0.5 + np.arange(width)
    neighbours = {step.name: list(step.reads) for step in steps}
    for step in steps:
        for other in step.reads:
            neighbours[other].append(step.name)
    for row in _rows(lane[0], steps, layers):
        wish = [np.mean([columns[m] for m in neighbours[n]] or [columns[n]]) for n in row]
        chosen = linear_sum_assignment((np.array(wish)[:, None] - slots) ** 2)[1]
        columns.update(zip(row, slots[chosen].tolist(), strict=True))


def _draw_lane(axes: Axes, lane: tuple[str, int, int], depth: int, colour: str) -> None:
    stage, start, width = lane
    box = Rectangle((start + 0.02, -0.42), width - 0.04, depth + 0.98, fc=colour, alpha=0.09)
    axes.add_patch(box)
    title = TITLES.get(stage, stage).replace(" ", "\n", 1) if width == 1 else TITLES.get(stage)
    axes.text(
        start + width / 2,
        -0.22,
        title or stage,
        ha="center",
        va="center",
        weight="bold",
        fontsize=NAME,
    )


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


def _draw_step(axes: Axes, step: Step, place: tuple[float, float], colour: str) -> None:
    """Box of a rule: what it reads of the recordings, its name, what it writes."""
    _box(axes, place, BOX_HEIGHT, fc="white", ec=colour)
    name = step.name.replace("_", "_\n", 1) if len(step.name) > LONG_NAME else step.name
    parts = [("\n".join(step.recorded), -0.215, TINY, "0.4", "normal")]
    parts += [(name, 0.0 if step.recorded else -0.08, NAME, BLACK, "bold")]
    parts += [("\n".join(step.writes), 0.23, TINY, BLACK, "normal")]
    for text, down, size_pt, ink, weight in parts:
        axes.text(
            place[0],
            place[1] + down,
            text,
            ha="center",
            va="center",
            fontsize=size_pt,
            color=ink,
            weight=weight,
            linespacing=1.05,
            zorder=4,
        )


def _box(axes: Axes, place: tuple[float, float], height: float, **look) -> None:
    size = np.array([BOX_WIDTH, height])
    style = "round,pad=0,rounding_size=0.05"
    corner = np.array(place) - size / 2
    axes.add_patch(FancyBboxPatch(corner, *size, boxstyle=style, lw=1.2, zorder=3, **look))


def _draw_results(
    axes: Axes, steps: Sequence[Step], places: Mapping[str, tuple[float, float]], depth: int
) -> None:
    """What the workflow is for, under the steps that end the way."""
    ends = {name for step in steps for name in step.reads}
    for step in steps:
        if step.name not in ends:
            column, row = places[step.name]
            result = column, depth + 0.36
            _draw_edge(axes, (column, row), (column, result[1] + BOX_HEIGHT / 2 - 0.13), True)
            _box(axes, result, 0.26, fc=BLACK, ec=BLACK)
            look = {"color": "white", "weight": "bold", "ha": "center", "va": "center"}
            axes.text(*result, r"$E$ and $\nu$", fontsize=NAME, zorder=4, **look)


def _draw_legend(axes: Axes, depth: int) -> None:
    text = "box: recordings that a rule reads (grey), its name, its files that others read\n"
    text += "arrow: who reads them; grey: who gets there by a longer way too"
    axes.text(0.05, depth + 0.83, text, va="center", fontsize=6.2, linespacing=1.3)


def make_figure_1_1(inputs: Any, params: Any) -> Figure:
    """The figure from the way that the workflow tells."""
    return figure_1_1(params.rules)
