"""How far what is compared scatters: noise, what moves with the surface, and what errs together."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls
from scipy.spatial import cKDTree

from palpate.estimate.direct.indentation import (
    DirectIndentation,
    Linearised,
    Parameters,
    depth_by_force,
    linearised,
    residuals,
)
from palpate.estimate.direct.options import Fit
from palpate.estimate.direct.prior import FREE, prior_of, scaled_inverse
from palpate.units import FROM_MEDIAN

# Deviations beyond which a residual counts with its size alone.
ROBUST = 8.0
# Degrees of freedom of the displacements' scatter, steps of its search, and the least part of a
# variance that was stated.
TAILS, VARIANCE_STEPS, LEAST_NOISE = 4.0, 30, 0.1
# Over such a way and so long errors of depths are alike that depend on where the probe is.
ALIKE_M, ALIKE_S = 0.002, 2.0
# Multiples of the stated deviations of depths that are tried.
NOISES, PATTERNS = np.geomspace(1, 100, 30), np.geomspace(1, 300, 30)
# Of log E and nu, where depths alone are to determine them.
WIDE_STD = np.array([10.0, 0.5])
# Larger parts than these, where none are asked for, would be too few to show their scatter; and
# steps of the correlogram [m].
LARGEST_PATCH_M, LAG_M, LAGS = 0.04, 0.002, 20


@dataclass(frozen=True)
class Scales:
    """What residuals of a capture are divided by, beside their stated deviations.

    Attributes
    ----------
    motion : float
        Scatter of displacements over what was stated.
    sharing : float
        Displacements of a patch or a frame that err together: by so much what they move E and nu by
        scatters more than it would if they were independent (variance).
    """

    motion: float = 1.0
    sharing: float = 1.0

    def weights(self, gaps: NDArray) -> NDArray:
        """Weights of squared residuals, (n,): beyond `ROBUST` deviations the loss is linear."""
        soft = 1 / np.sqrt(1 + (gaps / (ROBUST * self.motion)) ** 2)
        return soft / (self.motion**2 * self.sharing)


def scales_of(indentation: DirectIndentation, line: Linearised) -> Scales:
    """Scatter and sharing as residuals show them."""
    motion = max(FROM_MEDIAN * float(np.median(np.abs(line.motion))), 1e-9)
    return Scales(motion, sharing_of(indentation, line, motion))


def sharing_of(indentation: DirectIndentation, line: Linearised, motion: float) -> float:
    """Variance of slopes by E and nu over that of independent displacements; at least 1.

    What those of a patch share, whose pattern or outline is in all frames, and those of a frame, as
    a camera's shake, less those of both (clusters in two ways: A. C. Cameron, J. B. Gelbach and D.
    L. Miller, J. Business & Economic Statistics 29, 2011, 238). Each counts alike: the few near the
    contact do not show it. ``motion`` is the scatter of displacements over what was stated.
    """
    gaps, slope = line.motion, line.motion_slope[:, :FREE]
    frame, sample = np.nonzero(indentation.seen)
    patch = indentation.cluster[sample]
    weighted = Scales(motion).weights(gaps)[:, None] * slope
    terms = weighted * gaps[:, None], weighted * slope
    groups = patch, frame, patch * len(indentation.seen) + frame
    by_patch, by_frame, by_both = (_shared(group, *terms) for group in groups)
    # The fit takes a part of what a frame has in common.
    return max(1.0, by_patch, by_patch + by_frame - by_both)


def _shared(group: NDArray, term: NDArray, square: NDArray) -> float:
    """Mean square of groups' sums of terms (m, 2), over what independent ones have."""
    total, expected = (
        np.stack([np.bincount(group, column) for column in of.T]) for of in (term, square)
    )
    moves = expected > 0
    return float((total[moves] ** 2 / expected[moves]).mean()) if moves.any() else 1.0


def with_pattern(indentation: DirectIndentation, of: Parameters, options: Fit) -> DirectIndentation:
    """Deviations and patches of displacements as residuals show them.

    A sensor's fixed pattern cancels where nothing moves; where the surface moves it adds to the
    noise a variance about in proportion to the displacement.
    """
    seen, cell_m = indentation.seen, indentation.cell_m
    gaps = residuals(indentation, of).motion * indentation.moved_std_m[seen]
    size = np.abs(indentation.moved_m[seen] - gaps)
    parts = np.column_stack([indentation.noise_std_m[seen] ** 2, size])
    std, left = np.full((2, *seen.shape), np.nan)
    std[seen], left[seen] = np.sqrt(parts @ _variance_parts(gaps, parts)), gaps
    there = seen.any(axis=0)
    mean = np.nanmean((left / std)[:, there], axis=0)
    # Patches at least as large as residuals err together: twice their correlation's length.
    size_m = min(2 * correlation_length(cell_m[there], mean[None]), LARGEST_PATCH_M)
    cluster = error_clusters(cell_m, size_m=max(options.patch_m, size_m))
    return replace(indentation, moved_std_m=std, cluster=cluster)


def with_depth_errors(
    indentation: DirectIndentation, of: Parameters, options: Fit, *, likeliest: bool
) -> DirectIndentation:
    """Errors of the depths: noise from frame to frame, and what depends on where the probe is.

    A longer hold and a faster camera have more frames, but no more of the latter (lens, target,
    template, law): those of the same place and time err together. ``likeliest``: both as large as
    the residuals are most likely with, the unknowns integrated over, and at least as large as
    stated; else as stated.
    """
    # At the depths that the force gives: measured ones have the noise that this is to be told from.
    way, noise = depth_by_force(indentation, of)
    time = indentation.time_s[indentation.frames]
    apart = np.subtract.outer(way, way) / ALIKE_M, np.subtract.outer(time, time) / ALIKE_S
    alike = options.depth_pattern_std_m**2 * np.exp(-(apart[0] ** 2) / 2 - np.abs(apart[1]))
    by_noise, by_pattern = 1.0, 1.0
    if likeliest:
        gap, spread = _depths_beforehand(indentation, of, options)
        by_noise, by_pattern = _likeliest(
            gap / noise, spread / noise[:, None], alike / np.outer(noise, noise)
        )
    covariance = np.diag((by_noise * noise) ** 2) + by_pattern**2 * alike
    return replace(indentation, depth_root_m=np.linalg.cholesky(covariance))


def _likeliest(gap: NDArray, spread: NDArray, alike: NDArray) -> tuple[float, float]:
    """Multiples n and p with which gaps of covariance n^2 I + p^2 A + W W' are most likely."""
    # In the axes of A the first two are diagonal, and W has few columns.
    values, axes = np.linalg.eigh(alike)
    gap, spread = axes.T @ gap, axes.T @ spread
    variance = NOISES[:, None, None] ** 2 + PATTERNS[:, None] ** 2 * np.maximum(values, 0)
    outer = spread[:, :, None] * spread[:, None]
    inner = np.eye(spread.shape[1]) + np.tensordot(1 / variance, outer, axes=1)
    right = (gap / variance) @ spread
    taken = (right * np.linalg.solve(inner, right[..., None])[..., 0]).sum(axis=-1)
    costs = (gap**2 / variance + np.log(variance)).sum(axis=-1) + np.linalg.slogdet(inner)[1]
    best = np.unravel_index(int(np.argmin(costs - taken)), costs.shape)
    return float(NOISES[best[0]]), float(PATTERNS[best[1]])


def _depths_beforehand(
    indentation: DirectIndentation, of: Parameters, options: Fit
) -> tuple[NDArray, NDArray]:
    """Gaps of the depths as expected beforehand, (k,) [m]; root W (k, q) of what unknowns add."""
    line, root = linearised(indentation, of), indentation.depth_root_m
    gap, slope = root @ line.depth, root @ line.depth_slope
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


def _variance_parts(gaps: NDArray, parts: NDArray) -> NDArray:
    """Shares (p,) of parts (n, p) of a variance that gaps (n,) with wide tails most likely have.

    Student's t (Lange, Little and Taylor 1989) by Fisher's scoring, with as many steps whatever the
    gaps are: shares that depended on the gaps' order would differ where only the last bit does. At
    least 0, and of the first part at least `LEAST_NOISE`.
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


def error_clusters(places_m: NDArray, *, size_m: float) -> NDArray:
    """Cell of a cubic grid of an edge [m] that each of places (n, 3) [m] lies in, (n,) int."""
    cells = np.floor((places_m - places_m.min(axis=0)) / size_m).astype(np.int64)
    return np.unique(cells, axis=0, return_inverse=True)[1].ravel()


def correlation_length(places_m: NDArray, noise: NDArray) -> float:
    """L of the correlation exp(-(distance / L)^2) that is nearest to the noise's [m].

    Of places (c, 3) [m] and their noise in frames, (f, c) of any unit, NaN where there is none; 0
    where no two places are near enough.
    """
    pairs = cKDTree(places_m).query_pairs(LAG_M * LAGS, output_type="ndarray")
    apart = np.linalg.norm(places_m[pairs[:, 0]] - places_m[pairs[:, 1]], axis=1)
    product = noise[:, pairs[:, 0]] * noise[:, pairs[:, 1]]
    step = np.minimum((apart / LAG_M).astype(int), LAGS - 1)
    counts = np.bincount(step, np.isfinite(product).sum(axis=0), LAGS)
    known = counts > 0
    if not known.any():
        return 0.0
    sums = np.bincount(step, np.nansum(product, axis=0), LAGS)
    distance = np.bincount(step, apart, LAGS)[known] / np.bincount(step, minlength=LAGS)[known]
    correlation = sums[known] / counts[known] / np.nanmean(noise**2)
    lengths = np.linspace(LAG_M / 4, LAG_M * LAGS, 200)
    model = np.exp(-((distance / lengths[:, None]) ** 2))
    return float(lengths[np.argmin(((model - correlation) ** 2).sum(axis=1))])
