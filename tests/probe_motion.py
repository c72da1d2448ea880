"""Poses of a handle that is turned about its tip or held free; recordings of the probe alone."""

import numpy as np
import yaml
from scipy.spatial.transform import Rotation
from virtual_lab.probe_experiments import record_load, record_pivot, record_stiffness
from virtual_lab.rig import bare_bench, make_rig
from virtual_lab.rig_errors import errors_of
from virtual_lab.sensor_experiments import record_planes

TIP_M, MIDDLE_M = np.array([0.03, 0.17, 0.08]), np.array([0.03, 0.02, 0.0])
PIVOT_M = np.array([-0.01, 0.1, 0.65])


def turned_handle(*, frames=200, lean_deg=30.0, spin_deg=15.0, noise_deg=0.1, noise_m=2e-4, seed=0):
    """Poses camera_from_marker of a handle that leans to all sides, noise about the board's middle.

    What its noise is of turn and place is independent from frame to frame.
    """
    rng = np.random.default_rng(seed)
    way = np.linspace(0, 6 * np.pi, frames)
    lean = np.deg2rad(lean_deg) * np.sqrt(np.linspace(0.05, 1, frames))
    spin = np.deg2rad(spin_deg) * np.sin(1.7 * way)
    turn = Rotation.from_rotvec(np.column_stack([lean * np.cos(way), lean * np.sin(way), spin]))
    turn = turn * Rotation.from_euler("x", 20, degrees=True)
    middle = PIVOT_M + turn.apply(MIDDLE_M - TIP_M) + rng.normal(0, noise_m, (frames, 3))
    turn = Rotation.from_rotvec(rng.normal(0, np.deg2rad(noise_deg), (frames, 3))) * turn
    poses = np.tile(np.eye(4), (frames, 1, 1))
    poses[:, :3, :3] = turn.as_matrix()
    poses[:, :3, 3] = middle - turn.apply(MIDDLE_M)
    return poses


def held_free(frames=12, noise_deg=0.0, seed=0):
    """Poses camera_from_marker of a handle held tip down, level and in between, in the air."""
    rng = np.random.default_rng(seed)
    way = np.linspace(0, 4 * np.pi, frames)
    lean = np.deg2rad(np.linspace(0, 90, frames))
    turn = Rotation.from_rotvec(np.column_stack([lean * np.cos(way), lean * np.sin(way), 0 * way]))
    turn = turn * Rotation.from_euler("x", 20, degrees=True)
    turn = Rotation.from_rotvec(rng.normal(0, np.deg2rad(noise_deg), (frames, 3))) * turn
    poses = np.tile(np.eye(4), (frames, 1, 1))
    poses[:, :3, :3] = turn.as_matrix()
    poses[:, :3, 3] = [0.0, 0.0, 0.6]
    return poses


RECORDERS = {"load": record_load, "pivot": record_pivot, "stiffness": record_stiffness}
RECORDERS["planes"] = record_planes
APART = ("objects", "experiments", "simulated_block", "laser")


def lab_film(root, folder, sensor, probe, **changed):
    """Record the experiment that a folder is named by; gives its truth."""
    lab = yaml.safe_load((root / "config/lab.yaml").read_text())
    options = lab["experiments"][folder.name] | changed
    common = {key: value for key, value in lab.items() if key not in APART}
    common["background_frames"] = 3
    folder.mkdir(parents=True)
    bench = bare_bench(common, name=folder.name)
    rig = make_rig(common, errors_of(common, {}, sensor), options["camera"], bench)
    return RECORDERS[folder.name](folder, rig, options, probe, seed=[1])
