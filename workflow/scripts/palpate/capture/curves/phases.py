"""Approach, loading, hold and retract of a curve; which way its depth and its force count."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from palpate.units import FROM_MEDIAN

# Standard deviation of second differences over that of the samples.
SECOND_DIFFERENCES = np.sqrt(6.0)
BAND_DEVIATIONS = 3.0
# Least width of the band below a peak in which samples count as held, as part of the range.
BAND = 1e-3
# So many times longer than it took to climb through a band of its width: held. What rises by fewer
# bands than the last does not rise, and is not held then.
HELD, FEWEST_HELD, LEAST_RISE = 3.0, 5, 4.0
# Ends of the way that stand for the free and the loaded one.
END, BINS = 0.05, 50
# A way back shorter than this part of the whole is noise of the last samples.
BACK = 0.02
# Samples that leave their neighbours by this part of the range are glitches; by so many times the
# range of the others: no measurement.
GLITCH, OUT, GLITCH_SAMPLES = 0.1, 3.0, 25
# A loading goes from within this part of the range of its least to as near its greatest.
AGAIN = 0.4


@dataclass(frozen=True)
class Phases:
    """Parts of a record, in the order of its rows."""

    loading: slice  # approach and loading
    hold: slice  # what is held after it
    retract: slice  # the way back, and what follows
    loadings: int = 1  # how many there are in the record

    def summary(self, count: int) -> str:
        """How many samples a record has, and of which part."""
        parts = {"of loading": self.loading, "of hold": self.hold, "of retract": self.retract}
        counts = {"before": self.loading.start}
        counts |= {name: part.stop - part.start for name, part in parts.items()}
        if counts["of loading"] == count:
            return f"{count} samples"
        found = ", ".join(f"{number} {name}" for name, number in counts.items() if number)
        return f"{count} samples: {found}; the loading is fitted"


def signs_of(position: NDArray, force: NDArray) -> tuple[tuple[int, int], bool]:
    """Signs that make depth grow into the object and force grow with it, and whether that is plain.

    A record begins free; and force over depth is flat before contact and mostly convex, so that the
    free end of the way is the one whose force is nearer to the mean over the way. Where the two
    disagree the file's own signs are kept if either has them; else the shape counts, as of a
    retract alone.

    Parameters
    ----------
    position, force : (n,) arrays
        In the order of the record.
    """
    low, high = np.quantile(position, [0, 1])
    place = (position - low) / (high - low)
    bins = np.minimum((place * BINS).astype(int), BINS - 1)
    counts, sums = np.bincount(bins), np.bincount(bins, weights=force)
    levels = sums[counts > 0] / counts[counts > 0]
    ends = force[place <= END].mean(), force[place >= 1 - END].mean()
    by_shape = _signs(abs(ends[0] - levels.mean()) <= abs(ends[1] - levels.mean()), ends)
    by_order = _signs(float(np.median(place[:FEWEST_HELD])) < 0.5, ends)
    if by_shape == by_order:
        return by_shape, True
    # A free sensor reads less than a loaded one.
    own = by_order == (1, 1) and abs(ends[0]) <= abs(ends[1])
    return (by_order if own else by_shape), False


def _signs(free_is_low: bool, ends: tuple[float, float]) -> tuple[int, int]:
    """Signs of depth and force, where one end of the way is free."""
    free, loaded = ends if free_is_low else ends[::-1]
    return (1 if free_is_low else -1), (1 if loaded >= free else -1)


def phases_of(depth: NDArray, force: NDArray) -> Phases:
    """Loading, hold and retract of a record, of its deepest loading if it has several.

    The loading ends where depth or force first come within noise of their highest, if they stay
    there; else with the deepest sample. It begins with the record, or with the end of the retract
    before it. Of a record that begins pressed (`free_from`) only what follows counts.

    Parameters
    ----------
    depth, force : (n,) arrays
        Both growing with the indentation, in the order of the record.
    """
    if free := free_from(depth):
        rest = phases_of(depth[free:], force[free:])
        parts = (rest.loading, rest.hold, rest.retract)
        return Phases(*(slice(one.start + free, one.stop + free) for one in parts), rest.loadings)
    count, way = len(depth), _without_glitches(depth)
    # A way back shorter than this is noise.
    back = max(BACK * float(np.ptp(depth)), 2 * BAND_DEVIATIONS * noise_of(depth))
    deepest = int(np.argmax(way))
    after = way[deepest:] < way[deepest] - back
    end = deepest + int(np.argmax(after)) if after.any() else count
    start = _begin(way[: deepest + 1], back)
    held = [_held_from(one[start:end]) for one in (way, force)]
    found = [start + one for one in held if one is not None]
    # How often the way goes down into the object by most of its reach.
    sides = _sides(way)
    loadings = max(int((np.diff(sides[sides != 0], prepend=-1) > 0).sum()), 1)
    if found:
        stop, band = min(found) + 1, _band(way[start:end])
        end = int(np.flatnonzero(way[:end] >= way[deepest] - band)[-1]) + 1
        return Phases(slice(start, stop), slice(stop, end), slice(end, count), loadings)
    # Noise of the last samples is no hold and no way back.
    stop = deepest + 1 if after.any() else count
    return Phases(slice(start, stop), slice(stop, stop), slice(stop, count), loadings)


def outlier(values: NDArray) -> int | None:
    """First single sample that leaves its neighbours by several times the range of all others."""
    smooth = _smooth(values)
    out = np.abs(values - smooth) > OUT * np.ptp(smooth)
    return int(np.argmax(out)) if out.any() and np.ptp(smooth) > 0 else None


def _smooth(values: NDArray) -> NDArray:
    """A record without single samples that leave it, where it is long enough to tell."""
    return values if len(values) < GLITCH_SAMPLES else median_filter(values, 5, mode="nearest")


def _without_glitches(values: NDArray) -> NDArray:
    smooth = _smooth(values)
    return np.where(np.abs(values - smooth) > GLITCH * np.ptp(smooth), smooth, values)


def _begin(way: NDArray, back: float) -> int:
    """Sample with which the last loading of a way to its deepest begins."""
    falls = np.flatnonzero(np.maximum.accumulate(way) - way > back)
    if not len(falls):
        return 0
    top = int(np.argmax(way[: falls[-1] + 1]))
    return top + int(np.argmin(way[top:]))


def free_from(depth: NDArray) -> int:
    """First free sample of a record that begins pressed and is loaded again; 0 of others."""
    sides = _sides(way := _without_glitches(depth))
    free = np.flatnonzero(sides < 0)
    begins_free = not (sides[: free[0]] > 0).any()
    again = np.flatnonzero(sides[free[0] :] > 0)
    return 0 if begins_free or not len(again) else int(np.argmin(way[: free[0] + again[0]]))


def _sides(way: NDArray) -> NDArray:
    """Whether samples lie near a way's greatest (1), its least (-1) or between (0)."""
    reach = AGAIN * np.ptp(way)
    return np.select([way > way.max() - reach, way <= way.min() + reach], [1, -1])


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
