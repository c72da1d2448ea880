"""Approach, loading, hold and retract of a curve; which way its depth and its force count."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

# Normal distribution: standard deviation over median absolute value; of second differences, over
# that of the samples.
FROM_MEDIAN = 1.4826
SECOND_DIFFERENCES = np.sqrt(6.0)
BAND_DEVIATIONS = 3.0
# Least width of the band below a peak in which samples count as held, as part of the range.
BAND = 1e-3
# So many times longer than it took to climb through a band of its width: held.
HELD = 3.0
FEWEST_HELD = 5
# What rises by fewer bands than this does not rise, and is not held then.
LEAST_RISE = 4.0
# Ends of the way that stand for the free and the pressed one.
END = 0.05
BINS = 50
# A way back shorter than this part of the whole is noise of the last samples.
BACK = 0.02


@dataclass(frozen=True)
class Phases:
    """Parts of a record, in the order of its rows.

    Attributes
    ----------
    loading, hold, retract : slice
        Approach and loading; what is held after it; the way back.
    """

    loading: slice
    hold: slice
    retract: slice


def signs_of(position: NDArray, force: NDArray) -> tuple[int, int]:
    """Signs that make depth grow into the object and force grow with it.

    The free end of the way is the one whose force is nearer to the mean over the way: force over
    depth is convex, and flat before contact.

    Parameters
    ----------
    position, force : (n,) arrays
    """
    low, high = np.quantile(position, [0, 1])
    place = (position - low) / (high - low)
    bins = np.minimum((place * BINS).astype(int), BINS - 1)
    counts = np.bincount(bins, minlength=BINS)
    levels = np.bincount(bins, weights=force, minlength=BINS)[counts > 0] / counts[counts > 0]
    ends = force[place <= END].mean(), force[place >= 1 - END].mean()
    deeper_is_higher = abs(ends[0] - levels.mean()) <= abs(ends[1] - levels.mean())
    free, pressed = ends if deeper_is_higher else ends[::-1]
    return (1 if deeper_is_higher else -1), (1 if pressed >= free else -1)


def phases_of(depth: NDArray, force: NDArray) -> Phases:
    """Loading, hold and retract of a record.

    The loading ends where depth or force first come within noise of their highest, if they stay
    there; else with the deepest sample.

    Parameters
    ----------
    depth, force : (n,) arrays
        Both growing in the press, in the order of the record.
    """
    count, deepest = len(depth), int(np.argmax(depth))
    after = depth[deepest:] < depth[deepest] - BACK * np.ptp(depth)
    back = deepest + int(np.argmax(after)) if after.any() else count
    ends = [end for end in (_held_from(depth[:back]), _held_from(force[:back])) if end is not None]
    if ends:
        stop, band = min(ends) + 1, _band(depth[:back])
        back = int(np.flatnonzero(depth[:back] >= depth[deepest] - band)[-1]) + 1
        return Phases(slice(0, stop), slice(stop, back), slice(back, count))
    # Noise of the last samples is no hold and no way back.
    stop = deepest + 1 if after.any() else count
    return Phases(slice(0, stop), slice(stop, stop), slice(stop, count))


def noise_of(values: NDArray) -> float:
    """Standard deviation of a record's noise, by its second differences."""
    if len(values) < 3:
        return 0.0
    return FROM_MEDIAN * float(np.median(np.abs(np.diff(values, 2)))) / SECOND_DIFFERENCES


def _held_from(values: NDArray) -> int | None:
    """First sample within noise of the highest, if it stays there far longer than it climbed."""
    band, top = _band(values), float(values.max())
    if np.ptp(values) < LEAST_RISE * band:
        return None
    first = int(np.argmax(values >= top - band))
    climbed = first - int(np.argmax(values >= top - 2 * band))
    held = int((values[first:] >= top - band).sum())
    return first if held > HELD * climbed + FEWEST_HELD else None


def _band(values: NDArray) -> float:
    """How far below the highest a sample may lie that is as high."""
    return max(BAND_DEVIATIONS * noise_of(values), BAND * float(np.ptp(values)))
