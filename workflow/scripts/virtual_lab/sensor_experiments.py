"""Recordings about the sensors themselves: calibration pairs, workspace, CD case, planes.

Recorders as of `virtual_lab.probe_experiments`.
"""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from palpate.capture.images import write_image
from palpate.capture.tables import image_streams, write_frames, write_table
from palpate.vision.camera import camera_from_spec
from scipy.spatial.transform import Rotation

from virtual_lab.block import box_surface
from virtual_lab.motion import ProbeMotion, upright
from virtual_lab.paint import BlockPaint, CoverPaint
from virtual_lab.probe import Checkerboard, Probe, make_probe, target_alone
from virtual_lab.record import FACING, Body, write_images
from virtual_lab.render import PosedCamera, render, render_change
from virtual_lab.rig import STILL_SAMPLES, Rig, depth_view
from virtual_lab.rig_errors import seed_of
from virtual_lab.scene import Bench, Scene

GREY = "mono8"
# Of a calibration's picture, which its target keeps away from; poses that are tried for one.
MARGIN_PX, TRIES = 12, 2000


def record_calibration(
    folder: Path, rig: Rig, options: Mapping, probe_spec: None, *, seed: list
) -> dict[str, NDArray]:
    """Record a checkerboard in many poses before both cameras (Section 4.1.4).

    Writes ``color/``, ``infrared/`` (the dot projector covered), ``frames.csv``, ``board.csv``.

    Returns
    -------
    dict
        ``camera_from_board`` (k, 4, 4), poses in the colour camera's frame.
    """
    square_m, (columns, lines) = options["square_m"], options["squares"]
    target = target_alone(Checkerboard((columns, lines), square_m))
    rng, to_object = np.random.default_rng([*seed, 1]), rig.reference.object_from_camera
    views = {
        "color": PosedCamera(camera_from_spec(rig.sensor["color"]), to_object),
        "infrared": depth_view(rig.sensor, to_object),
    }
    empty = Scene(rig.bench)
    still = {name: render(v, empty, rig.light, samples=STILL_SAMPLES) for name, v in views.items()}
    rows, poses = [], []
    for k in range(options["pairs"]):
        poses.append(_target_pose(views, target, options, rng))
        files, scene = {}, _posed(rig.bench, target, to_object @ poses[-1])
        for name, view in views.items():
            layer = render_change(view, scene, rig.light, still[name])
            files[name] = f"{name}/{k:06d}.png"
            (folder / name).mkdir(exist_ok=True)
            write_image(folder / files[name], rig.exposed(layer.colour, GREY).shot(rng), GREY)
        rows.append({"frame": k, "time_s": float(k)} | files)
    write_frames(folder, pd.DataFrame(rows))
    corners = {"columns": columns - 1, "rows": lines - 1, "square_m": square_m}
    write_table(folder / "board.csv", pd.DataFrame([corners]))
    return {"camera_from_board": np.stack(poses)}


def _target_pose(
    views: Mapping[str, PosedCamera], target: Probe, options: Mapping, rng: np.random.Generator
) -> NDArray:
    """Random pose of a target that both cameras see whole, colour camera's frame (4, 4)."""
    reference = views["color"]
    camera = reference.camera
    middle = target.parts[0].vertices_m.mean(axis=0)
    for _ in range(TRIES):
        tilt = np.deg2rad(options["tilt_deg"]) * rng.uniform(-1, 1, 3) * [1, 1, 0.5]
        pose = np.eye(4)
        pose[:3, :3] = Rotation.from_rotvec(tilt).as_matrix()
        pixel = rng.uniform([0, 0], [camera.width_px, camera.height_px])
        place = camera.rays(pixel)[0] * rng.uniform(*options["distance_m"])
        pose[:3, 3] = place - pose[:3, :3] @ middle
        placed = reference.object_from_camera @ pose
        points = target.outline() @ placed[:3, :3].T + placed[:3, 3]
        if all(view.shows(points, MARGIN_PX) for view in views.values()):
            return pose
    raise ValueError("calibration: expected a board that both cameras can see whole, found none")


def _posed(bench: Bench, probe: Probe, pose: NDArray) -> Scene:
    """The bench with a probe or target at a pose (4, 4), object frame."""
    return Scene(bench, probe=probe, tip_m=pose[:3, 3], object_from_force=pose[:3, :3])


def record_workspace(
    folder: Path, rig: Rig, options: Mapping, probe_spec: Mapping, *, seed: list
) -> dict[str, NDArray]:
    """Record the tip on each point of a grid: Section 4.2.3, grey images.

    Writes one folder a point, and ``grid.csv`` (point, row, column, place).

    Returns
    -------
    dict
        ``tip_m`` (points, 3), the tip's centre in the reference camera's frame.
    """
    probe_spec = rig.errors.probe(probe_spec)
    probe, radius_m = make_probe(probe_spec), probe_spec["indenter"]["radius_m"]
    stream = next(iter(image_streams(rig.sensor)))
    still = render(rig.reference, Scene(rig.bench), rig.light, samples=STILL_SAMPLES)
    rows, tips = [], []
    to_camera, pose = rig.reference.camera_from_object, np.eye(4)
    for number, (row, column, place) in enumerate(_grid(options), start=1):
        rng, point = np.random.default_rng([*seed, number]), f"{number:02d}"
        tilt = np.deg2rad(options["tilt_deg"]) * rng.uniform(-1, 1, (1, 2))
        pose[:3, :3], pose[:3, 3] = upright(FACING, tilt)[0], place + [0, 0, radius_m]
        layer = render_change(rig.reference, _posed(rig.bench, probe, pose), rig.light, still)
        exposure, frames = rig.exposed(layer.colour, GREY), []
        (folder / point / stream).mkdir(parents=True)
        for k in range(options["frames"]):
            file = f"{stream}/{k:06d}.png"
            write_image(folder / point / file, exposure.shot(rng), GREY)
            frames.append({"frame": k, "time_s": k / rig.sensor["frame_rate_hz"], stream: file})
        write_frames(folder / point, pd.DataFrame(frames))
        where = {"row": row, "column": column, "x_m": place[0], "y_m": place[1]}
        rows.append({"point": point} | where)
        tips.append(to_camera[:3, :3] @ pose[:3, 3] + to_camera[:3, 3])
    write_table(folder / "grid.csv", pd.DataFrame(rows))
    return {"tip_m": np.array(tips)}


def _grid(options: Mapping) -> list[tuple[int, int, NDArray]]:
    """Rows (away from the camera), columns and places of the workspace's points."""
    columns, rows, step = options["columns"], options["rows"], options["step_m"]
    first = np.array([-step * (columns - 1) / 2, options["nearest_y_m"], 0.0])
    return [
        (row + 1, column + 1, first + [column * step, row * step, 0])
        for row, column in np.ndindex(rows, columns)
    ]


def record_trace(
    folder: Path, rig: Rig, options: Mapping, probe_spec: Mapping, *, seed: list
) -> dict[str, NDArray]:
    """Trace the outline of a CD case with the tip: Section 4.2.4.

    Writes ``trace/`` and ``background/`` in the capture format without force.

    Returns
    -------
    dict
        ``tip_m`` (k, 3) in the reference camera's frame, ``camera_from_object``, ``size_m``.
    """
    probe_spec, rng = rig.errors.probe(probe_spec), np.random.default_rng([*seed, 1])
    size, radius = np.array(options["size_m"]), probe_spec["indenter"]["radius_m"]
    cover = CoverPaint(size, np.random.default_rng(seed_of(rig.common, "cd_case", "cover")))
    rig = replace(rig, bench=replace(rig.bench, paint=cover))
    count, rate = options["frames"], options["frame_rate_hz"]
    tip = outline_path(size, radius, np.linspace(0, 1, count))
    tip[:, :2] += options["hand_m"] * _wander(count, rng)
    turns = upright(FACING, np.deg2rad(options["tilt_deg"]) * _wander(count, rng))
    path = ProbeMotion(np.arange(count) / rate, np.zeros(count), tip, turns)
    half = np.array([size[0] / 2, size[1] / 2, 0])
    vertices, faces = box_surface([np.linspace(-half[k], size[k] - half[k], 3) for k in range(3)])
    body = Body(vertices, faces, np.repeat(vertices[None], count, axis=0))
    for name in ("trace", "background"):
        (folder / name).mkdir()
    write_images(folder / "trace", rig, body, path, make_probe(probe_spec), seed=[*seed, 2])
    still = {"frames": rig.common["background_frames"], "seed": [*seed, 3]}
    rig.write_still(folder / "background", Scene(rig.bench), **still)
    to_camera = rig.reference.camera_from_object
    return {"tip_m": rig.reference.local(tip), "camera_from_object": to_camera, "size_m": size}


def outline_path(size_m: NDArray, radius_m: float, share: NDArray) -> NDArray:
    """Centres of a sphere that rolls on the table once around a box, shape (n, 3) [m].

    At shares (n,) of its path; the box of a size (3,) [m] stands centred on the origin.
    """
    a, b = size_m[0] / 2, size_m[1] / 2
    arc = np.linspace(0, np.pi / 2, 16)
    corners = [(a, -b, -np.pi / 2), (a, b, 0.0), (-a, b, np.pi / 2), (-a, -b, np.pi)]
    rounds = [
        np.column_stack([x + radius_m * np.cos(t + arc), y + radius_m * np.sin(t + arc)])
        for x, y, t in corners
    ]
    points = np.concatenate([*rounds, rounds[0][:1]])
    along = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    x, y = (np.interp(share * along[-1], along, points[:, k]) for k in range(2))
    return np.column_stack([x, y, np.full(len(x), radius_m)])


def _wander(count: int, rng: np.random.Generator) -> NDArray:
    """Smooth random walk of unit deviation that returns to its start, shape (count, 2)."""
    angle, tones = np.linspace(0, 2 * np.pi, count)[:, None], np.arange(2, 9)
    phase = rng.uniform(0, 2 * np.pi, (2, len(tones)))
    walks = [np.sin(angle * tones + p).sum(axis=1) for p in phase]
    return np.stack(walks, axis=1) * np.sqrt(2 / len(tones))


def record_planes(
    folder: Path, rig: Rig, options: Mapping, probe_spec: None, *, seed: list
) -> dict[str, NDArray]:
    """Record a flat foam board nearly square to the camera at several distances.

    Writes one folder a distance in the capture format without force, and ``planes.csv``; the truth
    is empty.
    """
    rows = []
    for number, distance in enumerate(options["distances_m"][rig.sensor["sensor"]], start=1):
        name = f"{number:02d}"
        scene = _plane(rig, options, distance, np.random.default_rng([*seed, number]))
        (folder / name).mkdir()
        rig.write_still(folder / name, scene, frames=options["frames"], seed=[*seed, 100 + number])
        rows.append({"plane": name, "distance_m": distance})
    write_table(folder / "planes.csv", pd.DataFrame(rows))
    return {}


def _plane(rig: Rig, options: Mapping, distance_m: float, rng: np.random.Generator) -> Scene:
    """A board in front of the camera, tilted a little, and nothing else."""
    width, height = options["size_m"]
    paint = BlockPaint(np.array([width, height, 0.01]), np.zeros((0, 3)), rng)
    corners = np.array([[-1, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1]])
    rest = corners * [width / 2, height / 2, 0.01]
    pose = rig.reference.object_from_camera
    tilt = Rotation.from_euler("xy", options["tilt_deg"], degrees=True)
    local = tilt.apply(rest * [1, -1, 0]) + [0, 0, distance_m]
    placed = local @ pose[:3, :3].T + pose[:3, 3]
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    return Scene(Bench(None, paint), surface_m=placed, rest_m=rest, faces=faces)
