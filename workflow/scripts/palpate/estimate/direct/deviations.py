"""How far what is compared scatters: noise, what moves with the surface, and what errs together."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls

from palpate.estimate.direct.indentation import (
    DirectIndentation,
    Parameters,
    depth_noise,
    linearised,
    patches_of,
    residuals,
)
from palpate.estimate.direct.motion_noise import correlation_length
from palpate.estimate.direct.options import Fit
from palpate.estimate.direct.prior import FREE, prior_of, scaled_inverse
from palpate.units import FROM_MEDIAN

# Deviations beyond which a residual counts with its size alone.
ROBUST = 8.0
# Degrees of freedom of the motions' scatter, steps of its search, and the least part of a variance
# that was stated.
TAILS, VARIANCE_STEPS, LEAST_NOISE = 4.0, 30, 0.1
# Over such a way and so long errors of depths are alike that hang on where the probe is.
ALIKE_M, ALIKE_S = 0.002, 2.0
# Multiples of the stated deviations of depths that are tried.
NOISES, PATTERNS = np.geomspace(1, 100, 30), np.geomspace(1, 300, 30)
# Of log E and nu, where depths alone are to tell them.
WIDE_STD = np.array([10.0, 0.5])
# Larger parts than these, where none are asked for, would be too few to tell their scatter [m].
LARGEST_PATCH_M = 0.04
# Of pictures: windows that overlap see the same grey values, and are 14 to 22 mm wide [m].
WINDOWED_M = 0.04


def with_pattern(
    indentation: DirectIndentation, of: Parameters, *, times_s: NDArray
) -> DirectIndentation:
    """Deviations of motions as residuals show them: of each frame's noise, and of what moves.

    A sensor's fixed pattern cancels where nothing moves; where the surface moves it does not, with
    a variance about in proportion to the motion.
    """
    seen, kind = indentation.seen, indentation.kind
    gaps = residuals(indentation, of, times_s=times_s).motion * indentation.moved_std_m[seen]
    noise = indentation.noise_std_m[seen] ** 2
    size = np.abs(indentation.moved_m[seen] - gaps)
    variance = np.zeros_like(gaps)
    for one in np.unique(kind):
        at = kind == one
        parts = np.column_stack([noise[at], size[at]])
        variance[at] = parts @ variance_parts(gaps[at], parts)
    std, left = np.full((2, *seen.shape), np.nan)
    std[seen], left[seen] = np.sqrt(variance), gaps
    pressed = replace(indentation, moved_std_m=std)
    return replace(pressed, cluster=_clusters(pressed, left))


def with_depth_errors(
    indentation: DirectIndentation, of: Parameters, options: Fit, *, likeliest: bool
) -> DirectIndentation:
    """Errors of the depths: noise from frame to frame, and what hangs on where the probe is.

    A longer hold and a faster camera have more frames, but no more of the latter (lens, board,
    template, law): those of the same place and time err together.

    Parameters
    ----------
    indentation : DirectIndentation
    of : Parameters
    options : Fit
    likeliest : bool
        Both as large as the residuals are most likely with, the unknowns integrated over, and at
        least as large as stated; else as stated.
    """
    times_s = np.array(options.relaxation_times_s, dtype=float)
    noise = depth_noise(indentation, of, times_s=times_s)
    way, time = indentation.depth_m, indentation.time_s[indentation.frames]
    apart = np.subtract.outer(way, way) / ALIKE_M, np.subtract.outer(time, time) / ALIKE_S
    alike = indentation.pattern_std_m**2 * np.exp(-(apart[0] ** 2) / 2 - np.abs(apart[1]))
    if not likeliest:
        return replace(indentation, depth_root_m=np.linalg.cholesky(np.diag(noise**2) + alike))
    gap, spread = _depths_beforehand(indentation, of, options, times_s)
    by_noise, by_pattern = _likeliest(
        gap / noise, spread / noise[:, None], alike / np.outer(noise, noise)
    )
    covariance = np.diag((by_noise * noise) ** 2) + by_pattern**2 * alike
    return replace(indentation, depth_root_m=np.linalg.cholesky(covariance))


def _likeliest(gap: NDArray, spread: NDArray, alike: NDArray) -> tuple[float, float]:
    """Multiples n and p with which gaps of covariance n^2 I + p^2 A + W W' are most likely.

    In the axes of A the first two are diagonal, and W has few columns.
    """
    values, axes = np.linalg.eigh(alike)
    gap, spread = axes.T @ gap, axes.T @ spread
    variance = NOISES[:, None, None] ** 2 + PATTERNS[:, None] ** 2 * np.maximum(values, 0)
    outer = spread[:, :, None] * spread[:, None]
    inner = np.eye(spread.shape[1]) + np.tensordot(1 / variance, outer, axes=1)
    right = (gap / variance) @ spread
    taken = (right * np.linalg.solve(inner, right[..., None])[..., 0]).sum(axis=-1)
    costs = (gap**2 / variance + np.log(variance)).sum(axis=-1) - taken
    costs += np.linalg.slogdet(inner)[1]
    best = np.unravel_index(int(np.argmin(costs)), costs.shape)
    return float(NOISES[best[0]]), float(PATTERNS[best[1]])


def _depths_beforehand(
    indentation: DirectIndentation, of: Parameters, options: Fit, times_s: NDArray
) -> tuple[NDArray, NDArray]:
    """Gaps of the depths as expected beforehand, (k,) [m], and a root of what the unknowns add.

    The root W (k, q) has the covariance W W'.
    """
    line = linearised(indentation, of, times_s=times_s)
    root = indentation.depth_root_m
    gap, slope = root @ line.residuals.depth, root @ line.depth_slope
    prior = prior_of([indentation], options)
    information, right = prior.information.copy(), prior.rows.T @ prior.values
    free = np.arange(FREE)
    information[free, free] += WIDE_STD**-2
    right[free] += of.vector[free] * WIDE_STD**-2
    covariance = scaled_inverse(information)
    beforehand = gap + slope @ (covariance @ right - of.vector)
    scale = np.sqrt(np.diag(covariance))
    root = np.linalg.cholesky(covariance / np.outer(scale, scale) + 1e-12 * np.eye(len(scale)))
    return beforehand, slope @ (scale[:, None] * root)


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
        variance = np.maximum(table @ shares, LEAST_NOISE * parts[:, 0])
        expected = square * (TAILS + 1) / (TAILS + square / variance)
        shares, _ = nnls(table / variance[:, None], expected / variance)
    shares = shares / unit
    return np.concatenate([np.maximum(shares[:1], LEAST_NOISE), shares[1:]])


def _clusters(indentation: DirectIndentation, left_m: NDArray) -> NDArray:
    """Patches at least as large as residuals err together: twice their correlation's length."""
    cell_m, length = indentation.cell_m, 0.0
    at = indentation.seen.any(axis=0) & (indentation.axis == 0)
    if at.any():
        mean = np.nanmean((left_m / indentation.moved_std_m)[:, at], axis=0)
        length = correlation_length(cell_m[at], mean[None])
    along = max(indentation.patch_m, min(2 * length, LARGEST_PATCH_M))
    sizes = [along, max(indentation.patch_m, WINDOWED_M)]
    return patches_of(cell_m, indentation.axis, sizes)


def robust_weights(gaps: NDArray, scale: NDArray | float) -> NDArray:
    """Weights of squares that make them soft absolute values beyond `ROBUST` deviations."""
    return 1 / np.sqrt(1 + (gaps / (ROBUST * scale)) ** 2)


def robust_scale(gaps: NDArray) -> float:
    """Deviation of the middle of the gaps; 1 without any."""
    return max(FROM_MEDIAN * float(np.median(np.abs(gaps))), 1e-9) if len(gaps) else 1.0
