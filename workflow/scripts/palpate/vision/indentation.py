"""A press as the tip's path and the force's record show it together."""

from collections.abc import Mapping

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from palpate.vision.clock import USB_CLOCK_STD_S, ClockOffset, clock_offset
from palpate.vision.force import (
    ForceRecord,
    averaged,
    check_direction,
    check_lever,
    frame_wrenches,
    zeroed,
)
from palpate.vision.options import Force
from palpate.vision.probe import ALONG_STD, AXIS, TIP, marker_transforms


def depth_along(poses: pd.DataFrame) -> tuple[NDArray, NDArray]:
    """Tip's place along the mean pressing direction, and its standard deviation, (n,) [m].

    Parameters
    ----------
    poses : DataFrame
        probe_pose.csv; frames without a marker get the largest deviation.
    """
    axis = poses[AXIS].to_numpy(float).mean(axis=0)
    axis /= np.linalg.norm(axis)
    std_m = poses[ALONG_STD].to_numpy(float)
    known = np.where(np.isfinite(std_m), std_m, np.nanmax(std_m))
    return poses[TIP].to_numpy(float) @ axis, known


def force_along(known: ForceRecord, probe: Mapping) -> tuple[NDArray, NDArray]:
    """Times [s] and force along the pressing direction [N], averaged, (m,) each."""
    time_s, wrench = averaged(known.time_s, known.wrench)
    axis = np.array(probe["force_from_tip"])[:3, 2]
    return time_s, -wrench[:, :3] @ axis


def capture_wrenches(
    record: pd.DataFrame,
    poses: pd.DataFrame,
    sensor: Mapping,
    probe: Mapping,
    options: Force,
    *,
    up: NDArray,
) -> tuple[pd.DataFrame, ClockOffset]:
    """Wrench on the object at every frame, with the offset of the clocks.

    Parameters
    ----------
    record : DataFrame
        force.csv of the capture.
    poses : DataFrame
        probe_pose.csv.
    sensor, probe : mapping
        The sensor's file and the probe's.
    options : Force
    up : (3,) array
        Upward direction, camera frame.

    Returns
    -------
    DataFrame
        Of `frame_wrenches`.
    ClockOffset

    Raises
    ------
    ValueError
        As `zeroed`, `clock_offset`, `frame_wrenches`, `check_direction` and `check_lever` do.
    """
    frames_s = poses["time_s"].to_numpy(float)
    known = zeroed(record, probe, options.bias_window_s, frames_s[0])
    depth_m, std_m = depth_along(poses)
    along = force_along(known, probe)
    prior_std_s = sensor.get("clock_offset_std_s", USB_CLOCK_STD_S)
    clock = clock_offset(*along, frames_s, depth_m, std_m, prior_std_s=prior_std_s)
    table = frame_wrenches(
        known,
        frames_s,
        marker_transforms(poses),
        probe,
        up=up,
        clock_offset_s=clock.offset_s,
        matching=options.matching,
        linear_window_s=options.linear_window_s,
        largest_gap_s=options.largest_gap_s,
    )
    check_direction(table, poses[AXIS].to_numpy(float))
    check_lever(table, probe["indenter"]["radius_m"])
    return table, clock
