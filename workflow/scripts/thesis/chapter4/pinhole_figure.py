"""Figure 4.8: the pinhole camera model, with a sensor's own optics."""

from collections.abc import Mapping
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Polygon
from numpy.typing import NDArray
from palpate.report.style import (
    ARROW,
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    PAGE_IN,
    SMALL,
    beside,
    sensor_name,
)
from palpate.units import MILLIMETRES
from palpate.vision.camera import PinholeCamera, camera_from_spec

# Where the reader stands. Lengths of the drawing are in pixels: the image plane lies at its focal
# length, so the field of view is true; the object's point lies so many focal lengths away.
SIDE_DEG, ABOVE_DEG = 47.0, 20.0
AWAY = 2.1
# The drawn point on the image, from the principal point in parts of the half image.
SHOWN = np.array([0.6, -0.78])


def make_figure_4_8(inputs: Any, params: Any) -> Figure:
    """The figure, of a sensor's file."""
    sensor = params.sensor
    return figure_4_8(sensor["color"], depth_m=params.depth_m, name=sensor["sensor"])


def figure_4_8(camera: Mapping, *, depth_m: float, name: str) -> Figure:
    """Pinhole camera model and the camera matrix (Fig. 4.8, Eq. 4.7-4.8).

    Parameters
    ----------
    camera : mapping
        ``color`` block of a sensor's file.
    depth_m : float
        Depth of the drawn point [m].
    name : str
        Sensor whose colour camera is drawn.

    Raises
    ------
    ValueError
        If the depth is not positive.
    """
    if not depth_m > 0:
        raise ValueError(f"depth_m: expected a positive length, found {depth_m} m")
    optics = camera_from_spec(camera)
    pixel, point = shown_point(optics, depth_m)
    figure = plt.figure(figsize=(PAGE_IN, 3.3))
    axes = figure.add_axes((0.01, 0.02, 0.62, 0.96))
    _draw_model(axes, optics, pixel)
    _write_model(figure.add_axes((0.65, 0.02, 0.34, 0.96)), optics, pixel, point, name)
    return figure


def shown_point(optics: PinholeCamera, depth_m: float) -> tuple[NDArray, NDArray]:
    """Drawn image point p_i (2,) [px] and the point P_c (3,) [m] that it shows, without lens."""
    half = np.array([optics.width_px, optics.height_px]) / 2
    pixel = np.round(np.array([optics.cx_px, optics.cy_px]) + SHOWN * half)
    ray = np.linalg.solve(optics.matrix, [*pixel, 1.0])
    return pixel, depth_m * ray


def _draw_model(axes: Axes, optics: PinholeCamera, pixel: NDArray) -> None:
    view = _view()
    focal = optics.fx_px
    size = np.array([optics.width_px, optics.height_px])
    middle = np.array([optics.cx_px, optics.cy_px])
    corners = np.array([[0, 0], [1, 0], [1, 1], [0, 1]]) * size - middle
    plane = np.column_stack([corners, np.full(4, focal)])
    image, point = np.array([*(pixel - middle), focal]), np.array([*(pixel - middle), focal]) * AWAY
    for corner in plane:
        _line(axes, view, np.zeros(3), corner, color=GREY, lw=0.5)
    axis_end = [0, 0, 1.45 * focal]
    _line(axes, view, np.zeros(3), [0, 0, focal], color=BLACK, lw=0.8, ls=(0, (6, 3, 1, 3)))
    axes.add_patch(Polygon(plane @ view, fc=BLUE, alpha=0.13, ec="none"))
    axes.add_patch(Polygon(plane @ view, fc="none", ec=BLUE, lw=1.1))
    _line(axes, view, [0, 0, focal], axis_end, color=BLACK, lw=0.8, ls=(0, (6, 3, 1, 3)))
    _line(axes, view, np.zeros(3), point, color=ORANGE, lw=1.3)
    _mark_places(axes, view, plane, image, point, focal)
    _draw_axes(axes, view, np.zeros(3), 0.25 * focal, ("$x_c$", "$y_c$", "$z_c$"))
    _draw_axes(axes, view, plane[0], 0.22 * focal, ("$x_i$", "$y_i$"))
    _draw_offsets(axes, view, plane[0], image)
    axes.set_aspect("equal")
    axes.set_axis_off()
    axes.autoscale_view()
    axes.margins(0.09)


def _mark_places(
    axes: Axes, view: NDArray, plane: NDArray, image: NDArray, point: NDArray, focal: float
) -> None:
    """Centre, principal point, image point and object point, and the focal length."""
    principal = np.array([0, 0, focal])
    places = {
        "centre of\nprojection": (np.zeros(3), (-0.05, 1), 22, BLACK),
        "principal point\n$(O_x, O_y)$": (principal, (0.25, -1), 15, BLACK),
        "$p_i$": (image, (-0.5, 1), 9, ORANGE),
        "$P_c$": (point, (1, 0.1), 8, ORANGE),
    }
    for text, (place, side, away, colour) in places.items():
        flat = place @ view
        axes.plot(*flat, "o", color=colour, ms=5, zorder=5)
        beside(axes, flat, text, side, away, color=colour)
    beside(axes, 0.7 * principal @ view, "$f$", (0.2, -1), 11)
    beside(axes, plane[2] @ view, "image plane", (1, 0.4), 7, color=BLUE)


def _draw_offsets(axes: Axes, view: NDArray, corner: NDArray, image: NDArray) -> None:
    """How far the image point lies from the image's corner."""
    for foot in ([image[0], corner[1], image[2]], [corner[0], image[1], image[2]]):
        _line(axes, view, foot, image, color=ORANGE, lw=0.7, ls=(0, (2, 2)))


def _draw_axes(
    axes: Axes, view: NDArray, origin: NDArray, length: float, names: tuple[str, ...]
) -> None:
    for k, name in enumerate(names):
        end = (origin + length * np.eye(3)[k]) @ view
        axes.annotate("", end, origin @ view, arrowprops=ARROW | {"color": GREEN, "lw": 1.3})
        beside(axes, end, name, end - origin @ view, 7, color=GREEN, fontsize=7.5)


def _write_model(
    axes: Axes, optics: PinholeCamera, pixel: NDArray, point: NDArray, name: str
) -> None:
    """Equations 4.7 and 4.8 with the camera's numbers."""
    axes.set(xlim=(0, 1), ylim=(0, 1))
    axes.set_axis_off()
    x, y, z = (f"{value * MILLIMETRES:.1f}" for value in point)
    lines = [
        (f"{sensor_name(name)}, colour camera", {"weight": "bold"}),
        (r"$\mathbf{K}$ (Eq. 4.7), px", {}),
    ]
    for k, (line, look) in enumerate(lines):
        axes.text(0, 0.93 - 0.11 * k, line, va="top", **look)
    _matrix(axes, 0.63, [["f/s_x", "0", "O_x"], ["0", "f/s_y", "O_y"], ["0", "0", "1"]], (0, 0.4))
    axes.text(0.445, 0.63, "=", ha="center", va="center")
    numbers = [
        [f"{value:.1f}" if value % 1 else f"{value:.0f}" for value in row] for row in optics.matrix
    ]
    _matrix(axes, 0.63, numbers, (0.49, 0.99))
    words = f"$P_c$ = ({x}, {y}, {z}) mm\n$p_i$ = ({pixel[0]:.0f}, {pixel[1]:.0f}) px"
    law = r"$p_i = (x_1/x_3,\; x_2/x_3)$ with $\mathbf{x} = \mathbf{K} P_c$  (Eq. 4.8)"
    axes.text(0, 0.36, law, va="top")
    axes.text(0, 0.25, words, va="top", color=ORANGE, linespacing=1.5)
    size = f"{optics.width_px} × {optics.height_px} px"
    note = f"{size}; field of view to scale;\nlens distortion is not drawn"
    axes.text(0, 0.06, note, va="top", fontsize=SMALL, color="0.35")


def _matrix(axes: Axes, middle: float, rows: list[list[str]], ends: tuple[float, float]) -> None:
    """Entries between two brackets."""
    low, high = ends
    for side, inward in ((low, 0.02), (high, -0.02)):
        x = [side + inward, side, side, side + inward]
        axes.plot(x, middle + 0.13 * np.array([1, 1, -1, -1]), color=BLACK, lw=0.8)
    for i, row in enumerate(rows):
        for j, entry in enumerate(row):
            place = low + (high - low) * (j + 0.5) / 3, middle + 0.085 * (1 - i)
            axes.text(*place, f"${entry}$", ha="center", va="center", fontsize=7.5)


def _line(axes: Axes, view: NDArray, start: NDArray, stop: NDArray, **look) -> None:
    axes.plot(*(np.array([start, stop]) @ view).T, **look)


def _view() -> NDArray:
    """Parallel projection of camera axes on the page, columns right and up (3, 2)."""
    turn, tilt = np.radians([SIDE_DEG, ABOVE_DEG])
    ahead = np.array([np.cos(turn), 0, np.sin(turn)])
    up = np.array([0, -1.0, 0])
    away = np.cross(up, ahead)
    return np.column_stack([ahead, np.cos(tilt) * up + np.sin(tilt) * away])
