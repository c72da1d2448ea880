"""Wrench on the object at each frame, by the tip's path and the force's record (Section 4.1.3)."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from palpate.capture.poses import POSES, read_poses
from palpate.config.sensor import said_of_base
from palpate.units import FROM_MEDIAN, GRAVITY_M_S2
from palpate.vision.clock import ClockOffset, clock_offset, stated_clock_std_s
from palpate.vision.force import FORCE, STRONGEST_N, WRENCH, ForceRecord, zeroed
from palpate.vision.options import Force, ProbePose
from palpate.vision.probe import (
    ALONG_STD,
    AXIS,
    MARKER,
    QUATERNION,
    TIP,
    marker_from_tip,
    marker_transforms,
    placed_poses,
    pose_table,
)
from palpate.yaml_files import mismatch

SMALLEST_PRESS_N, LARGEST_ANGLE_DEG = 0.2, 60.0
# Of the torque's noise, of the weight and of the tip's place; the study's captures have 0.4 mm.
LEVER_ERROR_M = 0.005
PATH = ["frame", "time_s", "inliers", ALONG_STD, *QUATERNION, *MARKER, *TIP]


def capture_path(
    folder: str | Path,
    record: pd.DataFrame,
    poses: pd.DataFrame,
    sensor: Mapping,
    probe: Mapping,
    options: Force,
    *,
    up: NDArray,
) -> tuple[pd.DataFrame, pd.DataFrame, ClockOffset]:
    """Forces at the frames, and all of the path that the estimate compares with them.

    Parameters
    ----------
    folder : path
        Of the capture.
    record, poses, sensor, probe, options, up
        As of `capture_wrenches`; the sensor's file with its base, if poses come from elsewhere.

    Returns
    -------
    DataFrame, DataFrame, ClockOffset
        force.csv: of `frame_wrenches`, of the frames; path.csv: `PATH` of probe_pose.csv and the
        force, in the frames and between them.

    Raises
    ------
    ValueError
        As `capture_wrenches` and `read_poses` do.
    """
    path = poses
    if (Path(folder) / POSES).is_file():
        path = _at_own_rate(Path(folder), poses, sensor, probe, options.linear_window_s)
        # Force and poses are each stated against the camera's clock.
        stds = [stated_clock_std_s(sensor), said_of_base(sensor, "clock_offset_std_s")]
        sensor = dict(sensor) | {"clock_offset_std_s": float(np.hypot(*stds))}
    table, clock = capture_wrenches(record, path, sensor, probe, options, up=up)
    at_frames = table[path["frame"].notna().to_numpy()].reset_index(drop=True)
    return at_frames.assign(frame=range(len(poses))), path[PATH].join(table[FORCE]), clock


def _at_own_rate(
    folder: Path, poses: pd.DataFrame, sensor: Mapping, probe: Mapping, window_s: float
) -> pd.DataFrame:
    """Poses at the frames and, a window apart, between them; tips by all poses of the window."""
    # By a shorter one the forces' noise would be a depth's of tenths of a millimetre.
    tracked, frames_s = read_poses(folder), poses["time_s"].to_numpy(float)
    step_s = float(np.median(np.diff(tracked.time_s)))
    parts = np.fmax(np.rint(np.diff(frames_s) / max(window_s, step_s)), 1).astype(int)
    ends = zip(frames_s[:-1], frames_s[1:], parts + 1, strict=True)
    between_s = np.concatenate([np.linspace(*one)[1:-1] for one in ends])
    placed = placed_poses(tracked, between_s, sensor) if len(between_s) else []
    kept = [k for k, pose in enumerate(placed) if pose is not None]
    path = poses
    if kept:
        found = [placed[k] for k in kept]
        more = pose_table(found, between_s[kept], probe, ProbePose(), sought=POSES)
        path = pd.concat([poses, more.drop(columns="frame")])
        path = path.sort_values("time_s", ignore_index=True)
    # From pose to pose, whatever is said of it.
    camera_from_tracked = sensor["base"]["camera_from_base"] @ tracked.base_from_tracked
    tips = camera_from_tracked @ marker_from_tip(probe)
    along_m = tips[:, :3, 3] @ tips[:, :3, 2].mean(axis=0)
    noise_m = FROM_MEDIAN * np.median(np.abs(np.diff(along_m, 2))) / np.sqrt(6)
    std_m = path[ALONG_STD].clip(lower=noise_m) / np.sqrt(max(window_s / step_s, 1))
    lines_m = _local_lines(path["time_s"].to_numpy(), tracked.time_s, tips[:, :3, 3], window_s)
    return path.assign(**{ALONG_STD: std_m}, **dict(zip(TIP, lines_m.T, strict=True)))


def capture_wrenches(
    record: pd.DataFrame,
    poses: pd.DataFrame,
    sensor: Mapping,
    probe: Mapping,
    options: Force,
    *,
    up: NDArray,
) -> tuple[pd.DataFrame, ClockOffset]:
    """Wrench on the object at every frame, of `frame_wrenches`, and the offset of the clocks.

    Parameters
    ----------
    record, poses : DataFrame
        force.csv of the capture and its probe_pose.csv.
    sensor, probe : mapping
        The sensor's file and the probe's.
    options : Force
    up : (3,) array
        Upward direction, camera frame.

    Raises
    ------
    ValueError
        As `zeroed`, `clock_offset`, `frame_wrenches` and `check_indentation` do.
    """
    frames_s = poses["time_s"].to_numpy(float)
    known = zeroed(record, probe, options.bias_window_s, frames_s[0])
    along = *force_along(known, probe), frames_s, *depth_along(poses)
    clock = clock_offset(*along, prior_std_s=stated_clock_std_s(sensor))
    table = frame_wrenches(known, poses, probe, options, up=up, clock_offset_s=clock.offset_s)
    check_indentation(table, poses[AXIS].to_numpy(float), probe["indenter"]["radius_m"])
    return table, clock


def depth_along(poses: pd.DataFrame) -> tuple[NDArray, NDArray]:
    """Tip's place along the mean pressing direction, and its standard deviation, (n,) each [m].

    Frames of probe_pose.csv without a marker get the largest deviation.
    """
    axis = poses[AXIS].to_numpy(float).mean(axis=0)
    axis /= np.linalg.norm(axis)
    std_m = poses[ALONG_STD].to_numpy(float)
    known = np.where(np.isfinite(std_m), std_m, np.nanmax(std_m))
    return poses[TIP].to_numpy(float) @ axis, known


def force_along(known: ForceRecord, probe: Mapping) -> tuple[NDArray, NDArray]:
    """Times [s] and force along the pressing direction [N], averaged, (m,) each."""
    averaged = known.averaged()
    return averaged.time_s, -averaged.wrench[:, :3] @ np.array(probe["force_from_tip"])[:3, 2]


def frame_wrenches(
    known: ForceRecord,
    poses: pd.DataFrame,
    probe: Mapping,
    options: Force,
    *,
    up: NDArray | None = None,
    clock_offset_s: float = 0.0,
) -> pd.DataFrame:
    """Wrench that the probe exerts on the object at each frame.

    Parameters
    ----------
    known : ForceRecord
        Of `zeroed`.
    poses : DataFrame
        Time [s] and pose of the marker at each frame, as probe_pose.csv has them.
    probe : mapping
        The probe's file; its ``load`` block states the sensor's payload.
    options : Force
        By whose ``matching`` the averaged reading nearest in time is taken, as the study does, or
        a line through all samples around the frame, which leaves less noise.
    up : (3,) array, optional
        Upward direction, camera frame; without it the payload's weight is left in.
    clock_offset_s : float, optional
        Force clock minus camera clock [s].

    Returns
    -------
    DataFrame
        ``frame, time_s, force_time_s, gap_s`` and the wrench about the tip, camera frame [N, Nm].

    Raises
    ------
    ValueError
        If a frame has no reading near.
    """
    frames_s, nearest_alone = poses["time_s"].to_numpy(float), options.matching == "nearest"
    read = known.averaged() if nearest_alone else known
    time_s = read.time_s - clock_offset_s
    nearest, gap_s = match_nearest(frames_s, time_s, largest_gap_s=options.largest_gap_s)
    wrench = read.wrench[nearest]
    if not nearest_alone:
        wrench = _local_lines(frames_s, time_s, read.wrench, options.linear_window_s)
    turns = marker_transforms(poses)[:, :3, :3] @ np.array(probe["marker_from_force"])[:3, :3]
    if up is not None and "load" in probe:
        resting = known.within(frames_s + clock_offset_s)
        resting[0] = True
        weight = weight_wrenches(turns, up, probe["load"])
        wrench = wrench - (weight - weight[resting].mean(axis=0))
    force, torque = wrench[:, :3], wrench[:, 3:]
    torque = torque - np.cross(np.array(probe["force_from_tip"])[:3, 3], force)
    table = pd.DataFrame({"frame": range(len(nearest)), "time_s": frames_s})
    table["force_time_s"], table["gap_s"] = time_s[nearest], gap_s
    table[WRENCH] = np.hstack([-np.einsum("nij,nj->ni", turns, part) for part in (force, torque)])
    return table


def check_indentation(table: pd.DataFrame, axis: NDArray, radius_m: float) -> None:
    """Reject a wrench that no operator exerts through a sphere, at its peak.

    Pressure and friction act on the sphere's surface: about its centre their torque is at most the
    radius times the force, whatever they are.

    The table is of `frame_wrenches`, ``axis`` (n, 3) the pressing direction at each frame, camera
    frame, and the radius the sphere's.

    Raises
    ------
    ValueError
        If the largest force exceeds 500 N, lies more than 60 degrees off the pressing direction,
        or passes the sphere's centre at more than the radius and 5 mm.
    """
    force = table[FORCE].to_numpy(float)
    size = np.linalg.norm(force, axis=1)
    peak = int(np.argmax(size))
    if not size[peak] <= STRONGEST_N:
        found = f"{size[peak]:.4g} N (newtons, and the unit of the gauges' calibration?)"
        raise mismatch("force.csv", f"at most {STRONGEST_N:g} N from an operator", found)
    if size[peak] < SMALLEST_PRESS_N:
        return
    angle = np.degrees(np.arccos(np.clip(force[peak] @ axis[peak] / size[peak], -1, 1)))
    if angle > LARGEST_ANGLE_DEG:
        found = f"it {angle:.0f} degrees off (order, sign and calibration of the channels?)"
        raise mismatch("force.csv", f"the press of {size[peak]:.2f} N along the probe", found)
    torque, farthest_m = table[WRENCH[3:]].to_numpy(float)[peak], radius_m + LEVER_ERROR_M
    lever_m = float(np.linalg.norm(torque) / size[peak])
    if lever_m > farthest_m:
        expected = f"a force within {farthest_m * 1e3:.1f} mm of the sphere's centre"
        hint = "(units of torque and force, calibration of the gauges, force_from_tip?)"
        raise mismatch("force.csv", expected, f"its line {lever_m * 1e3:.1f} mm away {hint}")


def weight_wrenches(camera_from_force: NDArray, up: NDArray, load: Mapping) -> NDArray:
    """Weight of the sensor's payload, about its origin, force frame, (n, 6) [N, Nm].

    By rotations (n, 3, 3), the upward unit vector (3,), camera frame, and ``mass_kg`` and
    ``centre_of_mass_m`` of the probe's file.
    """
    force = load["mass_kg"] * GRAVITY_M_S2 * -np.einsum("nji,j->ni", camera_from_force, up)
    return np.hstack([force, np.cross(np.array(load["centre_of_mass_m"]), force)])


def _local_lines(wanted_s: NDArray, time_s: NDArray, values: NDArray, window_s: float) -> NDArray:
    """Value at each wanted time of the line through the two samples or more around it, (n, k)."""
    found = []
    for moment in wanted_s:
        first, last = np.searchsorted(time_s, [moment - window_s / 2, moment + window_s / 2])
        first = int(np.clip(first, 0, len(time_s) - 2))
        near = slice(first, max(int(last), first + 2))
        away = time_s[near] - moment
        basis = np.column_stack([np.ones_like(away), away])
        found.append(np.linalg.lstsq(basis, values[near], rcond=None)[0][0])
    return np.array(found)


def match_nearest(
    wanted_s: NDArray, given_s: NDArray, *, largest_gap_s: float
) -> tuple[NDArray, NDArray]:
    """Index of the given time nearest to each wanted one, and the distance [s].

    Raises
    ------
    ValueError
        If a distance exceeds the largest gap.
    """
    after = np.clip(np.searchsorted(given_s, wanted_s), 1, len(given_s) - 1)
    nearest = after - (wanted_s - given_s[after - 1] <= given_s[after] - wanted_s)
    gap_s = np.abs(given_s[nearest] - wanted_s)
    worst = int(np.argmax(gap_s))
    if gap_s[worst] > largest_gap_s:
        expected = f"a reading within {largest_gap_s:g} s of each frame"
        raise mismatch("force", expected, f"{gap_s[worst]:.3g} s at frame {worst}")
    return nearest, gap_s
