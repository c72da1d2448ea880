"""Joint robust least squares of E, nu, the law and nuisances over all frames of captures."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

from palpate.estimate.direct.deviations import (
    ROBUST,
    Scales,
    scales_of,
    with_depth_errors,
    with_pattern,
)
from palpate.estimate.direct.indentation import (
    NU,
    OWN,
    SHARED,
    DirectIndentation,
    Linearised,
    Parameters,
    linearised,
    residuals,
)
from palpate.estimate.direct.options import Fit
from palpate.estimate.direct.prior import Prior, parameter_bounds, prior_of, scaled_inverse

ITERATIONS = 40
ROUNDS = 3
# Steps of log E, nu, q and m are held to these; below the last numbers they have converged.
LARGEST_STEP = np.array([0.5, 0.1, 0.5, 0.5])
SMALLEST_STEP = np.array([1e-5, 1e-5, 1e-4, 1e-4])
ROUNDED = 100.0


class Part(NamedTuple):
    """Contributions to the normal equations: matrices (b, q, q) and slopes (b, q) of b parts."""

    matrix: NDArray
    slope: NDArray


class Blocks(NamedTuple):
    """Those of a capture: of displacements by patch, and of depths by frame."""

    motion: Part
    depth: Part


def blocks_of(indentation: DirectIndentation, line: Linearised, scale: Scales) -> Blocks:
    """Sum a capture's weighted residuals and slopes by patch, and by frame of the depth."""
    gaps, slope = line.motion, line.motion_slope
    weight = scale.weights(gaps)
    cluster = np.broadcast_to(indentation.cluster, indentation.seen.shape)[indentation.seen]
    count, q = int(indentation.cluster.max()) + 1, slope.shape[1]
    # One after the other: sums of matrix products depend on where in memory their rows lie.
    order = np.argsort(cluster, kind="stable")
    there, first = np.unique(cluster[order], return_index=True)
    columns = np.ascontiguousarray(slope[order].T)
    weighted = weight[order] * columns
    matrix, total = np.zeros((count, q, q)), np.zeros((count, q))
    for k in range(q):
        sums = np.add.reduceat(weighted[k] * columns[k:], first, axis=1).T
        matrix[there, k, k:] = matrix[there, k:, k] = sums
    total[there] = np.add.reduceat(weighted * gaps[order], first, axis=1).T
    by = line.depth_slope
    return Blocks(
        Part(matrix, total), Part(by[:, :, None] * by[:, None, :], by * line.depth[:, None])
    )


@dataclass(frozen=True)
class Solution:
    """Least cost of captures.

    Attributes
    ----------
    parameters : tuple of Parameters
        Of each capture; moduli, laws, gain and fractions are the same in all.
    cost : float
        Twice the negative logarithm of the posterior density, but for what deviations add.
    scales : tuple of Scales
        Of each capture.
    blocks : tuple of Blocks
        At the minimum.
    indentations : tuple of DirectIndentation
        With the deviations that were found.
    options : Fit
    converged : bool
        Whether the last steps were small.
    """

    parameters: tuple[Parameters, ...]
    cost: float
    scales: tuple[Scales, ...]
    blocks: tuple[Blocks, ...]
    indentations: tuple[DirectIndentation, ...]
    options: Fit
    converged: bool

    @property
    def vector(self) -> NDArray:
        """(log E, nu, q, m, gain, fractions, and what each capture has for itself)."""
        return _joined(self.parameters)

    @property
    def places(self) -> list[NDArray]:
        """Places of each capture's unknowns among all."""
        return _places(len(self.indentations), self.options)

    @cached_property
    def prior(self) -> Prior:
        """What was known of the unknowns beforehand."""
        return prior_of(self.indentations, self.options)

    def information(self, kinds: Sequence[str] = Blocks._fields) -> NDArray:
        """Information on the unknowns, by the prior and kinds of residuals, (size, size)."""
        found = self.prior.information.copy()
        for at, block in zip(self.places, self.blocks, strict=True):
            for kind in kinds:
                found[np.ix_(at, at)] += getattr(block, kind).matrix.sum(axis=0)
        return found

    @cached_property
    def covariance(self) -> NDArray:
        """Of the unknowns, (size, size)."""
        return scaled_inverse(self.information())

    @property
    def std(self) -> NDArray:
        """Standard deviations of the unknowns, (size,)."""
        return np.sqrt(np.diag(self.covariance))


def fit_direct(
    indentations: Sequence[DirectIndentation],
    options: Fit,
    *starts: Parameters,
) -> Solution:
    """Minimise over the moduli, the law and the nuisances of all captures.

    Parameters
    ----------
    indentations : sequence of DirectIndentation
    options : Fit
    *starts : Parameters
        Where all captures start; with deviations as stated the one of least cost goes on.
    """
    joint, scales = _Joint(indentations, options), (Scales(),) * len(indentations)
    vectors = [
        np.clip(_joined([start] * len(indentations)), joint.low, joint.high) for start in starts
    ]
    joint = joint.with_deviations(vectors[0], first=True)
    found = [joint.minimise(vector, scales)[0] for vector in vectors]
    vector = min(found, key=lambda vector: joint.cost(vector, scales))
    for _ in range(ROUNDS):
        joint = joint.with_deviations(vector)
        scales = tuple(map(scales_of, joint.indentations, joint.linearised(vector)))
        vector, converged = joint.minimise(vector, scales)
    found = joint.split(vector), joint.cost(vector, scales), scales
    blocks = joint.blocks_at(vector, scales)
    return Solution(*found, blocks, joint.indentations, options, converged)


def held_at(best: Solution, nu: float) -> Solution:
    """Least cost with Poisson's ratio held; deviations stay as the estimate has them.

    Parameters
    ----------
    best : Solution
    nu : float
        Within its bounds.

    Returns
    -------
    Solution
    """
    joint = _Joint(best.indentations, best.options)
    by_nu = best.covariance[:, NU] / best.covariance[NU, NU]
    joint.low[NU] = joint.high[NU] = nu
    start = best.vector + (nu - best.vector[NU]) * by_nu
    vector, converged = joint.minimise(np.clip(start, joint.low, joint.high), best.scales)
    cost, blocks = joint.cost(vector, best.scales), joint.blocks_at(vector, best.scales)
    found = {"parameters": joint.split(vector), "cost": cost, "blocks": blocks}
    return replace(best, converged=converged, **found)


class _Joint:
    """Normal equations of all captures."""

    def __init__(self, indentations: Sequence[DirectIndentation], options: Fit) -> None:
        self.indentations, self.options = tuple(indentations), options
        self.places = _places(len(indentations), options)
        self.prior = prior_of(indentations, options)
        self.low, self.high = parameter_bounds(len(indentations), options)

    def split(self, vector: NDArray) -> tuple[Parameters, ...]:
        """Parameters of each capture."""
        times_s = np.array(self.options.relaxation_times_s, dtype=float)
        return tuple(Parameters.of(vector[at], times_s) for at in self.places)

    def minimise(self, vector: NDArray, scales: Sequence[Scales]) -> tuple[NDArray, bool]:
        """Unknowns of least cost, and whether they converged: no step lowers it further."""
        for _ in range(ITERATIONS):
            step = self.step(vector, self.blocks_at(vector, scales))
            before, vector = vector, self.moved(vector, step, scales)
            over = float((np.abs(step[: len(SMALLEST_STEP)]) / SMALLEST_STEP).max())
            if vector is before or over < 1:
                break
        # Rounding ends a search a little earlier, or lets it go to and fro.
        return vector, over < ROUNDED

    def with_deviations(self, vector: NDArray, *, first: bool = False) -> "_Joint":
        """The same with deviations as these unknowns leave them; at first the depths' alone."""
        found = []
        for one, p in zip(self.indentations, self.split(vector), strict=True):
            seen = one if first else with_pattern(one, p, self.options)
            found.append(with_depth_errors(seen, p, self.options, likeliest=not first))
        return _Joint(found, self.options)

    def moved(self, vector: NDArray, step: NDArray, scales: Sequence[Scales]) -> NDArray:
        """Take the step, halved until it does not raise the cost."""
        before = self.cost(vector, scales)
        for part in 0.5 ** np.arange(6):
            moved = np.clip(vector + part * step, self.low, self.high)
            if self.cost(moved, scales) <= before + 1e-9 * abs(before):
                return moved
        return vector

    def linearised(self, vector: NDArray) -> Iterator[Linearised]:
        return map(linearised, self.indentations, self.split(vector))

    def blocks_at(self, vector: NDArray, scales: Sequence[Scales]) -> tuple[Blocks, ...]:
        return tuple(map(blocks_of, self.indentations, self.linearised(vector), scales))

    def step(self, vector: NDArray, blocks: Sequence[Blocks]) -> NDArray:
        """Gauss and Newton's, within bounds."""
        matrix = np.zeros((len(vector), len(vector)))
        slope = np.zeros(len(vector))
        for at, (motion, depth) in zip(self.places, blocks, strict=True):
            matrix[np.ix_(at, at)] += motion.matrix.sum(axis=0) + depth.matrix.sum(axis=0)
            slope[at] += motion.slope.sum(axis=0) + depth.slope.sum(axis=0)
        matrix += self.prior.information
        slope += self.prior.rows.T @ self.prior.gaps(vector)
        low, high = self.low - vector, self.high - vector
        held = slice(len(LARGEST_STEP))
        low[held] = np.maximum(low[held], -LARGEST_STEP)
        high[held] = np.minimum(high[held], LARGEST_STEP)
        return _bounded_solution(matrix, -slope, low, high)

    def cost(self, vector: NDArray, scales: Sequence[Scales]) -> float:
        total = float((self.prior.gaps(vector) ** 2).sum())
        for one, p, scale in zip(self.indentations, self.split(vector), scales, strict=True):
            gaps = residuals(one, p)
            soft = np.sqrt(1 + (gaps.motion / (ROBUST * scale.motion)) ** 2) - 1
            total += float((gaps.depth**2).sum())
            total += 2 * ROBUST**2 * float(soft.sum()) / scale.sharing
        return total


def _places(captures: int, options: Fit) -> list[NDArray]:
    """Places of each capture's unknowns among all."""
    shared = SHARED + len(options.relaxation_times_s)
    own = shared + OWN * np.arange(captures)[:, None] + np.arange(OWN)
    return [np.concatenate([np.arange(shared), mine]) for mine in own]


def _joined(parameters: Sequence[Parameters]) -> NDArray:
    own = [p.vector[-OWN:] for p in parameters]
    return np.concatenate([parameters[0].vector[:-OWN], *own])


def _bounded_solution(matrix: NDArray, right: NDArray, low: NDArray, high: NDArray) -> NDArray:
    """Minimum of x' M x / 2 - b' x within bounds, for positive definite M."""
    scale = 1 / np.sqrt(np.diag(matrix))
    root = np.linalg.cholesky(matrix * scale * scale[:, None] + 1e-12 * np.eye(len(matrix)))
    target = np.linalg.solve(root, right * scale)
    low, high = np.minimum(low, 0) / scale, np.maximum(high, 0) / scale
    tiny = 1e-12 * (1 + np.abs(low))
    found = lsq_linear(root.T, target, bounds=(low - tiny, high + tiny), method="bvls")
    return found.x * scale
