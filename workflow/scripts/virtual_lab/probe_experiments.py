"""Recordings of the probe alone: turned about its tip, in static poses, against something rigid.

Each recorder takes an empty folder to fill in the capture format, the rig, the experiment's block
of lab.yaml, the probe's file and a seed, and gives the truth.
"""

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation, Slerp

from virtual_lab.motion import ProbeMotion, Tones, upright
from virtual_lab.probe import make_probe
from virtual_lab.record import FACING, clocks, write_images, write_record
from virtual_lab.rig import Rig
from virtual_lab.scene import Scene

# The handle goes round so often with a growing tilt, and about itself meanwhile.
ROUNDS, SPINS = 3.0, 2.5
LEAST_TILT = 0.1
# The ball comes from so far above, in so much time.
HOVER_M, APPROACH_S = 0.010, 0.6
Motion = Callable[[NDArray], ProbeMotion]
Force = Callable[[NDArray], NDArray]


def record_pivot(
    folder: Path, rig: Rig, options: Mapping, probe_spec: Mapping, *, seed: list
) -> dict[str, NDArray]:
    """Record the handle, tilted to all sides about its tip in a dimple, without forces.

    Returns
    -------
    dict
        ``tip_m`` (3,), the tip in the frame of the target as it is on the probe.
    """
    probe_spec, rng = rig.errors.probe(probe_spec), np.random.default_rng([*seed, 1])
    count = options["frames"]
    share = np.linspace(0, 1, count)
    around = 2 * np.pi * (ROUNDS * share + rng.uniform())
    tilt = np.deg2rad(options["lean_deg"]) * np.sqrt(LEAST_TILT + (1 - LEAST_TILT) * share)
    tremor = np.deg2rad(options["tremor_deg"]) * rng.standard_normal((count, 2))
    sides = np.column_stack([np.cos(around), np.sin(around)])
    turns = upright(FACING, tilt[:, None] * sides + tremor)
    spin = np.deg2rad(options["spin_deg"]) * np.sin(2 * np.pi * SPINS * share)
    turns = turns @ Rotation.from_euler("z", spin[:, None]).as_matrix()
    tip = np.tile([0.0, 0.0, probe_spec["indenter"]["radius_m"]], (count, 1))
    path = ProbeMotion(np.arange(count) / options["frame_rate_hz"], np.zeros(count), tip, turns)
    write_images(folder, rig, None, path, make_probe(probe_spec), seed=[*seed, 2])
    marker_from_tip = probe_spec["marker_from_force"] @ np.array(probe_spec["force_from_tip"])
    return {"tip_m": marker_from_tip[:3, 3]}


def record_load(
    folder: Path, rig: Rig, options: Mapping, probe_spec: Mapping, *, seed: list
) -> dict[str, NDArray]:
    """Record static poses that differ much, the target towards the camera, and the empty table.

    Returns
    -------
    dict
        ``mass_kg`` and ``centre_of_mass_m`` (3,) of the sensor's payload, force frame;
        ``marker_from_force`` (3, 3), the sensor's rotation against the target.
    """
    probe_spec, common = rig.errors.probe(probe_spec), rig.common
    stop_s = options["poses"] * (options["hold_s"] + options["turn_s"])
    at = _static_poses(rig, options, probe_spec, np.random.default_rng([*seed, 1]))
    _record(folder, rig, probe_spec, at, _no_force, options["frame_rate_hz"], stop_s, seed)
    (folder / "background").mkdir()
    still = {"frames": common["background_frames"], "seed": [*seed, 6]}
    rig.write_still(folder / "background", Scene(rig.bench), **still)
    payload = rig.errors.force(common["force"])
    return {
        "mass_kg": np.array(payload["mass_kg"]),
        "centre_of_mass_m": np.array(payload["centre_of_mass_m"]),
        "marker_from_force": np.array(probe_spec["marker_from_force"])[:3, :3],
    }


def record_stiffness(
    folder: Path, rig: Rig, options: Mapping, probe_spec: Mapping, *, seed: list
) -> dict[str, NDArray]:
    """Load the ball against a rigid bench, with a compliant probe.

    All of the probe is shown where its target is: the ball goes into the bench by the probe's
    compliance, which no calibration looks at.

    Returns
    -------
    dict
        ``stiffness_n_m``, between target and ball along the probe's axis.
    """
    probe_spec = rig.errors.probe(probe_spec)
    at, force_at = _loaded(options, probe_spec, np.random.default_rng([*seed, 1]))
    stop_s = options["rest_s"] + options["presses"] * options["press_s"] + options["rest_s"]
    _record(folder, rig, probe_spec, at, force_at, options["frame_rate_hz"], stop_s, seed)
    return {"stiffness_n_m": np.array(options["stiffness_n_m"])}


def _record(
    folder: Path,
    rig: Rig,
    probe_spec: Mapping,
    at: Motion,
    force_at: Force,
    rate_hz: float,
    stop_s: float,
    seed: list,
) -> None:
    """Write images and force.csv of a motion and the force (n, 3) on its tip, table's frame [N]."""
    time_s, offset_s, _ = clocks(rig, round(stop_s * rate_hz), rate_hz, seed)
    options = rig.common["force"]
    lead_s = options["lead_s"]
    samples_s = np.arange(-lead_s, stop_s + lead_s, 1 / options["rate_hz"])
    path, force_n = at(samples_s), force_at(samples_s)
    write_record(folder, rig, path, force_n, probe_spec, seed, offset_s=offset_s)
    write_images(folder, rig, None, at(time_s), make_probe(probe_spec), seed=[*seed, 3])


def _static_poses(
    rig: Rig, options: Mapping, probe_spec: Mapping, rng: np.random.Generator
) -> Motion:
    """Poses with the target turned round in the picture, each time tilted to another side."""
    count, probe = options["poses"], make_probe(probe_spec)
    towards = -rig.reference.object_from_camera[:3, 2]
    down = upright(FACING, np.zeros((1, 2)))[0]
    # Of the target's middle and face, as of all of the probe, the tip is the origin.
    middle_m, face = probe.parts[-1].vertices_m.mean(axis=0), -probe.tip_from_marker[:3, 2]
    facing, _ = Rotation.align_vectors([towards], [down @ face])
    round_, around = 2 * np.pi * np.arange(count) / count, rng.uniform(0, 2 * np.pi, count)
    # Two directions across the line of sight, which is not level.
    first = np.cross(towards, FACING)
    first /= np.linalg.norm(first)
    across = np.array([first, np.cross(towards, first)])
    tilt = np.column_stack([np.cos(around), np.sin(around)]) @ across
    tilted = Rotation.from_rotvec(np.deg2rad(options["lean_deg"]) * tilt)
    turns = tilted * Rotation.from_rotvec(round_[:, None] * towards) * facing
    starts = np.arange(count) * (options["hold_s"] + options["turn_s"])
    times = np.column_stack([starts, starts + options["hold_s"]]).ravel()
    between, tones = Slerp(times, turns[np.repeat(np.arange(count), 2)]), Tones(rng, channels=3)
    target = np.array(options["camera"]["target_m"])

    def at(time_s: NDArray) -> ProbeMotion:
        tremor = Rotation.from_rotvec(np.deg2rad(options["tremor_deg"]) * tones(time_s))
        turn = (tremor * between(np.clip(time_s, times[0], times[-1]))).as_matrix() @ down
        return ProbeMotion(time_s, np.full(len(time_s), -1.0), target - turn @ middle_m, turn)

    return at


def _no_force(time_s: NDArray) -> NDArray:
    return np.zeros((len(time_s), 3))


def _loaded(
    options: Mapping, probe_spec: Mapping, rng: np.random.Generator
) -> tuple[Motion, Force]:
    """The ball comes down and is loaded some times; the force on it."""
    tones, tilt = Tones(rng, channels=2), np.deg2rad(options["tilt_deg"]) * rng.uniform(-1, 1, 2)
    rest_s, press_s, presses = options["rest_s"], options["press_s"], options["presses"]
    radius_m = probe_spec["indenter"]["radius_m"]

    def turned(time_s: NDArray) -> NDArray:
        return upright(FACING, tilt + np.deg2rad(options["tremor_deg"]) * tones(time_s))

    def force_n(time_s: NDArray) -> NDArray:
        part = np.clip((time_s - rest_s) / press_s, 0, presses)
        return options["force_n"] * np.sin(np.pi * part) ** 2

    def at(time_s: NDArray) -> ProbeMotion:
        turn, loaded_n = turned(time_s), force_n(time_s)
        above_m = HOVER_M * np.clip((rest_s - time_s) / APPROACH_S, 0, 1)
        tip_m = turn[:, :, 2] * (loaded_n / options["stiffness_n_m"])[:, None]
        tip_m[:, 2] += radius_m + above_m
        return ProbeMotion(time_s, -above_m, tip_m, turn)

    return at, lambda time_s: -force_n(time_s)[:, None] * turned(time_s)[:, :, 2]
