"""Noise of a surface's motion: how it is correlated over distance."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

# Steps and end of the correlogram [m].
LAG_M, LAGS = 0.002, 20


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
