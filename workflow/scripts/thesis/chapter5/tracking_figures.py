"""Figures of tracked surfaces: clouds with added points and what the trackers make of them."""

from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from palpate.report.panels import Surface, named, photo_panel
from palpate.report.style import BLUE, GREEN, GREY, ORANGE, SMALL, sensor_name
from palpate.report.surface_figures import TrackedView, section_panel
from palpate.surface.alignment import load_alignment
from palpate.surface.pose import to_object

from thesis.chapter5.tracking_inputs import (
    added_points,
    last_frames,
    photos_of,
    recordings_of,
    surface_of,
)
from thesis.diagrams import labelled
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
from thesis.tracker.options import tracking_options
from thesis.views import View, view_from

CLOSE_MM, AROUND_MM, LOWEST_MM = (76.0, 44.0), (84.0, 62.0), -21
# Of the views of the ball, above the camera's side.
CLOUDS_DEG, SURFACES_DEG = 25, 10


def figure_5_5(inputs: Any, params: Any) -> Figure:
    """Picture, cloud with added points, tracked surface and its dent, by sensor (Fig. 5.5)."""
    captures, frames = params.captures, last_frames(inputs)
    recordings = recordings_of(inputs, params.probes)
    surfaces = [surface_of(*pair) for pair in zip(inputs.tracked, frames, strict=True)]
    options = map(tracking_options, params.options)
    files = zip(recordings, inputs.tracked, options, frames, strict=True)
    clouds = [added_points(*each) for each in files]
    photos = photos_of(inputs, params.sensors, recordings, frames)
    view, close = View(-72, 33), View(-72, 38)
    figure, axes = panels(
        4, len(captures), 7.5, heights=[1.3, 1.25, 1.25, 1.9], right=0.89, bottom_in=0.3
    )
    frame = view.frame(*(surface.rest_m for surface in surfaces))
    top = max(float(surface.displacement_mm().max()) for surface in surfaces)
    columns = zip(axes.T, captures, photos, clouds, surfaces, strict=True)
    for column, capture, photo, cloud, surface in columns:
        photo_panel(column[0], photo)
        captured, _, still, pressed = cloud
        groups = (captured, GREY, 0.5), (still, ORANGE, 2.5), (pressed, GREEN, 5)
        cloud_panel(column[1], groups, view, frame)
        whole = {"colours": coloured(surface.displacement_mm(), top), "edges": True}
        shape = surface.deformed_m, surface.faces
        surface_panel(column[2], *shape, view, frame, **whole, width_px=1100)
        detail = close.around(surface.contact_m, *CLOSE_MM)
        surface_panel(column[3], *shape, close, detail, **whole, width_px=1000)
        for panel, length in zip(column[1:], (100, 100, 10), strict=True):
            scale_bar(panel, length)
        titles = (f"{sensor_name(capture['sensor'])}, point {capture['point']}",
                  "cloud and added points", "tracked", "at the contact")  # fmt: skip
        first = "abcdefghijkl"[list(axes.T[:, 0]).index(column[0]) :: len(captures)]
        for panel, letter, title in zip(column, first, titles, strict=False):
            named(panel, letter, title)
    entries = ("captured", GREY), ("undeformed", ORANGE), ("under the indenter", GREEN)
    legend(figure, entries, 0.016)
    displacement_bar(figure, axes[2:, -1], top)
    return labelled(figure, params)


def figure_5_7(inputs: Any, params: Any) -> Figure:
    """Side and top view of the dent without and with refined mesh, and sections (Fig. 5.7)."""
    capture, frame = params.captures[0], last_frames(inputs)[0]
    recorded = recordings_of(inputs, params.probes)[0]
    unrefined, refined = (surface_of(of[0], frame) for of in (inputs.unrefined, inputs.tracked))
    cloud_m = to_object(recorded.alignment.camera_from_object, recorded.clouds[frame][0])
    figure, axes = panels(2, 3, 4.1, widths=[1, 1, 1.05], bottom_in=0.72, wspace=0.3)
    top = float(max(s.displacement_mm().max() for s in (unrefined, refined)))
    rows = (("template as it is", unrefined), ("refined at the contact", refined))
    for row, (name, surface), letters in zip(axes, rows, ("abc", "def"), strict=True):
        look = {"colours": coloured(surface.displacement_mm(), top), "edges": True}
        for panel, view in zip(row[:2], (View(-90, 14), View(-90, 90)), strict=True):
            frame = view.around(surface.contact_m, *AROUND_MM)
            surface_panel(panel, surface.deformed_m, surface.faces, view, frame, **look)
            scale_bar(panel, 20)
        section_panel(row[2], _with_cloud(surface, cloud_m))
        row[2].set_ylim(bottom=LOWEST_MM)
        titles = (f"{name}, side", "from above", "section")
        for panel, letter, title in zip(row, letters, titles, strict=True):
            named(panel, letter, title)
    axes[1, 2].set_xlabel("From the contact (mm)")
    axes[0, 2].legend(loc="lower right", fontsize=SMALL, handlelength=1.4)
    displacement_bar(figure, axes[:, 1], top, place=(0.06, 0.115, 0.5, 0.018))
    text = f"{sensor_name(capture['sensor'])}, point {capture['point']}"
    figure.text(0.02, 0.012, text, fontsize=SMALL)
    return labelled(figure, params)


def figure_5_11(inputs: Any, params: Any) -> Figure:
    """Cloud of one view, and turned about the support's normal, by sensor (Fig. 5.11)."""
    captures, recordings = params.captures, recordings_of(inputs, params.probes)
    options = map(tracking_options, params.options)
    parts = zip(captures, recordings, inputs.tracked, options, last_frames(inputs), strict=True)
    figure, axes = panels(len(captures), 3, 2.3 * len(captures) + 0.4, bottom_in=0.5)
    letters = iter("abcdefghijkl")
    for row, (capture, recorded, path, option, last) in zip(axes, parts, strict=True):
        turned = [added_points(recorded, path, option, k)[:3] for k in (0, last)]
        view = view_from(recorded.alignment.camera_from_object, elevation_deg=CLOUDS_DEG)
        frame = view.frame(np.vstack(turned[0]), margin=0.06)
        cloud_panel(row[0], [(turned[1][0], BLUE, 1.6)], view, frame)
        for panel, (own, copies, support) in zip(row[1:], turned, strict=True):
            groups = (copies, GREY, 1.2), (own, BLUE, 1.2), (support, ORANGE, 5)
            cloud_panel(panel, groups, view, frame)
        name = sensor_name(capture["sensor"])
        titles = f"{name}: one view", "turned, undeformed", "turned, deformed"
        for panel, title in zip(row, titles, strict=True):
            named(panel, next(letters), title)
            scale_bar(panel, 20)
    entries = ("captured", BLUE), ("turned copies", GREY), ("support's vertices", ORANGE)
    legend(figure, entries, 0.05)
    return labelled(figure, params)


def figure_5_13(inputs: Any, params: Any) -> Figure:
    """Ball tracked from one view and from turned clouds, by sensor (Fig. 5.13)."""
    captures, poses = params.captures, map(load_alignment, inputs.alignment)
    views = [view_from(one.camera_from_object, elevation_deg=SURFACES_DEG) for one in poses]
    files = zip(inputs.single_view, inputs.tracked, last_frames(inputs), strict=True)
    pairs = [(surface_of(one, k), surface_of(turned, k)) for one, turned, k in files]
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
            scale_bar(panel, 20)
    displacement_bar(figure, axes, top)
    figure.text(0.02, 0.012, "dashed: outline of the undeformed ball", fontsize=SMALL)
    return labelled(figure, params)


def figure_5_16(inputs: Any, params: Any) -> Figure:
    """Picture, cloud, tracked surface, and the same with its edges (Fig. 5.16)."""
    recordings, frames = recordings_of(inputs, params.probes), last_frames(inputs)
    capture, recorded, last = params.captures[0], recordings[0], frames[0]
    pose, surface = recorded.alignment.camera_from_object, surface_of(inputs.tracked[0], last)
    cloud_m, view = to_object(pose, recorded.clouds[last][0]), view_from(pose)
    photo = photos_of(inputs, params.sensors, recordings, frames)[0]
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
        scale_bar(panel, 20)
    displacement_bar(figure, axes[1:], top)
    return labelled(figure, params)


def _with_cloud(surface: Surface, cloud_m: NDArray) -> TrackedView:
    """A surface as the section through it takes it."""
    return TrackedView(**vars(surface), cloud_m=cloud_m, photo=np.empty((0, 0)))
