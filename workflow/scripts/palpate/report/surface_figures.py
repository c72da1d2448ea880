"""Tracked surfaces: photograph, and a section through the dent."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import pyvista as pv
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from palpate.capture.images import Stream
from palpate.json_fields import read_all
from palpate.report.panels import Surface, photo_panel, window
from palpate.report.style import BLACK, BLUE, GREY, PAGE_IN, label_provenance, sensor_name
from palpate.surface.pose import to_object
from palpate.surface.tracked import load_tracked
from palpate.units import MILLIMETRES
from palpate.vision.clouds import read_clouds

# Of the photograph, each way from the contact.
AROUND_M = 0.09
DETAIL_M = 0.025
SECTION_HALF_WIDTH_M = 0.0015
# Of the section's panel: as high as what was captured there, within limits [mm].
LOWEST_MM, HIGHEST_MM = -14, (5, 16)


@dataclass(frozen=True, kw_only=True)
class TrackedView(Surface):
    """Tracked surface of one frame, and what else there is of the frame.

    Attributes
    ----------
    cloud_m : (k, 3) array
        Captured points, object frame [m].
    photo : (h, w, 3) or (h, w) uint8 array, or None
        The frame as the reference camera saw it; None of a sensor of clouds.
    near : tuple of slice
        Rows and columns of it around the contact.
    """

    cloud_m: NDArray
    photo: NDArray | None
    near: tuple[slice, slice] = (slice(None), slice(None))


def make_tracked_surface(inputs: Any, params: Any) -> Figure:
    """Tracked surface of the most pressed frame of each capture."""
    fits = read_all(inputs.fits)
    parts = zip(inputs.tracked, inputs.clouds, fits, inputs.recorded, params.sensors, strict=True)
    views = [read_view(*part) for part in parts]
    return tracked_surface(params.captures, views)


def tracked_surface(captures: Sequence[Mapping], views: Sequence[TrackedView]) -> Figure:
    """Photograph, and section through the tracked surface at the contact, a row per sensor."""
    size = (PAGE_IN, 2.3 * len(views))
    figure, axes = plt.subplots(len(views), 2, figsize=size, width_ratios=(1, 1.6), squeeze=False)
    for (photo, section), capture, view in zip(axes, captures, views, strict=True):
        photo_panel(photo, None if view.photo is None else view.photo[view.near])
        photo.set_title(f"{sensor_name(capture['sensor'])}, point {capture['point']}")
        section_panel(section, view)
    # Above the plot: a dent may be anywhere in it.
    above = {"loc": "lower right", "bbox_to_anchor": (1.0, 1.0)}
    axes[0, 1].legend(fontsize=6.5, handlelength=1.4, ncols=3, columnspacing=1.0, **above)
    axes[-1, 1].set_xlabel("From the contact (mm)")
    figure.tight_layout(rect=(0, 0.02, 1, 1))
    label_provenance(figure, {capture["provenance"] for capture in captures})
    return figure


def read_view(
    tracked: str, clouds: str, fit: Mapping, recorded: str, sensor: Mapping
) -> TrackedView:
    """Most pressed frame of one capture."""
    surface, frame = load_tracked(tracked), fit["range"]["last_frame"]
    pose, color = surface.camera_from_object, sensor.get("color")
    return TrackedView(
        surface.template_m,
        to_object(pose, surface.vertices_m[frame]),
        surface.faces,
        surface.contact_point_m,
        cloud_m=to_object(pose, read_clouds(clouds)[frame].points_m),
        photo=Stream(recorded, sensor)[frame] if color else None,
        near=_near(color, pose, surface.contact_point_m) if color else (),
    )


def _near(color: Mapping, camera_from_object: NDArray, contact_m: NDArray) -> tuple[slice, slice]:
    """Rows and columns around the contact, of optics that the sensor's file states."""
    x, y, z = camera_from_object[:3, :3] @ contact_m + camera_from_object[:3, 3]
    reach = AROUND_M * color["fx_px"] / z
    across, down = color["cx_px"] + color["fx_px"] * x / z, color["cy_px"] + color["fy_px"] * y / z
    low, high = (across - reach, down - reach), (across + reach, down + reach)
    return window(low, high, (color["width_px"], color["height_px"]))


def section_panel(axes: Axes, view: TrackedView) -> None:
    """Draw the section through the dent: undeformed, tracked, captured."""
    centre = view.contact_m
    for vertices, colour, style, label in (
        (view.rest_m, GREY, (0, (4, 2)), "undeformed"),
        (view.deformed_m, BLUE, "-", "tracked"),
    ):
        for k, line in enumerate(_section(vertices, view.faces, centre)):
            name = "_nolegend_" if k else label
            axes.plot(*(line * MILLIMETRES), color=colour, ls=style, label=name)
    offset = view.cloud_m - centre
    slab = (np.abs(offset[:, 1]) < SECTION_HALF_WIDTH_M) & (np.abs(offset[:, 0]) < DETAIL_M)
    points = offset[slab] * MILLIMETRES
    axes.plot(points[:, 0], points[:, 2], ".", ms=2.5, color=BLACK, label="captured")
    axes.set_xlim(-DETAIL_M * MILLIMETRES, DETAIL_M * MILLIMETRES)
    axes.set_ylim(LOWEST_MM, np.clip(points[:, 2].max(initial=0) + 1, *HIGHEST_MM))
    axes.set_aspect("equal")
    axes.set_ylabel("Height (mm)")


def _section(vertices: NDArray, faces: NDArray, centre: NDArray) -> list[NDArray]:
    """Lines (2, k) in x and z where a surface crosses the plane y = the contact's."""
    surface = pv.PolyData.from_regular_faces(np.asarray(vertices, dtype=float), faces)
    lines = surface.slice(normal="y", origin=centre).strip()
    return [(line.points - centre)[:, [0, 2]].T for line in lines.cell]
