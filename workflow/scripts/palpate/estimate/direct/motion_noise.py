"""Noise of a surface's motion: how it hangs together over distance, and how it grows with motion.

A sensor's fixed pattern goes with the frames at rest only as long as the surface stays where it
was. Its windows see other grey values or dots when the surface has moved, and the pattern slowly
becomes another one: by how much is seen in how rough the motion is.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from palpate.estimate.hertz.range import FROM_MEDIAN

# Steps and end of the correlogram [m].
LAG_M, LAGS = 0.002, 20
# The motion is smooth over this part of the surface around the contact [m].
SMOOTH_REACH_M = 0.06
# Samples rougher than so many deviations were seen wrongly, and tell nothing of the pattern.
ROUGHEST = 4.0
# Powers of the distance from the contact, and multiples of the azimuth, of a smooth motion.
POWERS, MULTIPLES = (0, -1, -2), (1,)


def correlogram(places_m: NDArray, noise: NDArray) -> tuple[NDArray, NDArray]:
    """Correlation of noise over distance.

    Parameters
    ----------
    places_m : (c, 3) array
        Places [m].
    noise : (f, c) array
        In frames, of any unit; not a number where there is none.

    Returns
    -------
    distance_m, correlation : (20,) arrays
        In steps of 2 mm, their mean distances [m]; not a number where no two places are that far
        apart.
    """
    pairs = cKDTree(places_m).query_pairs(LAG_M * LAGS, output_type="ndarray")
    apart = np.linalg.norm(places_m[pairs[:, 0]] - places_m[pairs[:, 1]], axis=1)
    product = noise[:, pairs[:, 0]] * noise[:, pairs[:, 1]]
    step = np.minimum((apart / LAG_M).astype(int), LAGS - 1)
    sums = np.bincount(step, np.nansum(product, axis=0), LAGS)
    counts = np.bincount(step, np.isfinite(product).sum(axis=0), LAGS)
    distance = np.bincount(step, apart, LAGS) / np.maximum(np.bincount(step, minlength=LAGS), 1)
    covariance = np.where(counts > 0, sums / np.maximum(counts, 1), np.nan)
    return np.where(counts > 0, distance, np.nan), covariance / np.nanmean(noise**2)


def correlation_length(places_m: NDArray, noise: NDArray) -> float:
    """L of the correlation exp(-(distance / L)^2) that is nearest to the correlogram [m].

    Parameters
    ----------
    places_m : (c, 3) array
        Places [m].
    noise : (f, c) array
        In frames; not a number where there is none.

    Returns
    -------
    float
        0 where there are no two places.
    """
    distance, correlation = correlogram(places_m, noise)
    known = np.isfinite(correlation)
    if not known.any():
        return 0.0
    lengths = np.linspace(LAG_M / 4, LAG_M * LAGS, 200)
    model = np.exp(-((distance[known] / lengths[:, None]) ** 2))
    return float(lengths[np.argmin(((model - correlation[known]) ** 2).sum(axis=1))])


def pattern_growth(
    places_m: NDArray, moved_m: NDArray, variance_m2: NDArray, contact_m: NDArray
) -> float:
    """Growth of the pattern's variance with the motion [m]: the variance is growth * abs(moved).

    Whatever of the motion no smooth function of the place describes, less what the frames' noise
    explains, is the pattern's.

    Parameters
    ----------
    places_m : (c, 3) array
        Samples [m].
    moved_m, variance_m2 : (c,) arrays
        Motion of the pressed surface [m] and variance of its noise [m^2]; not a number where a
        sample was not seen.
    contact_m : (3,) array
        Contact [m].

    Returns
    -------
    float
        0 where too few samples are seen.
    """
    offset = places_m - contact_m
    near = np.isfinite(moved_m) & (np.linalg.norm(offset, axis=1) < SMOOTH_REACH_M)
    terms = _smooth_terms(offset[near])
    moved, variance = moved_m[near], variance_m2[near]
    kept = np.ones(len(moved), dtype=bool)
    for _ in range(2):
        if kept.sum() <= 2 * terms.shape[1]:
            return 0.0
        weight = 1 / np.sqrt(variance[kept])
        solution, *_ = np.linalg.lstsq(weight[:, None] * terms[kept], weight * moved[kept])
        rough = moved - terms @ solution
        kept = np.abs(rough) < ROUGHEST * FROM_MEDIAN * np.median(np.abs(rough[kept]))
    freedom = kept.sum() / (kept.sum() - terms.shape[1])
    # Squares scatter as their expectation: noisy samples tell little.
    way = np.abs(terms @ solution)[kept] / variance[kept]
    excess = freedom * rough[kept] ** 2 / variance[kept] - 1
    return float(max((way * excess).sum() / (way**2).sum(), 0.0))


def _smooth_terms(offset_m: NDArray) -> NDArray:
    """Terms of a smooth motion around the contact, (c, 9)."""
    _, _, directions = np.linalg.svd(offset_m, full_matrices=False)
    x, y = directions[:2] @ offset_m.T
    r, azimuth = np.linalg.norm(offset_m, axis=1) / SMOOTH_REACH_M, np.arctan2(y, x)
    around = [np.ones_like(r)]
    around += [wave(k * azimuth) for k in MULTIPLES for wave in (np.cos, np.sin)]
    return np.column_stack([r**power * part for power in POWERS for part in around])
