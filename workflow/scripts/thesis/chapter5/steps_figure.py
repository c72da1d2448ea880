"""E and nu of each step of the error minimisation against the truth, drawn."""

from string import ascii_lowercase

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from palpate.report.style import (
    BLACK,
    BLUE,
    ERROR_NAMES,
    GREY,
    ORANGE,
    PAGE_IN,
    SMALL,
    label_provenance,
    panel_letter,
    sensor_name,
)

from thesis.chapter5.minimise_steps import ALONE, TRUE

COLOURS = {"bumblebee": BLUE, "kinect": ORANGE}
SPREAD = 0.16
HEIGHT_IN = 5.4
RATIO_TICKS = (0.5, 0.8, 1.0, 1.25, 2.0, 4.0)
ROWS = {
    "relaxed_modulus_ratio": "E over the truth\na second after a step",
    "poisson_ratio": "Poisson's ratio",
}


def minimise_steps(table: pd.DataFrame, error: str) -> Figure:
    """E over the truth and nu of each capture, by object and step.

    Parameters
    ----------
    table : DataFrame
        Of `thesis.chapter5.steps_table.steps_table`.
    error : str
        The error option that is shown.

    Raises
    ------
    ValueError
        If the table has no row of that error option.
    """
    shown = table[table["error"] == error]
    if shown.empty:
        raise ValueError(f"error: expected one of the table's, found {error}")
    names, size = list(dict.fromkeys(shown["object"])), (PAGE_IN, HEIGHT_IN)
    shared = {"sharex": True, "sharey": "row", "squeeze": False}
    figure, axes = plt.subplots(2, len(names), figsize=size, **shared)
    for k, name in enumerate(names):
        mine = shown[shown["object"] == name]
        for panel, column in zip(axes[:, k], ROWS, strict=True):
            _draw(panel, mine, column)
        axes[0, k].set_title(name.replace("foam_", "").capitalize())
    for panel, letter in zip(axes.flat, ascii_lowercase, strict=False):
        panel_letter(panel, letter)
    for row, label in zip(axes[:, 0], ROWS.values(), strict=True):
        row.set_ylabel(label)
    _ratio_axis(axes[0, 0])
    axes[1, 0].set_ylim(0, 0.5)
    figure.tight_layout(rect=(0, 0.09, 1, 1))
    _explain(figure, shown, error)
    label_provenance(figure, set(shown["provenance"]))
    return figure


def _draw(panel: Axes, rows: pd.DataFrame, column: str) -> None:
    """Each capture's steps joined, those that stand alone beside them, and the truth."""
    steps = list(dict.fromkeys(rows["step"]))
    keys = list(dict.fromkeys(zip(rows["sensor"], rows["capture"], strict=True)))
    for shift, (sensor, capture) in zip(_spread(len(keys)), keys, strict=True):
        mine = rows[(rows["sensor"] == sensor) & (rows["capture"] == capture)]
        look = {"color": COLOURS.get(sensor, GREY), "ms": 3.5, "lw": 0.7, "clip_on": False}
        for part, style in _parts(mine):
            place = np.array([steps.index(step) for step in part["step"]]) + shift
            panel.plot(place, part[column], **style, **look)
    true = 1.0 if column != "poisson_ratio" else rows["true_poisson_ratio"].iloc[0]
    panel.axhline(true, color=BLACK, lw=0.8, ls=(0, (4, 2)))
    labels = [step.replace("_", " ") for step in steps]
    panel.set_xticks(range(len(steps)), labels, rotation=55, ha="right", fontsize=SMALL)


def _parts(rows: pd.DataFrame) -> list[tuple[pd.DataFrame, dict]]:
    """Steps added in turn, each alone, and those on the true surface, with how they look."""
    kinds = rows["kind"]
    return [
        (rows[~kinds.isin([ALONE, TRUE])], {"marker": "o", "ls": "-"}),
        (rows[kinds == ALONE], {"marker": "x", "ls": ""}),
        (rows[kinds == TRUE], {"marker": "o", "ls": ":", "mfc": "white"}),
    ]


def _ratio_axis(panel: Axes) -> None:
    """Logarithmic, so that half and double stand alike, with plain numbers."""
    panel.set_yscale("log")
    low, high = panel.get_ylim()
    low, high = min(low, RATIO_TICKS[1]), max(high, RATIO_TICKS[3])
    ticks = [tick for tick in RATIO_TICKS if low <= tick <= high]
    panel.set_yticks(ticks, [f"{tick:g}" for tick in ticks])
    panel.minorticks_off()
    panel.set_ylim(low, high)


def _spread(count: int) -> np.ndarray:
    return np.linspace(-SPREAD, SPREAD, count) if count > 1 else np.zeros(1)


def _explain(figure: Figure, rows: pd.DataFrame, error: str) -> None:
    look = {"ms": 3.5, "lw": 0.7}
    lines = {
        f"{sensor_name(name)}, added in turn": {"color": COLOURS.get(name, GREY), "marker": "o"}
        for name in dict.fromkeys(rows["sensor"])
    }
    lines["alone"] = {"marker": "x", "ls": ""}
    lines["on the true surface"] = {"marker": "o", "ls": ":", "mfc": "white"}
    lines["truth"] = {"lw": 0.8, "ls": (0, (4, 2))}
    handles = [
        plt.Line2D([], [], **({"color": BLACK} | look | line), label=name)
        for name, line in lines.items()
    ]
    title, place = f"error of {ERROR_NAMES[error]}", {"bbox_to_anchor": (0.5, 0.02)}
    figure.legend(handles=handles, title=title, loc="lower center", ncols=len(lines), **place)
