"""The probe with its record of forces: held free in the air, or pressed on something rigid."""

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation, Slerp

from virtual_lab.motion import ProbeMotion, Tones, upright
from virtual_lab.probe import make_probe
from virtual_lab.record import FACING, film, write_record
from virtual_lab.rig import Rig, frame_times
from virtual_lab.scene import Scene

# The ball comes from so far above, and the hand takes so long.
HOVER_M, APPROACH_S = 0.010, 0.6
Motion = Callable[[NDArray], ProbeMotion]
Force = Callable[[NDArray], NDArray]


def record_load(
    folder: Path, rig: Rig, common: Mapping, options: Mapping, probe_spec: Mapping, *, seed: list
) -> dict[str, NDArray]:
    """Hold the probe still in poses that differ much, with its board towards the camera.

    Parameters
    ----------
    folder : Path
        Empty folder to fill with a capture, and ``background/`` of the empty table.
    rig : Rig
    common, probe_spec : mapping
        lab.yaml without its objects, the probe's file.
    options : mapping
        ``load`` block of lab.yaml.
    seed : list of int

    Returns
    -------
    dict
        ``mass_kg`` and ``centre_of_mass_m`` (3,) of what hangs on the sensor, force frame;
        ``marker_from_force`` (3, 3), the sensor's rotation against the board.
    """
    probe_spec = rig.device.probe(probe_spec)
    count, pose_s = options["poses"], options["hold_s"] + options["turn_s"]
    at = _held(rig, options, probe_spec, np.random.default_rng([*seed, 1]))
    _record(folder, rig, common, probe_spec, (at, _nothing), options, count * pose_s, seed)
    (folder / "background").mkdir()
    still = common["background_frames"]
    rig.write_still(folder / "background", Scene(rig.bench), frames=still, seed=[*seed, 6])
    hanging = rig.device.weighed(common["force"])
    return {
        "mass_kg": np.array(hanging["mass_kg"]),
        "centre_of_mass_m": np.array(hanging["centre_of_mass_m"]),
        "marker_from_force": np.array(probe_spec["marker_from_force"])[:3, :3],
    }


def record_stiffness(
    folder: Path, rig: Rig, common: Mapping, options: Mapping, probe_spec: Mapping, *, seed: list
) -> dict[str, NDArray]:
    """Press the ball on a bench that gives not way, with a probe that does.

    All of the probe is drawn where its board is: the ball goes into the bench by what the probe
    gives way by, which no calibration looks at.

    Parameters
    ----------
    folder, rig, common, probe_spec, seed
        As of `record_load`.
    options : mapping
        ``stiffness`` block of lab.yaml.

    Returns
    -------
    dict
        ``stiffness_n_m``, between board and ball along the probe's axis.
    """
    probe_spec = rig.device.probe(probe_spec)
    at, force_at = _pressed(options, probe_spec, np.random.default_rng([*seed, 1]))
    stop_s = options["rest_s"] + options["presses"] * options["press_s"] + options["rest_s"]
    _record(folder, rig, common, probe_spec, (at, force_at), options, stop_s, seed)
    return {"stiffness_n_m": np.array(options["stiffness_n_m"])}


def _record(
    folder: Path,
    rig: Rig,
    common: Mapping,
    probe_spec: Mapping,
    moved: tuple[Motion, Force],
    options: Mapping,
    stop_s: float,
    seed: list,
) -> None:
    """Write film and force.csv of a motion and the force (n, 3) on its tip, table's frame [N]."""
    (at, force_at), rate_hz = moved, options["frame_rate_hz"]
    clock = np.random.default_rng([*seed, 4])
    time_s = frame_times(common, round(stop_s * rate_hz), rate_hz, clock)
    offset_s = common["timing"]["clock_offset_s"] * clock.uniform(-1, 1)
    force = rig.device.weighed(common["force"])
    lead_s = force["lead_s"]
    samples_s = np.arange(-lead_s, stop_s + lead_s, 1 / force["rate_hz"])
    path, force_n = at(samples_s), force_at(samples_s)
    write_record(folder, rig.device, path, force_n, probe_spec, force, seed, offset_s=offset_s)
    film(folder, rig, None, at(time_s), make_probe(probe_spec), seed=[*seed, 3])


def _held(rig: Rig, options: Mapping, probe_spec: Mapping, rng: np.random.Generator) -> Motion:
    """A hand that turns the board round in the picture, each time leant to another side."""
    count, probe = options["poses"], make_probe(probe_spec)
    towards = -rig.reference.object_from_camera[:3, 2]
    down = upright(FACING, np.zeros((1, 2)))[0]
    # Of the board's middle and face, as of all of the probe, the tip is the origin.
    middle_m, face = probe.parts[-1].vertices_m.mean(axis=0), -probe.tip_from_marker[:3, 2]
    facing, _ = Rotation.align_vectors([towards], [down @ face])
    round_, way = 2 * np.pi * np.arange(count) / count, rng.uniform(0, 2 * np.pi, count)
    lean = np.column_stack([np.cos(way), np.sin(way)]) @ _across(towards)
    leant = Rotation.from_rotvec(np.deg2rad(options["lean_deg"]) * lean)
    turns = leant * Rotation.from_rotvec(round_[:, None] * towards) * facing
    pose_s = options["hold_s"] + options["turn_s"]
    starts = np.arange(count) * pose_s
    times = np.column_stack([starts, starts + options["hold_s"]]).ravel()
    between, tones = Slerp(times, turns[np.repeat(np.arange(count), 2)]), Tones(rng, channels=3)
    target = np.array(options["camera"]["target_m"])

    def at(time_s: NDArray) -> ProbeMotion:
        tremor = Rotation.from_rotvec(np.deg2rad(options["tremor_deg"]) * tones(time_s))
        turn = (tremor * between(np.clip(time_s, times[0], times[-1]))).as_matrix() @ down
        return ProbeMotion(time_s, np.full(len(time_s), -1.0), target - turn @ middle_m, turn)

    return at


def _nothing(time_s: NDArray) -> NDArray:
    return np.zeros((len(time_s), 3))


def _across(normal: NDArray) -> NDArray:
    """Two rows across a unit vector that is not level, and square to each other, (2, 3)."""
    first = np.cross(normal, FACING)
    first /= np.linalg.norm(first)
    return np.array([first, np.cross(normal, first)])


def _pressed(
    options: Mapping, probe_spec: Mapping, rng: np.random.Generator
) -> tuple[Motion, Force]:
    """A hand that lets the ball down and presses some times, and the force on the ball."""
    tones, lean = Tones(rng, channels=2), np.deg2rad(options["tilt_deg"]) * rng.uniform(-1, 1, 2)
    rest_s, press_s, presses = options["rest_s"], options["press_s"], options["presses"]
    radius_m = probe_spec["indenter"]["radius_m"]

    def turned(time_s: NDArray) -> NDArray:
        return upright(FACING, lean + np.deg2rad(options["tremor_deg"]) * tones(time_s))

    def force_n(time_s: NDArray) -> NDArray:
        part = np.clip((time_s - rest_s) / press_s, 0, presses)
        return options["force_n"] * np.sin(np.pi * part) ** 2

    def at(time_s: NDArray) -> ProbeMotion:
        turn, pressed_n = turned(time_s), force_n(time_s)
        above_m = HOVER_M * np.clip((rest_s - time_s) / APPROACH_S, 0, 1)
        tip_m = turn[:, :, 2] * (pressed_n / options["stiffness_n_m"])[:, None]
        tip_m[:, 2] += radius_m + above_m
        return ProbeMotion(time_s, -above_m, tip_m, turn)

    def on_ball(time_s: NDArray) -> NDArray:
        return -force_n(time_s)[:, None] * turned(time_s)[:, :, 2]

    return at, on_ball
