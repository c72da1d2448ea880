"""Contributions of captures to the normal equations, by patch of the surface and by frame."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

from palpate.estimate.direct.deviations import robust_weights
from palpate.estimate.direct.indentation import (
    AXES,
    KINDS,
    DirectIndentation,
    Linearised,
    Parameters,
    linearised,
)
from palpate.estimate.direct.prior import FREE


@dataclass(frozen=True)
class Scales:
    """What residuals of a capture are divided by, beside their stated deviations.

    Attributes
    ----------
    motion : (2,) tuple of float
        Scatter of motions over what was stated: along the normals, and across.
    sharing : (2,) tuple of float
        Motions of a patch or a frame that err together: by so much what they move E and nu by
        scatters more than it would if they were independent (variance).
    """

    motion: tuple[float, ...] = (1.0,) * KINDS
    sharing: tuple[float, ...] = (1.0,) * KINDS

    def of(self, kind: NDArray) -> tuple[NDArray, NDArray]:
        """Scatter and sharing of motions by their kind, both as many."""
        return np.array(self.motion)[kind], np.array(self.sharing)[kind]


@dataclass(frozen=True)
class Blocks:
    """Contributions of a capture to the normal equations, by patch and by frame.

    Attributes
    ----------
    motion_matrix, motion_slope : (b, q, q), (b, q) arrays
    depth_matrix, depth_slope : (k, q, q), (k, q) arrays
    """

    motion_matrix: NDArray
    motion_slope: NDArray
    depth_matrix: NDArray
    depth_slope: NDArray


def blocks_of(indentation: DirectIndentation, line: Linearised, scale: Scales) -> Blocks:
    """Sum a capture's weighted residuals and slopes by patch, and by frame of the depth."""
    gaps, slope = line.residuals.motion, line.motion_slope
    motion, sharing = scale.of(indentation.kind)
    weight = robust_weights(gaps, motion) / (motion**2 * sharing)
    cluster = np.broadcast_to(indentation.cluster, indentation.seen.shape)[indentation.seen]
    count, q = int(indentation.cluster.max()) + 1, slope.shape[1]
    # One after the other: sums of matrix products hang on where in memory their rows lie.
    order = np.argsort(cluster, kind="stable")
    there, first = np.unique(cluster[order], return_index=True)
    columns = np.ascontiguousarray(slope[order].T)
    weighted = weight[order] * columns
    matrix, total = np.zeros((count, q, q)), np.zeros((count, q))
    for k in range(q):
        sums = np.add.reduceat(weighted[k] * columns[k:], first, axis=1).T
        matrix[there, k, k:] = matrix[there, k:, k] = sums
    total[there] = np.add.reduceat(weighted * gaps[order], first, axis=1).T
    depth, by = line.residuals.depth, line.depth_slope
    outer = by[:, :, None] * by[:, None, :]
    return Blocks(matrix, total, outer, by * depth[:, None])


def normal_rows(
    indentation: DirectIndentation, of: Parameters, scale: Scales, *, times_s: NDArray
) -> tuple[Linearised, NDArray, NDArray]:
    """Residuals of a capture, and what each adds to the slope of the cost, (q, k) and (q, m)."""
    line = linearised(indentation, of, times_s=times_s)
    motion, sharing = scale.of(indentation.kind)
    weight = robust_weights(line.residuals.motion, motion) / (motion**2 * sharing)
    return line, line.depth_slope.T, (line.motion_slope * weight[:, None]).T


def sharing_of(
    indentation: DirectIndentation, line: Linearised, motion: tuple[float, ...]
) -> tuple[float, ...]:
    """Variance of motions' slopes by E and nu over that of independent motions; at least 1.

    Of each kind of motion: what those of a patch share, whose pattern or outline is in all frames,
    and what those of a frame share, as a camera's shake, less what those of both do, which is in
    either (clusters in two ways: A. C. Cameron, J. B. Gelbach and D. L. Miller, J. Business &
    Economic Statistics 29, 2011, 238). Each patch and frame
    counts alike: what they move E and nu by is a matter of the few near the contact, which are too
    few to tell.

    Parameters
    ----------
    indentation : DirectIndentation
    line : Linearised
    motion : (2,) tuple of float
        Scatter of motions over what was stated.
    """
    gaps, slope = line.residuals.motion, line.motion_slope[:, :FREE]
    frame, sample = np.nonzero(indentation.seen)
    patch, at = indentation.cluster[sample], frame * AXES + indentation.axis[sample]
    # Patches are of one axis each.
    groups = patch, at, patch * len(indentation.seen) + frame
    found = []
    for kind, scatter in enumerate(motion):
        of = indentation.kind == kind
        weighted = (robust_weights(gaps[of], scatter) / scatter**2)[:, None] * slope[of]
        terms = weighted * gaps[of, None], weighted * slope[of]
        by_patch, by_frame, by_both = (_shared(group[of], *terms) for group in groups)
        # The fit takes a part of what a frame has in common.
        found.append(max(1.0, by_patch, by_patch + by_frame - by_both))
    return tuple(found)


def _shared(group: NDArray, term: NDArray, square: NDArray) -> float:
    """Mean square of groups' sums of terms (m, 2), over what independent ones have."""
    total, expected = (
        np.stack([np.bincount(group, column) for column in of.T]) for of in (term, square)
    )
    told = expected > 0
    return float((total[told] ** 2 / expected[told]).mean()) if told.any() else 1.0


def bounded_solution(matrix: NDArray, right: NDArray, low: NDArray, high: NDArray) -> NDArray:
    """Minimum of x' M x / 2 - b' x within bounds, for positive definite M."""
    scale = 1 / np.sqrt(np.diag(matrix))
    root = np.linalg.cholesky(matrix * scale * scale[:, None] + 1e-12 * np.eye(len(matrix)))
    target = np.linalg.solve(root, right * scale)
    low, high = np.minimum(low, 0) / scale, np.maximum(high, 0) / scale
    tiny = 1e-12 * (1 + np.abs(low))
    found = lsq_linear(root.T, target, bounds=(low - tiny, high + tiny), method="bvls")
    return found.x * scale
