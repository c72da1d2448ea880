"""Figures 4.14 to 4.19: the workspace and the tip's deviation in it."""

from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from numpy.typing import NDArray
from palpate.report import style
from palpate.report.panels import named
from palpate.report.style import BLACK, BLUE, GREEN, GREY, ORANGE
from palpate.units import CENTIMETRES, MILLIMETRES
from palpate.vision.pose import CORNERS, REFINED, averages, select_threshold

from thesis.chapter4.workspace import AXES, by_sensor
from thesis.diagrams import DASHED, TEXT_PT, by_sensor_panels, legend_below, provenances

COLOURS = (BLUE, GREEN, ORANGE)
AXIS_LOOKS = {
    name: {"color": colour, "marker": mark}
    for name, colour, mark in zip("xyz", COLOURS, "os^", strict=True)
}
SENSOR_LOOKS = {"bumblebee": {"color": BLUE, "marker": "o"}}
SENSOR_LOOKS |= {"kinect": {"color": ORANGE, "marker": "s"}}
# Sensors see the same places: a cross shows inside a ring.
PLACE_LOOKS = {"bumblebee": {"marker": "o", "ms": 7}, "kinect": {"marker": "+", "ms": 6}}
OTHER = {"color": BLACK, "marker": "^"}
# Where the study's own choice of threshold lies [px] (Section 4.2.3).
STUDY_PX = {"bumblebee": 0.25, "kinect": 0.45}
CORNERS_LOOK = {"label": "as the study", "marker": "o", "color": BLUE, "ms": 3.6}
REFINED_LOOK = {"label": "refined on the picture", "marker": "D", "color": ORANGE}
REFINED_LOOK |= {"ms": 3.4, "mfc": "none"}
THRESHOLD = "Reprojection threshold (px)"
FACTORS = {"std_angle_rad": float(np.degrees(1))}


def figure_4_14(inputs: Any, params: Any) -> Figure:
    """The sampled points, from above and from the side, in each camera's frame (Fig. 4.14)."""
    figure, axes = plt.subplots(1, 2, figsize=(style.PAGE_IN, 2.9))
    for name, table in sorted(by_sensor(params.names, inputs.tables).items()):
        tips = _places(table) * CENTIMETRES
        look = OTHER | SENSOR_LOOKS.get(name, {}) | PLACE_LOOKS.get(name, {})
        for panel, across in zip(axes, (0, 1), strict=True):
            label = style.sensor_name(name)
            panel.plot(*tips[:, [2, across]].T, ls="", mfc="none", mew=1.1, label=label, **look)
    words = (("From above", "x, to the right (cm)"), ("From the side", "y, down (cm)"))
    for panel, (title, label), letter in zip(axes, words, "ab", strict=True):
        panel.set(xlabel="z, away from the camera (cm)", ylabel=label)
        panel.set_aspect("equal", adjustable="datalim")
        panel.margins(0.12)
        named(panel, letter, title)
        arrow = {"arrowstyle": "-|>", "lw": 0.8, "color": BLACK}
        text = "to the camera at 0"
        look = {"xycoords": "axes fraction", "textcoords": "offset points", "fontsize": TEXT_PT}
        panel.annotate(text, (0.01, 0.96), (22, 0), va="center", arrowprops=arrow, **look)
    axes[1].invert_yaxis()
    return legend_below(figure, axes[0], provenances(params))


def figure_4_15(inputs: Any, params: Any) -> Figure:
    """Mean deviation of the tip along x, y, z against the threshold (Fig. 4.15)."""
    figure, axes, items = by_sensor_panels(by_sensor(params.names, inputs.tables), 3.0, sharey=True)
    for panel, (name, table) in zip(axes[0], items, strict=True):
        means = averages(table)
        for axis, look in AXIS_LOOKS.items():
            values = means[f"std_{axis}_m"] * MILLIMETRES
            panel.plot(means.index, values, "-", ms=3.5, label=f"${axis}$", **look)
        panel.axvline(select_threshold(table), color=BLACK, lw=0.8, label="selected")
        if name in STUDY_PX:
            study = {"color": GREY, "lw": 0.8, "ls": DASHED, "label": "the study's"}
            panel.axvline(STUDY_PX[name], **study)
        panel.set_xlabel(THRESHOLD)
    axes[0, 0].set_ylabel("Mean standard deviation\nof the tip (mm)")
    axes[0, 0].set_ylim(bottom=0)
    return legend_below(figure, axes[0, 0], provenances(params))


def by_threshold(inputs: Any, params: Any) -> Figure:
    """One quantity of all sensors against the threshold (Fig. 4.16 to 4.18)."""
    tables, factor = by_sensor(params.names, inputs.tables), FACTORS.get(params.column, 1.0)
    figure, panel = plt.subplots(figsize=(style.COLUMN_IN, 2.5))
    for name, table in sorted(tables.items()):
        values, selected = averages(table)[params.column] * factor, select_threshold(table)
        look = SENSOR_LOOKS.get(name, OTHER)
        panel.plot(values.index, values, "-", ms=3.5, label=style.sensor_name(name), **look)
        panel.plot(selected, values[selected], ls="", ms=8, mfc="none", **look)
    panel.plot([], [], "o", ms=8, mfc="none", mec=GREY, label="selected")
    panel.set(xlabel=THRESHOLD, ylabel=params.label)
    panel.set_ylim(bottom=0)
    # Above the panel: curves may be anywhere in it.
    above = {"loc": "lower left", "bbox_to_anchor": (-0.02, 0.98), "ncols": len(tables) + 1}
    panel.legend(columnspacing=1.2, handletextpad=0.4, **above)
    return style.finished(figure, provenances(params))


def figure_4_19(inputs: Any, params: Any) -> Figure:
    """Deviation of the tip against the grid point's distance, per axis and sensor (Fig. 4.19)."""
    tables = by_sensor(params.names, inputs.tables)
    size = (style.PAGE_IN, 2.0 * len(tables) + 0.5)
    figure, axes = plt.subplots(len(tables), 3, figsize=size, sharex=True, squeeze=False)
    letters = iter("abcdefghijkl")
    for row, (name, table) in zip(axes, sorted(tables.items()), strict=True):
        at = (table["method"] == CORNERS) & (table["threshold_px"] == select_threshold(table))
        for panel, axis in zip(row, AXES, strict=True):
            for chosen, look in ((at, CORNERS_LOOK), (table["method"] == REFINED, REFINED_LOOK)):
                distance = np.linalg.norm(_places(table[chosen]), axis=1) * CENTIMETRES
                values = table[chosen][f"std_{axis}_m"] * MILLIMETRES
                panel.plot(distance, values, ls="", clip_on=False, **look)
            named(panel, next(letters), f"{style.sensor_name(name)}, ${axis}$")
            panel.set_ylim(bottom=0)
        row[0].set_ylabel("Standard deviation (mm)")
    for panel in axes[-1]:
        panel.set_xlabel("Distance from the camera (cm)")
    return legend_below(figure, axes[0, 0], provenances(params))


def _places(table: pd.DataFrame) -> NDArray:
    """Mean tip of each point, camera frame, (n, 3) [m]."""
    first = table[table["method"] == REFINED] if "method" in table else table
    rows = first if len(first) else table
    return rows[["mean_x_m", "mean_y_m", "mean_z_m"]].to_numpy(float)
