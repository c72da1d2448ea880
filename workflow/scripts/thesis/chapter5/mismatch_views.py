"""Mismatch of tracked and computed deformation: Figures 5.10, 5.15 and 5.18."""

from collections.abc import Mapping, Sequence
from typing import Any

import meshio
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patheffects import Normal, Stroke
from numpy.typing import NDArray
from palpate.report.panels import (
    coloured,
    displacement_bar,
    named,
    panels,
    scale_bar,
    surface_panel,
)
from palpate.report.style import BLACK, PAGE_IN, SMALL, label_provenance, sensor_name
from palpate.report.surface_figures import Mismatch, figure_5_10
from palpate.report.views import MILLIMETRES, View, view_from
from palpate.solid.mesh import read_solid
from palpate.surface.tracked import load_tracked

HALF_TURN_DEG = 180.0
RIGHT, ROOM_IN = 0.87, 0.62
HALO = [Stroke(linewidth=2.2, foreground="white"), Normal()]


def make_figure_5_10(inputs: Any, params: Any) -> Figure:
    """Mismatch on the block, from above."""
    return figure_5_10(params.captures, _read_mismatches(inputs))


def make_mismatch_views(inputs: Any, params: Any) -> Figure:
    """Mismatch from the side of the camera and from behind."""
    poses = [load_tracked(path).camera_from_object for path in inputs.tracked]
    views = [view_from(pose, elevation_deg=params.elevation_deg) for pose in poses]
    return mismatch_views(params.captures, _read_mismatches(inputs), views)


def mismatch_views(
    captures: Sequence[Mapping], shown: Sequence[Mismatch], views: Sequence[View]
) -> Figure:
    """Mismatch of tracked and computed deformation from two sides, a row per sensor.

    Parameters
    ----------
    captures : sequence of mapping
    shown : sequence of Mismatch
        Of each capture, in its object frame.
    views : sequence of View
        From where each capture's camera stood; the second column shows the far side.

    Returns
    -------
    Figure
        Figures 5.15 and 5.18.
    """
    turned = [(view, _behind(view)) for view in views]
    frames = [_frames(one, sides) for one, sides in zip(shown, turned, strict=True)]
    figure, axes = panels(len(captures), 2, _height_in(frames), right=RIGHT)
    top = max(float(one.mismatch_m.max()) for one in shown) * MILLIMETRES
    letters = iter("abcdefghijkl")
    parts = zip(axes, captures, shown, turned, frames, strict=True)
    for row, capture, one, sides, framed in parts:
        name = sensor_name(capture["sensor"])
        titles = (f"{name}: from the camera", "from behind")
        for panel, view, frame, title in zip(row, sides, framed, titles, strict=True):
            _panel(panel, one, view, frame, top)
            named(panel, next(letters), title)
        _cross(row[0], sides[0].project(one.contact_m[None])[0])
        _numbers(row[1], one.mismatch_m[np.unique(one.triangles)] * MILLIMETRES)
    displacement_bar(figure, axes, top, label="Mismatch (mm)")
    figure.text(0.02, 0.012, "cross: contact", fontsize=SMALL)
    label_provenance(figure, {capture["provenance"] for capture in captures})
    return figure


def _read_mismatches(inputs: Any) -> list[Mismatch]:
    """Mismatch of each capture."""
    return [_read_mismatch(*pair) for pair in zip(inputs.mismatches, inputs.tracked, strict=True)]


def _read_mismatch(mismatch: str, tracked: str) -> Mismatch:
    solid = read_solid(mismatch)
    values = meshio.read(mismatch).point_data["mismatch_m"]
    contact = load_tracked(tracked).contact_point_m
    return Mismatch(solid.nodes_m, solid.surface_triangles(), values, contact)


def _behind(view: View) -> View:
    return View(view.azimuth_deg + HALF_TURN_DEG, view.elevation_deg)


def _frames(one: Mismatch, sides: Sequence[View]) -> list[NDArray]:
    """Frames of one size about the object in each view, (4,) arrays [mm]."""
    tight = np.array([view.frame(one.nodes_m) for view in sides])
    centre = (tight[:, ::2] + tight[:, 1::2]) / 2
    half = np.max(tight[:, 1::2] - tight[:, ::2], axis=0) / 2
    return list(np.stack([centre - half, centre + half], axis=2).reshape(-1, 4))


def _height_in(frames: Sequence[Sequence[NDArray]]) -> float:
    """Height of the figure whose panels fit the objects' proportions."""
    shapes = [(frame[3] - frame[2]) / (frame[1] - frame[0]) for frame, _ in frames]
    return PAGE_IN * RIGHT / 2 * max(shapes) * 1.1 * len(frames) + ROOM_IN


def _panel(axes: Axes, one: Mismatch, view: View, frame: NDArray, top_mm: float) -> None:
    colours = coloured(one.mismatch_m * MILLIMETRES, top_mm)
    surface_panel(axes, one.nodes_m, one.triangles, view, frame, colours=colours, edges=True)
    scale_bar(axes, 20, frame)


def _cross(axes: Axes, place: NDArray) -> None:
    axes.plot(*place[:2], "+", color=BLACK, ms=9, mew=1.3, zorder=6, path_effects=HALO)


def _numbers(axes: Axes, mismatch_mm: NDArray) -> None:
    text = f"median {np.median(mismatch_mm):.2f} mm, largest {mismatch_mm.max():.1f} mm"
    axes.annotate(text, (1, 0), xycoords="axes fraction", ha="right", va="top", fontsize=SMALL)
