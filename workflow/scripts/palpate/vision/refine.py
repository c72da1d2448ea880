"""The optics, transform and poses that fit a board's corners best, and how well they are known."""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize
from scipy.sparse import csr_array

from palpate.vision.bundle import POSE, Bundle, Sight

# Where the loss leaves the parabola, in standard deviations: few good corners lie beyond.
ROBUST_FROM = 2.0
# In unknowns that are scaled to the standard error which each has alone.
FIRST_STEP, LONGEST_STEP, STEEPEST = 1e3, 1e9, 1e-5
MOST_STEPS = 100
# Part of a direction that the corners don't tell, above which an unknown is not told either.
SHARE_LOST = 1e-3
# Of a scaled normal matrix: below, an eigenvalue is what rounding leaves.
SMALLEST = 1e-10


def fit(bundle: Bundle, x: NDArray) -> NDArray:
    """The unknowns that bring the projected corners to the seen ones, with Huber's loss.

    Steps are exact within a region of trust; solvers for large sparse problems, which approach
    each step, come to a halt where distance and focal length all but trade.

    Parameters
    ----------
    bundle : Bundle
    x : array
        Where to start.
    """
    scale = _lengths(bundle, x)

    def whole(scaled: NDArray) -> NDArray:
        filled = x.copy()
        filled[bundle.free] = scaled / scale
        return filled

    # The minimiser asks for the cost and for the curvature of the same place.
    @lru_cache(maxsize=1)
    def at(scaled: bytes) -> tuple[NDArray, csr_array]:
        place = whole(np.frombuffer(scaled))
        return bundle.residuals(place), bundle.jacobian(place)

    def cost(scaled: NDArray) -> tuple[float, NDArray]:
        off, by = at(scaled.tobytes())
        bent = bent_back(off)
        # Huber's loss: the parabola, and its tangent beyond.
        return bent @ (off - bent / 2), by.T @ bent / scale

    def curvature(scaled: NDArray) -> NDArray:
        off, by = at(scaled.tobytes())
        weights = ROBUST_FROM / np.maximum(np.abs(off), ROBUST_FROM)
        return (by.T @ by.multiply(weights[:, None])).toarray() / np.outer(scale, scale)

    found = minimize(
        cost,
        x[bundle.free] * scale,
        jac=True,
        hess=curvature,
        method="trust-exact",
        options={
            "initial_trust_radius": FIRST_STEP,
            "max_trust_radius": LONGEST_STEP,
            "gtol": STEEPEST,
            "maxiter": MOST_STEPS,
        },
    )
    return whole(found.x)


def bent_back(off: NDArray) -> NDArray:
    """Residuals as Huber's loss lets them pull."""
    return np.clip(off, -ROBUST_FROM, ROBUST_FROM)


def _lengths(bundle: Bundle, x: NDArray) -> NDArray:
    """Lengths of the Jacobian's columns; 1 where it has none."""
    lengths = np.sqrt(bundle.jacobian(x).power(2).sum(axis=0))
    return np.where(lengths > 0, lengths, 1.0)


def information(bundle: Bundle, x: NDArray) -> NDArray:
    """Normal matrix of the shared unknowns with the poses eliminated, (shared, shared).

    Dropped terms have rows and columns of 0.
    """
    total = np.zeros((bundle.shared, bundle.shared))
    for key in bundle.boards:
        total += view_information(bundle, x, [s for s in bundle.sights if s.board == key])
    return total


def view_information(bundle: Bundle, x: NDArray, sights: list[Sight]) -> NDArray:
    """What one board's sights tell of the shared unknowns whatever its pose is."""
    size = bundle.shared + POSE
    normal = np.zeros((size, size))
    for sight in sights:
        block, places = bundle.block(x, sight)
        start = bundle.boards[sight.board].start
        places = np.where(places < bundle.shared, places, places - start + bundle.shared)
        normal[np.ix_(places, places)] += block.T @ block
    dropped = np.setdiff1d(np.arange(bundle.shared), bundle.free)
    normal[dropped] = normal[:, dropped] = 0
    shared, pose = slice(None, bundle.shared), slice(bundle.shared, None)
    solved = np.linalg.lstsq(normal[pose, pose], normal[pose, shared], rcond=None)[0]
    return normal[shared, shared] - normal[shared, pose] @ solved


def covariance(bundle: Bundle, x: NDArray) -> NDArray:
    """Covariance of the shared unknowns, (shared, shared), with the variance of the residuals.

    That of an estimate with Huber's loss: P. J. Huber, Robust Statistics (1981), Section 7.6. A
    direction that the corners don't tell has an infinite variance.
    """
    off = bundle.residuals(x)
    spare = off.size - bundle.free.size
    inside = np.mean(np.abs(off) < ROBUST_FROM)
    bent = bent_back(off)
    variance = (bent @ bent) / spare / inside**2
    return variance * inverse(information(bundle, x))


def inverse(normal: NDArray) -> NDArray:
    """Inverse of a normal matrix without its empty rows; infinite where it has none."""
    filled = np.diag(normal) > 0
    scale = np.sqrt(np.diag(normal)[filled])
    values, vectors = np.linalg.eigh(normal[np.ix_(filled, filled)] / np.outer(scale, scale))
    told = values > SMALLEST
    inner = (vectors[:, told] / values[told]) @ vectors[:, told].T
    lost = (np.abs(vectors[:, ~told]) > SHARE_LOST).any(axis=1)
    inner[lost, lost] = np.inf
    out = np.zeros_like(normal)
    out[np.ix_(filled, filled)] = inner / np.outer(scale, scale)
    return out
