"""Figures of tracked surfaces: clouds with added points and what the trackers make of them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray
from palpate.report.panels import Surface, named, photo_panel
from palpate.report.style import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    SMALL,
    label_provenance,
    sensor_name,
)
from palpate.units import MILLIMETRES

from thesis.panels import (
    cloud_panel,
    coloured,
    displacement_bar,
    legend,
    outline,
    panels,
    scale_bar,
    surface_panel,
)
from thesis.views import View

CLOSE_MM, AROUND_MM = (76.0, 44.0), (84.0, 62.0)
SECTION_HALF_WIDTH_M = 0.0015
SECTION_REACH_M = 0.030


@dataclass(frozen=True)
class AddedCloud:
    """A frame's cloud and the points added to it, object frame.

    Attributes
    ----------
    captured_m : (n, 3) array
    still_m : (k, 3) array
        Places of vertices that stay undeformed [m].
    pressed_m : (j, 3) array
        The indenter's: places of vertices on it, or its own points [m].
    """

    captured_m: NDArray
    still_m: NDArray
    pressed_m: NDArray


@dataclass(frozen=True)
class TurnedClouds:
    """A capture's cloud, and its copies before and in the most pressed frame, object frame.

    Attributes
    ----------
    single_m : (n, 3) array
        Captured, in the most pressed frame [m].
    rest_m, pressed_m : tuple of (captured (n, 3), copies (k, 3), support (j, 3)) [m]
    """

    single_m: NDArray
    rest_m: tuple[NDArray, NDArray, NDArray]
    pressed_m: tuple[NDArray, NDArray, NDArray]


def figure_5_5(
    captures: Sequence[Mapping],
    photos: Sequence[NDArray],
    clouds: Sequence[AddedCloud],
    surfaces: Sequence[Surface],
) -> Figure:
    """Picture, cloud with added points, tracked surface and its dent, by sensor (Fig. 5.5)."""
    view, close = View(-72, 33), View(-72, 38)
    figure, axes = panels(
        4, len(captures), 7.5, heights=[1.3, 1.25, 1.25, 1.9], right=0.89, bottom_in=0.3
    )
    frame = view.frame(*(surface.rest_m for surface in surfaces))
    top = max(float(surface.displacement_mm().max()) for surface in surfaces)
    columns = zip(axes.T, captures, photos, clouds, surfaces, strict=True)
    for column, capture, photo, cloud, surface in columns:
        photo_panel(column[0], photo)
        dots = (cloud.captured_m, GREY, 0.5), (cloud.still_m, ORANGE, 2.5)
        cloud_panel(column[1], [*dots, (cloud.pressed_m, GREEN, 5)], view, frame)
        whole = {"colours": coloured(surface.displacement_mm(), top), "edges": True}
        shape = surface.deformed_m, surface.faces
        surface_panel(column[2], *shape, view, frame, **whole, width_px=1100)
        detail = close.around(surface.contact_m, *CLOSE_MM)
        surface_panel(column[3], *shape, close, detail, **whole, width_px=1000)
        for panel, length, place in zip(
            column[1:], (100, 100, 10), (frame, frame, detail), strict=True
        ):
            scale_bar(panel, length, place)
        titles = (f"{sensor_name(capture['sensor'])}, point {capture['point']}",
                  "cloud and added points", "tracked", "at the contact")  # fmt: skip
        first = "abcdefghijkl"[list(axes.T[:, 0]).index(column[0]) :: len(captures)]
        for panel, letter, title in zip(column, first, titles, strict=False):
            named(panel, letter, title)
    entries = ("captured", GREY), ("undeformed", ORANGE), ("under the indenter", GREEN)
    legend(figure, entries, 0.016)
    displacement_bar(figure, axes[2:, -1], top)
    label_provenance(figure, {capture["provenance"] for capture in captures})
    return figure


def figure_5_7(capture: Mapping, unrefined: Surface, refined: Surface, cloud_m: NDArray) -> Figure:
    """Side and top view of the dent without and with refined mesh, and sections (Fig. 5.7)."""
    figure, axes = panels(2, 3, 4.1, widths=[1, 1, 1.05], bottom_in=0.72, wspace=0.3)
    top = float(max(s.displacement_mm().max() for s in (unrefined, refined)))
    rows = (("template as it is", unrefined), ("refined at the contact", refined))
    for row, (name, surface), letters in zip(axes, rows, ("abc", "def"), strict=True):
        look = {"colours": coloured(surface.displacement_mm(), top), "edges": True}
        for panel, view in zip(row[:2], (View(-90, 14), View(-90, 90)), strict=True):
            frame = view.around(surface.contact_m, *AROUND_MM)
            surface_panel(panel, surface.deformed_m, surface.faces, view, frame, **look)
            scale_bar(panel, 20, frame)
        _section_panel(row[2], surface, cloud_m)
        titles = (f"{name}, side", "from above", "section")
        for panel, letter, title in zip(row, letters, titles, strict=True):
            named(panel, letter, title)
    axes[1, 2].set_xlabel("From the contact (mm)")
    axes[0, 2].legend(loc="lower right", fontsize=SMALL, handlelength=1.4)
    displacement_bar(figure, axes[:, 1], top, place=(0.06, 0.115, 0.5, 0.018))
    text = f"{sensor_name(capture['sensor'])}, point {capture['point']}"
    figure.text(0.02, 0.012, text, fontsize=SMALL)
    label_provenance(figure, {capture["provenance"]})
    return figure


def figure_5_11(
    captures: Sequence[Mapping], views: Sequence[View], clouds: Sequence[TurnedClouds]
) -> Figure:
    """Cloud of one view, and turned about the support's normal, by sensor (Fig. 5.11)."""
    figure, axes = panels(len(captures), 3, 2.3 * len(captures) + 0.4, bottom_in=0.5)
    letters = iter("abcdefghijkl")
    for row, capture, view, found in zip(axes, captures, views, clouds, strict=True):
        frame = view.frame(np.vstack(found.rest_m), margin=0.06)
        cloud_panel(row[0], [(found.single_m, BLUE, 1.6)], view, frame)
        turned = found.rest_m, found.pressed_m
        for panel, (own, copies, support) in zip(row[1:], turned, strict=True):
            groups = (copies, GREY, 1.2), (own, BLUE, 1.2), (support, ORANGE, 5)
            cloud_panel(panel, groups, view, frame)
        titles = (
            f"{sensor_name(capture['sensor'])}: one view",
            "turned, undeformed",
            "turned, deformed",
        )
        for panel, title in zip(row, titles, strict=True):
            named(panel, next(letters), title)
            scale_bar(panel, 20, frame)
    entries = ("captured", BLUE), ("turned copies", GREY), ("support's vertices", ORANGE)
    legend(figure, entries, 0.05)
    label_provenance(figure, {capture["provenance"] for capture in captures})
    return figure


def figure_5_13(
    captures: Sequence[Mapping], views: Sequence[View], pairs: Sequence[tuple[Surface, Surface]]
) -> Figure:
    """Ball tracked from one view and from turned clouds, by sensor (Fig. 5.13).

    Parameters
    ----------
    captures, views
        By sensor.
    pairs : sequence of (single view, augmented)
    """
    figure, axes = panels(len(captures), 2, 2.9 * len(captures) + 0.3, right=0.87)
    top = max(float(surface.displacement_mm().max()) for pair in pairs for surface in pair)
    letters = iter("abcdefghijkl")
    for row, capture, view, pair in zip(axes, captures, views, pairs, strict=True):
        frame = view.frame(*(s.rest_m for s in pair), *(s.deformed_m for s in pair))
        for panel, surface, how in zip(row, pair, ("one view", "turned clouds"), strict=True):
            look = {"colours": coloured(surface.displacement_mm(), top), "edges": True}
            surface_panel(panel, surface.deformed_m, surface.faces, view, frame, **look)
            outline(panel, surface.rest_m, surface.faces, view, frame)
            text = f"volume {100 * surface.volume_change():+.1f} %"
            place = {"xy": (1, 0), "xycoords": "axes fraction", "ha": "right"}
            panel.annotate(text, **place, fontsize=SMALL)
            named(panel, next(letters), f"{sensor_name(capture['sensor'])}: {how}")
            scale_bar(panel, 20, frame)
    displacement_bar(figure, axes, top)
    figure.text(0.02, 0.012, "dashed: outline of the undeformed ball", fontsize=SMALL)
    label_provenance(figure, {capture["provenance"] for capture in captures})
    return figure


def figure_5_16(
    capture: Mapping, photo: NDArray, view: View, cloud_m: NDArray, surface: Surface
) -> Figure:
    """Picture, cloud, tracked surface, and the same with its edges (Fig. 5.16)."""
    figure, axes = panels(2, 2, 5.3, right=0.88, bottom_in=0.3)
    photo_panel(axes[0, 0], photo)
    frame, top = view.frame(surface.rest_m), float(surface.displacement_mm().max())
    cloud_panel(axes[0, 1], [(cloud_m, BLUE, 3)], view, frame)
    whole = surface.deformed_m, surface.faces
    surface_panel(axes[1, 0], *whole, view, frame)
    look = {"colours": coloured(surface.displacement_mm(), top), "edges": True}
    surface_panel(axes[1, 1], *whole, view, frame, **look, width_px=1400)
    titles = (f"{sensor_name(capture['sensor'])}: picture", "cloud", "tracked surface",
              "its triangles and displacement")  # fmt: skip
    for panel, letter, title in zip(axes.ravel(), "abcd", titles, strict=True):
        named(panel, letter, title)
    for panel in axes.ravel()[1:]:
        scale_bar(panel, 20, frame)
    displacement_bar(figure, axes[1:], top)
    label_provenance(figure, {capture["provenance"]})
    return figure


def section(surface: Surface, vertices_m: NDArray) -> tuple[NDArray, NDArray]:
    """Upper profile across y of the contact: x and z from it, sorted along x, (k,) [m]."""
    offset = vertices_m - surface.contact_m
    faces = surface.faces
    edges = np.unique(np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0)
    a, b = offset[edges[:, 0]], offset[edges[:, 1]]
    crosses = (a[:, 1] > 0) != (b[:, 1] > 0)
    a, b = a[crosses], b[crosses]
    points = a + (a[:, 1] / (a[:, 1] - b[:, 1]))[:, None] * (b - a)
    upper = points[points[:, 2] > -0.5 * np.ptp(vertices_m[:, 2])]
    order = np.argsort(upper[:, 0])
    return upper[order, 0], upper[order, 2]


def _section_panel(axes: Axes, surface: Surface, cloud_m: NDArray) -> None:
    for vertices, colour, style, name in (
        (surface.rest_m, GREY, (0, (4, 2)), "undeformed"),
        (surface.deformed_m, BLUE, "-", "tracked"),
    ):
        x, z = section(surface, vertices)
        axes.plot(x * MILLIMETRES, z * MILLIMETRES, color=colour, ls=style, label=name)
    offset = cloud_m - surface.contact_m
    near = (np.abs(offset[:, 1]) < SECTION_HALF_WIDTH_M) & (np.abs(offset[:, 0]) < SECTION_REACH_M)
    points = offset[near] * MILLIMETRES
    axes.plot(points[:, 0], points[:, 2], ".", ms=2.5, color=BLACK, label="captured")
    reach = SECTION_REACH_M * MILLIMETRES
    axes.set(xlim=(-reach, reach), ylim=(-21, 6), aspect="equal", ylabel="Height (mm)")
