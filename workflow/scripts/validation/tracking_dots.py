"""Errors of the trackers as dots, one for each capture."""

from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter, ScalarFormatter
from palpate.report.panels import named
from palpate.report.style import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    PAGE_IN,
    label_provenance,
    sensor_name,
)

ROWS = {
    "displacement_mean_dent_mm": "Error in the dent (mm)",
    "displacement_mean_all_mm": "Error over all (mm)",
}
COLOURS = (GREY, BLUE, ORANGE, GREEN)
NOTE = (
    "mean error of displacement in the most pressed frame, by tracker; dot: capture, line: median"
)
SPREAD = 0.32
MEDIAN_HALF_WIDTH = 0.4


def tracking_accuracy(table: pd.DataFrame) -> Figure:
    """Mean error of the displacement in the most pressed frame, by object, sensor and tracker.

    Parameters
    ----------
    table : DataFrame
        tracking_accuracy.csv.

    Raises
    ------
    ValueError
        If it holds no capture.
    """
    if table.empty:
        raise ValueError("table: expected captures, found none")
    groups = list(table.groupby(["object", "sensor"], sort=False))
    size = (PAGE_IN, 4.2)
    figure, axes = plt.subplots(
        2, len(groups), figsize=size, sharey="row", sharex=True, squeeze=False
    )
    letters = iter("abcdefghijklmnopqrstuvwxyz")
    for k, (row, (column, label)) in enumerate(zip(axes, ROWS.items(), strict=True)):
        for panel, ((name, sensor), group) in zip(row, groups, strict=True):
            _dots(panel, group, column)
            title = f"{name.replace('foam_', '').capitalize()}, {sensor_name(sensor)}"
            named(panel, next(letters), title if k == 0 else "")
        row[0].set_ylabel(label)
        _decades(row[0])
    figure.align_ylabels(axes[:, 0])
    figure.tight_layout(rect=(0, 0.05, 1, 0.98))
    figure.text(0.02, 0.012, NOTE, fontsize=6.5)
    label_provenance(figure, set(table["provenance"]))
    return figure


def _dots(panel: Axes, group: pd.DataFrame, column: str) -> None:
    names = list(dict.fromkeys(group["tracker"]))
    for k, (name, colour) in enumerate(zip(names, COLOURS, strict=False)):
        values = np.sort(group.loc[group["tracker"] == name, column].dropna().to_numpy(float))
        if not len(values):
            continue
        # Even spacing by rank keeps dots apart without chance.
        aside = np.linspace(-SPREAD, SPREAD, len(values)) if len(values) > 1 else np.zeros(1)
        panel.plot(k + aside, values, "o", ms=3.2, mew=0, color=colour, alpha=0.85)
        ends = [k - MEDIAN_HALF_WIDTH, k + MEDIAN_HALF_WIDTH]
        panel.plot(ends, [np.median(values)] * 2, color=BLACK, lw=1.1, zorder=3)
    panel.set_xticks(range(len(names)), names, rotation=30)
    panel.set_xlim(-0.6, len(names) - 0.4)
    panel.grid(axis="y", lw=0.4, color="0.9")
    panel.set_axisbelow(True)


def _decades(panel: Axes) -> None:
    panel.set_yscale("log")
    panel.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    panel.yaxis.set_major_formatter(ScalarFormatter())
    panel.yaxis.set_minor_formatter(NullFormatter())


def make_tracking_accuracy_figure(inputs: Any, params: Any) -> Figure:
    """The figure from the table."""
    return tracking_accuracy(pd.read_csv(inputs.table, dtype={"capture": str, "point": str}))
