"""Which colour image belongs to which depth image, by their stamps."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Pairs:
    """Images that were taken together.

    Parameters
    ----------
    color, depth : (n,) int arrays
        Their places in the streams, by the time of the colour image.
    within_ns : float
        How far apart they may be [ns].
    farthest_ns : int
        How far apart they are at most [ns].
    missed_ns : (k,) int array
        How far apart those are that are each other's nearest, but not within that [ns].
    """

    color: NDArray
    depth: NDArray
    within_ns: float
    farthest_ns: int
    missed_ns: NDArray


def paired(color_ns: NDArray, depth_ns: NDArray, within_ns: float | None = None) -> Pairs:
    """Pair images of two streams that are nearest to each other.

    Parameters
    ----------
    color_ns, depth_ns : (n,), (m,) int64 arrays
        Stamps [ns], in any order.
    within_ns : float, optional
        How far apart they may be [ns]; half a frame if not given. A frame lasts as long as the
        median interval of the faster stream.

    Returns
    -------
    Pairs

    Raises
    ------
    ValueError
        If a stream has fewer than two images, or its stamps do not move.
    """
    half_ns = min(_interval(color_ns, "color"), _interval(depth_ns, "depth")) / 2
    within_ns = half_ns if within_ns is None else within_ns
    # Halfway between two, one side takes the later and the other the earlier: they still agree.
    to_depth = _nearest(color_ns, depth_ns, later=True)
    to_color = _nearest(depth_ns, color_ns, later=False)
    apart = np.abs(depth_ns[to_depth] - color_ns)
    mutual = to_color[to_depth] == np.arange(len(color_ns))
    color = np.flatnonzero(mutual & (apart <= within_ns))
    color = color[np.argsort(color_ns[color], kind="stable")]
    farthest = int(apart[color].max()) if len(color) else 0
    return Pairs(color, to_depth[color], within_ns, farthest, apart[mutual & (apart > within_ns)])


def _interval(times_ns: NDArray, name: str) -> float:
    if len(times_ns) < 2:
        raise ValueError(f"{name}: expected at least 2 images, found {len(times_ns)}")
    steps = np.diff(np.unique(times_ns))
    if not len(steps):
        raise ValueError(f"{name}: stamps: expected times that move, found {times_ns[0]} ns only")
    return float(np.median(steps))


def _nearest(times: NDArray, others: NDArray, *, later: bool) -> NDArray:
    """Place of the nearest other time for each time; of one stamp's images, the first."""
    order = np.argsort(others, kind="stable")
    ordered = others[order]
    after = np.clip(np.searchsorted(ordered, times), 1, len(ordered) - 1)
    before = after - 1
    nearer = (times - ordered[before]) - (ordered[after] - times)
    closer = np.where(nearer > 0, after, before)
    closer = np.where((nearer == 0) & later, after, closer)
    return order[np.searchsorted(ordered, ordered[closer])]
