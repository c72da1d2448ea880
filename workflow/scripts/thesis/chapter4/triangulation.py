"""Figures 4.2 and 4.3: how the depth sensors triangulate, with their own optics."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from palpate.report.panels import named
from palpate.report.style import ARROW, BLACK, BLUE, GREEN, GREY, ORANGE, PAGE_IN
from palpate.units import MILLIMETRES

from thesis.diagrams import DOT_DASH, NOTE, TEXT_PT, dimension, write

# Where the drawn point lies between the axes, and the drawn image plane before it: at its
# focal length of a few millimetres the plane could not be seen.
ACROSS, PLANE, HALF_PLANE, DEPTH_LINE = 0.42, 0.3, 0.4, 2.65


@dataclass(frozen=True)
class Triangle:
    """A point seen from the two ends of a baseline, in the plane of both.

    Attributes
    ----------
    focal_px : float
        Focal length of both ends.
    centre_px : float
        Column of the principal point.
    baseline_m : float
        From the first centre, in the origin, to the second along x.
    x_m, z_m : float
        Place of the point.
    """

    focal_px: float
    centre_px: float
    baseline_m: float
    x_m: float
    z_m: float

    @property
    def first_px(self) -> float:
        """Column of the point's image at the first end (Eq. 4.8)."""
        return self.centre_px + self.focal_px * self.x_m / self.z_m

    @property
    def second_px(self) -> float:
        """Column at the second end."""
        return self.centre_px + self.focal_px * (self.x_m - self.baseline_m) / self.z_m

    @property
    def disparity_px(self) -> float:
        """Shift between the two images, d = f b / Z (Eq. 4.1)."""
        return self.first_px - self.second_px


def triangle(optics: Mapping, baseline_m: float, depth_m: float) -> Triangle:
    """Put a point at a depth before a sensor.

    Parameters
    ----------
    optics : mapping
        ``fx_px`` and ``cx_px`` of the sensor's file.
    baseline_m, depth_m : float

    Raises
    ------
    ValueError
        If baseline or depth is not positive.
    """
    for name, value in (("baseline_m", baseline_m), ("depth_m", depth_m)):
        if not value > 0:
            raise ValueError(f"{name}: expected a positive length, found {value} m")
    x_m = ACROSS * baseline_m
    return Triangle(optics["fx_px"], optics["cx_px"], baseline_m, x_m, depth_m)


def counts_of(depth: Mapping, disparity_px: float) -> float:
    """Number d' that a structured-light sensor writes for a disparity (Eq. 4.2)."""
    return (disparity_px - depth["disparity_offset_px"]) / depth["disparity_scale"]


def figure_4_2(inputs: Any, params: Any) -> Figure:
    """Triangulation of a structured-light sensor that writes disparities (Fig. 4.2)."""
    sensor, depth = params.sensor, params.sensor["depth"]
    shape = triangle(depth, depth["baseline_m"], params.depth_m)
    figure, left, right = _panels(shape, ("infrared\ncamera", "infrared\nprojector"))
    _plane(left, shape, 0.0)
    _image_point(left, shape, shape.first_px, "$p$", BLUE)
    _image_point(left, shape, shape.second_px, "$p'$", ORANGE)
    far = np.array([(shape.x_m - shape.baseline_m) / shape.z_m, 1.0]) * shape.z_m * 0.86
    ray = ARROW | {"color": ORANGE, "ls": "--"}
    left.annotate("", far * MILLIMETRES, (0, 0), arrowprops=ray)
    words = "ray of the same\ndot in the reference\npattern ($d = 0$)"
    write(left, far * MILLIMETRES, words, (-0.1, 1), 18, color=ORANGE)
    named(left, "a", "One dot of the pattern")
    _counts(right, sensor, shape)
    named(right, "b", "From the sensor's number to depth")
    return figure


def figure_4_3(inputs: Any, params: Any) -> Figure:
    """Triangulation of a rectified stereo pair (Fig. 4.3)."""
    sensor = params.sensor
    shape = triangle(sensor["color"], sensor["stereo"]["baseline_m"], params.depth_m)
    figure, left, right = _panels(shape, ("left\ncamera $O_L$", "right\ncamera $O_R$"))
    _plane(left, shape, 0.0)
    _plane(left, shape, shape.baseline_m)
    _image_point(left, shape, shape.first_px, "$P_L$", BLUE)
    _image_point(left, shape, shape.second_px, "$P_R$", ORANGE, shift_m=shape.baseline_m)
    _image_point(left, shape, shape.second_px, "", ORANGE, mfc="white")
    named(left, "a", "One point in both images")
    _images(right, sensor, shape)
    named(right, "b", "Search along the epipolar line")
    return figure


def on_plane(shape: Triangle, column_px: float) -> tuple[float, float]:
    """Where a column lies on the plane drawn before the first end, x and z [mm]."""
    depth = PLANE * shape.z_m * MILLIMETRES
    return (column_px - shape.centre_px) / shape.focal_px * depth, depth


def _panels(shape: Triangle, names: tuple[str, str]) -> tuple[Figure, Axes, Axes]:
    """Two panels; the left with both ends of the baseline, the point, its rays and disparity."""
    figure = plt.figure(figsize=(PAGE_IN, 3.7))
    axes = figure.add_axes((0.09, 0.12, 0.47, 0.79))
    b, x, z = (MILLIMETRES * value for value in (shape.baseline_m, shape.x_m, shape.z_m))
    for place, name, colour in ((0.0, names[0], BLUE), (b, names[1], ORANGE)):
        axes.plot([place, place], [0, 1.03 * z], color=GREY, lw=0.6, ls=DOT_DASH)
        axes.plot([place, x], [0, z], color=colour)
        axes.plot(place, 0, "o", color=colour, ms=6, zorder=4)
        write(axes, (place, 0), name, (0, -1), 15, weight="bold", color=colour)
    axes.plot(x, z, "o", color=BLACK, ms=5, zorder=4)
    write(axes, (x, z), "$P$", (0.3, 1), 9)
    dimension(axes, (0, -0.2 * z), (b, -0.2 * z), f"$b$ = {b:.0f} mm", (0, -1))
    side = DEPTH_LINE * b
    dimension(axes, (side, 0), (side, z), f"$Z$ = {z:.0f} mm", (1, 0), rotation=90)
    for start, height in ((x, z), (b, 0)):
        axes.plot([start, 1.02 * side], [height, height], color=GREY, lw=0.6)
    (low, _), (high, plane) = (on_plane(shape, c) for c in (shape.second_px, shape.first_px))
    below = plane - 0.055 * z
    dimension(axes, (low, below), (high, below), "", (0, -1), color=GREEN)
    text = f"$d = f\\,b\\,/\\,Z$ = {shape.disparity_px:.1f} px"
    write(axes, (low, below), text, (-1, -2.5), 12, color=GREEN)
    axes.set(xlim=(-1.95 * b, 3.0 * b), ylim=(-0.3 * z, 1.14 * z))
    note = "image planes\nnot to scale"
    axes.text(0.99, 0.02, note, transform=axes.transAxes, ha="right", **NOTE)
    axes.set(xlabel="along the baseline, $x$ (mm)", ylabel="along the optical axes, $z$ (mm)")
    return figure, axes, figure.add_axes((0.645, 0.12, 0.345, 0.79))


def _plane(axes: Axes, shape: Triangle, at_m: float) -> None:
    """Image plane before one end, nearer to the object than to scale."""
    height = PLANE * shape.z_m * MILLIMETRES
    ends = (at_m + np.array([-1, 1]) * HALF_PLANE * shape.baseline_m) * MILLIMETRES
    axes.plot(ends, [height, height], color=BLACK, lw=2, zorder=2, solid_capstyle="butt")
    end, side = (ends[0], -1) if at_m == 0 else (ends[1], 1)
    write(axes, (end, height), f"image plane\n$f$ = {shape.focal_px:.1f} px", (side, 0), 5)


def _image_point(
    axes: Axes,
    shape: Triangle,
    column_px: float,
    name: str,
    colour: str,
    *,
    shift_m: float = 0.0,
    **look,
) -> None:
    """An image point on the drawn plane."""
    x, z = on_plane(shape, column_px)
    place = x + shift_m * MILLIMETRES, z
    axes.plot(*place, "o", **{"color": colour, "ms": 4.5, "zorder": 5} | look)
    if name:
        side = 1 if column_px > shape.centre_px else -1
        write(axes, place, name, (side, 0.8), 9, color=colour)


def _counts(axes: Axes, sensor: Mapping, shape: Triangle) -> None:
    """Depth over what the sensor writes, in its range (Eq. 4.3)."""
    depth, (low, high) = sensor["depth"], sensor["range_m"]
    product = depth["fx_px"] * depth["baseline_m"]
    ends = [counts_of(depth, product / limit) for limit in (low, high)]
    # Between them the depth is the sensor's by Eq. 4.3, Z = f b / (m d' + n).
    disparity = np.linspace(product / low, product / high, 400)
    axes.plot(counts_of(depth, disparity), product / disparity, color=BLUE)
    here = counts_of(depth, shape.disparity_px)
    axes.plot([here, here, ends[0]], [low, shape.z_m, shape.z_m], color=GREY, lw=0.7, ls="--")
    axes.plot(here, shape.z_m, "o", color=BLACK, ms=5)
    step = abs(depth["disparity_scale"]) * shape.z_m**2 / product * MILLIMETRES
    words = f"$P$: $d'$ = {here:.0f}, $Z$ = {shape.z_m:.2f} m\none count is {step:.1f} mm"
    write(axes, (here, shape.z_m), words, (1, -0.9), 12)
    law = r"$Z = \frac{f\,b}{m\,d' + n}$"
    numbers = f"$f$ = {depth['fx_px']:.1f} px\n$b$ = {depth['baseline_m'] * MILLIMETRES:.0f} mm\n"
    numbers += f"$m$ = {depth['disparity_scale']:g} px\n$n$ = {depth['disparity_offset_px']:g} px"
    axes.text(0.05, 0.96, law, transform=axes.transAxes, va="top", fontsize=11)
    axes.text(0.05, 0.80, numbers, transform=axes.transAxes, va="top", linespacing=1.4)
    axes.set_yscale("log")
    ticks = [tick for tick in (0.5, 1, 2, 4, 8) if low <= tick <= high]
    axes.set_yticks(ticks, [f"{tick:g}" for tick in ticks], minor=False)
    axes.minorticks_off()
    axes.set(xlabel="normalised disparity $d'$ (counts)", ylabel="depth $Z$ (m)")
    axes.set(xlim=(ends[0] - 15, ends[1] + 15), ylim=(0.9 * low, 1.1 * high))


def _images(axes: Axes, sensor: Mapping, shape: Triangle) -> None:
    """Both images one above the other, to scale, with the row in which the match lies."""
    width, height = (sensor["color"][key] for key in ("width_px", "height_px"))
    row, gap = sensor["color"]["cy_px"], 0.16 * height
    for k, (name, column, colour) in enumerate(
        (
            ("left image, with $P_L$", shape.first_px, BLUE),
            ("right image, with $P_R$", shape.second_px, ORANGE),
        )
    ):
        top = k * (height + gap)
        axes.add_patch(Rectangle((0, top), width, height, fc="0.96", ec=BLACK, lw=0.8))
        look = {"va": "top", "color": colour, "fontsize": TEXT_PT}
        axes.text(0.02 * width, top + 0.05 * height, name, **look)
        axes.plot([0, width], [top + row] * 2, color=GREY, lw=0.8)
        axes.plot(column, top + row, "o", color=colour, ms=4.5, zorder=5)
        write(axes, (column, top + row), f"{column:.1f} px", (0, 1), 10)
    product = shape.focal_px * shape.baseline_m
    near, far = (shape.first_px - product / limit for limit in sensor["range_m"])
    line = height + gap + row
    axes.plot([near, far], [line] * 2, color=GREEN, lw=4, alpha=0.55, solid_capstyle="butt")
    words = f"searched: {far - near:.0f} columns,\n{sensor['range_m'][0]:g} m deep at the left end,"
    words += f"\n{sensor['range_m'][1]:g} m at the right end"
    place = width / 2, line + 0.06 * height
    axes.text(*place, words, ha="center", va="top", fontsize=TEXT_PT)
    axes.set(xlim=(-8, width + 8), ylim=(2 * height + gap + 8, -8), aspect="equal")
    axes.set(xticks=[], yticks=[])
    axes.spines[["left", "bottom"]].set_visible(False)
    axes.set_xlabel(f"each {width} × {height} px,\nrow {row:g} is the epipolar line of both")
