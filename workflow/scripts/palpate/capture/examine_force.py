"""What is unusual of a press's record, and does not keep it from being used."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from palpate.capture.findings import Findings
from palpate.capture.tables import FORCE

SLOWEST_HZ = 100.0
# Drift or noise of the rest over the press's peak.
LARGEST_REST_SHARE = 0.1
# Frames before the press, and frames in it.
FEWEST_AT_REST, FEWEST_PRESSED = 2, 5
PRESSED_SHARE = 0.05


def examine_force(
    folder: Path,
    time_s: NDArray,
    load_n: NDArray,
    rest: NDArray,
    frames_s: NDArray,
    *,
    onset_n: float,
) -> Findings:
    """Look into a capture's record of forces.

    Parameters
    ----------
    folder : Path
        ``raw/<object>/<sensor>/<capture>``.
    time_s : (n,) array
        Of the samples [s].
    load_n : (n, 3) array
        On the sensor, its zero taken out, as running means [N].
    rest : (n,) bool array
        Where the zero was taken.
    frames_s : (m,) array
        Times of the frames, the record's clock [s].
    onset_n : float
        Smallest force that counts as contact [N].

    Returns
    -------
    Findings
    """
    path, size = folder / FORCE, np.linalg.norm(load_n, axis=1)
    rate = (len(time_s) - 1) / (time_s[-1] - time_s[0])
    peak, noise = float(size.max()), float(load_n[rest].std(axis=0).max())
    doubts = _restless(path, load_n[rest], peak)
    first = time_s < time_s[0] + np.ptp(time_s[rest])
    doubts += _other_zero(path, load_n[first].mean(axis=0), onset_n)
    if rate < SLOWEST_HZ:
        doubts.append(f"{path}: time_s: expected {SLOWEST_HZ:g} Hz or more, found {rate:.0f} Hz")
    doubts += _few_frames(folder, frames_s, time_s, size, onset_n)
    text = f"force {rate:.0f} Hz, {noise:.3f} N of noise at rest, peak {peak:.2f} N"
    return Findings(doubts=tuple(doubts), found=(text,))


def _restless(path: Path, rest_n: NDArray, peak_n: float) -> list[str]:
    half = max(1, len(rest_n) // 2)
    drift = np.linalg.norm(rest_n[half:].mean(axis=0) - rest_n[:half].mean(axis=0))
    noise = float(rest_n.std(axis=0).max())
    if max(drift, noise) <= LARGEST_REST_SHARE * peak_n:
        return []
    expected = "an unloaded probe where the zero is taken"
    return [f"{path}: force: expected {expected}, found it moving by {max(drift, noise):.2f} N"]


def _other_zero(path: Path, first_n: NDArray, onset_n: float) -> list[str]:
    """A record that begins with another load than where its zero is taken."""
    found = float(np.linalg.norm(first_n))
    if found <= onset_n:
        return []
    expected = "the load of the first frames, which is taken for zero, at the record's begin too"
    return [f"{path}: force: expected {expected}, found {found:.2f} N (where did the probe lie?)"]


def _few_frames(
    folder: Path, frames_s: NDArray, time_s: NDArray, size_n: NDArray, onset_n: float
) -> list[str]:
    """Too few frames before the press, or in it."""
    seen = np.interp(frames_s, time_s, size_n)
    pressed = np.flatnonzero(seen > max(onset_n, PRESSED_SHARE * size_n.max()))
    before = int(pressed[0]) if len(pressed) else len(seen)
    lines = []
    if before < FEWEST_AT_REST:
        expected = f"at least {FEWEST_AT_REST} before the press"
        lines.append(f"{folder}: frames: expected {expected}, found {before}")
    if len(pressed) < FEWEST_PRESSED:
        expected = f"at least {FEWEST_PRESSED} in the press"
        lines.append(f"{folder}: frames: expected {expected}, found {len(pressed)}")
    return lines
