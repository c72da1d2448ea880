"""Figures 4.14 to 4.19: the workspace and the tip's deviation in it."""

from collections.abc import Mapping
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray
from palpate.report.style import (
    BLACK,
    BLUE,
    COLUMN_IN,
    GREEN,
    GREY,
    ORANGE,
    PAGE_IN,
    finished,
    panel_letter,
    sensor_name,
)
from palpate.units import CENTIMETRES, MILLIMETRES

from thesis.chapter4.sensor_files import by_sensor, provenances
from thesis.chapter4.workspace import CORNERS, REFINED, averages, select_threshold

AXIS_COLOURS = {"x": BLUE, "y": GREEN, "z": ORANGE}
SENSOR_COLOURS = {"bumblebee": BLUE, "kinect": ORANGE}
MARKERS = {"bumblebee": "o", "kinect": "s"}
# Where the study's own choice of threshold lies [px] (Section 4.2.3).
STUDY_PX = {"bumblebee": 0.25, "kinect": 0.45}


def make_figure_4_14(inputs: Any, params: Any) -> Figure:
    """Figure 4.14, of each sensor's points."""
    return figure_4_14(by_sensor(params.names, inputs.tables), provenances(params))


def figure_4_14(tables: Mapping[str, pd.DataFrame], provenance: set[str]) -> Figure:
    """The sampled points, from above and from the side, in each camera's frame (Fig. 4.14)."""
    figure, axes = plt.subplots(1, 2, figsize=(PAGE_IN, 2.3))
    for name, table in sorted(tables.items()):
        tips = _places(table) * CENTIMETRES
        style = _points(name)
        for panel, across in zip(axes, (0, 1), strict=True):
            panel.plot(tips[:, 2], tips[:, across], **style)
    for panel, label, letter in zip(
        axes, ("x, to the right (cm)", "y, down (cm)"), "ab", strict=True
    ):
        panel.plot(0, 0, ">", ms=8, color=BLACK, clip_on=False)
        panel.annotate("camera", (0, 0), (0, 9), textcoords="offset points", fontsize=7.5)
        panel.set_xlabel("z, away from the camera (cm)")
        panel.set_ylabel(label)
        panel.set_aspect("equal")
        panel.set_xlim(left=-4)
        panel_letter(panel, letter)
    axes[1].invert_yaxis()
    for name in sorted(tables):
        axes[0].plot([], [], label=sensor_name(name), **_points(name))
    axes[0].legend(loc="lower left", bbox_to_anchor=(0.0, 0.62))
    return finished(figure, provenance)


def make_figure_4_15(inputs: Any, params: Any) -> Figure:
    """Figure 4.15, of each sensor's points."""
    return figure_4_15(by_sensor(params.names, inputs.tables), provenances(params))


def figure_4_15(tables: Mapping[str, pd.DataFrame], provenance: set[str]) -> Figure:
    """Mean deviation of the tip along x, y, z against the threshold (Fig. 4.15)."""
    figure, axes = plt.subplots(1, len(tables), figsize=_wide(tables), sharey=True, squeeze=False)
    for panel, (name, table) in zip(axes[0], sorted(tables.items()), strict=True):
        means = averages(table)
        for axis, colour in AXIS_COLOURS.items():
            values = means[f"std_{axis}_m"] * MILLIMETRES
            panel.plot(means.index, values, "o-", ms=3, color=colour, label=axis)
        panel.set_title(sensor_name(name))
        panel.set_xlabel("Reprojection threshold (px)")
        _mark_thresholds(panel, name, table)
    axes[0, 0].set_ylabel("Mean standard deviation of the tip (mm)")
    axes[0, 0].set_ylim(bottom=0)
    axes[0, 0].legend(
        loc="upper right",
        title="axis of the camera",
        title_fontsize=7.5,
        frameon=True,
        framealpha=1,
        edgecolor="none",
    )
    return finished(figure, provenance)


def make_figure_4_16(inputs: Any, params: Any) -> Figure:
    """Figure 4.16, of each sensor's points."""
    return figure_4_16(by_sensor(params.names, inputs.tables), provenances(params))


def figure_4_16(tables: Mapping[str, pd.DataFrame], provenance: set[str]) -> Figure:
    """Mean deviation of the angle of the board's normal against the threshold (Fig. 4.16)."""
    label = "Mean std. deviation of the angle (°)"
    degrees = float(np.degrees(1))
    return _by_threshold(tables, "std_angle_rad", degrees, label, provenance, legend="upper right")


def make_figure_4_17(inputs: Any, params: Any) -> Figure:
    """Figure 4.17, of each sensor's points."""
    return figure_4_17(by_sensor(params.names, inputs.tables), provenances(params))


def figure_4_17(tables: Mapping[str, pd.DataFrame], provenance: set[str]) -> Figure:
    """Mean number of inliers against the threshold (Fig. 4.17)."""
    label = "Mean number of inliers"
    return _by_threshold(tables, "inliers", 1, label, provenance, legend="lower right")


def make_figure_4_18(inputs: Any, params: Any) -> Figure:
    """Figure 4.18, of each sensor's points."""
    return figure_4_18(by_sensor(params.names, inputs.tables), provenances(params))


def figure_4_18(tables: Mapping[str, pd.DataFrame], provenance: set[str]) -> Figure:
    """Mean reprojection error against the threshold (Fig. 4.18)."""
    label = "Mean reprojection error (px²)"
    return _by_threshold(
        tables, "reprojection_error_px2", 1, label, provenance, legend="lower right"
    )


def make_figure_4_19(inputs: Any, params: Any) -> Figure:
    """Figure 4.19, of each sensor's points."""
    return figure_4_19(by_sensor(params.names, inputs.tables), provenances(params))


def figure_4_19(tables: Mapping[str, pd.DataFrame], provenance: set[str]) -> Figure:
    """Deviation of the tip against the grid point's distance, per axis and sensor (Fig. 4.19)."""
    size = (PAGE_IN, 2.5 * len(tables) + 0.3)
    figure, axes = plt.subplots(len(tables), 3, figsize=size, sharex=True, squeeze=False)
    for row, (name, table) in zip(axes, sorted(tables.items()), strict=True):
        selected = (table["method"] == CORNERS) & (table["threshold_px"] == select_threshold(table))
        distance = np.linalg.norm(_places(table[selected]), axis=1) * CENTIMETRES
        refined = table[table["method"] == REFINED]
        away = np.linalg.norm(_places(refined), axis=1) * CENTIMETRES
        for panel, axis in zip(row, "xyz", strict=True):
            column = f"std_{axis}_m"
            colour = AXIS_COLOURS[axis]
            values = table[selected][column] * MILLIMETRES
            panel.plot(distance, values, "o", ms=3.2, color=colour, label="as the study")
            panel.plot(
                away,
                refined[column] * MILLIMETRES,
                "D",
                ms=3,
                mfc="none",
                color=GREY,
                label="refined on the picture",
            )
            panel.set_title(f"{sensor_name(name)}, {axis}")
            panel.set_ylim(bottom=0)
        row[0].set_ylabel("Standard deviation (mm)")
    for panel in axes[-1]:
        panel.set_xlabel("Distance from the camera (cm)")
    axes[0, 0].legend(loc="upper left")
    return finished(figure, provenance)


def _points(name: str) -> dict:
    """Look of a sensor's points; another size each, so that none hides another."""
    size = 6 if name == "bumblebee" else 3.5
    colour = SENSOR_COLOURS.get(name, BLACK)
    return {"ls": "", "marker": MARKERS.get(name, "^"), "ms": size, "mfc": "none", "color": colour}


def _by_threshold(
    tables: Mapping[str, pd.DataFrame],
    column: str,
    factor: float,
    label: str,
    provenance: set[str],
    *,
    legend: str,
) -> Figure:
    """One quantity of all sensors against the threshold."""
    figure, panel = plt.subplots(figsize=(COLUMN_IN + 0.4, 2.7))
    for name, table in sorted(tables.items()):
        values, selected = averages(table)[column] * factor, select_threshold(table)
        look = {"marker": MARKERS.get(name, "^"), "color": SENSOR_COLOURS.get(name, BLACK)}
        panel.plot(values.index, values, "-", ms=3.5, label=sensor_name(name), **look)
        panel.plot(selected, values[selected], ls="", ms=8, mfc="none", **look)
    panel.plot([], [], "o", ms=8, mfc="none", mec=GREY, label="selected")
    panel.set_xlabel("Reprojection threshold (px)")
    panel.set_ylabel(label)
    panel.set_ylim(bottom=0)
    panel.legend(loc=legend)
    return finished(figure, provenance)


def _mark_thresholds(panel: Axes, name: str, table: pd.DataFrame) -> None:
    """The selected threshold and the study's."""
    panel.axvline(select_threshold(table), color=BLACK, lw=0.8, label="selected")
    if name in STUDY_PX:
        panel.axvline(STUDY_PX[name], color=GREY, lw=0.8, ls=(0, (4, 2)), label="the study's")


def _places(table: pd.DataFrame) -> NDArray:
    """Mean tip of each point, camera frame, (n, 3) [m]."""
    first = table[table["method"] == REFINED] if "method" in table else table
    rows = first if len(first) else table
    return rows[["mean_x_m", "mean_y_m", "mean_z_m"]].to_numpy(float)


def _wide(tables: Mapping) -> tuple[float, float]:
    return (max(COLUMN_IN, PAGE_IN * len(tables) / 2), 2.9)
