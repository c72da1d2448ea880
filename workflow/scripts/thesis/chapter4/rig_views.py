"""Figure 4.7: each sensor before the study's block, as its placement is configured."""

from collections.abc import Mapping, Sequence
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Polygon
from matplotlib.patheffects import Normal
from numpy.typing import NDArray
from palpate.report.style import (
    BLACK,
    BLUE,
    ORANGE,
    PAGE_IN,
    SMALL,
    beside,
    entitle,
    label_provenance,
    sensor_name,
)
from palpate.report.views import View, render_surface
from palpate.units import MILLIMETRES
from palpate.vision.camera import camera_from_spec

from thesis.chapter4.rig_parts import Shape, box, joined, probe_shape, sensor_shape
from thesis.chapter4.transform_chain import HALO

PIXELS_PER_MM = 1.1
# The drawn field of view goes so far, in distances of the target.
REACH = 1.12
SIDE = View(-24, 17)
TABLE_M, TABLE_THICKNESS_M = (0.85, 0.78), 0.015
TABLE, FOAM = "#D9CBB8", "#7E93B8"
# The probe stands upright on the object: the force frame's z points down.
UPRIGHT = np.diag([1.0, -1.0, -1.0])


def make_figure_4_7(inputs: Any, params: Any) -> Figure:
    """The figure, of the lab's placements."""
    return figure_4_7(params.setups, provenance="simulated")


def figure_4_7(setups: Sequence[Mapping], *, provenance: str) -> Figure:
    """Capture setup of each sensor, to scale (Fig. 4.7).

    Parameters
    ----------
    setups : sequence of mapping
        Of each sensor ``sensor`` (its file), ``probe`` (its file), ``size_m`` of the block,
        ``point_m`` that is pressed, and ``placement`` (``target_m``, ``distance_m``,
        ``elevation_deg``).
    provenance : str

    Raises
    ------
    ValueError
        If there is no setup.
    """
    if not setups:
        raise ValueError("setups: expected at least one sensor, found none")
    frame = _common_frame(setups)
    height = 0.5 * PAGE_IN * (frame[3] - frame[2]) / (frame[1] - frame[0])
    figure = plt.figure(figsize=(PAGE_IN, height + 0.4))
    share = height / (height + 0.4)
    for k, setup in enumerate(setups):
        place = (k / len(setups) + 0.025, 0.02, 1 / len(setups) - 0.03, share)
        axes = figure.add_axes(place)
        _draw_setup(axes, setup, frame)
        entitle(axes, sensor_name(setup["sensor"]["sensor"]), "abcdef"[k])
    label_provenance(figure, {provenance})
    return figure


def camera_pose(placement: Mapping) -> NDArray:
    """Pose of a level camera in front of the object that looks at its target, shape (4, 4).

    Axes are right, down and ahead; the camera stands on the side y < 0 of the object frame.
    """
    elevation = np.deg2rad(placement["elevation_deg"])
    ahead = np.array([0.0, np.cos(elevation), -np.sin(elevation)])
    right = np.array([1.0, 0.0, 0.0])
    pose = np.eye(4)
    pose[:3, :3] = np.column_stack([right, np.cross(ahead, right), ahead])
    pose[:3, 3] = np.array(placement["target_m"]) - placement["distance_m"] * ahead
    return pose


def frustum(camera: Mapping, pose: NDArray, reach_m: float) -> NDArray:
    """Centre of a camera and the corners of its field of view, shape (5, 3) [m].

    Each corner's ray ends on the table, z = 0, or else at a depth of ``reach_m``.
    """
    optics = camera_from_spec(dict(camera) | {"distortion": [0.0] * 5})
    width, height = optics.width_px, optics.height_px
    rays = optics.rays([[0, 0], [width, 0], [width, height], [0, height]]) @ pose[:3, :3].T
    down = np.maximum(-rays[:, 2], 1e-9)
    depth = np.minimum(pose[2, 3] / down, reach_m)
    return pose[:3, 3] + np.vstack([np.zeros(3), depth[:, None] * rays])


def eyes(sensor: Mapping, pose: NDArray) -> dict[str, tuple[Mapping, NDArray]]:
    """Cameras of a sensor by name: optics and pose, the reference camera's first."""
    if sensor["kind"] == "stereo":
        aside = np.eye(4)
        aside[0, 3] = sensor["stereo"]["baseline_m"]
        return {"left": (sensor["color"], pose), "right": (sensor["color"], pose @ aside)}
    depth = sensor["depth"]
    return {
        "colour": (sensor["color"], pose),
        "infrared": (depth, pose @ np.array(depth["color_from_depth"])),
    }


def probe_on(probe: Mapping, point_m: Sequence[float]) -> Shape:
    """The probe whose sphere touches a point of the object from above."""
    place = np.eye(4)
    place[:3, :3] = UPRIGHT
    tip = np.array(point_m) + [0, 0, probe["indenter"]["radius_m"]]
    place[:3, 3] = tip - UPRIGHT @ np.array(probe["force_from_tip"])[:3, 3]
    return probe_shape(probe).moved(place)


def _scene(setup: Mapping) -> Shape:
    """Table, block, probe and sensor."""
    size = np.array(setup["size_m"])
    table = (*TABLE_M, TABLE_THICKNESS_M)
    housing, _ = sensor_shape(setup["sensor"])
    return joined(
        [
            box(table, (0, 0, -TABLE_THICKNESS_M / 2), TABLE),
            box(size, (0, 0, size[2] / 2), FOAM),
            probe_on(setup["probe"], setup["point_m"]),
            housing.moved(camera_pose(setup["placement"])),
        ]
    )


def _common_frame(setups: Sequence[Mapping]) -> NDArray:
    """One frame for all setups, so that they have one scale."""
    frames = np.array([SIDE.frame(_scene(setup).vertices_m, margin=0.05) for setup in setups])
    low, high = frames.min(axis=0), frames.max(axis=0)
    return np.array([low[0], high[1], low[2], high[3]])


def _draw_setup(axes: Axes, setup: Mapping, frame: NDArray) -> None:
    scene, pose = _scene(setup), camera_pose(setup["placement"])
    picture = render_surface(
        scene.vertices_m,
        scene.faces,
        SIDE,
        frame,
        width_px=int(PIXELS_PER_MM * (frame[1] - frame[0])),
        colours=scene.colours,
    )
    axes.imshow(picture, extent=tuple(frame), interpolation="antialiased")
    axes.set_axis_off()
    depth = setup["placement"]["distance_m"]
    for (name, (camera, place)), colour in zip(
        eyes(setup["sensor"], pose).items(), (BLUE, ORANGE), strict=True
    ):
        _draw_frustum(axes, frustum(camera, place, REACH * depth), name, colour)
    _draw_distance(axes, pose, setup["placement"])
    _name_things(axes, setup)
    _scale_bar(axes, frame)
    axes.set(xlim=frame[:2], ylim=frame[2:])


def _draw_frustum(axes: Axes, corners: NDArray, name: str, colour: str) -> None:
    flat = SIDE.project(corners)[:, :2]
    for k in range(1, 5):
        axes.plot(*flat[[0, k]].T, color=colour, lw=0.7, alpha=0.8)
    axes.add_patch(Polygon(flat[1:], fc=colour, alpha=0.10, ec="none"))
    axes.add_patch(Polygon(flat[1:], fc="none", ec=colour, lw=0.9, label=f"{name} camera's view"))
    axes.legend(loc="upper right", fontsize=SMALL, handlelength=1.2, borderaxespad=0.1)


def _draw_distance(axes: Axes, pose: NDArray, placement: Mapping) -> None:
    """From the reference camera to what it looks at."""
    ends = SIDE.project(np.array([pose[:3, 3], placement["target_m"]]))[:, :2]
    axes.plot(*ends.T, color=BLACK, lw=1.1, ls=(0, (5, 2)))
    axes.plot(*ends[1], "o", color=BLACK, ms=2.5)
    text = f"{placement['distance_m']:.2f} m,\n{placement['elevation_deg']:g}° down"
    halo = {"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 0.6}
    beside(axes, ends.mean(axis=0), text, (0, 1), 0, fontsize=7, bbox=halo)


def _name_things(axes: Axes, setup: Mapping) -> None:
    length, _, height = setup["size_m"]
    probe = probe_on(setup["probe"], setup["point_m"]).vertices_m
    top = probe[probe[:, 2].argmax()]
    block = f"foam block,\n{length * MILLIMETRES:.0f} mm long"
    names = {
        block: ((0.5 * length, 0.0, height / 2), (1, 0.3), 16),
        "probe": (top, (0.6, 1), 8),
    }
    for text, (place, side, away) in names.items():
        flat = SIDE.project(np.array([place]))[0, :2]
        beside(axes, flat, text, side, away, fontsize=7, path_effects=[HALO, Normal()])


def _scale_bar(axes: Axes, frame: NDArray) -> None:
    right, low = frame[1] - 30, frame[2] + 25
    axes.plot([right - 200, right], [low, low], color=BLACK, lw=2)
    axes.text(right - 100, low + 12, "200 mm", ha="center", va="bottom", fontsize=SMALL)
