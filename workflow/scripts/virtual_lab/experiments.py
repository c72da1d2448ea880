"""Recordings about the sensors themselves: workspace, CD case, planes."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from palpate.capture.images import write_image
from palpate.capture.tables import image_streams, write_frames, write_table
from scipy.spatial.transform import Rotation

from virtual_lab.block import box_surface
from virtual_lab.cameras import Exposure
from virtual_lab.motion import ProbeMotion, upright
from virtual_lab.paint import BlockPaint, CoverPaint
from virtual_lab.probe import make_probe
from virtual_lab.record import FACING, Body, film, reached
from virtual_lab.render import render, render_around
from virtual_lab.rig import STILL_SAMPLES, Rig
from virtual_lab.scene import Bench, Scene
from virtual_lab.seeds import seed_of

SAMPLES = 3
GREY = "mono8"


def record_workspace(
    folder: Path, rig: Rig, common: Mapping, options: Mapping, probe_spec: Mapping, *, seed: list
) -> dict[str, NDArray]:
    """Hold the tip on each point of a grid and film it: Section 4.2.3, grey images.

    Parameters
    ----------
    folder : Path
        Empty folder to fill: one folder a point, and ``grid.csv`` (point, row, column, place).
    rig : Rig
    common, probe_spec : mapping
    options : mapping
        ``workspace`` block of lab.yaml.
    seed : list of int

    Returns
    -------
    dict
        ``tip_m`` (points, 3), the tip's centre in the reference camera's frame.
    """
    probe_spec = rig.device.probe(probe_spec)
    probe = make_probe(probe_spec)
    stream = next(iter(image_streams(rig.sensor)))
    still = render(rig.reference, Scene(rig.bench), rig.light, samples=STILL_SAMPLES)
    rows, tips = [], []
    to_camera = rig.reference.camera_from_object
    for number, (row, column, place) in enumerate(_grid(options), start=1):
        tip = place + [0, 0, probe_spec["indenter"]["radius_m"]]
        rng = np.random.default_rng([*seed, number])
        turn = upright(FACING, np.deg2rad(options["tilt_deg"]) * rng.uniform(-1, 1, (1, 2)))[0]
        scene = Scene(rig.bench, probe=probe, tip_m=tip, object_from_force=turn)
        parts = reached(rig.light, probe, tip, turn)
        layer = render_around(rig.reference, scene, rig.light, still, parts, samples=SAMPLES)
        point = f"{number:02d}"
        _write_repeats(folder / point, layer.colour, stream, rig, options["frames"], rng)
        rows.append(
            {"point": point, "row": row, "column": column, "x_m": place[0], "y_m": place[1]}
        )
        tips.append(to_camera[:3, :3] @ tip + to_camera[:3, 3])
    write_table(folder / "grid.csv", pd.DataFrame(rows))
    return {"tip_m": np.array(tips)}


def record_trace(
    folder: Path, rig: Rig, common: Mapping, options: Mapping, probe_spec: Mapping, *, seed: list
) -> dict[str, NDArray]:
    """Trace the outline of a CD case with the tip: Section 4.2.4.

    Parameters
    ----------
    folder : Path
        Empty folder to fill: ``trace/`` and ``background/`` in the capture format without force.
    rig : Rig
    common, probe_spec : mapping
    options : mapping
        ``cd_case`` block of lab.yaml.
    seed : list of int

    Returns
    -------
    dict
        ``tip_m`` (k, 3) in the reference camera's frame, ``camera_from_object``, ``size_m``.
    """
    probe_spec, rng = rig.device.probe(probe_spec), np.random.default_rng([*seed, 1])
    probe = make_probe(probe_spec)
    size, radius = np.array(options["size_m"]), probe_spec["indenter"]["radius_m"]
    cover = CoverPaint(size, np.random.default_rng(seed_of(common, "cd_case", "cover")))
    rig = replace(rig, bench=replace(rig.bench, paint=cover))
    count, rate = options["frames"], options["frame_rate_hz"]
    tip = outline_path(size, radius, np.linspace(0, 1, count))
    tip[:, :2] += options["hand_m"] * _wander(count, rng)
    tilt = np.deg2rad(options["tilt_deg"]) * np.column_stack([_wander(count, rng)])
    path = ProbeMotion(np.arange(count) / rate, np.zeros(count), tip, upright(FACING, tilt))
    half = np.array([size[0] / 2, size[1] / 2, 0])
    axes = [np.linspace(-half[k], size[k] - half[k], 3) for k in range(3)]
    vertices, faces = box_surface(axes)
    body = Body(vertices, faces, np.repeat(vertices[None], count, axis=0))
    for name in ("trace", "background"):
        (folder / name).mkdir()
    film(folder / "trace", rig, body, path, probe, seed=[*seed, 2])
    rig.write_still(
        folder / "background",
        Scene(rig.bench),
        frames=common["background_frames"],
        seed=[*seed, 3],
    )
    transform = rig.reference.camera_from_object
    return {
        "tip_m": tip @ transform[:3, :3].T + transform[:3, 3],
        "camera_from_object": transform,
        "size_m": size,
    }


def record_planes(
    folder: Path, rig: Rig, common: Mapping, options: Mapping, probe_spec: None, *, seed: list
) -> dict[str, NDArray]:
    """Film a flat foam board nearly square to the camera at several distances.

    Writes one folder a distance in the capture format without force, and ``planes.csv``; of it
    nothing is hidden.
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


def outline_path(size_m: NDArray, radius_m: float, share: NDArray) -> NDArray:
    """Centres of a sphere that rolls on the table once around a box, shape (n, 3) [m].

    Parameters
    ----------
    size_m : (3,) array
        Box, centred on the origin, standing on the table.
    radius_m : float
    share : (n,) array
        Part of the way, 0 to 1.
    """
    a, b = size_m[0] / 2, size_m[1] / 2
    arc = np.linspace(0, np.pi / 2, 16)
    corners = [(a, -b, -np.pi / 2), (a, b, 0.0), (-a, b, np.pi / 2), (-a, -b, np.pi)]
    points = np.concatenate(
        [
            np.column_stack([x + radius_m * np.cos(t + arc), y + radius_m * np.sin(t + arc)])
            for x, y, t in corners
        ]
    )
    points = np.concatenate([points, points[:1]])
    way = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    x, y = (np.interp(share * way[-1], way, points[:, k]) for k in range(2))
    return np.column_stack([x, y, np.full(len(x), radius_m)])


def _plane(rig: Rig, options: Mapping, distance_m: float, rng: np.random.Generator) -> Scene:
    """A board in front of the camera, tilted a little, and nothing else."""
    width, height = options["size_m"]
    paint = BlockPaint(np.array([width, height, 0.01]), np.zeros((0, 3)), rng)
    rest = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]) * [width / 2, height / 2, 0]
    rest = rest + [0, 0, 0.01]
    pose = rig.reference.object_from_camera
    tilt = Rotation.from_euler("xy", options["tilt_deg"], degrees=True)
    local = tilt.apply(rest * [1, -1, 0]) + [0, 0, distance_m]
    placed = local @ pose[:3, :3].T + pose[:3, 3]
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    return Scene(Bench(None, paint), surface_m=placed, rest_m=rest, faces=faces)


def _grid(options: Mapping) -> list[tuple[int, int, NDArray]]:
    """Rows (away from the camera), columns and places of the workspace's points."""
    columns, rows = options["columns"], options["rows"]
    step = options["step_m"]
    first = np.array([-step * (columns - 1) / 2, options["nearest_y_m"], 0.0])
    return [
        (row + 1, column + 1, first + [column * step, row * step, 0])
        for row in range(rows)
        for column in range(columns)
    ]


def _write_repeats(
    folder: Path, radiance: NDArray, stream: str, rig: Rig, frames: int, rng
) -> None:
    exposure = Exposure(radiance, GREY, rig.noise)
    (folder / stream).mkdir(parents=True)
    rows = []
    for k in range(frames):
        file = f"{stream}/{k:06d}.png"
        write_image(folder / file, exposure.shot(rng), GREY)
        rows.append({"frame": k, "time_s": k / rig.sensor["frame_rate_hz"], stream: file})
    write_frames(folder, pd.DataFrame(rows))


def _wander(count: int, rng: np.random.Generator) -> NDArray:
    """Smooth random walk of unit deviation that returns to its start, shape (count, 2)."""
    angle = np.linspace(0, 2 * np.pi, count)[:, None]
    tones = np.arange(2, 9)
    phase = rng.uniform(0, 2 * np.pi, (2, len(tones)))
    return np.stack([np.sin(angle * tones + p).sum(axis=1) for p in phase], axis=1) * np.sqrt(
        2 / len(tones)
    )
