"""Rigid alignment that may slide along an object, with and without what holds it (Fig. 5.6)."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from palpate.study.style import BLACK, BLUE, GREEN, GREY, ORANGE, SMALL, label_provenance
from palpate.study.tracking_panels import cloud_panel, named, panels, scale_bar
from palpate.study.tracking_views import MILLIMETRES, View
from palpate.surface.pose import CONVERGED_M, nearest_step, to_camera, to_object
from palpate.surface.template import Template

STEPS = 200
BAR_ROOM_MM = 35


@dataclass(frozen=True)
class Slides:
    """Where alignments end that start shifted along the object.

    Attributes
    ----------
    shifts_m : (k,) array
        Along the object's x axis, of the first pose from the right one [m].
    left_m : dict of str to (k,) array
        How far each way of aligning is from the right pose in the end [m].
    """

    shifts_m: NDArray
    left_m: Mapping[str, NDArray]


def align_to_nearest(
    template: Template,
    cloud_m: NDArray,
    normals: NDArray,
    pose: NDArray,
    *,
    largest_distance_m: float,
    largest_normal_deg: float,
) -> NDArray:
    """Minimise Eq. 4.24 alone: from template vertices to their nearest points, nothing else.

    Parameters
    ----------
    template : Template
    cloud_m, normals : (n, 3) arrays
        Cloud [m] and unit normals, camera frame.
    pose : (4, 4) array
        First camera_from_object.
    largest_distance_m, largest_normal_deg : float
        dr and the angle threshold.

    Returns
    -------
    (4, 4) array

    Raises
    ------
    ValueError
        If hardly a vertex has a point near it.
    """
    tree, least = cKDTree(cloud_m), float(np.cos(np.deg2rad(largest_normal_deg)))
    for _ in range(STEPS):
        pose, moved_m = nearest_step(template, pose, tree, normals, largest_distance_m, least)
        if np.isnan(moved_m):
            raise ValueError("cloud_m: expected points near the template, found hardly any")
        if moved_m < CONVERGED_M:
            break
    return pose


def shifted(pose: NDArray, along_m: float) -> NDArray:
    """A pose whose object stands farther along its own x axis [m]."""
    step = np.eye(4)
    step[0, 3] = along_m
    return pose @ step


def slide(pose: NDArray, right: NDArray, point_m: NDArray) -> float:
    """How far a pose takes a point of the object along x from where the right one does [m]."""
    return float(to_object(right, to_camera(pose, point_m[None]))[0, 0] - point_m[0])


def without_ends(points_m: NDArray, *, low_m: float, high_m: float) -> NDArray:
    """Points of the object frame between two places along x, (n,) bool array."""
    return (points_m[:, 0] > low_m) & (points_m[:, 0] < high_m)


def figure_5_6(
    capture: Mapping,
    template: Template,
    slid: Sequence[tuple[str, NDArray, NDArray]],
    slides: Slides,
    *,
    note: str,
) -> Figure:
    """Cloud on the template where alignments end, and how far they are off (Fig. 5.6).

    Parameters
    ----------
    capture : mapping
    template : Template
        Object frame.
    slid : sequence of (title, cloud (n, 3), added (k, 3))
        Cloud and added points as each alignment places them in the object frame [m].
    slides : Slides
    note : str
        What was cut and shifted.
    """
    rows = len(slid)
    figure, axes = panels(rows, 2, 1.35 * rows + 0.75, widths=[1.75, 1], wspace=0.28)
    view = View(-90, 55)
    clouds = [np.vstack(part[1:]) for part in slid]
    frame = view.frame(template.vertices_m, *clouds) - [0, 0, BAR_ROOM_MM, 0]
    for panel, letter, (title, cloud, added) in zip(axes[:, 0], "abcdef", slid, strict=False):
        groups = [(cloud, BLUE, 0.8), (added, ORANGE, 1.5)]
        cloud_panel(panel, groups, view, frame)
        flat = view.project(template.vertices_m)
        panel.plot(*flat[:, :2].T, ".", ms=1.1, color=BLACK, zorder=3)
        scale_bar(panel, 100, frame)
        named(panel, letter, title)
    for panel in axes[1:, 1]:
        panel.remove()
    chart = axes[0, 1]
    chart.set_position(_tall(axes[0, 1], axes[-1, 1]))
    colours = (ORANGE, GREY, GREEN, BLUE)
    lines = zip(slides.left_m.items(), colours, ("o", "s", "^", "D"), strict=False)
    for (name, left), colour, mark in lines:
        chart.plot(slides.shifts_m * MILLIMETRES, left * MILLIMETRES, color=colour, marker=mark,
                   ms=3.2, lw=1.0, label=name)  # fmt: skip
    chart.axhline(0, color=BLACK, lw=0.5, zorder=0)
    chart.set(xlabel="First pose shifted along the block (mm)", ylabel="Slide in the end (mm)")
    chart.legend(loc="upper left", fontsize=SMALL, handlelength=1.3)
    low, high = chart.get_ylim()
    chart.set_ylim(low, high + 0.22 * (high - low))
    named(chart, "abcdef"[rows], "slide")
    figure.text(0.02, 0.012, note, fontsize=SMALL)
    label_provenance(figure, {capture["provenance"]})
    return figure


def _tall(upper, lower):
    """Place of a panel over the whole column."""
    high, low = upper.get_position(), lower.get_position()
    return (high.x0, low.y0 + 0.03, high.width, high.y1 - low.y0 - 0.03)
