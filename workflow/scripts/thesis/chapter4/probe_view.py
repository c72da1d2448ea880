"""Figure 4.5: the force sensor with its handle, sphere and board."""

from collections.abc import Mapping
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray
from palpate.report.style import ARROW, BLACK, PAGE_IN, SMALL, beside, entitle
from palpate.report.views import View, render_surface
from palpate.units import MILLIMETRES

from thesis.chapter4.rig_parts import Shape, board_shape, probe_shape
from thesis.chapter4.transform_chain import (
    HANDLE_M,
    NANO25_LENGTH_M,
    NANO25_RADIUS_M,
)

PIXELS_PER_MM = 4.0
# The force frame's z points to the sphere: the probe is shown standing on it.
UPRIGHT = np.diag([1.0, -1.0, -1.0, 1.0])
OBLIQUE = View(-128, 22)
BOTH_WAYS = ARROW | {"arrowstyle": "<|-|>,head_width=0.14,head_length=0.28", "lw": 0.7}


def make_figure_4_5(inputs: Any, params: Any) -> Figure:
    """The figure, of a probe's file."""
    return figure_4_5(params.probe)


def figure_4_5(probe: Mapping) -> Figure:
    """Force sensor with handle and spherical indenter, with its configured sizes (Fig. 4.5).

    Parameters
    ----------
    probe : mapping
        The probe's file.
    """
    shape = probe_shape(probe).moved(UPRIGHT)
    side = side_view(probe)
    figure = plt.figure(figsize=(PAGE_IN, 3.9))
    left = figure.add_axes((0.05, 0.02, 0.4, 0.88))
    right = figure.add_axes((0.46, 0.02, 0.53, 0.88))
    _draw(left, shape, OBLIQUE)
    _name_parts(left, probe)
    _draw(right, shape, side)
    _measure(right, probe, side)
    for axes, title, letter in ((left, "Parts", "a"), (right, "Sizes, seen from the side", "b")):
        axes.set_aspect("equal", adjustable="datalim")
        axes.set_axis_off()
        entitle(axes, title, letter)
    return figure


def side_view(probe: Mapping) -> View:
    """View along the board's edge, so that its lean shows: parallel to its x axis."""
    edge = (UPRIGHT @ np.linalg.inv(probe["marker_from_force"]))[:3, 0]
    return View(float(np.rad2deg(np.arctan2(edge[1], edge[0]))), 0.0)


def lean_deg(probe: Mapping) -> float:
    """Angle between the board's face and the probe's axis [deg]."""
    normal = np.linalg.inv(probe["marker_from_force"])[:3, 2]
    return float(np.rad2deg(np.arcsin(abs(normal[2]))))


def _draw(axes: Axes, shape: Shape, view: View) -> None:
    frame = view.frame(shape.vertices_m, margin=0.02)
    picture = render_surface(
        shape.vertices_m,
        shape.faces,
        view,
        frame,
        width_px=int(PIXELS_PER_MM * (frame[1] - frame[0])),
        colours=shape.colours,
    )
    axes.imshow(picture, extent=tuple(frame), interpolation="antialiased", zorder=1)
    axes.set(xlim=frame[:2], ylim=frame[2:])


def _name_parts(axes: Axes, probe: Mapping) -> None:
    """Names beside the parts, with thin lines to them."""
    tip = np.array(probe["force_from_tip"])[2, 3]
    board = board_shape(probe["marker"]).vertices_m.mean(axis=0)
    board = np.linalg.inv(probe["marker_from_force"])[:3] @ [*board, 1.0]
    columns, rows = np.array(probe["marker"]["inner_corners"]) + 1
    side = probe["marker"]["square_m"] * MILLIMETRES
    parts = {
        "handle": (np.array([0, 0, -0.17 * HANDLE_M]), 0.44),
        f"checkerboard\n{columns} × {rows} squares of {side:.0f} mm": (board, 0.72),
        "force/torque sensor\nATI Nano25": (np.array([0, 0, NANO25_LENGTH_M / 2]), 0.24),
        "spherical indenter": (np.array([0, 0, tip]), 0.06),
    }
    (left, right), (low, high) = axes.get_xlim(), axes.get_ylim()
    axes.set_xlim(left - 5, right + 0.95 * (right - left))
    for text, (place, height) in parts.items():
        flat = OBLIQUE.project((UPRIGHT[:3, :3] @ place)[None])[0, :2]
        end = np.array([right + 0.07 * (right - left), low + height * (high - low)])
        axes.plot(*np.transpose([flat, end]), color=BLACK, lw=0.7)
        axes.plot(*flat, "o", color=BLACK, mec="white", mew=0.6, ms=3.4)
        axes.text(*(end + [2, 0]), text, va="center", fontsize=7.5)


def _measure(axes: Axes, probe: Mapping, view: View) -> None:
    """Dimension lines of what the probe's file and the sensor's data sheet give."""
    tip = np.array(probe["force_from_tip"])[2, 3] * MILLIMETRES
    radius, sensor = probe["indenter"]["radius_m"] * MILLIMETRES, NANO25_LENGTH_M * MILLIMETRES
    (left, right), (low, high) = axes.get_xlim(), axes.get_ylim()
    free = _free_side(probe, view)
    wide = NANO25_RADIUS_M * MILLIMETRES
    near, far = free * (wide + 12), free * (wide + 52)
    _upright(axes, near, -sensor, 0.0, f"{sensor:.1f} mm", free)
    _upright(axes, near, -tip, -sensor, f"{tip - sensor:.1f} mm", free)
    _upright(axes, far, -tip, 0.0, f"{tip:.0f} mm to\nthe sphere's\ncentre", free)
    _upright(axes, near, 0.0, HANDLE_M * MILLIMETRES, "handle\n(sketched)", free)
    for height in (0.0, -sensor, -tip):
        axes.plot([0, far], [height, height], color=BLACK, lw=0.4, ls=(0, (4, 3)), zorder=0)
    words = f"sphere, radius {radius:.2f} mm"
    beside(axes, (-free * radius, -tip), words, (-free, -0.15), 6, fontsize=7)
    words = f"diameter {2 * wide:.0f} mm"
    beside(axes, (-free * wide, -0.62 * sensor), words, (-free, -0.1), 6, fontsize=7)
    _measure_board(axes, probe, view)
    ends = left - 26, max(right, abs(far) + 30)
    axes.set_xlim(ends if free > 0 else (-ends[1], right + 26))
    axes.set_ylim(low - 8, high + 4)
    axes.text(
        0.0,
        0.0,
        "sensor after its data sheet; handle and stem sketched",
        transform=axes.transAxes,
        fontsize=SMALL,
        color="0.35",
        va="bottom",
    )


def _free_side(probe: Mapping, view: View) -> int:
    """Side of the picture, 1 right or -1 left, on which the board is not."""
    return -1 if _board_ends(probe, view)[:, 0].mean() > 0 else 1


def _board_ends(probe: Mapping, view: View) -> NDArray:
    """Ends of the board's squares in the side view, shape (2, 2) [mm]."""
    marker = probe["marker"]
    rows = marker["inner_corners"][1] + 1
    ends = np.array([[0, -1, 0, 1], [0, rows - 1, 0, 1.0]])
    ends[:, :3] *= marker["square_m"]
    flat = (UPRIGHT @ np.linalg.inv(probe["marker_from_force"]) @ ends.T).T[:, :3]
    return view.project(flat)[:, :2]


def _measure_board(axes: Axes, probe: Mapping, view: View) -> None:
    ends = _board_ends(probe, view)
    side = np.sign(ends[:, 0].mean())
    along = (ends[1] - ends[0]) / np.linalg.norm(ends[1] - ends[0])
    across = np.array([-along[1], along[0]])
    across *= side * np.sign(across[0]) * 9
    axes.annotate("", ends[1] + across, ends[0] + across, arrowprops=BOTH_WAYS)
    text = f"board {np.linalg.norm(ends[1] - ends[0]):.0f} mm,\nleans {lean_deg(probe):.0f}°"
    beside(axes, ends.mean(axis=0) + across, text, across, 4, fontsize=7)


def _upright(axes: Axes, x: float, low: float, high: float, text: str, side: int) -> None:
    axes.annotate("", (x, high), (x, low), arrowprops=BOTH_WAYS)
    beside(axes, (x, (low + high) / 2), text, (side, 0), 5, fontsize=7)
