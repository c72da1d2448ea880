"""Figure 4.8: the pinhole camera model, with a sensor's own optics."""

from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray
from palpate.report.panels import named
from palpate.report.style import BLUE, GREEN, GREY, ORANGE, PAGE_IN, sensor_name
from palpate.units import MILLIMETRES
from palpate.vision.camera import PinholeCamera, camera_from_spec

from thesis.diagrams import DOT_DASH, FROM_CAMERA, NOTE, Sketch, blank, matrix
from thesis.views import View

# Lengths of the drawing are in pixels: the image plane lies at its focal length, so the field of
# view is true; the object's point lies so many focal lengths away.
SIDE, AWAY = View(227, 20), 2.0
# The drawn point on the image, from the principal point in parts of the half image.
SHOWN = np.array([0.6, -0.78])


def figure_4_8(inputs: Any, params: Any) -> Figure:
    """Pinhole camera model and the camera matrix of a sensor's file (Fig. 4.8, Eq. 4.7-4.8)."""
    optics = camera_from_spec(params.sensor["color"])
    pixel, point = shown_point(optics, params.depth_m)
    figure = plt.figure(figsize=(PAGE_IN, 3.2))
    _draw(blank(figure, (0.02, 0.02, 0.59, 0.88), "Projection", "a"), optics, pixel)
    axes = figure.add_axes((0.65, 0.02, 0.34, 0.88))
    axes.set_axis_off()
    named(axes, "b", f"{sensor_name(params.sensor['sensor'])}, colour camera")
    _write(axes, optics, pixel, point)
    return figure


def shown_point(optics: PinholeCamera, depth_m: float) -> tuple[NDArray, NDArray]:
    """Drawn image point p_i (2,) [px] and the point P_c (3,) [m] that it shows, without lens."""
    half = np.array([optics.width_px, optics.height_px]) / 2
    pixel = np.round(np.array([optics.cx_px, optics.cy_px]) + SHOWN * half)
    ray = np.linalg.solve(optics.matrix, [*pixel, 1.0])
    return pixel, depth_m * ray


def _draw(axes: Axes, optics: PinholeCamera, pixel: NDArray) -> None:
    """Centre of projection, image plane and the ray through it."""
    sketch, focal, centre = Sketch(axes, SIDE, FROM_CAMERA), optics.fx_px, np.zeros(3)
    middle = np.array([optics.cx_px, optics.cy_px])
    corners = np.array([[0, 0], [1, 0], [1, 1], [0, 1]]) * [optics.width_px, optics.height_px]
    plane = np.column_stack([corners - middle, np.full(4, focal)])
    principal, image = np.array([0, 0, focal]), np.array([*(pixel - middle), focal])
    for corner in plane:
        sketch.line(centre, corner, color=GREY, lw=0.5)
    sketch.line(centre, 1.45 * principal, ls=DOT_DASH)
    sketch.area(plane, BLUE)
    sketch.line(centre, AWAY * image, color=ORANGE, lw=1.3)
    for end in ([image[0], plane[0, 1], focal], [plane[0, 0], image[1], focal]):
        sketch.line(end, image, color=ORANGE, lw=0.7, ls=(0, (2, 2)))
    for text, place, side, away, colour in (
        ("centre of\nprojection", centre, (-0.05, 1), 22, "black"),
        ("principal point\n$(O_x, O_y)$", principal, (0.25, -1), 18, "black"),
        ("$p_i$", image, (-0.5, 1), 9, ORANGE),
        ("$P_c$", AWAY * image, (1, 0.1), 8, ORANGE),
    ):
        sketch.dot(place, color=colour)
        sketch.name(place, text, side, away, color=colour)
    sketch.name(0.62 * principal, "$f$", (0.2, -1), 9)
    sketch.name(plane[2], "image plane", (1, 0.4), 7, color=BLUE)
    corner = np.eye(4)
    corner[:3, 3] = plane[0]
    for frame, names in ((np.eye(4), ("$x_c$", "$y_c$", "$z_c$")), (corner, ("$x_i$", "$y_i$"))):
        sketch.triad(frame, 0.25 * focal, names=names, colours=[GREEN] * 3)
    axes.margins(0.06)


def _write(axes: Axes, optics: PinholeCamera, pixel: NDArray, point: NDArray) -> None:
    """Equations 4.7 and 4.8 with the camera's numbers."""
    axes.set(xlim=(0, 1), ylim=(0, 1))
    axes.text(0, 0.95, r"$\mathbf{K}$ (Eq. 4.7), px", va="top")
    numbers = [[f"{v:.1f}" if v % 1 else f"{v:.0f}" for v in row] for row in optics.matrix]
    symbols = [["f/s_x", "0", "O_x"], ["0", "f/s_y", "O_y"], ["0", "0", "1"]]
    matrix(axes, symbols, (0, 0.4), 0.68)
    axes.text(0.445, 0.68, "=", ha="center", va="center")
    matrix(axes, numbers, (0.49, 0.99), 0.68)
    law = r"$p_i = (x_1/x_3,\; x_2/x_3)$ with $\mathbf{x} = \mathbf{K} P_c$  (Eq. 4.8)"
    axes.text(0, 0.45, law, va="top")
    x, y, z = (f"{value * MILLIMETRES:.1f}" for value in point)
    words = f"$P_c$ = ({x}, {y}, {z}) mm\n$p_i$ = ({pixel[0]:.0f}, {pixel[1]:.0f}) px"
    axes.text(0, 0.34, words, va="top", color=ORANGE, linespacing=1.5)
    size = f"{optics.width_px} × {optics.height_px} px"
    axes.text(0, 0.01, f"{size}; field of view to scale;\nlens distortion is not drawn", **NOTE)
