"""Panels of surfaces and clouds, in millimetres of the picture, and what stands about them."""

from collections.abc import Sequence

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LinearSegmentedColormap, Normalize, to_rgb
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties
from matplotlib.lines import Line2D
from mpl_toolkits.axes_grid1.anchored_artists import AnchoredSizeBar
from numpy.typing import NDArray
from palpate.report.style import BLACK, PAGE_IN

from thesis.views import View, render_surface

# Light where nothing moves, so that shading shows; darker with every step for all readers.
MAP = LinearSegmentedColormap.from_list("moved", ["#D3DEE8", "#F2C48D", "#D55E00", "#7A1F0A"])
OUTLINE_PX, BAR_PT = 500, 7.5


def surface_panel(
    axes: Axes, vertices_m: NDArray, faces: NDArray, view: View, frame_mm: NDArray, **look
) -> None:
    """Put `render_surface`'s picture into a panel whose units are millimetres of the view."""
    picture = render_surface(vertices_m, faces, view, frame_mm, **{"width_px": 900} | look)
    axes.imshow(picture, extent=frame_mm, interpolation="antialiased", zorder=1)
    space(axes, frame_mm)


def cloud_panel(
    axes: Axes, groups: Sequence[tuple[NDArray, str, float]], view: View, frame_mm: NDArray
) -> None:
    """Draw groups of points, each with its colour and size; nearer points over farther ones."""
    flat = np.concatenate([view.project(points) for points, _, _ in groups])
    colour = np.concatenate([np.tile(to_rgb(name), (len(points), 1)) for points, name, _ in groups])
    size = np.concatenate([np.full(len(points), size) for points, _, size in groups])
    order = np.argsort(flat[:, 2], kind="stable")
    look = {"s": size[order], "c": colour[order], "linewidths": 0, "rasterized": True, "zorder": 2}
    axes.scatter(*flat[order, :2].T, **look)
    space(axes, frame_mm)


def wire(axes: Axes, vertices_m: NDArray, faces: NDArray, view: View, *, colour=BLACK) -> None:
    """Draw the edges of the triangles that face the viewer."""
    flat = view.project(vertices_m)
    a, b, c = (flat[faces[:, k], :2] for k in range(3))
    facing = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0] > 0
    axes.triplot(*flat[:, :2].T, faces[facing], color=colour, lw=0.35, alpha=0.8, zorder=3)


def space(axes: Axes, frame_mm: NDArray) -> None:
    """Leave a panel without axes, in true proportions."""
    axes.set(xlim=frame_mm[:2], ylim=frame_mm[2:], aspect="equal")
    axes.set_axis_off()


def scale_bar(
    axes: Axes, length: float, text: str = "", *, loc: str = "lower left", **where
) -> None:
    """Bar of a length of the panel's unit with its text below, by default as millimetres."""
    look = {"frameon": False, "pad": 0.1, "sep": 2, "color": BLACK}
    look |= {"size_vertical": 0.005 * np.ptp(axes.get_xlim())}
    look |= {"fontproperties": FontProperties(size=BAR_PT)}
    text = text or f"{length:g} mm"
    axes.add_artist(AnchoredSizeBar(axes.transData, length, text, loc, **look | where))


def coloured(values: NDArray, top: float) -> NDArray:
    """Colours of values between 0 and the top, shape (n, 3)."""
    return MAP(Normalize(0, top)(values))[:, :3]


def outline(axes: Axes, vertices_m: NDArray, faces: NDArray, view: View, frame_mm: NDArray) -> None:
    """Dash the outline of a surface."""
    picture = render_surface(vertices_m, faces, view, frame_mm, width_px=OUTLINE_PX)
    rows, columns = picture.shape[:2]
    left, right, bottom, top = frame_mm
    x = left + (right - left) * (np.arange(columns) + 0.5) / columns
    y = top - (top - bottom) * (np.arange(rows) + 0.5) / rows
    look = {"colors": BLACK, "linewidths": 0.9, "linestyles": [(0, (4, 2.5))], "zorder": 4}
    axes.contour(x, y, picture[..., 3], [0.5], **look)


def panels(
    rows: int,
    columns: int,
    height_in: float,
    *,
    heights: Sequence[float] | None = None,
    widths: Sequence[float] | None = None,
    right: float = 0.98,
    bottom_in: float = 0.42,
    wspace: float = 0.06,
    hspace: float = 0.2,
) -> tuple[Figure, NDArray]:
    """Figure over the page's width with panels, (rows, columns), and room for words about them."""
    ratios = {"height_ratios": heights, "width_ratios": widths, "figsize": (PAGE_IN, height_in)}
    figure, axes = plt.subplots(rows, columns, squeeze=False, **ratios)
    place = {"left": 0.02, "right": right, "wspace": wspace, "hspace": hspace}
    figure.subplots_adjust(bottom=bottom_in / height_in, top=1 - 0.26 / height_in, **place)
    return figure, axes


def legend(figure: Figure, entries: Sequence[tuple[str, str]], height: float) -> None:
    """Dots of named colours in one line across the figure."""
    marks = [Line2D([], [], marker="o", ls="", ms=3.5, color=colour) for _, colour in entries]
    place = {"loc": "center", "bbox_to_anchor": (0.5, height), "ncols": len(entries)}
    figure.legend(
        marks, [name for name, _ in entries], handletextpad=0.1, columnspacing=1.4, **place
    )


def displacement_bar(
    figure: Figure,
    beside: NDArray,
    top_mm: float,
    *,
    place: tuple | None = None,
    label: str = "Displacement (mm)",
) -> None:
    """Bar of the displacement's colours at the right of panels, or lying at a place."""
    boxes = [panel.get_position() for panel in np.ravel(beside)]
    low, high = min(box.y0 for box in boxes), max(box.y1 for box in boxes)
    upright = (max(box.x1 for box in boxes) + 0.015, low + 0.15 * (high - low), 0.014)
    axes = figure.add_axes(place or (*upright, 0.7 * (high - low)))
    orientation = "horizontal" if place else "vertical"
    scale = ScalarMappable(Normalize(0, top_mm), MAP)
    figure.colorbar(scale, cax=axes, label=label, orientation=orientation)
