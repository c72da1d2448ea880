"""Whether a record of forces holds a press: rest, onset, peak, direction."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d

from palpate.capture.findings import Findings
from palpate.capture.tables import FORCE, GAUGE_COLUMNS, WRENCH_COLUMNS

# The first so many seconds are taken as zero, as the pipeline does.
REST_S = 0.5
# As the pipeline's onset of a press [N].
ONSET_N = 0.1
# Readings are averaged over so long, as the pipeline does.
AVERAGED_S = 0.01
SLOWEST_HZ = 100.0
# Drift or noise of the rest over the press's peak.
LARGEST_REST_SHARE = 0.1
# Part of the peak that runs along the probe.
LEAST_ALONG = 0.5
# Of the gauges' range.
SATURATED = 0.999
# Frames before the press, and frames in it.
FEWEST_AT_REST, FEWEST_PRESSED = 2, 5
PRESSED_SHARE = 0.05


def examine_force(folder: Path, force: pd.DataFrame, frames_s: NDArray, probe: Mapping) -> Findings:
    """Look into a capture's force.csv.

    Parameters
    ----------
    folder : Path
        ``raw/<object>/<sensor>/<capture>``.
    force : DataFrame
        Its force.csv, right by its columns.
    frames_s : (n,) array
        Times of the frames [s].
    probe : mapping
        The probe's specification.

    Returns
    -------
    Findings
    """
    path, time = folder / FORCE, force["time_s"].to_numpy(float)
    rate = (len(time) - 1) / (time[-1] - time[0])
    load = _averaged(_load_n(force, probe), round(AVERAGED_S * rate))
    rest = time <= time[0] + REST_S
    pressed = load - load[rest].mean(axis=0)
    size = np.linalg.norm(pressed, axis=1)
    at, noise = int(size.argmax()), float(load[rest].std(axis=0).max())
    if size[at] < ONSET_N:
        expected = f"a press of more than {ONSET_N:g} N over the first {REST_S:g} s"
        return Findings((f"{path}: force: expected {expected}, found {size[at]:.3f} N",))
    wrong = [*_saturated(path, force, probe), *_pulled(path, pressed[at])]
    doubts = [*_restless(path, load[rest], size[at]), *_sideways(path, pressed[at])]
    if rate < SLOWEST_HZ:
        doubts.append(f"{path}: time_s: expected {SLOWEST_HZ:g} Hz or more, found {rate:.0f} Hz")
    doubts += _few_frames(folder, frames_s, time, size)
    text = f"force {rate:.0f} Hz, {noise:.3f} N of noise at rest, peak {size[at]:.2f} N"
    return Findings(tuple(wrong), tuple(doubts), (text,))


def _load_n(force: pd.DataFrame, probe: Mapping) -> NDArray:
    """Force on the sensor in its axes, (n, 3) [N]."""
    if set(WRENCH_COLUMNS) <= set(force.columns):
        return force[list(WRENCH_COLUMNS[:3])].to_numpy(float)
    volts = force[list(GAUGE_COLUMNS)].to_numpy(float)
    return volts @ np.array(probe["gauge"]["calibration"])[:3].T


def _averaged(load_n: NDArray, count: int) -> NDArray:
    """Running means over a count of samples."""
    return uniform_filter1d(load_n, max(1, count), axis=0, mode="nearest")


def _saturated(path: Path, force: pd.DataFrame, probe: Mapping) -> list[str]:
    if not set(GAUGE_COLUMNS) <= set(force.columns):
        return []
    limit = SATURATED * probe["gauge"]["range_v"]
    over = [name for name in GAUGE_COLUMNS if np.abs(force[name]).max() >= limit]
    expected = f"volts within {probe['gauge']['range_v']:g} V"
    return [f"{path}: {name}: expected {expected}, found it at its limit" for name in over]


def _pulled(path: Path, peak_n: NDArray) -> list[str]:
    """A press that seems to pull: the sign, or the unloaded start, is wrong."""
    if peak_n[2] < LEAST_ALONG * np.linalg.norm(peak_n):
        return []
    expected = "a press to lower it (z points to the tip, the record begins unloaded)"
    return [f"{path}: fz: expected {expected}, found {peak_n[2]:+.2f} N at the peak"]


def _sideways(path: Path, peak_n: NDArray) -> list[str]:
    along = abs(peak_n[2]) / np.linalg.norm(peak_n)
    if along >= LEAST_ALONG:
        return []
    expected = "a press along the probe's axis z"
    return [f"{path}: force: expected {expected}, found {along:.0%} of the peak along it"]


def _restless(path: Path, rest_n: NDArray, peak_n: float) -> list[str]:
    half = max(1, len(rest_n) // 2)
    drift = np.linalg.norm(rest_n[half:].mean(axis=0) - rest_n[:half].mean(axis=0))
    noise = float(rest_n.std(axis=0).max())
    if max(drift, noise) <= LARGEST_REST_SHARE * peak_n:
        return []
    expected = f"an unloaded probe for the first {REST_S:g} s"
    return [f"{path}: force: expected {expected}, found it moving by {max(drift, noise):.2f} N"]


def _few_frames(folder: Path, frames_s: NDArray, time_s: NDArray, size_n: NDArray) -> list[str]:
    """Too few frames before the press, or in it."""
    seen = np.interp(frames_s, time_s, size_n)
    pressed = np.flatnonzero(seen > max(ONSET_N, PRESSED_SHARE * size_n.max()))
    before = int(pressed[0]) if len(pressed) else len(seen)
    lines = []
    if before < FEWEST_AT_REST:
        expected = f"at least {FEWEST_AT_REST} before the press"
        lines.append(f"{folder}: frames: expected {expected}, found {before}")
    if len(pressed) < FEWEST_PRESSED:
        expected = f"at least {FEWEST_PRESSED} in the press"
        lines.append(f"{folder}: frames: expected {expected}, found {len(pressed)}")
    return lines
