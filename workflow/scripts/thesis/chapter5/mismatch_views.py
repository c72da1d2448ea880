"""Mismatch of tracked and computed deformation: Figures 5.10, 5.15 and 5.18."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import matplotlib.pyplot as plt
import meshio
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.tri import Triangulation
from numpy.typing import NDArray
from palpate.report.panels import named
from palpate.report.style import BLACK, ORANGE, PAGE_IN, SMALL, sensor_name
from palpate.solid.mesh import read_solid
from palpate.surface.tracked import load_tracked
from palpate.units import MILLIMETRES

from thesis.diagrams import HALO, labelled
from thesis.panels import coloured, displacement_bar, panels, scale_bar, surface_panel
from thesis.views import View, upward, view_from

HALF_TURN_DEG = 180.0
RIGHT, ROOM_IN = 0.87, 0.62
MAP = "cividis"
# Of the detail about the contact [m].
ZOOM_M = 0.040


@dataclass(frozen=True)
class Mismatch:
    """Mismatch on the surface of one solid: nodes (n, 3) [m], outward triangles, (n,) [m]."""

    nodes_m: NDArray
    triangles: NDArray
    mismatch_m: NDArray
    contact_m: NDArray


def figure_5_10(inputs: Any, params: Any) -> Figure:
    """Mismatch of tracked and computed deformation from above, a row per sensor (Fig. 5.10)."""
    captures, views = params.captures, _read_mismatches(inputs)
    count = len(views)
    figure, axes = plt.subplots(
        count,
        2,
        figsize=(PAGE_IN, 2.5 * count + 0.2),
        width_ratios=(2.1, 1),
        squeeze=False,
        layout="constrained",
    )
    limit = max(float(view.mismatch_m.max()) for view in views) * MILLIMETRES
    for row, capture, view in zip(axes, captures, views, strict=True):
        _plan_panel(row[0], view, limit, None)
        image = _plan_panel(row[1], view, limit, ZOOM_M)
        row[0].set_title(f"{sensor_name(capture['sensor'])}, point {capture['point']}")
        row[1].set_title("at the contact")
        figure.colorbar(image, ax=row[1], label="Mismatch (mm)", shrink=0.85)
    figure.get_layout_engine().set(rect=(0, 0.03, 1, 0.97))
    return labelled(figure, params)


def mismatch_views(inputs: Any, params: Any) -> Figure:
    """Mismatch from the camera's side and from behind, a row per sensor (Fig. 5.15 and 5.18)."""
    captures, shown = params.captures, _read_mismatches(inputs)
    poses = [load_tracked(path).camera_from_object for path in inputs.tracked]
    views = [view_from(pose, elevation_deg=params.elevation_deg) for pose in poses]
    turned = [(one, View(one.azimuth_deg + HALF_TURN_DEG, one.elevation_deg)) for one in views]
    frames = [_frames(one, sides) for one, sides in zip(shown, turned, strict=True)]
    figure, axes = panels(len(captures), 2, _height_in(frames), right=RIGHT)
    top = max(float(one.mismatch_m.max()) for one in shown) * MILLIMETRES
    letters = iter("abcdefghijkl")
    parts = zip(axes, captures, shown, turned, frames, strict=True)
    for row, capture, one, sides, framed in parts:
        name = sensor_name(capture["sensor"])
        titles = (f"{name}: from the camera", "from behind")
        for panel, view, frame, title in zip(row, sides, framed, titles, strict=True):
            look = {"colours": coloured(one.mismatch_m * MILLIMETRES, top), "edges": True}
            surface_panel(panel, one.nodes_m, one.triangles, view, frame, **look)
            scale_bar(panel, 20)
            named(panel, next(letters), title)
        cross = sides[0].project(one.contact_m[None])[0, :2]
        row[0].plot(*cross, "+", color=BLACK, ms=9, mew=1.3, zorder=6, path_effects=HALO)
        gaps = one.mismatch_m[np.unique(one.triangles)] * MILLIMETRES
        text = f"median {np.median(gaps):.2f} mm, largest {gaps.max():.1f} mm"
        look = {"xycoords": "axes fraction", "ha": "right", "va": "top", "fontsize": SMALL}
        row[1].annotate(text, (1, 0), **look)
    displacement_bar(figure, axes, top, label="Mismatch (mm)")
    figure.text(0.02, 0.012, "cross: contact", fontsize=SMALL)
    return labelled(figure, params)


def _read_mismatches(inputs: Any) -> list[Mismatch]:
    """Mismatch of each capture."""
    found = []
    for path, tracked in zip(inputs.mismatches, inputs.tracked, strict=True):
        solid, values = read_solid(path), meshio.read(path).point_data["mismatch_m"]
        contact = load_tracked(tracked).contact_point_m
        found.append(Mismatch(solid.nodes_m, solid.surface_triangles(), values, contact))
    return found


def _plan_panel(axes: Axes, view: Mismatch, limit: float, zoom_m: float | None):
    x, y = view.nodes_m[:, 0] * MILLIMETRES, view.nodes_m[:, 1] * MILLIMETRES
    top = Triangulation(x, y, view.triangles[upward(view.nodes_m, view.triangles)])
    values = view.mismatch_m * MILLIMETRES
    image = axes.tripcolor(
        top, values, shading="gouraud", cmap=MAP, vmin=0, vmax=limit, rasterized=True
    )
    axes.triplot(top, color="white", lw=0.15, alpha=0.6)
    place = view.contact_m[:2] * MILLIMETRES
    axes.plot(*place, "+", color=ORANGE, ms=6, mew=1.1)
    axes.set_aspect("equal")
    if zoom_m is not None:
        reach = zoom_m * MILLIMETRES
        axes.set_xlim(place[0] - reach, place[0] + reach)
        axes.set_ylim(place[1] - reach, place[1] + reach)
    if axes.get_subplotspec().is_last_row():
        axes.set_xlabel("Length (mm)")
    axes.set_ylabel("Width (mm)")
    return image


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
