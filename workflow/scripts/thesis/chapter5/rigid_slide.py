"""Rigid alignment that may slide along an object, with and without what holds it (Fig. 5.6)."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from palpate.report.panels import cloud_panel, named, panels, scale_bar
from palpate.report.style import BLACK, BLUE, GREEN, GREY, ORANGE, SMALL, label_provenance
from palpate.report.views import MILLIMETRES, View
from palpate.surface.alignment import resting_prior
from palpate.surface.options import Aligning
from palpate.surface.pose import (
    CONVERGED_M,
    RestingPrior,
    align_rigidly,
    nearest_step,
    to_camera,
    to_object,
)
from palpate.surface.template import Template, refine_template, vertex_normals
from palpate.surface.tracked import Recorded
from palpate.vision.support_plane import read_plane
from palpate.yaml_files import load_yaml
from scipy.spatial import cKDTree

from thesis.chapter5.tracking_inputs import last_frames, recordings_of
from thesis.tracker.capture import undeformed_points

STEPS = 200
BAR_ROOM_MM = 35
# Of the first pose along the block, and the one whose ends the panels show.
SHIFTS_M = np.array([-60, -40, -20, -10, 0, 10, 20, 40, 60]) / 1000
SHOWN_M = 0.040
# Of the cloud is kept what lies this far from the block's end.
KEPT_M = (0.030, 0.230)
REACH_M, WHOLE_M, SPACING_M = 0.040, 1.0, 0.006
ALONE, WHOLE, ADDED, HELD = (
    "Eq. 4.24, cut cloud",
    "Eq. 4.24, whole cloud",
    "Eq. 4.24, cut cloud + added",
    "with table and touch",
)
TITLES = {
    ALONE: "Eq. 4.24 alone",
    ADDED: "with added points (orange)",
    HELD: "with table and touched point",
}
NOTE = (
    f"Cloud cut to {1e3 * KEPT_M[0]:g} to {1e3 * KEPT_M[1]:g} mm from the block's end;"
    f" a, b, c: first pose shifted {1e3 * SHOWN_M:g} mm; black: template.\n"
    "Each vertex pairs with the nearest point within"
)


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


@dataclass(frozen=True)
class Way:
    """A way to align.

    Attributes
    ----------
    align : callable
        From the first camera_from_object to the last.
    cloud_m, added_m : (n, 3) and (k, 3) arrays
        Captured and added points that it places, camera frame [m].
    """

    align: Callable[[NDArray], NDArray]
    cloud_m: NDArray
    added_m: NDArray


def make_figure_5_6(inputs: Any, params: Any) -> Figure:
    """The cut cloud of a point at the block's end, aligned from shifted poses."""
    recorded, frame = recordings_of(inputs, params.probes)[0], last_frames(inputs)[0]
    options = Aligning.read(params.options)
    known = _resting(inputs, recorded, params.captures[0]["point"])
    ways = ways_of(recorded, frame, known, options)
    right = recorded.alignment.camera_from_object
    left = {name: np.array([_slid(w, right, s) for s in SHIFTS_M]) for name, w in ways.items()}
    shown = [_shown(title, ways[name], right) for name, title in TITLES.items()]
    slides, note = Slides(SHIFTS_M, left), _note(options)
    return figure_5_6(params.captures[0], recorded.template, shown, slides, note=note)


def ways_of(
    recorded: Recorded, frame: int, known: RestingPrior, options: Aligning
) -> dict[str, Way]:
    """Ways to align a frame's cloud, by name.

    Parameters
    ----------
    recorded : Recorded
    frame : int
    known : RestingPrior
        What table and touched point tell of the object's place.
    options : Aligning
    """
    template, none = recorded.template, np.zeros((0, 3))
    (whole, normals), added = recorded.clouds[frame], added_places(recorded)
    kept = _kept(recorded, whole)
    cut = whole[kept], normals[kept]
    more = tuple(np.vstack(pair) for pair in zip(cut, added, strict=True))
    within = {
        "largest_distance_m": options.largest_distance_m,
        "largest_normal_deg": options.largest_normal_deg,
    }
    nearest = partial(align_to_nearest, template, **within)
    held = partial(align_rigidly, template, *cut, options=options, resting=known)
    return {
        ALONE: Way(partial(nearest, *cut), cut[0], none),
        WHOLE: Way(partial(nearest, whole, normals), whole, none),
        ADDED: Way(partial(nearest, *more), cut[0], added[0]),
        HELD: Way(held, cut[0], none),
    }


def added_places(recorded: Recorded) -> tuple[NDArray, NDArray]:
    """Points of the template that no camera sees and no press reaches, and their normals.

    As close as a cloud's: the template's own vertices would lock it at multiples of its edges.
    """
    alignment = recorded.alignment
    template = refine_template(
        recorded.template, alignment.contact_point_m, radius_m=WHOLE_M, edge_m=SPACING_M
    )
    rest = to_camera(alignment.camera_from_object, template.vertices_m)
    contact = to_camera(alignment.camera_from_object, alignment.contact_point_m)
    still = undeformed_points(rest, recorded.clouds[0][0], contact, reach_m=REACH_M)
    return rest[still], vertex_normals(rest, template.faces)[still]


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


def _resting(inputs: Any, recorded: Recorded, point: str) -> RestingPrior:
    """What table and touched point tell of the block's place."""
    declared = load_yaml(inputs.object[0])["points"][point]
    plane = read_plane(inputs.planes[0])
    frame = recorded.alignment.contact_frame
    touch = recorded.tips_m, frame, frame
    radius = recorded.indenter_radius_m
    known = recorded.template, recorded.support, declared, plane
    return resting_prior(*known, *touch, indenter_radius_m=radius)


def _kept(recorded: Recorded, cloud_m: NDArray) -> NDArray:
    """Which points of a cloud lie within the kept part of the block."""
    end = recorded.template.vertices_m[:, 0].max()
    placed = to_object(recorded.alignment.camera_from_object, cloud_m)
    return without_ends(placed, low_m=end - KEPT_M[1], high_m=end - KEPT_M[0])


def _slid(way: Way, right: NDArray, shift_m: float) -> float:
    """How far off an alignment ends that starts shifted [m]."""
    return slide(way.align(shifted(right, shift_m)), right, np.zeros(3))


def _shown(title: str, way: Way, right: NDArray) -> tuple[str, NDArray, NDArray]:
    """Panel of a way: how far it slid, and where it places the points."""
    pose = way.align(shifted(right, SHOWN_M))
    slid = 1e3 * slide(pose, right, np.zeros(3))
    cloud, added = (to_object(pose, points) for points in (way.cloud_m, way.added_m))
    return f"{title}: slid {slid:+.1f} mm", cloud, added


def _note(options: Aligning) -> str:
    """What was cut, shifted and sought, in words under the figure."""
    reach = f" dr = {1e3 * options.largest_distance_m:g} mm"
    return f"{NOTE}{reach}: on flat faces any shift stays, with added points too."


def _tall(upper, lower):
    """Place of a panel over the whole column."""
    high, low = upper.get_position(), lower.get_position()
    return (high.x0, low.y0 + 0.03, high.width, high.y1 - low.y0 - 0.03)
