"""What a robot or an optical tracker records of an indentation: probe_poses.csv."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from palpate.capture.poses import PoseRecord, write_poses
from scipy.spatial.transform import Rotation

from virtual_lab.motion import Operator
from virtual_lab.probe import Probe
from virtual_lab.rig import Rig
from virtual_lab.rig_errors import seed_of

# Rows in turn, from and to, that a tracker loses in the approach.
LOST_ROWS = (3, 5)


def record_poses(
    folder: Path, rig: Rig, operator: Operator, probe: Probe, *, tracked: str, seed: list
) -> dict[str, NDArray]:
    """Record the frame of the probe's target where the sensor's file has a ``base``.

    Parameters
    ----------
    folder : Path
        Of a capture, to write into.
    rig : Rig
        To the base of its sensor's file come the rates and errors of ``poses`` in lab.yaml.
    operator : Operator
    probe : Probe
    tracked : str
        Name of the target's frame.
    seed : list of int
        Seed of this recording; the base's name has a stream of its own.

    Returns
    -------
    dict
        ``camera_from_base`` (4, 4) as it is, and ``pose_clock_offset_s``, by how much the poses'
        clock is ahead of the camera's; empty without a base.
    """
    if (base := rig.sensor.get("base")) is None:
        return {}
    rng = np.random.default_rng([*seed, *seed_of({"seed": 7}, base["name"])])
    placed = seed_of(rig.common, "rig", rig.errors.rig, "base", base["name"])
    motion, lead_s = operator.options, rig.common["force"]["lead_s"]
    stop_s = operator.frames / motion["frame_rate_hz"] + lead_s
    time_s = np.arange(-lead_s, stop_s, 1 / base["rate_hz"])
    path, count = operator.at(time_s), len(time_s)
    poses = np.tile(np.eye(4), (count, 1, 1))
    poses[:, :3, :3], poses[:, :3, 3] = path.object_from_force, path.tip_m
    # As the sensor's file says, but for the rig's own error.
    turn, shift_m = np.random.default_rng(placed).standard_normal((2, 3))
    camera_from_base = np.array(base["camera_from_base"], dtype=float)
    turn = Rotation.from_rotvec(base["base_rad"] * turn).as_matrix()
    camera_from_base[:3, :3] = turn @ camera_from_base[:3, :3]
    camera_from_base[:3, 3] += base["base_m"] * shift_m
    base_from_object = np.linalg.inv(camera_from_base) @ rig.reference.camera_from_object
    poses = base_from_object @ poses @ probe.tip_from_marker
    turns = Rotation.from_rotvec(base["noise_rad"] * rng.standard_normal((count, 3)))
    poses[:, :3, :3] = poses[:, :3, :3] @ turns.as_matrix()
    std_m = base["noise_m"] * (1 + base.get("std_spread", 0) * rng.uniform(-1, 1, count))
    poses[:, :3, 3] += std_m[:, None] * rng.standard_normal((count, 3))
    kept = rng.random(count) >= base.get("lost", 0)
    if "lost" in base:
        first = np.searchsorted(time_s, motion["rest_s"] + motion["approach_s"] * rng.uniform())
        kept[first : first + rng.integers(*LOST_ROWS, endpoint=True)] = False
    stated_m = std_m if "std_spread" in base else np.full(count, np.nan)
    of_rows = ((time_s + base["latency_s"])[kept], poses[kept], stated_m[kept])
    write_poses(folder, PoseRecord(*of_rows, base=base["name"], tracked=tracked))
    offset_s = np.array(base["latency_s"])
    return {"camera_from_base": camera_from_base, "pose_clock_offset_s": offset_s}
