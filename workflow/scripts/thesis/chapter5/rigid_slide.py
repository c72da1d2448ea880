"""Rigid alignment that may slide along an object, with and without what holds it (Fig. 5.6)."""

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from palpate.report.panels import named
from palpate.report.style import BLACK, BLUE, GREEN, GREY, ORANGE, SMALL
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
from palpate.units import MILLIMETRES
from palpate.vision.support_plane import read_plane
from palpate.yaml_files import load_yaml
from scipy.spatial import cKDTree

from thesis.chapter5.tracking_inputs import last_frames, recordings_of
from thesis.diagrams import labelled
from thesis.panels import cloud_panel, panels, scale_bar
from thesis.tracker.capture import undeformed_points
from thesis.views import View

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
    "Each vertex pairs with the nearest point within dr = {dr_mm:g} mm: on flat faces any shift"
    " stays, with added points too."
)


def _cases(
    recorded: Recorded, frame: int, known: RestingPrior, options: Aligning
) -> dict[str, tuple[Callable, NDArray, NDArray]]:
    """Alignments of a frame's cloud by name: from first pose to last, points, added points [m]."""
    template, none = recorded.template, np.zeros((0, 3))
    (whole, normals), added = recorded.clouds[frame], _added_places(recorded)
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
        ALONE: (partial(nearest, *cut), cut[0], none),
        WHOLE: (partial(nearest, whole, normals), whole, none),
        ADDED: (partial(nearest, *more), cut[0], added[0]),
        HELD: (held, cut[0], none),
    }


def _added_places(recorded: Recorded) -> tuple[NDArray, NDArray]:
    """Points of the template that no camera sees and no indentation reaches, and their normals."""
    # As close as a cloud's: the template's own vertices would lock it at multiples of its edges.
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


def slide(pose: NDArray, right: NDArray) -> float:
    """How far a pose takes the object along its x from where the right one does [m]."""
    return float(to_object(right, pose[None, :3, 3])[0, 0])


def figure_5_6(inputs: Any, params: Any) -> Figure:
    """Cloud of a point at the block's end where alignments end, and their slides (Fig. 5.6)."""
    recorded, frame = recordings_of(inputs, params.probes)[0], last_frames(inputs)[0]
    options, template = Aligning.read(params.options), recorded.template
    known = _resting(inputs, recorded, params.captures[0]["point"])
    cases = _cases(recorded, frame, known, options)
    right = recorded.alignment.camera_from_object
    slid = [_shown(title, cases[name], right) for name, title in TITLES.items()]
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
        scale_bar(panel, 100)
        named(panel, letter, title)
    for panel in axes[1:, 1]:
        panel.remove()
    chart = axes[0, 1]
    high, low = chart.get_position(), axes[-1, 1].get_position()
    chart.set_position((high.x0, low.y0 + 0.03, high.width, high.y1 - low.y0 - 0.03))
    looks = zip(cases.items(), (ORANGE, GREY, GREEN, BLUE), "os^D", strict=True)
    for (name, (align, *_)), colour, mark in looks:
        left_m = np.array([slide(align(shifted(right, shift)), right) for shift in SHIFTS_M])
        look = {"color": colour, "marker": mark, "ms": 3.2, "lw": 1.0, "label": name}
        chart.plot(SHIFTS_M * MILLIMETRES, left_m * MILLIMETRES, **look)
    chart.axhline(0, color=BLACK, lw=0.5, zorder=0)
    chart.set(xlabel="First pose shifted along the block (mm)", ylabel="Slide in the end (mm)")
    chart.legend(loc="upper left", fontsize=SMALL, handlelength=1.3)
    low, high = chart.get_ylim()
    chart.set_ylim(low, high + 0.22 * (high - low))
    named(chart, "abcdef"[rows], "slide")
    dr_mm = options.largest_distance_m * MILLIMETRES
    figure.text(0.02, 0.012, NOTE.format(dr_mm=dr_mm), fontsize=SMALL)
    return labelled(figure, params)


def _resting(inputs: Any, recorded: Recorded, point: str) -> RestingPrior:
    """What table and touched point say of the block's place."""
    declared = load_yaml(inputs.object[0])["points"][point]
    plane = read_plane(inputs.planes[0])
    known, frame = recorded.indenter_radius_m, recorded.alignment.contact_frame
    placed = recorded.template, recorded.support, declared, plane, recorded.tips_m
    return resting_prior(*placed, frame, frame, indenter_radius_m=known)


def _kept(recorded: Recorded, cloud_m: NDArray) -> NDArray:
    """Which points of a cloud lie within the kept part of the block."""
    end = recorded.template.vertices_m[:, 0].max()
    x = to_object(recorded.alignment.camera_from_object, cloud_m)[:, 0]
    return (x > end - KEPT_M[1]) & (x < end - KEPT_M[0])


def _shown(title: str, case: tuple, right: NDArray) -> tuple[str, NDArray, NDArray]:
    """Panel of an alignment: how far it slid, and where it places the points."""
    align, *clouds = case
    pose = align(shifted(right, SHOWN_M))
    cloud, added = (to_object(pose, points) for points in clouds)
    return f"{title}: slid {1e3 * slide(pose, right):+.1f} mm", cloud, added
