"""Views of the rig as configured: devices (4.1), probe (4.5), setup (4.7), transforms (4.12)."""

from collections.abc import Mapping
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import trimesh
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Polygon, Rectangle
from matplotlib.patheffects import Normal, Stroke
from numpy.typing import NDArray
from palpate.capture.tables import read_table
from palpate.report import style
from palpate.units import MILLIMETRES

from thesis.chapter4 import rig
from thesis.diagrams import (
    BOTH_WAYS,
    DASHED,
    TEXT_PT,
    Sketch,
    blank,
    dimension,
    labelled,
    leader,
    write,
)
from thesis.panels import scale_bar
from thesis.views import View

# From a device's axes (right, down, ahead) to axes with z up; the reader stands before it.
STANDING = np.array([[-1.0, 0, 0], [0, 0, -1.0], [0, -1.0, 0]])
FRONT, OBLIQUE, ASIDE, BESIDE = View(-72, 14), View(-128, 22), View(-24, 17), View(140, 34)
KINDS = {"stereo": "stereo pair", "structured_light": "dot pattern", "laser": "light section"}
# Plans end here [m]; fields of view of Figure 4.7 go so far, in distances of the target.
PLAN_M, REACH = 1.25, 1.12
TABLE_M, TABLE, FOAM = (0.85, 0.78, 0.015), "#D9CBB8", "#7E93B8"
FRAME_M, CAMERA_M = 0.035, 0.09
CHAIN = {"lw": 1.6, "arrowstyle": "-|>,head_width=0.25,head_length=0.5"}
CHAIN |= {"path_effects": [Stroke(linewidth=3.2, foreground="white"), Normal()]}
CHESSBOARD, SENSOR, TIP = (
    rf"$\mathbf{{T}}_{{\mathrm{{{name}}}}}$" for name in ("Chessboard", "Sensor", "Tip")
)


def figure_4_1(inputs: Any, params: Any) -> Figure:
    """Three depth devices, their optics and fields of view, as configured (Fig. 4.1)."""
    figure = plt.figure(figsize=(style.PAGE_IN, 4.7))
    for k, device in enumerate(params.devices[name] for name in ("scan", "dots", "stereo")):
        left, width = k / 3 + 0.03, 1 / 3 - 0.05
        sensor = device.get("sensor")
        name = style.sensor_name(sensor["sensor"]) if sensor else "VIVID 910"
        kind = KINDS[sensor["kind"] if sensor else "laser"]
        top = blank(figure, (left, 0.52, width, 0.41), f"{name}: {kind}", "abc"[k])
        _device(top, sensor)
        plan = blank(figure, (left, 0.04, width, 0.42))
        if sensor:
            _fields(plan, device)
        else:
            _scans(plan, device)
    return figure


def _device(axes: Axes, sensor: Mapping | None) -> None:
    """Housing from the front, with the names of its optics and what is known of it."""
    sketch = Sketch(axes, FRONT, STANDING)
    mesh, places = rig.sensor_mesh(sensor)
    left, right, low, high = sketch.surface(mesh, width_px=600)
    width, middle = right - left, (low + high) / 2
    for k, (name, place) in enumerate(sorted(places.items(), key=lambda one: -one[1][0])):
        flat = sketch.flat(place)
        aside = (k - (len(places) - 1) / 2) * 0.1
        end = flat + width * np.array([aside, -0.27 if k % 2 == 0 else 0.27])
        look = {"ha": "center", "va": "top" if k % 2 == 0 else "bottom"}
        if sensor is None:
            end, look = np.array([left - 0.1 * width, flat[1]]), {"ha": "right"}
        leader(axes, flat, end, name.replace(" ", "\n"), **look)
    known = "640 × 480 points a view"
    if sensor:
        block = sensor["stereo" if sensor["kind"] == "stereo" else "depth"]
        size = f"{sensor['color']['width_px']} × {sensor['color']['height_px']} px"
        known = f"baseline {block['baseline_m'] * MILLIMETRES:.0f} mm, {size},"
        known += f"\n{sensor['frame_rate_hz']} frames/s"
    half = (0.62 if sensor else 0.55) * max(width, high - low)
    axes.set(
        xlim=(left - (0 if sensor else 0.4 * width), right), ylim=(middle - half, middle + half)
    )
    axes.text(0.5, -0.02, known, transform=axes.transAxes, ha="center", va="top", fontsize=TEXT_PT)


def _fields(axes: Axes, device: Mapping) -> None:
    """Fields of view from above, in the sensor's range."""
    sensor, distance = device["sensor"], device["distance_m"]
    near, far = sensor["range_m"]
    shown = min(far, PLAN_M)
    seen_by, looks = rig.cameras(sensor, np.eye(4)), ((style.BLUE, "-"), (style.ORANGE, "--"))
    for (name, (camera, pose)), (colour, dash) in zip(seen_by.items(), looks, strict=True):
        ends = (np.array([0, camera["width_px"]]) - camera["cx_px"]) / camera["fx_px"]
        reach = np.array([near, near, shown, shown])
        corners = np.column_stack([pose[0, 3] + reach * ends[[0, 1, 1, 0]], reach + pose[2, 3]])
        axes.add_patch(Polygon(corners, fc=colour, alpha=0.16, ec="none"))
        wide, tall = rig.field_deg(camera)
        label = f"{name} camera: {wide:.0f}° × {tall:.0f}°"
        axes.add_patch(Polygon(corners, fc="none", ec=colour, lw=0.9, ls=dash, label=label))
        for corner in corners[:2]:
            axes.plot(*np.array([pose[[0, 2], 3], corner]).T, color=colour, lw=0.5, ls=dash)
        axes.plot(pose[0, 3], pose[2, 3], "o", color=colour, ms=3.5, zorder=4)
    axes.annotate("", (0, distance), (0, 0), arrowprops=BOTH_WAYS)
    axes.plot(0, distance, "o", color=style.BLACK, ms=3.5)
    write(axes, (0, distance), f"object, {distance:.2f} m", (0.2, 1), 8)
    ranged = f"range {near:g} to {far:g} m" + (", cut" if far > PLAN_M else "")
    write(axes, (0, shown), ranged, (0, -1), 8)
    _plan(axes, (-1.25, 1.25), (-0.6, PLAN_M + 0.5))


def _scans(axes: Axes, scan: Mapping) -> None:
    """Where the scanner stands about the object, from above."""
    size, distance = np.array(scan["size_m"]), scan["distance_m"]
    axes.add_patch(Rectangle(-size[:2] / 2, *size[:2], fc=style.GREY, ec=style.BLACK, lw=0.7))
    turns = np.deg2rad(scan["turns_deg"])
    directions = np.column_stack([np.sin(turns), -np.cos(turns)])
    looks = zip(
        scan["elevations_deg"],
        ((style.BLUE, "^"), (style.ORANGE, "v"), (style.GREEN, "s")),
        strict=False,
    )
    for elevation, (colour, marker) in looks:
        over = elevation < 0
        flat = distance * np.cos(np.deg2rad(elevation)) * (0.88 if over else 1.0) * directions
        for place in flat:
            axes.plot(*np.array([place, 0.55 * place]).T, color=colour, lw=0.5)
        words = f"{abs(elevation):g}°, turned over" if over else f"{elevation:g}° above"
        axes.plot(*flat.T, marker, color=colour, ms=4.5, ls="none", label=words)
    title = f"{len(turns) * len(scan['elevations_deg'])} views of {distance:.1f} m"
    _plan(axes, (-1.65 * distance, 1.65 * distance), (-1.75 * distance, 1.35 * distance), title)


def _plan(axes: Axes, across: tuple, up: tuple, title: str | None = None) -> None:
    """Seen from above, with a scale bar."""
    axes.set(xlim=across, ylim=up)
    scale_bar(axes, 0.5, "0.5 m", loc="upper left")
    look = {"fontsize": TEXT_PT, "title_fontsize": TEXT_PT, "handlelength": 1.3}
    axes.legend(loc="lower center", title=title, borderaxespad=0, **look)


def figure_4_5(inputs: Any, params: Any) -> Figure:
    """Force sensor with handle and spherical indenter, with its configured sizes (Fig. 4.5)."""
    probe, figure = params.probe, plt.figure(figsize=(style.PAGE_IN, 3.9))
    mesh, marker_to_force = rig.probe_mesh(probe), np.linalg.inv(probe["marker_from_force"])
    parts = blank(figure, (0.04, 0.03, 0.44, 0.89), "Parts", "a")
    sketch = Sketch(parts, OBLIQUE, rig.UPRIGHT[:3, :3])
    left, right, low, high = sketch.surface(mesh, width_px=700)
    _name_parts(sketch, probe, marker_to_force, right, np.array([low, high]))
    parts.set(xlim=(left, right + 0.85 * (right - left)), ylim=(low, high))
    # Along the target's edge, its x axis, so that its tilt shows.
    edge = rig.UPRIGHT[:3, :3] @ marker_to_force[:3, 0]
    sizes = blank(figure, (0.5, 0.03, 0.49, 0.89), "Sizes, seen from the side", "b")
    side = View(float(np.rad2deg(np.arctan2(edge[1], edge[0]))), 0.0)
    sketch = Sketch(sizes, side, rig.UPRIGHT[:3, :3])
    left, right, low, high = sketch.surface(mesh, width_px=500)
    ends = _target_ends(sketch, probe)
    free = -1 if ends[:, 0].mean() > 0 else 1
    _measure(sizes, probe, free)
    along = (ends[1] - ends[0]) / np.linalg.norm(ends[1] - ends[0])
    across = np.array([-along[1], along[0]])
    across *= -free * np.sign(across[0]) * 9
    text = f"target {np.linalg.norm(ends[1] - ends[0]):.0f} mm,\ntilted {rig.tilt_deg(probe):.0f}°"
    dimension(sizes, ends[0] + across, ends[1] + across, text, across)
    reach = rig.NANO25_RADIUS_M * MILLIMETRES + 106
    sizes.set_xlim((left - 38, reach) if free > 0 else (-reach, right + 38))
    sizes.set_ylim(low - 6, high + 4)
    return figure


def _name_parts(
    sketch: Sketch, probe: Mapping, marker_to_force: NDArray, right: float, ends: NDArray
) -> None:
    """Names beside the parts, with thin lines to them."""
    marker = probe["marker"]
    columns, rows = np.array(marker["inner_corners"]) + 1
    side = marker["square_m"] * MILLIMETRES
    middle = (np.array([columns, rows]) / 2 - 1) * marker["square_m"]
    places = {
        f"checkerboard\n{columns} × {rows} squares\nof {side:.0f} mm": (
            marker_to_force[:3] @ [*middle, 0, 1.0],
            0.72,
        ),
        "handle": ([0, 0, -0.17 * rig.HANDLE_M], 0.44),
        "force/torque sensor\nATI Nano25": ([0, 0, rig.NANO25_LENGTH_M / 2], 0.24),
        "spherical indenter": (np.array(probe["force_from_tip"])[:3, 3], 0.06),
    }
    for text, (place, height) in places.items():
        end = right + 8, ends[0] + height * np.ptp(ends)
        leader(sketch.axes, sketch.flat(place), end, text)


def _target_ends(sketch: Sketch, probe: Mapping) -> NDArray:
    """Ends of the target's squares in the side view, shape (2, 2) [mm]."""
    marker = probe["marker"]
    ends = np.array([[0, -1, 0, 1], [0, marker["inner_corners"][1], 0, 1.0]])
    ends[:, :3] *= marker["square_m"]
    return sketch.flat((ends @ np.linalg.inv(probe["marker_from_force"]).T)[:, :3])


def _measure(axes: Axes, probe: Mapping, free: int) -> None:
    """Dimension lines of what the probe's file and the sensor's data sheet give [mm]."""
    tip = np.array(probe["force_from_tip"])[2, 3] * MILLIMETRES
    radius, sensor = probe["indenter"]["radius_m"] * MILLIMETRES, rig.NANO25_LENGTH_M * MILLIMETRES
    wide = rig.NANO25_RADIUS_M * MILLIMETRES
    near, far = free * (wide + 12), free * (wide + 56)
    for x, low, high, text in (
        (near, -sensor, 0.0, f"{sensor:.1f} mm"),
        (near, -tip, -sensor, f"{tip - sensor:.1f} mm"),
        (far, -tip, 0.0, f"{tip:.0f} mm to\nthe sphere's\ncentre"),
        (near, 0.0, rig.HANDLE_M * MILLIMETRES, "handle\n(sketched)"),
    ):
        dimension(axes, (x, low), (x, high), text, (free, 0))
    for height in (0.0, -sensor, -tip):
        axes.plot([0, far], [height, height], color=style.BLACK, lw=0.4, ls=DASHED, zorder=0)
    write(axes, (-free * radius, -tip), f"sphere,\nradius {radius:.2f} mm", (-free, -0.15))
    write(axes, (-free * wide, -0.5 * sensor), f"diameter\n{2 * wide:.0f} mm", (-free, -0.1))


def figure_4_7(inputs: Any, params: Any) -> Figure:
    """Setup of each sensor at the lab's placements, to scale (Fig. 4.7)."""
    setups = params.setups
    scenes = [_scene(setup) for setup in setups]
    frame = ASIDE.frame(*(scene.vertices for scene in scenes), margin=0.03)
    height = style.PAGE_IN / len(setups) * (frame[3] - frame[2]) / (frame[1] - frame[0])
    figure = plt.figure(figsize=(style.PAGE_IN, height + 0.55))
    for k, (setup, scene) in enumerate(zip(setups, scenes, strict=True)):
        place = k / len(setups) + 0.02, 0.07, 1 / len(setups) - 0.03, height / (height + 0.55)
        axes = blank(figure, place, style.sensor_name(setup["sensor"]["sensor"]), "abcdef"[k])
        _setup(Sketch(axes, ASIDE), setup, scene, frame)
    style.label_provenance(figure, {"simulated"})
    return figure


def _scene(setup: Mapping) -> trimesh.Trimesh:
    """Table, block, probe and sensor."""
    size, (housing, _) = np.array(setup["size_m"]), rig.sensor_mesh(setup["sensor"])
    parts = [
        rig.box(TABLE_M, (0, 0, -TABLE_M[2] / 2), TABLE),
        rig.box(size, (0, 0, size[2] / 2), FOAM),
        rig.probe_on(setup["probe"], setup["point_m"]),
        housing.apply_transform(rig.camera_pose(setup["placement"])),
    ]
    return trimesh.util.concatenate(parts)


def _setup(sketch: Sketch, setup: Mapping, scene: trimesh.Trimesh, frame: NDArray) -> None:
    """The scene with fields of view, the camera's distance and names."""
    sketch.surface(scene, frame=frame, width_px=1100)
    placement, axes = setup["placement"], sketch.axes
    pose, target = rig.camera_pose(placement), placement["target_m"]
    distance, looks = placement["distance_m"], ((style.BLUE, "-"), (style.ORANGE, "--"))
    seen_by = rig.cameras(setup["sensor"], pose).items()
    for (name, (camera, place)), (colour, dash) in zip(seen_by, looks, strict=True):
        corners = rig.frustum(camera, place, REACH * distance)
        for corner in corners[1:]:
            sketch.line(corners[0], corner, color=colour, lw=0.7, ls=dash)
        sketch.area(corners[1:], colour, alpha=0.1, ls=dash, label=f"{name} camera's view")
    sketch.line(pose[:3, 3], target, lw=1.1, ls=(0, (5, 2)))
    sketch.dot(target, ms=2.5)
    text = f"{distance:.2f} m,\n{placement['elevation_deg']:g}° down"
    sketch.name((pose[:3, 3] + target) / 2, text, (1, 0.8), 6)
    length, _, height = setup["size_m"]
    block = f"foam block,\n{length * MILLIMETRES:.0f} mm long"
    sketch.name((0.5 * length, 0.0, height / 2), block, (1, 0.3), 16)
    probe = rig.probe_on(setup["probe"], setup["point_m"]).vertices
    sketch.name(probe[probe[:, 2].argmax()], "probe", (0.6, 1), 8)
    axes.legend(loc="upper right", fontsize=TEXT_PT, handlelength=1.2, borderaxespad=0)
    scale_bar(axes, 200, "200 mm", loc="lower right")


def figure_4_12(inputs: Any, params: Any) -> Figure:
    """Chain of transforms from the probe's tip to a capture's camera, to scale (Fig. 4.12)."""
    probe, sensor = params.probe, params.sensor
    frames = rig.chain(read_table(inputs.pose), probe)
    # The probe stands upright; the camera looks along x.
    up = -frames["tip"][:3, 2]
    ahead = frames["tip"][:3, 3] - (frames["tip"][:3, 3] @ up) * up
    ahead /= np.linalg.norm(ahead)
    upright = np.stack([ahead, np.cross(up, ahead), up])
    figure = plt.figure(figsize=(style.PAGE_IN, 3.8))
    whole = Sketch(
        blank(figure, (0.03, 0.04, 0.55, 0.89), "From camera to tip", "a"), BESIDE, upright
    )
    near = Sketch(blank(figure, (0.6, 0.04, 0.39, 0.89), "Probe", "b"), BESIDE, upright)
    mesh = rig.probe_mesh(probe).apply_transform(frames["force"])
    housing, _ = rig.sensor_mesh(sensor)
    places = {name: transform[:3, 3] for name, transform in frames.items()}

    whole.surface(trimesh.util.concatenate([mesh, housing]), width_px=1500)
    corners = rig.frustum(sensor["color"], np.eye(4), CAMERA_M, table=False)
    for corner in corners[1:]:
        whole.line(corners[0], corner, color=style.GREY, lw=0.6)
    whole.area(corners[1:], style.GREY, lw=0.6)
    whole.arrow(places["camera"], places["tip"], lw=1.0, ls=DASHED)
    whole.arrow(places["camera"], places["marker"], **CHAIN)
    left, right, low, high = near.surface(mesh, width_px=800)
    # Room for the axes of the tip.
    near.axes.set(xlim=(left - 12, right + 26), ylim=(low - 44, high))
    near.arrow(places["marker"], places["force"], **CHAIN, connectionstyle="arc3,rad=-0.25")
    near.arrow(places["force"], places["tip"], **CHAIN, connectionstyle="arc3,rad=0.6")
    for sketch, names in ((whole, ("camera", "marker", "tip")), (near, ("marker", "force", "tip"))):
        for name in names:
            sketch.triad(frames[name], FRAME_M)
    for sketch, ends, symbol, side, points in (
        (whole, ("camera", "marker"), CHESSBOARD, (0, 1), 26),
        (whole, ("camera", "tip"), f"{CHESSBOARD}{SENSOR}{TIP}", (1, -0.8), 20),
        (near, ("marker", "force"), SENSOR, (-1.1, -0.75), 62),
        (near, ("force", "tip"), TIP, (-1, -0.5), 30),
    ):
        first, second = (places[name] for name in ends)
        length = np.linalg.norm(second - first) * MILLIMETRES
        text = f"{symbol}\n{ends[0]} from {ends[1]}\n{length:.0f} mm"
        sketch.name((first + second) / 2, text, side, points)
    radius = probe["indenter"]["radius_m"] * MILLIMETRES
    whole.name(places["camera"], "camera", (-0.2, 1), 38, weight="bold")
    near.name(places["marker"], "marker", (-0.7, 1), 56, weight="bold")
    near.name(places["force"], "force sensor", (1, 0), 44, weight="bold")
    near.name(places["tip"], f"tip,\nradius {radius:.2f} mm", (1, 0), 44, weight="bold")
    scale_bar(whole.axes, 100, "100 mm, parallel to the page", loc="lower right")
    scale_bar(near.axes, 50, "50 mm, parallel to the page", loc="lower left")
    return labelled(figure, params)
