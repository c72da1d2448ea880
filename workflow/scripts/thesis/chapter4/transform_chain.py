"""Figure 4.12: the chain of transforms from the probe's tip to the camera, to scale."""

from collections.abc import Mapping
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Ellipse, Polygon
from matplotlib.patheffects import Normal, Stroke
from numpy.typing import NDArray
from palpate.capture.tables import read_table
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
    label_provenance,
)
from palpate.units import MILLIMETRES
from palpate.vision.probe import marker_transforms

# Where the reader stands, and sizes of what the files don't give [m]; the sensor's are of ATI's
# data sheet of the Nano25, handle and stem are sketched.
SIDE_DEG, ABOVE_DEG = 50.0, 34.0
CAMERA_M, FRAME_M = 0.060, 0.035
NANO25_RADIUS_M, NANO25_LENGTH_M = 0.0125, 0.0216
HANDLE_RADIUS_M, HANDLE_M, STEM_RADIUS_M = 0.011, 0.120, 0.0035
HALO = Stroke(linewidth=3.2, foreground="white")
CHAIN_ARROW = ARROW | {"lw": 1.6, "arrowstyle": "-|>,head_width=0.25,head_length=0.5"}
CHAIN_ARROW |= {"path_effects": [HALO, Normal()]}
CHESSBOARD, SENSOR, TIP = (
    rf"$\mathbf{{T}}_{{\mathrm{{{name}}}}}$" for name in ("Chessboard", "Sensor", "Tip")
)


def chain(pose: pd.DataFrame, probe: Mapping) -> dict[str, NDArray]:
    """Frames of Eq. 4.20 in the camera's, in the first frame that shows the marker.

    Parameters
    ----------
    pose : DataFrame
        probe_pose.csv.
    probe : mapping
        The probe's file.

    Returns
    -------
    dict
        ``camera``, ``marker``, ``force`` and ``tip``, each a (4, 4) transform to the camera [m].

    Raises
    ------
    ValueError
        If the marker is in no frame.
    """
    seen = np.flatnonzero(pose["detected"] == 1)
    if not len(seen):
        raise ValueError(f"pose: expected a frame with the marker, found none of {len(pose)}")
    marker = marker_transforms(pose)[seen[0]]
    force = marker @ np.array(probe["marker_from_force"])
    tip = force @ np.array(probe["force_from_tip"])
    return {"camera": np.eye(4), "marker": marker, "force": force, "tip": tip}


def make_figure_4_12(inputs: Any, params: Any) -> Figure:
    """The figure, of one capture's poses."""
    (capture,) = params.captures
    return figure_4_12(
        read_table(inputs.pose),
        params.probe,
        params.sensor["color"],
        provenance=capture["provenance"],
    )


def figure_4_12(pose: pd.DataFrame, probe: Mapping, camera: Mapping, *, provenance: str) -> Figure:
    """Chain of transforms from the probe's tip to the camera, to scale (Fig. 4.12).

    Parameters
    ----------
    pose : DataFrame
        probe_pose.csv.
    probe : mapping
        The probe's file.
    camera : mapping
        ``color`` block of the sensor's file, for the field of view.
    provenance : str
    """
    frames = chain(pose, probe)
    figure = plt.figure(figsize=(PAGE_IN, 3.6))
    _chain_panel(figure.add_axes((0.03, 0.04, 0.53, 0.88)), frames, probe, camera)
    _probe_panel(figure.add_axes((0.6, 0.04, 0.39, 0.88)), frames, probe)
    label_provenance(figure, {provenance})
    return figure


def _chain_panel(
    axes: Axes, frames: Mapping[str, NDArray], probe: Mapping, camera: Mapping
) -> None:
    """Everything, from the camera to the tip."""
    view = _side_view(frames)
    _blank(axes, "From camera to tip", "a")
    _draw_camera(axes, camera, view)
    _draw_probe(axes, frames, probe, view)
    places = _origins(frames, view)
    _arrow(axes, places["camera"], places["tip"], lw=1.0, linestyle=(0, (4, 2)), color=BLACK)
    _arrow(axes, places["camera"], places["marker"])
    for name in ("camera", "marker", "tip"):
        _draw_frame(axes, frames[name], view)
    _name_transform(axes, frames, view, ("camera", "marker"), CHESSBOARD, (0, 12))
    _name_transform(axes, frames, view, ("camera", "tip"), f"{CHESSBOARD}{SENSOR}{TIP}", (6, -6))
    beside(axes, places["camera"], "camera", (0.16, 1), 21, weight="bold")
    _scale_bar(axes, places["tip"] + [0.1, 0], 0.100)
    axes.autoscale_view()


def _probe_panel(axes: Axes, frames: Mapping[str, NDArray], probe: Mapping) -> None:
    """The probe from nearby."""
    view = _side_view(frames)
    _blank(axes, "Probe", "b")
    _draw_probe(axes, frames, probe, view)
    places = _origins(frames, view)
    _arrow(axes, places["marker"], places["force"], connectionstyle="arc3,rad=-0.25")
    _arrow(axes, places["force"], places["tip"], connectionstyle="arc3,rad=0.6")
    for name in ("marker", "force", "tip"):
        _draw_frame(axes, frames[name], view)
    _name_transform(axes, frames, view, ("marker", "force"), SENSOR, (-30, -28))
    _name_transform(axes, frames, view, ("force", "tip"), TIP, (-26, -1))
    for name, words in (("force", "force sensor"), ("tip", "tip")):
        beside(axes, places[name], words, (1, 0), 44, weight="bold")
    beside(axes, places["marker"], "marker", (-0.4, 1), 32, weight="bold")
    radius = probe["indenter"]["radius_m"] * MILLIMETRES
    beside(axes, places["tip"], f"radius {radius:.2f} mm", (1, -0.22), 45, fontsize=SMALL)
    _scale_bar(axes, places["tip"] + [0.055, 0.031], 0.050)
    axes.autoscale_view()


def _scale_bar(axes: Axes, place: NDArray, length_m: float) -> None:
    """Scale of the parallel projection; the arrows are foreshortened and have their lengths."""
    axes.plot(place[0] + np.array([0, length_m]), [place[1]] * 2, color=BLACK, lw=2)
    middle = place + [length_m / 2, 0]
    text = f"{length_m * MILLIMETRES:.0f} mm, parallel to the page"
    beside(axes, middle, text, (0, -1), 8, fontsize=SMALL)


def _name_transform(
    axes: Axes,
    frames: Mapping[str, NDArray],
    view: NDArray,
    ends: tuple[str, str],
    symbol: str,
    offset: tuple[float, float],
) -> None:
    """Write a transform's symbol, what it takes where, and its length beside its middle."""
    first, second = (frames[name][:3, 3] for name in ends)
    length = np.linalg.norm(second - first) * MILLIMETRES
    text = f"{symbol}\n{ends[0]} from {ends[1]}\n{length:.0f} mm"
    axes.annotate(
        text,
        (first + second) @ view / 2,
        offset,
        textcoords="offset points",
        fontsize=7.5,
        ha="center" if offset[0] == 0 else "left" if offset[0] > 0 else "right",
        va="bottom" if offset[1] > 0 else "top",
    )


def _origins(frames: Mapping[str, NDArray], view: NDArray) -> dict[str, NDArray]:
    return {name: transform[:3, 3] @ view for name, transform in frames.items()}


def _arrow(axes: Axes, start: NDArray, stop: NDArray, **look) -> None:
    axes.annotate("", stop, start, arrowprops=CHAIN_ARROW | look)


def _side_view(frames: Mapping[str, NDArray]) -> NDArray:
    """Directions of the paper's right and up in the camera frame, as columns (3, 2).

    The probe stands upright and the camera is to its right; the reader stands beside the camera.
    """
    turn, tilt = np.radians([SIDE_DEG, ABOVE_DEG])
    up = -frames["tip"][:3, 2]
    ahead = frames["tip"][:3, 3] - (frames["tip"][:3, 3] @ up) * up
    ahead /= np.linalg.norm(ahead)
    look = np.sin(turn) * ahead + np.cos(turn) * np.cross(ahead, up)
    return np.column_stack([np.cross(look, up), np.cos(tilt) * up + np.sin(tilt) * look])


def _draw_camera(axes: Axes, camera: Mapping, view: NDArray) -> None:
    """Pyramid of the camera's field of view."""
    size = np.array([camera["width_px"], camera["height_px"]])
    focal = np.array([camera["fx_px"], camera["fy_px"]])
    centre = np.array([camera["cx_px"], camera["cy_px"]])
    corners = (np.array([[0, 0], [1, 0], [1, 1], [0, 1]]) * size - centre) / focal
    corners = CAMERA_M * np.column_stack([corners, np.ones(4)])
    for k in range(4):
        side = np.array([np.zeros(3), corners[k], corners[k - 1]])
        axes.add_patch(Polygon(side @ view, fc=GREY, alpha=0.18, ec=BLACK, lw=0.6))


def _draw_board(axes: Axes, transform: NDArray, marker: Mapping, view: NDArray) -> None:
    """Squares of the checkerboard; the outer one beside the origin is black."""
    columns, rows = np.array(marker["inner_corners"]) + 1
    for row, column in np.ndindex(rows, columns):
        x, y = np.array([column - 1, row - 1]) * marker["square_m"]
        corners = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]) * marker["square_m"]
        colour = "white" if (row + column) % 2 else "#555555"
        places = _moved(transform, corners + [x, y, 0])
        axes.add_patch(Polygon(places @ view, fc=colour, ec=GREY, lw=0.3))


def _draw_probe(axes: Axes, frames: Mapping[str, NDArray], probe: Mapping, view: NDArray) -> None:
    """Sphere at its radius, stem and sensor."""
    centre = frames["tip"][:3, 3] @ view
    along = [[0, 0, -HANDLE_M], [0, 0, 0], [0, 0, NANO25_LENGTH_M]]
    grip, top, face = _moved(frames["force"], np.array(along)) @ view
    axes.add_patch(Circle(centre, probe["indenter"]["radius_m"], fc="#B0B0B0", ec=BLACK, lw=0.7))
    _tube(axes, face, centre + [0, STEM_RADIUS_M], STEM_RADIUS_M, "#DDDDDD")
    _tube(axes, top, face, NANO25_RADIUS_M, "#EEEEEE")
    _tube(axes, grip, top, HANDLE_RADIUS_M, "#CFCFCF")
    _draw_board(axes, frames["marker"], probe["marker"], view)


def _tube(axes: Axes, top: NDArray, foot: NDArray, radius_m: float, colour: str) -> None:
    """Cylinder about the paper's vertical, seen from above."""
    look = {"fc": colour, "ec": BLACK, "lw": 0.6}
    size = 2 * radius_m * np.array([1, np.sin(np.radians(ABOVE_DEG))])
    aside = np.array([radius_m, 0])
    axes.add_patch(Ellipse(foot, *size, **look))
    axes.add_patch(Polygon([top - aside, foot - aside, foot + aside, top + aside], fc=colour))
    for side in (aside, -aside):
        axes.plot(*np.transpose([top + side, foot + side]), color=BLACK, lw=0.6, zorder=1)
    axes.add_patch(Ellipse(top, *size, **look))


def _draw_frame(axes: Axes, transform: NDArray, view: NDArray) -> None:
    """Axes of a frame."""
    origin = transform[:3, 3] @ view
    for k, (name, colour) in enumerate(zip("xyz", (ORANGE, GREEN, BLUE), strict=True)):
        end = (transform[:3, 3] + FRAME_M * transform[:3, k]) @ view
        axes.annotate("", end, origin, arrowprops=ARROW | {"color": colour, "lw": 1.2})
        axes.update_datalim([end])
        look = {"color": colour, "fontsize": SMALL, "path_effects": [HALO, Normal()]}
        beside(axes, end, f"${name}$", end - origin, 4, **look)


def _moved(transform: NDArray, points_m: NDArray) -> NDArray:
    return points_m @ transform[:3, :3].T + transform[:3, 3]


def _blank(axes: Axes, title: str, letter: str) -> None:
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_axis_off()
    entitle(axes, title, letter)
