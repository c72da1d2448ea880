"""From gauge volts to the wrench on the object at each frame (Section 4.1.3)."""

import logging
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from palpate.capture.tables import GAUGE_COLUMNS, WRENCH_COLUMNS, force_columns
from palpate.units import GRAVITY_M_S2

# The sensor's driver averages ten samples of 1000 Hz (Section 4.1.3); records of another rate are
# averaged over the same time.
AVERAGED_S = 0.01
FEWEST_UNLOADED = 10
SMALLEST_PRESS_N, LARGEST_ANGLE_DEG = 0.2, 60.0
# Of the torque's noise, of the weight and of the tip's place; the study's captures have 0.4 mm.
LEVER_ERROR_M = 0.005
# A load that moves while the zero is taken: half of what counts as contact, and beyond noise.
MOVED_N, SURE = 0.05, 5.0
# So much of the record is the first frame's load [s].
FIRST_S = 0.05
SATURATION = 0.999
# No hand presses harder; a record in millinewtons does.
STRONGEST_HAND_N = 500.0
# A live gauge's noise crosses a step of the converter long before this time is over.
STILL_S = 1.0
WRENCH = list(WRENCH_COLUMNS)
FORCE = WRENCH[:3]


@dataclass(frozen=True)
class ForceRecord:
    """A record of wrenches on the sensor, its zero taken out.

    Attributes
    ----------
    time_s : (m,) array
    wrench : (m, 6) array
        Force frame [N, Nm].
    zero_s : (float, float)
        From when to when the sensor was taken for unloaded [s].
    columns : tuple of str
        Of force.csv, that were taken.
    """

    time_s: NDArray
    wrench: NDArray
    zero_s: tuple[float, float]
    columns: tuple[str, ...]

    def within(self, time_s: NDArray) -> NDArray:
        """Whether times lie where the zero was taken, (n,)."""
        return (time_s >= self.zero_s[0]) & (time_s < self.zero_s[1])


def frame_wrenches(
    known: ForceRecord,
    frame_time_s: NDArray,
    camera_from_marker: NDArray,
    probe: Mapping,
    *,
    up: NDArray | None,
    matching: str,
    linear_window_s: float,
    largest_gap_s: float,
    clock_offset_s: float = 0.0,
) -> pd.DataFrame:
    """Wrench that the probe exerts on the object at each frame.

    Parameters
    ----------
    known : ForceRecord
        Of `zeroed`.
    frame_time_s : (n,) array
        Times of the frames [s].
    camera_from_marker : (n, 4, 4) array
        Marker pose at each frame.
    probe : mapping
        The probe's file; its ``load`` block says what hangs on the sensor.
    up : (3,) array or None
        Upward direction in the camera frame, along which the load's weight is taken out; None
        leaves the weight in.
    matching : {"nearest", "linear"}
        Averaged reading nearest in time, as the study does; or a line through all samples around
        the frame, which leaves less noise.
    linear_window_s : float
        Length of record to which the line is fitted [s].
    largest_gap_s : float
        Largest distance in time between a frame and its reading [s].
    clock_offset_s : float
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
    time_s, wrench = known.time_s - clock_offset_s, known.wrench
    if matching == "nearest":
        time_s, wrench = averaged(time_s, wrench)
    elif matching != "linear":
        raise ValueError(f"matching: expected nearest or linear, found {matching}")
    nearest, gap_s = match_nearest(frame_time_s, time_s, largest_gap_s=largest_gap_s)
    if matching == "nearest":
        at_frames = wrench[nearest]
    else:
        at_frames = local_lines(frame_time_s, time_s, wrench, window_s=linear_window_s)
    camera_from_force = camera_from_marker[:, :3, :3] @ np.array(probe["marker_from_force"])[:3, :3]
    if up is not None and "load" in probe:
        resting = known.within(frame_time_s + clock_offset_s)
        resting[0] = True
        weight = weight_wrenches(camera_from_force, up, probe["load"])
        at_frames = at_frames - (weight - weight[resting].mean(axis=0))
    at_tip = _about_tip(at_frames, np.array(probe["force_from_tip"])[:3, 3])
    force, torque = (
        -np.einsum("nij,nj->ni", camera_from_force, part) for part in np.split(at_tip, 2, axis=1)
    )
    table = pd.DataFrame({"frame": range(len(nearest)), "time_s": frame_time_s})
    table["force_time_s"], table["gap_s"] = time_s[nearest], gap_s
    table[WRENCH] = np.hstack([force, torque])
    return table


def check_direction(table: pd.DataFrame, axis: NDArray) -> None:
    """Refuse a force that no hand has, or that does not push where the probe points, at its peak.

    Parameters
    ----------
    table : DataFrame
        Of `frame_wrenches`.
    axis : (n, 3) array
        Pressing direction at each frame, camera frame.

    Raises
    ------
    ValueError
        If the largest force exceeds 500 N or lies more than 60 degrees off the pressing direction.
    """
    force = table[FORCE].to_numpy(float)
    size = np.linalg.norm(force, axis=1)
    peak = int(np.argmax(size))
    if not size[peak] <= STRONGEST_HAND_N:
        raise ValueError(
            f"force.csv: expected at most {STRONGEST_HAND_N:g} N from a hand, found"
            f" {size[peak]:.4g} N (newtons, and the unit of the gauges' calibration?)"
        )
    if size[peak] < SMALLEST_PRESS_N:
        return
    angle = np.degrees(np.arccos(np.clip(force[peak] @ axis[peak] / size[peak], -1, 1)))
    if angle > LARGEST_ANGLE_DEG:
        raise ValueError(
            f"force.csv: expected the press of {size[peak]:.2f} N along the probe, found it"
            f" {angle:.0f} degrees off (order, sign and calibration of the channels?)"
        )


def check_lever(table: pd.DataFrame, radius_m: float) -> None:
    """Refuse a wrench whose force passes beside the sphere, at its peak.

    Pressure and friction act on the sphere's surface: about its centre their torque is at most the
    radius times the force, whatever they are.

    Parameters
    ----------
    table : DataFrame
        Of `frame_wrenches`.
    radius_m : float
        Of the sphere.

    Raises
    ------
    ValueError
        If the force's line passes the centre at more than the radius and 5 mm.
    """
    wrench = table[WRENCH].to_numpy(float)
    size = np.linalg.norm(wrench[:, :3], axis=1)
    peak = int(np.argmax(size))
    if size[peak] < SMALLEST_PRESS_N:
        return
    lever_m = float(np.linalg.norm(wrench[peak, 3:]) / size[peak])
    if lever_m > radius_m + LEVER_ERROR_M:
        raise ValueError(
            f"force.csv: expected a force within {(radius_m + LEVER_ERROR_M) * 1e3:.1f} mm of the"
            f" sphere's centre, found its line {lever_m * 1e3:.1f} mm away (units of torque and"
            " force, calibration of the gauges, force_from_tip?)"
        )


def weight_wrenches(camera_from_force: NDArray, up: NDArray, load: Mapping) -> NDArray:
    """Weight of what hangs on the sensor, about its origin, force frame, (n, 6) [N, Nm].

    Parameters
    ----------
    camera_from_force : (n, 3, 3) array
    up : (3,) array
        Upward unit vector, camera frame.
    load : mapping
        ``mass_kg`` and ``centre_of_mass_m`` of the probe's file.
    """
    down = -np.einsum("nji,j->ni", camera_from_force, up)
    force = load["mass_kg"] * GRAVITY_M_S2 * down
    return np.hstack([force, np.cross(np.array(load["centre_of_mass_m"]), force)])


def averaged(time_s: NDArray, wrench: NDArray) -> tuple[NDArray, NDArray]:
    """Times and wrenches averaged over a hundredth of a second."""
    size = max(1, round(AVERAGED_S / float(np.median(np.diff(time_s)))))
    return block_mean(time_s, size), block_mean(wrench, size)


def local_lines(wanted_s: NDArray, time_s: NDArray, values: NDArray, *, window_s: float) -> NDArray:
    """Value at each wanted time of the line through the samples around it, (n, k).

    Parameters
    ----------
    wanted_s : (n,) array
    time_s : (m,) array
        Times of the samples, increasing [s].
    values : (m, k) array
    window_s : float
        Samples within half of this on either side are used; at least two.
    """
    found = []
    for moment in wanted_s:
        first, last = np.searchsorted(time_s, [moment - window_s / 2, moment + window_s / 2])
        first = int(np.clip(first, 0, len(time_s) - 2))
        near = slice(first, max(int(last), first + 2))
        away = time_s[near] - moment
        basis = np.column_stack([np.ones_like(away), away])
        found.append(np.linalg.lstsq(basis, values[near], rcond=None)[0][0])
    return np.array(found)


def block_mean(values: NDArray, size: int) -> NDArray:
    """Means of consecutive blocks of rows; a last incomplete block is left out."""
    blocks = len(values) // size
    return values[: blocks * size].reshape(blocks, size, *values.shape[1:]).mean(axis=1)


def match_nearest(
    wanted_s: NDArray, given_s: NDArray, *, largest_gap_s: float
) -> tuple[NDArray, NDArray]:
    """Index of the given time nearest to each wanted one, and the distance.

    Raises
    ------
    ValueError
        If a distance exceeds the largest gap.
    """
    after = np.clip(np.searchsorted(given_s, wanted_s), 1, len(given_s) - 1)
    earlier = wanted_s - given_s[after - 1] <= given_s[after] - wanted_s
    nearest = np.where(earlier, after - 1, after)
    gap_s = np.abs(given_s[nearest] - wanted_s)
    worst = int(np.argmax(gap_s))
    if gap_s[worst] > largest_gap_s:
        raise ValueError(
            f"force: expected a reading within {largest_gap_s:g} s of each frame,"
            f" found {gap_s[worst]:.3g} s at frame {worst}"
        )
    return nearest, gap_s


def zeroed(
    record: pd.DataFrame, probe: Mapping, bias_window_s: float, first_frame_s: float
) -> ForceRecord:
    """A record with the unloaded reading taken out.

    What hangs on the sensor weighs on it by the probe's pose: a zero from before all frames may be
    that of a probe that lay on the table.

    Parameters
    ----------
    record : DataFrame
        force.csv of a capture: ``time_s`` and gauge volts or a wrench (the load of the object on
        the tip, force frame).
    probe : mapping
        The probe's file.
    bias_window_s : float
        The mean of so much is the unloaded reading [s]: of the record's beginning where a frame
        shows the probe's pose in it, else from the first frame on; where the load moves in that,
        of what is right before the first frame, if the load is still there and the first frame's.
    first_frame_s : float
        Time of the first frame [s].

    Raises
    ------
    ValueError
        If a gauge is saturated or dead, the load moves, or too few samples are unloaded.
    """
    time_s = record["time_s"].to_numpy(dtype=float)
    if time_s[-1] - time_s[0] < 2 * bias_window_s:
        raise ValueError(
            f"force: expected a record at least twice as long as the bias window of"
            f" {bias_window_s:g} s, found {time_s[-1] - time_s[0]:.3g} s"
        )
    columns, wrench = wrenches(record, probe)
    start = time_s[0] if first_frame_s < time_s[0] + bias_window_s else first_frame_s
    zero_s = _unloaded_s(time_s, wrench[:, 2], (start, start + bias_window_s), first_frame_s)
    known = ForceRecord(time_s, wrench, zero_s, columns)
    logging.info("force of %s..%s, zero from %.3f to %.3f s", *columns[:: len(WRENCH) - 1], *zero_s)
    return replace(known, wrench=wrench - wrench[known.within(time_s)].mean(axis=0))


def wrenches(record: pd.DataFrame, probe: Mapping) -> tuple[tuple[str, ...], NDArray]:
    """Columns of a force.csv that count, and what the sensor says by them, (m, 6) [N, Nm].

    Raises
    ------
    ValueError
        If a gauge is saturated, dead or not calibrated.
    """
    columns = force_columns(record.columns, probe)
    wrench = record[list(columns)].to_numpy(dtype=float)
    if columns == GAUGE_COLUMNS:
        _check_gauges(wrench, probe, record["time_s"].to_numpy(dtype=float))
        wrench = wrench @ np.array(probe["gauge"]["calibration"]).T
    return columns, wrench


def _unloaded_s(
    time_s: NDArray, along_n: NDArray, window_s: tuple[float, float], first_s: float
) -> tuple[float, float]:
    """The window, or where the load moves in it, as much right before the first frame."""

    def load_n(start: float, end: float) -> NDArray:
        return along_n[(time_s >= start) & (time_s < end)]

    wanted = f"from {window_s[0]:.3f} to {window_s[1]:.3f} s of the record"
    inside = load_n(*window_s)
    if len(inside) < FEWEST_UNLOADED:
        expected = f"{FEWEST_UNLOADED} samples {wanted}"
        raise ValueError(f"force: expected {expected}, found {len(inside)}")
    change_n = _change_n(*np.array_split(inside, 2))
    if not change_n:
        return window_s
    before_s = max(time_s[0], first_s - (window_s[1] - window_s[0])), first_s
    before, first = load_n(*before_s), load_n(first_s, first_s + FIRST_S)
    still = len(before) >= FEWEST_UNLOADED and not _change_n(*np.array_split(before, 2))
    if still and len(first) and not _change_n(before, first):
        return before_s
    raise ValueError(
        f"force: expected an unloaded probe {wanted}, found its load change by {change_n:.2f} N"
    )


def _change_n(before: NDArray, after: NDArray) -> float:
    """How far the means of two stretches are apart, 0 if noise could do it or no contact [N]."""
    change_n = abs(float(after.mean() - before.mean()))
    noise_n = np.diff(np.concatenate([before, after])).std() / np.sqrt(2)
    mean_n = noise_n * np.sqrt(1 / len(before) + 1 / len(after))
    return change_n if change_n > max(MOVED_N, SURE * mean_n) else 0.0


def _check_gauges(volts: NDArray, probe: Mapping, time_s: NDArray) -> None:
    if "gauge" not in probe:
        raise ValueError("probe's file: gauge: expected a calibration of the volts, found none")
    limit = SATURATION * probe["gauge"]["range_v"]
    for name, channel in zip(GAUGE_COLUMNS, volts.T, strict=True):
        if np.abs(channel).max() >= limit:
            raise ValueError(f"force.csv: {name}: expected less than {limit:g} V, found saturation")
        still_s = _longest_still(channel, time_s)
        if still_s > STILL_S:
            raise ValueError(
                f"force.csv: {name}: expected a live gauge, found one value for {still_s:.1f} s"
            )


def _longest_still(values: NDArray, time_s: NDArray) -> float:
    """Longest time for which a channel keeps one value [s]."""
    changes = np.flatnonzero(np.diff(values)) + 1
    edges = np.concatenate([[0], changes, [len(values) - 1]])
    return float(np.diff(time_s[edges]).max())


def _about_tip(wrench: NDArray, tip_m: NDArray) -> NDArray:
    force = wrench[:, :3]
    return np.hstack([force, wrench[:, 3:] - np.cross(tip_m, force)])
