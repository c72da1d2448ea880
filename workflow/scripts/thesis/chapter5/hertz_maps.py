"""Where the block was pressed, and its modulus over the block: Figures 5.1 and 5.4."""

from collections.abc import Mapping
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from numpy.typing import NDArray
from palpate.capture.images import Stream
from palpate.json_fields import read_all
from palpate.report import style
from palpate.surface.alignment import load_alignment
from palpate.surface.pose import to_camera
from palpate.surface.template import read_template
from palpate.units import KILOPASCALS, MILLIMETRES
from palpate.vision.camera import camera_from_spec, sensor_with_optics
from palpate.yaml_files import load_yaml

from thesis.chapter5.hertz_points import ROWS_OF_BLOCK, correlation, hertz_table, table_5_2
from thesis.diagrams import HALO, entitle, labelled, provenances

MAP = "cividis"
MARGIN = 0.12


def figure_5_1(inputs: Any, params: Any) -> Figure:
    """Declared points in a capture's first frame and in the block's plan to scale (Fig. 5.1)."""
    (capture,), declared = params.captures, load_yaml(inputs.object)
    points = {name: np.array(p["position_m"], float) for name, p in declared["points"].items()}
    points = dict(sorted(points.items()))
    pose = load_alignment(inputs.alignment).camera_from_object
    camera = camera_from_spec(sensor_with_optics(params.sensor, inputs.optics)["color"])
    pixels = camera.project(to_camera(pose, np.array(list(points.values()))))
    vertices = read_template(inputs.template, unit=declared["template"]["unit"]).vertices_m[:, :2]
    outline = np.array([vertices.min(axis=0), vertices.max(axis=0)])
    photo = Stream(inputs.recorded, params.sensor)[0]
    figure, (above, below) = plt.subplots(
        2, 1, figsize=(style.PAGE_IN, 5.0), height_ratios=(1.25, 1)
    )
    _photo_panel(above, photo, pixels, list(points))
    _plan_panel(below, points, outline)
    for panel in (above, below):
        panel.set_title("room for the title")
    figure = style.finished(figure, provenances(params))
    entitle(above, f"{style.sensor_name(capture['sensor'])}, recording {capture['capture']}", "a")
    entitle(below, "Plan, to scale", "b")
    return figure


def figure_5_4(inputs: Any, params: Any) -> Figure:
    """E* over the block per sensor, beside the published values in one scale (Fig. 5.4)."""
    hertz = hertz_table(params.captures, read_all(inputs.fits))
    table = table_5_2(hertz, pd.read_csv(inputs.published), block=params.block)
    sensors = sorted(set(table["sensor"]))
    size = (style.PAGE_IN, 1.1 * len(sensors) + 0.5)
    figure, axes = plt.subplots(len(sensors), 2, figsize=size, squeeze=False, layout="constrained")
    values = table[["reduced_modulus_pa", "published_reduced_modulus_pa"]] * KILOPASCALS
    limits = float(np.nanmin(values)), float(np.nanmax(values))
    for row, sensor in zip(axes, sensors, strict=True):
        mine, name = table[table["sensor"] == sensor], style.sensor_name(sensor)
        _map_panel(row[0], modulus_map(mine, "reduced_modulus_pa"), limits)
        image = _map_panel(row[1], modulus_map(mine, "published_reduced_modulus_pa"), limits)
        row[0].set_title(name)
        row[1].set_title(f"{name}, published; {_agreement(mine)}")
        row[0].set_ylabel("Row")
    for panel in axes[-1]:
        panel.set_xlabel("Column")
    figure.colorbar(image, ax=axes, label="E* (kPa)", shrink=0.8, aspect=30)
    figure.get_layout_engine().set(rect=(0, 0.03, 1, 0.97))
    return labelled(figure, params)


def modulus_map(table: pd.DataFrame, column: str) -> NDArray:
    """Values by row and column of the block, shape (3, columns) [Pa]; NaN where there is none."""
    found = np.full((ROWS_OF_BLOCK, int(table["column"].max())), np.nan)
    found[table["row"].to_numpy() - 1, table["column"].to_numpy() - 1] = table[column]
    return found


def _agreement(table: pd.DataFrame) -> str:
    found = correlation(table, "reduced_modulus_pa")
    if found is None:
        return "too few points to correlate"
    return f"correlation {found:.2f}".replace("-", "\N{MINUS SIGN}")


def _map_panel(axes: Axes, values_pa: NDArray, limits: tuple[float, float]):
    values = values_pa * KILOPASCALS
    rows, columns = values.shape
    axes.set_facecolor("0.92")
    extent = (0.5, columns + 0.5, rows + 0.5, 0.5)
    image = axes.imshow(values, cmap=MAP, vmin=limits[0], vmax=limits[1], extent=extent, aspect=0.5)
    for (row, column), value in np.ndenumerate(values):
        bright = value > sum(limits) / 2
        colour = style.BLACK if bright or np.isnan(value) else "white"
        place = column + 1, row + 1
        text = "–" if np.isnan(value) else f"{value:.1f}"
        axes.text(*place, text, ha="center", va="center", color=colour, fontsize=7.5)
        number = f"{ROWS_OF_BLOCK * column + row + 1}"
        axes.text(column + 0.56, row + 0.56, number, va="top", color=colour, fontsize=5)
    axes.set(xticks=range(1, columns + 1), yticks=range(1, rows + 1))
    axes.tick_params(length=0)
    return image


def _photo_panel(axes: Axes, photo: NDArray, pixels: NDArray, names: list[str]) -> None:
    grey = "gray" if photo.ndim == 2 else None
    axes.imshow(photo, cmap=grey, interpolation="antialiased")
    axes.plot(*pixels.T, "o", ms=5, mfc="none", mec=style.ORANGE, mew=1.1)
    for name, place in zip(names, pixels, strict=True):
        look = {"weight": "bold", "fontsize": style.SMALL, "path_effects": HALO, "va": "center"}
        axes.annotate(name, place, (4.5, 0), textcoords="offset points", **look)
    low, high = pixels.min(axis=0), pixels.max(axis=0)
    width = MARGIN * (high[0] - low[0])
    axes.set_xlim(max(low[0] - width, 0), min(high[0] + width, photo.shape[1]))
    height = (high[0] - low[0] + 2 * width) * 0.42
    middle = (low[1] + high[1]) / 2 - 0.1 * height
    axes.set_ylim(min(middle + height / 2, photo.shape[0]), max(middle - height / 2, 0))
    axes.set_axis_off()


def _plan_panel(axes: Axes, points: Mapping[str, NDArray], outline_m: NDArray) -> None:
    low, high = outline_m * MILLIMETRES
    axes.add_patch(Rectangle(low, *(high - low), fc="0.95", ec=style.BLACK, lw=1.0))
    places = np.array(list(points.values()))[:, :2] * MILLIMETRES
    for values, line in ((places[:, 0], axes.axvline), (places[:, 1], axes.axhline)):
        for value in np.unique(values.round(3)):
            line(value, color=style.GREY, lw=0.5, ls=(0, (3, 2)), zorder=1.5)
    axes.plot(*places.T, "o", ms=5, mfc="white", mec=style.ORANGE, mew=1.2)
    for name, place in zip(points, places, strict=True):
        look = {"weight": "bold", "fontsize": style.SMALL, "path_effects": HALO}
        axes.annotate(name, place, (4, 3), textcoords="offset points", **look)
    axes.set_aspect("equal")
    axes.set(xlim=(low[0] - 12, high[0] + 12), ylim=(low[1] - 10, high[1] + 10))
    axes.set(xlabel="x (mm)", ylabel="y (mm)")
