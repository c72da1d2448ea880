"""Relaxation times to choose among, and equally likely amplitudes."""

from functools import cache
from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

# From two frame intervals to the length of the contact, about a factor of three apart.
FIRST_INTERVALS = 2.0
FACTOR = 3.0
FEWEST, MOST = 2, 4
# Points of the whole share, and of each breaking of it.
SHARES, BREAKS = 24, 6
# A material keeps something.
LARGEST_SHARE = 0.95


def relaxation_times(time_s: NDArray) -> NDArray:
    """Times spread over a contact that its samples can tell apart.

    Parameters
    ----------
    time_s : (n,) array
        Times of the samples from the onset of force to the end of the hold, increasing [s].

    Returns
    -------
    (p,) array
        Two to four times from two median intervals to the whole length, in geometric steps [s].

    Raises
    ------
    ValueError
        If there are fewer than four samples.
    """
    if len(time_s) < 4:
        raise ValueError(f"time_s: expected at least 4 samples in contact, found {len(time_s)}")
    first = FIRST_INTERVALS * float(np.median(np.diff(time_s)))
    last = max(float(time_s[-1] - time_s[0]), FACTOR * first)
    count = 1 + round(np.log(last / first) / np.log(FACTOR))
    return np.geomspace(first, last, int(np.clip(count, FEWEST, MOST)))


@cache
def amplitude_grid(terms: int, *, scale: float) -> NDArray:
    """Equally likely amplitudes of a Prony series, (g, terms).

    The whole share has a half-normal prior and every split of it is as likely as any other: a
    Dirichlet distribution of ones, by the quantiles of breaking a stick.

    Parameters
    ----------
    terms : int
    scale : float
        Scale of the half-normal distribution of the whole share.

    Raises
    ------
    ValueError
        If there is no term, or the scale is not from 0 to 1.
    """
    if terms < 1:
        raise ValueError(f"terms: expected 1 or more, found {terms}")
    if not 0 < scale <= 1:
        raise ValueError(f"scale: expected a share above 0 and up to 1, found {scale:g}")
    share = scale * ndtri(0.5 + (np.arange(SHARES) + 0.5) / (2 * SHARES))
    share = share[share < LARGEST_SHARE]
    splits = np.array([_split(u) for u in product(_middles(BREAKS), repeat=terms - 1)])
    grid = (share[:, None, None] * splits).reshape(-1, terms)
    grid.flags.writeable = False
    return grid


def _middles(count: int) -> NDArray:
    return (np.arange(count) + 0.5) / count


def _split(quantiles: tuple[float, ...]) -> list[float]:
    """Parts of a stick broken at Beta(1, k) quantiles, k the number of parts still to come."""
    left, parts = 1.0, []
    for k, u in zip(range(len(quantiles), 0, -1), quantiles, strict=True):
        part = 1 - (1 - u) ** (1 / k)
        parts.append(left * part)
        left *= 1 - part
    return [*parts, left]
