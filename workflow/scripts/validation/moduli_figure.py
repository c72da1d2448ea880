"""Direct estimates of E and nu with their intervals, capture by capture and together."""

from collections.abc import Mapping, Sequence
from string import ascii_lowercase
from typing import Any

import matplotlib.pyplot as plt
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from palpate.json_fields import read_all, read_by_folder
from palpate.modulus import IDENTIFIED, VERDICTS
from palpate.report.estimate_rows import compared
from palpate.report.own_moduli import QUANTITIES
from palpate.report.style import (
    BLACK,
    BLUE,
    GREY,
    ORANGE,
    PAGE_IN,
    finished,
    panel_letter,
    sensor_name,
)
from validation.measured import truth_of

# Of captures on an axis.
MOST_NAMES = 12
COLOURS = {"bumblebee": BLUE, "kinect": ORANGE}


def make_direct_moduli(inputs: Any, params: Any) -> Figure:
    """Moduli of captures and groups, beside the true ones where there are any."""
    files = read_all(inputs.direct), read_all(inputs.joint)
    singles, joints = compared(params.captures, files[0], params.groups, files[1])
    materials = read_by_folder(inputs.materials)
    return direct_moduli(params.captures, singles, params.groups, joints, materials)


def direct_moduli(
    captures: Sequence[Mapping],
    singles: Sequence[Mapping],
    groups: Sequence[Mapping],
    joints: Sequence[Mapping],
    materials: Mapping[str, Mapping],
) -> Figure:
    """Moduli of each capture and of all together, a column of panels for each object.

    Parameters
    ----------
    captures, singles : sequences of mapping
        Described captures and their direct.json.
    groups, joints : sequences of mapping
        ``object, sensor`` and the direct.json of all captures of each.
    materials : mapping
        material.json by object, where the lab made it.
    """
    objects = list(dict.fromkeys(group["object"] for group in groups))
    width = [max(sum(c["object"] == name for c in captures), 4) + 4 for name in objects]
    figure, axes = plt.subplots(
        len(QUANTITIES),
        len(objects),
        figsize=(PAGE_IN, 1.75 * len(QUANTITIES)),
        sharex="col",
        squeeze=False,
        width_ratios=width,
    )
    for column, name in zip(axes.T, objects, strict=True):
        mine = [(c, s) for c, s in zip(captures, singles, strict=True) if c["object"] == name]
        ours = [(g, j) for g, j in zip(groups, joints, strict=True) if g["object"] == name]
        places = _places(mine, ours)
        for panel, (quantity, (_, scale)) in zip(column, QUANTITIES.items(), strict=True):
            _draw(panel, places, quantity, scale)
            if name in materials:
                truth = truth_of(materials[name])[quantity] * scale
                panel.axhline(truth, color=BLACK, lw=0.8, ls="--", zorder=0, label="truth")
        column[0].set_title(name.replace("_", " "), pad=14)
        column[-1].set_ylim(0, 0.5)
        _name_captures(column[-1], places)
    for panel, letter in zip(axes.flat, ascii_lowercase, strict=False):
        panel_letter(panel, letter)
    for row, (label, _) in zip(axes, QUANTITIES.values(), strict=True):
        row[0].set_ylabel(label)
    given = {found[name]["verdict"] for found in (*singles, *joints) for name in QUANTITIES}
    _legend(figure, groups, bool(materials), given)
    return finished(figure, {capture["provenance"] for capture in captures})


def _places(mine: Sequence, ours: Sequence) -> list[tuple[float, Mapping, Mapping, bool]]:
    """Place on the axis, capture, estimate, and whether it is that of all together."""
    found, place = [], 0.0
    for group, joint in ours:
        for capture, single in mine:
            if capture["sensor"] == group["sensor"]:
                found.append((place, capture, single, False))
                place += 1
        found.append((place + 0.3, group, joint, True))
        place += 2.3
    return found


def _draw(panel: Axes, places: Sequence, quantity: str, scale: float) -> None:
    for place, capture, found, together in places:
        value, low, high = (scale * found[quantity][end] for end in ("value", "low", "high"))
        colour = COLOURS.get(capture["sensor"], GREY)
        known = found[quantity]["verdict"] == IDENTIFIED
        width = 2.2 if together else 0.9
        panel.plot([place] * 2, [low, high], color=colour, lw=width, solid_capstyle="butt")
        look = {"marker": "D", "ms": 5} if together else {"marker": "o", "ms": 3}
        panel.plot(place, value, color=colour, mfc=colour if known else "white", mew=0.8, **look)


def _name_captures(panel: Axes, places: Sequence) -> None:
    ticks = [
        (place, "all" if together else capture["capture"]) for place, capture, _, together in places
    ]
    every = -(-len(ticks) // MOST_NAMES)
    shown = [tick for k, tick in enumerate(ticks) if tick[1] == "all" or k % every == 0]
    panel.set_xticks(*zip(*shown, strict=True))
    panel.tick_params(axis="x", labelrotation=90, labelsize=6.5)
    panel.set_xlabel("capture")
    ends = [place for place, *_ in places]
    panel.set_xlim(min(ends) - 1, max(ends) + 1)


def _legend(figure: Figure, groups: Sequence[Mapping], truth: bool, given: set[str]) -> None:
    sensors = dict.fromkeys(group["sensor"] for group in groups)
    dot = {"marker": "o", "ms": 3}
    handles = [
        Line2D([], [], color=COLOURS.get(sensor, GREY), lw=0.9, label=sensor_name(sensor), **dot)
        for sensor in sensors
    ]
    handles.append(Line2D([], [], color=GREY, marker="D", ms=5, lw=2.2, label="all together"))
    if others := [verdict for verdict in VERDICTS if verdict in given - {IDENTIFIED}]:
        label = " or ".join(others)
        handles.append(Line2D([], [], color=GREY, mfc="white", lw=0, label=label, **dot))
    if truth:
        handles.append(Line2D([], [], color=BLACK, lw=0.8, ls="--", label="truth"))
    place = {"loc": "lower left", "bbox_to_anchor": (0.05, -0.005)}
    figure.legend(handles=handles, ncols=len(handles), fontsize=7, handlelength=1.6, **place)
