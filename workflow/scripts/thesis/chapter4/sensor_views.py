"""Figure 4.1: the depth devices of the rig, and where they stand."""

import itertools
from collections.abc import Mapping
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Polygon, Rectangle
from matplotlib.patheffects import Normal
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
    entitle,
    sensor_name,
)
from palpate.report.views import View, render_surface
from palpate.units import MILLIMETRES

from thesis.chapter4.rig_parts import Shape, scanner_shape, sensor_shape
from thesis.chapter4.rig_views import eyes
from thesis.chapter4.transform_chain import HALO

WIDTH_PX = 600
FRONT = View(-72, 14)
# From a device's axes (right, down, ahead) to axes with z up; the reader stands before it.
STANDING = np.array([[-1.0, 0, 0], [0, 0, -1.0], [0, -1.0, 0]])
BOTH_WAYS = ARROW | {"arrowstyle": "<|-|>,head_width=0.14,head_length=0.28", "lw": 0.7}
PLAN_M = 1.25
KINDS = {"stereo": "stereo pair", "structured_light": "dot pattern", "laser": "laser light section"}
SCANNER_NAME = "VIVID 910"


def make_figure_4_1(inputs: Any, params: Any) -> Figure:
    """The figure, of the configured devices."""
    return figure_4_1(**params.devices)


def figure_4_1(stereo: Mapping, dots: Mapping, scan: Mapping) -> Figure:
    """Three depth devices, their optics and fields of view (Fig. 4.1).

    Parameters
    ----------
    stereo, dots : mapping
        ``sensor`` (the sensor's file) and ``distance_m`` from the object, of the stereo head and
        of the structured-light sensor.
    scan : mapping
        ``turns_deg``, ``elevations_deg`` and ``distance_m`` of the laser scanner's views, and
        ``size_m`` of the object.
    """
    figure = plt.figure(figsize=(PAGE_IN, 4.7))
    for k, device in enumerate((scan, dots, stereo)):
        left, width = k / 3 + 0.03, 1 / 3 - 0.04
        top = figure.add_axes((left, 0.52, width, 0.4))
        plan = figure.add_axes((left, 0.05, width, 0.42))
        sensor = device.get("sensor")
        name = sensor_name(sensor["sensor"]) if sensor else SCANNER_NAME
        kind = KINDS[sensor["kind"] if sensor else "laser"]
        _draw_device(top, *(sensor_shape(sensor) if sensor else scanner_shape()), sensor)
        entitle(top, f"{name}: {kind}", "abc"[k])
        if sensor:
            _draw_view(plan, device)
        else:
            _draw_scans(plan, device)
    note = "top: housings sketched at about their size, each to its own scale;"
    note += " bottom: seen from above, as configured"
    figure.text(0.5, 0.004, note, ha="center", va="bottom", fontsize=SMALL, color="0.35")
    return figure


def field_deg(camera: Mapping) -> tuple[float, float]:
    """Horizontal and vertical field of view of a camera, both sides together [deg]."""
    found = []
    for size, focal, centre in (("width", "fx", "cx"), ("height", "fy", "cy")):
        ends = np.array([0, camera[f"{size}_px"]]) - camera[f"{centre}_px"]
        angles = np.rad2deg(np.arctan(ends / camera[f"{focal}_px"]))
        found.append(float(angles[1] - angles[0]))
    return found[0], found[1]


def _draw_device(
    axes: Axes, shape: Shape, places: Mapping[str, NDArray], sensor: Mapping | None
) -> None:
    """Housing from the front, with the names of its optics."""
    vertices = shape.vertices_m @ STANDING.T
    frame = FRONT.frame(vertices, margin=0.03)
    picture = render_surface(
        vertices, shape.faces, FRONT, frame, width_px=WIDTH_PX, colours=shape.colours
    )
    axes.imshow(picture, extent=tuple(frame), interpolation="antialiased")
    axes.set_axis_off()
    width = frame[1] - frame[0]
    flat = {n: FRONT.project((STANDING @ p)[None])[0, :2] for n, p in places.items()}
    for k, (name, place) in enumerate(sorted(flat.items(), key=lambda item: item[1][0])):
        aside, up = (k - (len(flat) - 1) / 2) * 0.08, 1 if k % 2 else -1
        end = place + np.array([aside, 0.26 * up]) * width
        if sensor is None:
            end = np.array([frame[0] - 0.12 * width, place[1]])
        axes.plot(*np.transpose([place, end]), color=BLACK, lw=0.7)
        axes.plot(*place, "o", color=BLACK, mec="white", mew=0.6, ms=3.4)
        side = (-1, 0) if sensor is None else (0, up)
        beside(axes, end, name.replace(" ", "\n"), side, 4 if sensor is None else 9, fontsize=7)
    axes.set(xlim=(frame[0] - 0.06 * width, frame[1] + 0.06 * width))
    middle, half = (
        (frame[2] + frame[3]) / 2,
        0.5 * max(frame[3] - frame[2], 0.95 * width) * (1.0 if sensor else 1.12),
    )
    axes.set_ylim(middle - half, middle + half)
    axes.set_aspect("equal", adjustable="datalim")
    axes.text(0.5, 0.0, _stated(sensor), transform=axes.transAxes, ha="center", fontsize=7)


def _stated(sensor: Mapping | None) -> str:
    """What is known of a device, in a line."""
    if sensor is None:
        return "640 × 480 points a view"
    block = sensor["stereo"] if sensor["kind"] == "stereo" else sensor["depth"]
    size = f"{sensor['color']['width_px']} × {sensor['color']['height_px']} px"
    rate = f"{sensor['frame_rate_hz']} frames/s"
    return f"baseline {block['baseline_m'] * MILLIMETRES:.0f} mm, {size}, {rate}"


def _draw_view(axes: Axes, device: Mapping) -> None:
    """Fields of view from above, in the sensor's range."""
    sensor, distance = device["sensor"], device["distance_m"]
    near, far = sensor["range_m"]
    colours = (BLUE, ORANGE)
    for (name, (camera, pose)), colour in zip(
        eyes(sensor, np.eye(4)).items(), colours, strict=True
    ):
        ends = (np.array([0, camera["width_px"]]) - camera["cx_px"]) / camera["fx_px"]
        reach = np.array([near, near, min(far, PLAN_M), min(far, PLAN_M)])
        x = pose[0, 3] + reach * ends[[0, 1, 1, 0]]
        corners = np.column_stack([x, reach + pose[2, 3]])
        axes.add_patch(Polygon(corners, fc=colour, alpha=0.16, ec="none"))
        axes.add_patch(Polygon(corners, fc="none", ec=colour, lw=0.8))
        for corner in corners[:2]:
            line = np.array([pose[[0, 2], 3], corner]).T
            axes.plot(*line, color=colour, lw=0.5, ls=(0, (3, 2)))
        axes.plot(pose[0, 3], pose[2, 3], "o", color=colour, ms=3.5, zorder=4)
        wide, tall = field_deg(camera)
        label = f"{name} camera: {wide:.0f}° × {tall:.0f}°"
        axes.plot([], [], "s", color=colour, alpha=0.5, ms=5, label=label)
    axes.annotate("", (0, distance), (0, 0), arrowprops=BOTH_WAYS)
    axes.plot(0, distance, "o", color=BLACK, ms=3.5)
    halo = {"path_effects": [HALO, Normal()], "fontsize": 7}
    beside(axes, (0, distance), f"object, {distance:.2f} m", (0.2, 1), 8, **halo)
    ranged = f"range {near:g} to {far:g} m" + (", cut" if far > PLAN_M else "")
    beside(axes, (0, min(far, PLAN_M)), ranged, (0, -1), 7, **halo)
    _plan(axes, ((-1.0, 1.0), (-0.35, PLAN_M + 0.2)))
    axes.legend(loc="lower center", fontsize=SMALL, handletextpad=0.2, borderaxespad=0)


def _draw_scans(axes: Axes, scan: Mapping) -> None:
    """Where the scanner stands about the object, from above."""
    size, distance = np.array(scan["size_m"]), scan["distance_m"]
    axes.add_patch(Rectangle(-size[:2] / 2, *size[:2], fc=GREY, ec=BLACK, lw=0.7))
    turns = np.deg2rad(scan["turns_deg"])
    directions = np.column_stack([np.sin(turns), -np.cos(turns)])
    colours = itertools.cycle((BLUE, ORANGE, GREEN))
    for elevation, colour in zip(scan["elevations_deg"], colours, strict=False):
        flat = distance * np.cos(np.deg2rad(elevation)) * (0.94 if elevation < 0 else 1.0)
        for place in flat * directions:
            axes.plot(*np.array([place, 0.55 * place]).T, color=colour, lw=0.5)
        words = (
            f"{abs(elevation):g}° above"
            if elevation > 0
            else f"{abs(elevation):g}°, turned over, drawn nearer"
        )
        axes.plot(*(flat * directions).T, "^", color=colour, ms=4.5, ls="none", label=words)
    title = f"{len(turns) * len(scan['elevations_deg'])} views of {distance:.1f} m"
    reach = 1.05 * distance
    _plan(axes, ((-reach, reach), (-1.75 * reach, 1.25 * reach)))
    look = {"fontsize": SMALL, "title_fontsize": 7, "handletextpad": 0.2, "borderaxespad": 0}
    axes.legend(loc="lower center", title=title, **look)


def _plan(axes: Axes, limits: tuple) -> None:
    """Seen from above, with a scale bar."""
    axes.set(xlim=limits[0], ylim=limits[1])
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_axis_off()
    left, high = limits[0][0], limits[1][1]
    axes.plot([left, left + 0.5], [high, high], color=BLACK, lw=2)
    axes.text(left + 0.25, high - 0.03, "0.5 m", ha="center", va="top", fontsize=SMALL)
