"""Calibration pairs: a checkerboard in many poses before both cameras (Section 4.1.4)."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from palpate.capture.images import write_image
from palpate.capture.tables import write_frames, write_table
from palpate.vision.camera import camera_from_spec
from scipy.spatial.transform import Rotation

from virtual_lab.cameras import Exposure
from virtual_lab.probe import Probe, loose_board
from virtual_lab.probe_board import Board
from virtual_lab.record import reached
from virtual_lab.render import View, render, render_around
from virtual_lab.rig import STILL_SAMPLES, Rig, depth_view
from virtual_lab.scene import Bench, Scene

SAMPLES = 3
MARGIN_PX = 12
TRIES = 2000
GREY = "mono8"


def record_calibration(
    folder: Path, rig: Rig, common: Mapping, options: Mapping, probe_spec: None, *, seed: list
) -> dict[str, NDArray]:
    """Write pairs of colour and infrared images of a board, the dot projector covered.

    Parameters
    ----------
    folder : Path
        Empty folder to fill: ``color/``, ``infrared/``, ``frames.csv``, ``board.csv``.
    rig : Rig
        Of a structured-light sensor.
    common, probe_spec
        As of `virtual_lab.experiments.record_workspace`, unused.
    options : mapping
        ``calibration`` block of lab.yaml.
    seed : list of int

    Returns
    -------
    dict
        ``camera_from_board`` (k, 4, 4), poses in the colour camera's frame.
    """
    board = Board(tuple(options["squares"]), options["square_m"])
    prop, rng = loose_board(board), np.random.default_rng([*seed, 1])
    colour = View(camera_from_spec(rig.sensor["color"]), rig.reference.object_from_camera)
    views = {"color": colour, "infrared": depth_view(rig.sensor, colour.object_from_camera)}
    empty = Scene(rig.bench)
    still = {name: render(v, empty, rig.light, samples=STILL_SAMPLES) for name, v in views.items()}
    rows, poses = [], []
    for k in range(options["pairs"]):
        pose = _board_pose(views, prop, options, rng)
        files = {}
        scene = _posed(rig.bench, prop, colour.object_from_camera @ pose)
        placed = colour.object_from_camera @ pose
        parts = reached(rig.light, prop, placed[:3, 3], placed[:3, :3])
        for name, view in views.items():
            layer = render_around(view, scene, rig.light, still[name], parts, samples=SAMPLES)
            image = Exposure(layer.colour, GREY, rig.noise).shot(rng)
            files[name] = f"{name}/{k:06d}.png"
            (folder / name).mkdir(exist_ok=True)
            write_image(folder / files[name], image, GREY)
        rows.append({"frame": k, "time_s": float(k)} | files)
        poses.append(pose)
    write_frames(folder, pd.DataFrame(rows))
    columns, lines = options["squares"]
    write_table(
        folder / "board.csv",
        pd.DataFrame(
            [{"columns": columns - 1, "rows": lines - 1, "square_m": options["square_m"]}]
        ),
    )
    return {"camera_from_board": np.stack(poses)}


def _board_pose(views: Mapping[str, View], board: Probe, options: Mapping, rng) -> NDArray:
    """Random pose of a board that both cameras see whole, colour camera's frame (4, 4)."""
    reference = views["color"]
    camera = reference.camera
    middle = board.parts[0].vertices_m.mean(axis=0)
    for _ in range(TRIES):
        tilt = np.deg2rad(options["tilt_deg"]) * rng.uniform(-1, 1, 3) * [1, 1, 0.5]
        pose = np.eye(4)
        pose[:3, :3] = Rotation.from_rotvec(tilt).as_matrix()
        pixel = rng.uniform([0, 0], [camera.width_px, camera.height_px])
        place = camera.rays(pixel)[0] * rng.uniform(*options["distance_m"])
        pose[:3, 3] = place - pose[:3, :3] @ middle
        points = _outline(board, reference.object_from_camera @ pose)
        if all(_inside(view, points) for view in views.values()):
            return pose
    raise ValueError("calibration: expected a board that both cameras can see whole, found none")


def _inside(view: View, points: NDArray) -> bool:
    transform = view.camera_from_object
    pixels = view.camera.project(points @ transform[:3, :3].T + transform[:3, 3])
    limit = [view.camera.width_px - MARGIN_PX, view.camera.height_px - MARGIN_PX]
    return bool((pixels > MARGIN_PX).all() and (pixels < limit).all())


def _outline(board: Probe, object_from_board: NDArray) -> NDArray:
    return board.outline() @ object_from_board[:3, :3].T + object_from_board[:3, 3]


def _posed(bench: Bench, board: Probe, object_from_board: NDArray) -> Scene:
    return Scene(
        bench,
        probe=board,
        tip_m=object_from_board[:3, 3],
        object_from_force=object_from_board[:3, :3],
    )
