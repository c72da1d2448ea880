"""How far what is compared scatters: noise, what moves with the surface, and what errs together."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls

from palpate.estimate.direct.indentation import (
    DirectIndentation,
    Parameters,
    residuals,
    with_depth_std,
)
from palpate.estimate.direct.motion_noise import correlation_length
from palpate.estimate.hertz.range import FROM_MEDIAN
from palpate.estimate.minimise.scatter import error_clusters

# Deviations beyond which a residual counts with its size alone.
ROBUST = 8.0
# Degrees of freedom of the motions' scatter, steps of its search, and the least part of a variance
# that was stated.
TAILS, VARIANCE_STEPS, LEAST_NOISE = 4.0, 30, 0.1
# Larger parts would be too few to tell their scatter [m].
LARGEST_PATCH_M = 0.04


def with_pattern(
    indentation: DirectIndentation, of: Parameters, *, times_s: NDArray
) -> DirectIndentation:
    """Deviations as the residuals show them: of each frame's noise, and of what moves.

    A sensor's fixed pattern cancels where nothing moves; where the surface moves it does not, with
    a variance about in proportion to the motion.
    """
    gaps = (
        residuals(indentation, of, times_s=times_s).motion
        * indentation.moved_std_m[indentation.seen]
    )
    noise = indentation.noise_std_m[indentation.seen] ** 2
    size = np.abs(indentation.moved_m[indentation.seen] - gaps)
    of_noise, of_motion = variance_parts(gaps, np.column_stack([noise, size]))
    variance = of_noise * indentation.noise_std_m**2
    motion = np.full(indentation.moved_m.shape, np.nan)
    motion[indentation.seen] = size
    pressed = replace(indentation, moved_std_m=np.sqrt(variance + of_motion * motion))
    left = np.full(indentation.moved_m.shape, np.nan)
    left[indentation.seen] = gaps
    pressed = with_depth_std(pressed, of, times_s=times_s)
    return replace(pressed, cluster=_clusters(pressed, left))


def variance_parts(gaps: NDArray, parts: NDArray) -> NDArray:
    """Shares of parts of a variance that gaps with wide tails are most likely to have.

    Student's t (Lange, Little and Taylor 1989) by Fisher's scoring, with as many steps whatever the
    gaps are: shares that hung on the gaps' order would differ where only the last bit does.

    Parameters
    ----------
    gaps : (n,) array
    parts : (n, p) array
        Of the gaps' unit, squared; the first above 0.

    Returns
    -------
    (p,) array
        At least 0; the first at least `LEAST_NOISE`.
    """
    unit = parts.mean(axis=0) + 1e-300
    table, square = parts / unit, gaps**2
    shares = np.full(parts.shape[1], square.mean() / parts.shape[1])
    for _ in range(VARIANCE_STEPS):
        variance = np.maximum(table @ shares, LEAST_NOISE * table[:, 0] * unit[0])
        expected = square * (TAILS + 1) / (TAILS + square / variance)
        shares, _ = nnls(table / variance[:, None], expected / variance)
    shares = shares / unit
    return np.concatenate([np.maximum(shares[:1], LEAST_NOISE), shares[1:]])


def _clusters(indentation: DirectIndentation, left_m: NDArray) -> NDArray:
    """Patches at least as large as residuals err together: twice their correlation's length."""
    seen = indentation.seen.any(axis=0)
    mean = np.nanmean((left_m / indentation.moved_std_m)[:, seen], axis=0)
    length = correlation_length(indentation.cell_m[seen], mean[None])
    size = min(max(indentation.patch_m, 2 * length), LARGEST_PATCH_M)
    return error_clusters(indentation.cell_m, size_m=size)


def robust_weights(gaps: NDArray, scale: float) -> NDArray:
    """Weights of squares that make them soft absolute values beyond `ROBUST` deviations."""
    return 1 / np.sqrt(1 + (gaps / (ROBUST * scale)) ** 2)


def robust_scale(gaps: NDArray) -> float:
    """Deviation of the middle of the gaps; 1 without any."""
    return max(FROM_MEDIAN * float(np.median(np.abs(gaps))), 1e-9) if len(gaps) else 1.0
