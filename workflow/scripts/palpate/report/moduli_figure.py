"""Moduli of objects, a line for each capture and one for all of a sensor together."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import matplotlib.pyplot as plt
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from palpate.json_fields import read_all
from palpate.modulus import IDENTIFIED, LABELS
from palpate.report.estimate_rows import compared, of_group
from palpate.report.style import BLACK, BLUE, PAGE_IN, finished, sensor_name
from palpate.units import KILOPASCALS

# Of a line, of what is above and below the lines of an object, and of the whole at most [in].
LINE_IN, AROUND_IN, HIGHEST_IN = 0.24, 0.62, 9.0
GREATEST_NU = 0.5
SCALES = {
    "effective_reduced_modulus_pa": KILOPASCALS,
    "youngs_modulus_pa": KILOPASCALS,
    "poisson_ratio": 1.0,
}
TRUTH = {"color": BLACK, "lw": 0.8, "ls": "--", "zorder": 0, "label": "truth"}


class Line(NamedTuple):
    """An estimate and what it is of."""

    label: str
    found: Mapping
    together: bool


def make_moduli(
    inputs: Any, params: Any, truths: Mapping[str, Mapping[str, float]] | None = None
) -> Figure:
    """Moduli of each capture, and of all of an object by each sensor; truths where known."""
    files = read_all(inputs.direct), read_all(inputs.joint)
    singles, joints = compared(params.captures, files[0], params.groups, files[1])
    return moduli_figure(params.captures, singles, params.groups, joints, truths or {})


def moduli_figure(
    captures: Sequence[Mapping],
    singles: Sequence[Mapping],
    groups: Sequence[Mapping],
    joints: Sequence[Mapping],
    truths: Mapping[str, Mapping[str, float]],
) -> Figure:
    """Moduli with their intervals on lines one below the other, a row of panels for each object.

    Parameters
    ----------
    captures, singles : sequences of mapping
        Described captures and their direct.json.
    groups, joints : sequences of mapping
        ``object, sensor`` and the direct.json of all captures of each.
    truths : mapping
        True moduli by object and quantity, where they are known.
    """
    rows: dict[str, list[Line]] = {}
    for group, joint in zip(groups, joints, strict=True):
        mine = [(of["capture"], single) for of, single in of_group(group, captures, singles)]
        rows.setdefault(group["object"], []).extend(_lines(group["sensor"], mine, joint))
    heights = [AROUND_IN + LINE_IN * len(lines) for lines in rows.values()]
    size = (PAGE_IN, min(sum(heights), HIGHEST_IN))
    look = {"sharey": "row", "squeeze": False, "height_ratios": heights}
    figure, axes = plt.subplots(len(rows), len(SCALES), figsize=size, **look)
    for panels, (name, lines) in zip(axes, rows.items(), strict=True):
        for panel, (quantity, scale) in zip(panels, SCALES.items(), strict=True):
            draw_lines(panel, lines, quantity)
            if name in truths:
                panel.axvline(scale * truths[name][quantity], **TRUTH)
        if len(rows) > 1:
            panels[0].set_title(name.replace("_", " "))
    if truths:
        figure.legend(handles=[Line2D([], [], **TRUTH)], loc="lower left")
    return finished(figure, {capture["provenance"] for capture in captures})


def _lines(sensor: str, singles: Sequence[tuple[str, Mapping]], joint: Mapping) -> Iterator[Line]:
    """Captures of a sensor and then all of them; one alone is all of them."""
    name = sensor_name(sensor)
    if len(singles) > 1:
        yield from (Line(f"{name} {capture}", single, False) for capture, single in singles)
        name += f", all {len(singles)}"
    yield Line(name, joint, True)


def draw_lines(panel: Axes, lines: Sequence[Line], quantity: str) -> None:
    """Draw a quantity's intervals and values; a symbol of what is not identified is hollow."""
    scale = SCALES[quantity]
    panel.set_xlabel(LABELS[quantity] + " (kPa)" * quantity.endswith("_pa"))
    for place, line in enumerate(lines):
        one = line.found[quantity]
        value, low, high = (scale * one[end] for end in ("value", "low", "high"))
        width = 2.2 if line.together else 0.9
        panel.plot([low, high], [place] * 2, color=BLUE, lw=width, solid_capstyle="butt")
        marker = {"marker": "D", "ms": 5} if line.together else {"marker": "o", "ms": 3.5}
        marker["mfc"] = BLUE if one["verdict"] == IDENTIFIED else "white"
        panel.plot(value, place, color=BLUE, mew=0.9, **marker)
    panel.set_xlim(0, GREATEST_NU if quantity == "poisson_ratio" else None)
    panel.set_yticks(range(len(lines)), [line.label for line in lines])
    panel.set_ylim(len(lines) - 0.4, -0.6)
    panel.tick_params(axis="y", length=0)
