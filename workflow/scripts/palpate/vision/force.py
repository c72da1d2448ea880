"""From gauge volts to the wrench on the object at each frame (Section 4.1.3)."""

from collections.abc import Mapping

import numpy as np
import pandas as pd
from numpy.typing import NDArray

# The sensor's driver averages ten samples of 1000 Hz (Section 4.1.3); records of another rate are
# averaged over the same time.
AVERAGED_S = 0.01
FEWEST_UNLOADED = 10
SATURATION = 0.999
GAUGES = ["v0", "v1", "v2", "v3", "v4", "v5"]
FORCE = ["fx_n", "fy_n", "fz_n"]
WRENCH = [*FORCE, "tx_nm", "ty_nm", "tz_nm"]


def frame_wrenches(
    record: pd.DataFrame,
    frame_time_s: NDArray,
    camera_from_marker: NDArray,
    probe: Mapping,
    *,
    bias_window_s: float,
    largest_gap_s: float,
) -> pd.DataFrame:
    """Wrench that the probe exerts on the object at each frame.

    Parameters
    ----------
    record : DataFrame
        force.csv of a capture: ``time_s`` and gauge volts or a wrench (the load of the object on
        the tip, force frame).
    frame_time_s : (n,) array
        Times of the frames [s].
    camera_from_marker : (n, 4, 4) array
        Marker pose at each frame.
    probe : mapping
        The probe's file.
    bias_window_s : float
        The mean of this first part of the record is taken as the unloaded reading [s].
    largest_gap_s : float
        Largest distance in time between a frame and its reading [s].

    Returns
    -------
    DataFrame
        ``frame, time_s, force_time_s, gap_s`` and the wrench about the tip, camera frame [N, Nm].

    Raises
    ------
    ValueError
        If a gauge is saturated or dead, the bias window is empty, or a frame has no reading near.
    """
    time_s, wrench = _unbiased(record, probe, bias_window_s)
    size = max(1, round(AVERAGED_S / float(np.median(np.diff(time_s)))))
    time_s, wrench = block_mean(time_s, size), block_mean(wrench, size)
    nearest, gap_s = match_nearest(frame_time_s, time_s, largest_gap_s=largest_gap_s)
    at_tip = _about_tip(wrench[nearest], np.array(probe["force_from_tip"])[:3, 3])
    turn = camera_from_marker[:, :3, :3] @ np.array(probe["marker_from_force"])[:3, :3]
    force = -np.einsum("nij,nj->ni", turn, at_tip[:, :3])
    torque = -np.einsum("nij,nj->ni", turn, at_tip[:, 3:])
    table = pd.DataFrame({"frame": range(len(nearest)), "time_s": frame_time_s})
    table["force_time_s"], table["gap_s"] = time_s[nearest], gap_s
    table[WRENCH] = np.hstack([force, torque])
    return table


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


def _unbiased(
    record: pd.DataFrame, probe: Mapping, bias_window_s: float
) -> tuple[NDArray, NDArray]:
    """Times and wrench (force frame) with the unloaded reading taken out."""
    time_s = record["time_s"].to_numpy(dtype=float)
    unloaded = time_s < time_s[0] + bias_window_s
    if unloaded.sum() < FEWEST_UNLOADED:
        found = int(unloaded.sum())
        raise ValueError(
            f"force: expected {FEWEST_UNLOADED} samples in the first {bias_window_s:g} s,"
            f" found {found}"
        )
    if set(GAUGES) <= set(record.columns):
        volts = record[GAUGES].to_numpy(dtype=float)
        _check_gauges(volts, probe)
        calibration = np.array(probe["gauge"]["calibration"])
        return time_s, (volts - volts[unloaded].mean(axis=0)) @ calibration.T
    wrench = record[WRENCH].to_numpy(dtype=float)
    return time_s, wrench - wrench[unloaded].mean(axis=0)


def _check_gauges(volts: NDArray, probe: Mapping) -> None:
    if "gauge" not in probe:
        raise ValueError(f"probe {probe['probe']}: gauge: expected a calibration, found none")
    limit = SATURATION * probe["gauge"]["range_v"]
    for name, channel in zip(GAUGES, volts.T, strict=True):
        if np.abs(channel).max() >= limit:
            raise ValueError(f"force.csv: {name}: expected less than {limit:g} V, found saturation")
        if np.ptp(channel) == 0:
            raise ValueError(f"force.csv: {name}: expected a live gauge, found {channel[0]:g} V")


def _about_tip(wrench: NDArray, tip_m: NDArray) -> NDArray:
    force = wrench[:, :3]
    return np.hstack([force, wrench[:, 3:] - np.cross(tip_m, force)])
