"""From gauge volts to the wrench on the sensor, its offset taken out (Section 4.1.3)."""

import logging
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from palpate.capture.tables import GAUGE_COLUMNS, WRENCH_COLUMNS, force_columns
from palpate.yaml_files import mismatch

# The sensor's driver averages ten samples of 1000 Hz (Section 4.1.3); records of another rate are
# averaged over the same time.
AVERAGED_S = 0.01
FEWEST_UNLOADED = 10
# A load that moves while the offset is taken: half of what counts as contact, and beyond noise.
MOVED_N, SURE = 0.05, 5.0
# So much of the record is the first frame's load [s].
FIRST_S = 0.05
SATURATION = 0.999
# No operator presses harder; a record in millinewtons does.
STRONGEST_N = 500.0
# A live gauge's noise crosses a step of the converter long before this time is over.
STILL_S = 1.0
WRENCH = list(WRENCH_COLUMNS)
FORCE = WRENCH[:3]


@dataclass(frozen=True)
class ForceRecord:
    """A record of wrenches on the sensor, its offset taken out."""

    time_s: NDArray  # (m,)
    wrench: NDArray  # (m, 6), force frame [N, Nm]
    zero_s: tuple[float, float]  # from when to when the sensor was taken for unloaded [s]
    columns: tuple[str, ...]  # of force.csv, that were taken

    def within(self, time_s: NDArray) -> NDArray:
        """Whether times lie where the offset was taken, (n,)."""
        return (time_s >= self.zero_s[0]) & (time_s < self.zero_s[1])

    def averaged(self) -> "ForceRecord":
        """The record averaged over a hundredth of a second."""
        size = max(1, round(AVERAGED_S / float(np.median(np.diff(self.time_s)))))
        time_s, wrench = block_mean(self.time_s, size), block_mean(self.wrench, size)
        return replace(self, time_s=time_s, wrench=wrench)


def block_mean(values: NDArray, size: int) -> NDArray:
    """Means of consecutive blocks of rows; a last incomplete block is left out."""
    blocks = len(values) // size
    return values[: blocks * size].reshape(blocks, size, *values.shape[1:]).mean(axis=1)


def zeroed(
    record: pd.DataFrame, probe: Mapping, bias_window_s: float, first_frame_s: float
) -> ForceRecord:
    """A record with the unloaded reading taken out.

    The payload weighs on it by the probe's pose: an offset from before all frames may
    be that of a probe that lay on the table.

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
        expected = f"a record at least twice as long as the bias window of {bias_window_s:g} s"
        raise mismatch("force", expected, f"{time_s[-1] - time_s[0]:.3g} s")
    columns, wrench = wrenches(record, probe)
    start = time_s[0] if first_frame_s < time_s[0] + bias_window_s else first_frame_s
    zero_s = _unloaded_s(time_s, wrench[:, 2], (start, start + bias_window_s), first_frame_s)
    known = ForceRecord(time_s, wrench, zero_s, columns)
    logging.info("force of %s..%s, zero from %.3f to %.3f s", columns[0], columns[-1], *zero_s)
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
        raise mismatch("force", f"{FEWEST_UNLOADED} samples {wanted}", len(inside))
    change_n = _change_n(*np.array_split(inside, 2))
    if not change_n:
        return window_s
    before_s = max(time_s[0], first_s - (window_s[1] - window_s[0])), first_s
    before, first = load_n(*before_s), load_n(first_s, first_s + FIRST_S)
    still = len(before) >= FEWEST_UNLOADED and not _change_n(*np.array_split(before, 2))
    if still and len(first) and not _change_n(before, first):
        return before_s
    raise mismatch("force", f"an unloaded probe {wanted}", f"its load change by {change_n:.2f} N")


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
        # Where it changes its value, and the record's ends.
        edges = [0, *np.flatnonzero(np.diff(channel)) + 1, len(channel) - 1]
        still_s = np.diff(time_s[edges]).max()
        if still_s > STILL_S:
            raise mismatch(f"force.csv: {name}", "a live gauge", f"one value for {still_s:.1f} s")
