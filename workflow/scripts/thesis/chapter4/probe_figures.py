"""Figures of the probe: loading test (4.6), tracing test (4.13, 4.20, 4.21)."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from numpy.typing import NDArray
from palpate.capture.images import Stream
from palpate.json_fields import read_one
from palpate.report.style import (
    BLACK,
    BLUE,
    COLUMN_IN,
    GREEN,
    GREY,
    ORANGE,
    PAGE_IN,
    finished,
    label_provenance,
    panel_letter,
    sensor_name,
)
from palpate.units import CENTIMETRES, MILLIMETRES

from thesis.chapter4.sensor_files import by_sensor, provenances

# Figure 4.13 shows so many frames on either side of a corner.
SHOWN_FRAMES = 9
TEXT_BOX = {"boxstyle": "square,pad=0.3", "fc": "white", "ec": "none", "alpha": 0.85}
FILTERS = {
    "raw": {"label": "as found", "color": GREY, "marker": "o", "ms": 2.5, "lw": 0.6},
    "study": {"label": "the study's filter", "color": ORANGE, "lw": 1.2},
    "smooth": {"label": "smoother", "color": BLUE, "lw": 1.2},
}


def make_figure_4_6(inputs: Any, params: Any) -> Figure:
    """Figure 4.6, of each sensor's loading test."""
    frames, forces = (by_sensor(params.names, paths) for paths in (inputs.frames, inputs.forces))
    return figure_4_6(frames, forces, provenances(params))


def figure_4_6(
    frames: Mapping[str, pd.DataFrame], forces: Mapping[str, pd.DataFrame], provenance: set[str]
) -> Figure:
    """Force and displacement against time while loading and holding, per sensor (Fig. 4.6).

    The broken line marks the frame at which the tip reaches the depth that it then holds.

    Parameters
    ----------
    frames : mapping
        Sensor to ``time_s, force_n, displacement_m`` at each frame.
    forces : mapping
        Sensor to ``time_s, force_n`` of the averaged record.
    provenance : set of str
    """
    size = (max(COLUMN_IN, PAGE_IN * len(frames) / 2), 3.6)
    figure, axes = plt.subplots(
        2, len(frames), figsize=size, sharex=True, sharey="row", squeeze=False
    )
    for (top, bottom), (name, table), letter in zip(
        axes.T, sorted(frames.items()), "abcdef", strict=False
    ):
        record = forces[name]
        top.plot(record["time_s"], record["force_n"], color=GREY, lw=0.5, label="force's record")
        top.plot(
            table["time_s"], table["force_n"], "o", ms=2.6, color=ORANGE, label="at the frames"
        )
        bottom.plot(
            table["time_s"], table["displacement_m"] * MILLIMETRES, "o-", ms=2.6, lw=0.8, color=BLUE
        )
        for panel in (top, bottom):
            panel.axvline(table["time_s"][_arrival(table)], color=BLACK, lw=0.8, ls=(0, (4, 2)))
        top.set_title(sensor_name(name))
        bottom.set_xlabel("Time (s)")
        panel_letter(top, letter)
    axes[0, 0].set_ylabel("Force (N)")
    axes[1, 0].set_ylabel("Displacement of the tip (mm)")
    axes[0, 0].legend(loc="lower right")
    figure.align_ylabels(axes[:, 0])
    return finished(figure, provenance)


def _arrival(table: pd.DataFrame) -> int:
    """First frame at the depth that is then held."""
    held = np.median(table["displacement_m"][-len(table) // 4 :])
    return int(np.argmax(table["displacement_m"] > held - 2e-4))


def make_figure_4_13(inputs: Any, params: Any) -> Figure:
    """Figure 4.13, of each sensor's path."""
    return figure_4_13(by_sensor(params.names, inputs.paths), provenances(params))


def figure_4_13(paths: Mapping[str, pd.DataFrame], provenance: set[str]) -> Figure:
    """The tip's way around a corner of the CD case before and after the filters (Fig. 4.13).

    Parameters
    ----------
    paths : mapping
        Sensor to the path in the case's frame (cd_case_path.csv).
    provenance : set of str
    """
    size = (max(COLUMN_IN, PAGE_IN * len(paths) / 2), 3.0)
    figure, axes = plt.subplots(1, len(paths), figsize=size, squeeze=False)
    for panel, (name, path), letter in zip(axes[0], sorted(paths.items()), "abcdef", strict=False):
        part = _around_corner(path)
        for kind, style in FILTERS.items():
            x, y = (part[f"{kind}_{axis}_m"] * MILLIMETRES for axis in "xy")
            panel.plot(x, y, **style)
        panel.set_aspect("equal", adjustable="datalim")
        panel.set_xlabel("x, along the case (mm)")
        panel.set_title(sensor_name(name))
        panel_letter(panel, letter)
    axes[0, 0].set_ylabel("y, across the case (mm)")
    axes[0, 0].legend(loc="lower left")
    return finished(figure, provenance)


def make_figure_4_20(inputs: Any, params: Any) -> Figure:
    """Figure 4.20, of the first sensor's film."""
    frames = Stream(Path(inputs.cases[0]) / "trace", params.sensors[params.names[0]])
    return figure_4_20(frames[len(frames) // 3], provenances(params))


def figure_4_20(image: NDArray, provenance: set[str]) -> Figure:
    """A colour image of the CD case being traced (Fig. 4.20)."""
    height, width = image.shape[:2]
    figure, panel = plt.subplots(figsize=(COLUMN_IN + 1, (COLUMN_IN + 1) * height / width + 0.2))
    panel.imshow(image, interpolation="none")
    panel.set_axis_off()
    return finished(figure, provenance)


def make_figure_4_21(inputs: Any, params: Any) -> Figure:
    """Figure 4.21, of each sensor's path, cloud and place of the case."""
    paths = by_sensor(params.names, inputs.paths)
    clouds = by_sensor(params.names, inputs.clouds, _cloud_points)
    places = by_sensor(params.names, inputs.places, read_one)
    return figure_4_21(paths, clouds, places, provenances(params))


def figure_4_21(
    paths: Mapping[str, pd.DataFrame],
    clouds: Mapping[str, NDArray],
    places: Mapping[str, Mapping],
    provenance: set[str],
) -> Figure:
    """The tip's way around the case against the case's cloud, from above (Fig. 4.21).

    Parameters
    ----------
    paths, clouds, places : mapping
        Of each sensor cd_case_path.csv, points (n, 3) in the case's frame [m], and cd_case.json.
    provenance : set of str
    """
    size = (max(COLUMN_IN, PAGE_IN * len(paths) / 2), 3.5)
    figure, axes = plt.subplots(1, len(paths), figsize=size, squeeze=False, sharey=True)
    for panel, (name, path), letter in zip(axes[0], sorted(paths.items()), "abcdef", strict=False):
        cloud, place = clouds[name] * CENTIMETRES, places[name]
        panel.plot(
            cloud[:, 0], cloud[:, 1], ".", ms=0.8, mew=0, color=GREEN, alpha=0.6, rasterized=True
        )
        half = np.array(place["size_m"][:2]) / 2 * CENTIMETRES
        corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1], [-1, -1]]) * half
        panel.plot(*corners.T, color=BLACK, lw=0.8, label="case, registered")
        way = path[["smooth_x_m", "smooth_y_m"]].to_numpy(float) * CENTIMETRES
        panel.plot(*way.T, ".-", ms=2.5, lw=0.8, color=BLUE, label="tip's centre")
        offset, spread = path["smooth_offset_m"].mean(), path["smooth_offset_m"].std()
        text = f"offset {offset * MILLIMETRES:.2f} ± {spread * MILLIMETRES:.2f} mm"
        text += f"\ntip's radius {place['tip_radius_m'] * MILLIMETRES:.2f} mm"
        panel.text(0, 0, text, ha="center", va="center", fontsize=7.5, bbox=TEXT_BOX)
        panel.set_aspect("equal")
        panel.set_title(sensor_name(name))
        panel.set_xlabel("x, along the case (cm)")
        panel_letter(panel, letter)
    axes[0, 0].plot([], [], "o", ms=3, color=GREEN, label="cloud")
    axes[0, 0].set_ylabel("y, across the case (cm)")
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="upper center", ncols=3)
    figure.tight_layout(rect=(0, 0.03, 1, 0.94))
    label_provenance(figure, provenance)
    return figure


def _cloud_points(path: str) -> NDArray:
    with np.load(path, allow_pickle=False) as data:
        return data["points_m"].astype(float)


def _around_corner(path: pd.DataFrame) -> pd.DataFrame:
    """Frames around the one that is farthest along both sides of the case."""
    middle = int((path["smooth_x_m"] + path["smooth_y_m"]).argmax())
    first = max(0, middle - SHOWN_FRAMES)
    return path.iloc[first : middle + SHOWN_FRAMES + 1]
