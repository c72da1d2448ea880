"""Figures of the probe: loading test (4.6), tracing test (4.13, 4.20, 4.21)."""

from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from numpy.typing import NDArray
from palpate.capture.images import Stream
from palpate.json_fields import read_one
from palpate.report.panels import photo_panel
from palpate.report.style import BLACK, BLUE, COLUMN_IN, GREEN, GREY, ORANGE, finished
from palpate.units import CENTIMETRES, MILLIMETRES

from thesis.chapter4.workspace import by_sensor
from thesis.diagrams import DASHED, by_sensor_panels, legend_below, provenances

# Figure 4.13 shows so many frames on either side of a corner.
SHOWN_FRAMES = 9
FILTERS = {
    "raw": {"label": "as found", "color": GREY, "marker": "o", "ms": 3, "lw": 0.6},
    "study": {"label": "the study's filter", "color": ORANGE, "lw": 1.2, "ls": DASHED},
    "smooth": {"label": "smoother", "color": BLUE, "lw": 1.2},
}


def figure_4_6(inputs: Any, params: Any) -> Figure:
    """Force and displacement against time while loading and holding, per sensor (Fig. 4.6).

    The broken line marks the frame at which the tip reaches the depth that it then holds.
    """
    frames, forces = (by_sensor(params.names, paths) for paths in (inputs.frames, inputs.forces))
    figure, axes, items = by_sensor_panels(frames, 3.6, rows=2, sharex=True, sharey="row")
    for (top, bottom), (name, table) in zip(axes.T, items, strict=True):
        record, time = forces[name], table["time_s"]
        top.plot(record["time_s"], record["force_n"], color=GREY, lw=0.5, label="force, recorded")
        top.plot(time, table["force_n"], "o", ms=3.2, color=ORANGE, label="force at the frames")
        displacement = table["displacement_m"] * MILLIMETRES
        bottom.plot(time, displacement, "s-", ms=2.6, lw=0.8, color=BLUE)
        for panel in (top, bottom):
            panel.axvline(time[_arrival(table)], color=BLACK, lw=0.8, ls=DASHED)
        bottom.set_xlabel("Time (s)")
    axes[0, 0].set_ylabel("Force (N)")
    axes[1, 0].set_ylabel("Displacement (mm)")
    top.plot([], [], "s-", ms=2.6, lw=0.8, color=BLUE, label="tip")
    top.plot([], [], color=BLACK, lw=0.8, ls=DASHED, label="depth reached")
    figure.align_ylabels(axes[:, 0])
    return legend_below(figure, top, provenances(params))


def _arrival(table: pd.DataFrame) -> int:
    """First frame at the depth that is then held."""
    held = np.median(table["displacement_m"][-len(table) // 4 :])
    return int(np.argmax(table["displacement_m"] > held - 2e-4))


def figure_4_13(inputs: Any, params: Any) -> Figure:
    """The tip's path around a corner of the CD case before and after the filters (Fig. 4.13)."""
    figure, axes, items = by_sensor_panels(by_sensor(params.names, inputs.paths), 3.2)
    for panel, (_, path) in zip(axes[0], items, strict=True):
        part = _around_corner(path)
        for kind, look in FILTERS.items():
            panel.plot(*(part[f"{kind}_{axis}_m"] * MILLIMETRES for axis in "xy"), **look)
        panel.set_aspect("equal", adjustable="datalim")
        panel.set_xlabel("x, along the case (mm)")
    axes[0, 0].set_ylabel("y, across the case (mm)")
    return legend_below(figure, axes[0, 0], provenances(params))


def _around_corner(path: pd.DataFrame) -> pd.DataFrame:
    """Frames around the one that is farthest along both sides of the case."""
    middle = int((path["smooth_x_m"] + path["smooth_y_m"]).argmax())
    first = max(0, middle - SHOWN_FRAMES)
    return path.iloc[first : middle + SHOWN_FRAMES + 1]


def figure_4_20(inputs: Any, params: Any) -> Figure:
    """A colour image of the CD case being traced, by the first sensor (Fig. 4.20)."""
    frames = Stream(Path(inputs.cases[0]) / "trace", params.sensors[params.names[0]])
    image = frames[len(frames) // 3]
    height, width = image.shape[:2]
    figure, panel = plt.subplots(figsize=(COLUMN_IN + 1, (COLUMN_IN + 1) * height / width + 0.2))
    photo_panel(panel, image)
    return finished(figure, provenances(params))


def figure_4_21(inputs: Any, params: Any) -> Figure:
    """The tip's path around the case against the case's cloud, from above (Fig. 4.21)."""
    paths = by_sensor(params.names, inputs.paths)
    clouds = by_sensor(params.names, inputs.clouds, _cloud_points)
    places = by_sensor(params.names, inputs.places, read_one)
    figure, axes, items = by_sensor_panels(paths, 3.7, sharey=True)
    for panel, (name, path) in zip(axes[0], items, strict=True):
        cloud, place = clouds[name] * CENTIMETRES, places[name]
        panel.plot(*cloud[:, :2].T, ".", ms=0.8, mew=0, color=GREEN, alpha=0.6, rasterized=True)
        panel.plot([], [], "o", ms=3, color=GREEN, label="cloud")
        half = np.array(place["size_m"][:2]) / 2 * CENTIMETRES
        corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1], [-1, -1]]) * half
        panel.plot(*corners.T, color=BLACK, lw=0.8, label="case, registered")
        tip = path[["smooth_x_m", "smooth_y_m"]].to_numpy(float) * CENTIMETRES
        label = f"tip's centre, radius {place['tip_radius_m'] * MILLIMETRES:.2f} mm"
        panel.plot(*tip.T, ".-", ms=2.5, lw=0.8, color=BLUE, label=label)
        offset, spread = (path["smooth_offset_m"].agg(how) * MILLIMETRES for how in ("mean", "std"))
        title = f"offset {offset:.2f} ± {spread:.2f} mm"
        panel.set_title(title, fontsize=7.5, weight="normal", loc="right")
        panel.set_aspect("equal")
        panel.set_xlabel("x, along the case (cm)")
    axes[0, 0].set_ylabel("y, across the case (cm)")
    return legend_below(figure, axes[0, 0], provenances(params))


def _cloud_points(path: str) -> NDArray:
    with np.load(path, allow_pickle=False) as data:
        return data["points_m"].astype(float)
