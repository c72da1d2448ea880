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
from palpate.estimate.direct.prior import FARTHEST_LAW, Prior, prior_of, scaled_inverse

ITERATIONS, ROUNDS = 40, 3
# Steps of log E, nu, q and m are held to these.
LARGEST_STEP = np.array([0.5, 0.1, 0.5, 0.5])
# A search ends with a step that lowers the cost by no more: of starts, which are compared, and of
# what they lead to (0.003 deviations). It has converged if it is by less than the last.
LEAST_OF_STARTS, LEAST, CONVERGED = 0.1, 1e-5, 1e-2


class Part(NamedTuple):
    """Contributions to the normal equations: matrices (b, q, q) and slopes (b, q) of b parts."""

    matrix: NDArray
    slope: NDArray


class Blocks(NamedTuple):
    """Those of a capture: of displacements by patch, and of depths by frame."""

    motion: Part
    depth: Part


def _blocks_of(one: DirectIndentation, line: Linearised, scale: Scales, apart: bool) -> Blocks:
    """Sum a capture's weighted residuals and slopes by patch, or all, and by frame of the depth."""
    by, gaps, slope = line.depth_slope, line.motion, line.motion_slope
    depth = Part(by[:, :, None] * by[:, None, :], by * line.depth[:, None])
    weight = scale.weights(gaps)
    if not apart:
        weighted = slope.T * weight
        return Blocks(Part((weighted @ slope)[None], (weighted @ gaps)[None]), depth)
    cluster = np.broadcast_to(one.cluster, one.seen.shape)[one.seen]
    count, q = int(one.cluster.max()) + 1, slope.shape[1]
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
    return Blocks(Part(matrix, total), depth)


@dataclass(frozen=True)
class _Joint:
    """Captures with their deviations, and what unknowns of all of them and of each cost."""

    indentations: tuple[DirectIndentation, ...]
    options: Fit

    @cached_property
    def prior(self) -> Prior:
        """What was known of the unknowns beforehand."""
        return prior_of(self.indentations, self.options)

    @cached_property
    def bounds(self) -> tuple[NDArray, NDArray]:
        """Least and greatest value of each unknown."""
        o, terms = self.options, len(self.options.relaxation_times_s)
        (low_E, high_E), (low_nu, high_nu) = o.youngs_modulus_bounds_pa, o.poisson_ratio_bounds
        wide = [np.inf] * (OWN * len(self.indentations))
        # Of q, m and gain.
        free = [FARTHEST_LAW, np.inf, np.inf]
        low = [np.log(low_E), low_nu, *np.negative(free), *[0.0] * terms, *np.negative(wide)]
        high = [np.log(high_E), high_nu, *free, *[0.95 / max(terms, 1)] * terms, *wide]
        return np.array(low), np.array(high)

    @cached_property
    def places(self) -> list[NDArray]:
        """Places of each capture's unknowns among all."""
        shared = SHARED + len(self.options.relaxation_times_s)
        own = shared + OWN * np.arange(len(self.indentations))[:, None] + np.arange(OWN)
        return [np.concatenate([np.arange(shared), mine]) for mine in own]

    def split(self, vector: NDArray) -> tuple[Parameters, ...]:
        """Parameters of each capture."""
        times_s = np.array(self.options.relaxation_times_s, dtype=float)
        return tuple(Parameters(vector[at], times_s) for at in self.places)

    def linearised(self, vector: NDArray) -> Iterator[Linearised]:
        return map(linearised, self.indentations, self.split(vector))

    def blocks_at(
        self, vector: NDArray, scales: Sequence[Scales], apart: bool = False
    ) -> tuple[Blocks, ...]:
        parts = zip(self.indentations, self.linearised(vector), scales, strict=True)
        return tuple(_blocks_of(*part, apart) for part in parts)

    def summed(self, blocks: Sequence[Blocks], kinds: Sequence[str] = Blocks._fields) -> Part:
        """Normal equations by the prior's curvature and kinds of residuals: of all captures."""
        size = len(self.prior.information)
        matrix, slope = np.zeros((size, size)), np.zeros(size)
        for at, block in zip(self.places, blocks, strict=True):
            parts = [getattr(block, kind) for kind in kinds]
            matrix[np.ix_(at, at)] += sum(part.matrix.sum(axis=0) for part in parts)
            slope[at] += sum(part.slope.sum(axis=0) for part in parts)
        return Part(matrix + self.prior.information, slope)

    def cost_at(self, vector: NDArray, scales: Sequence[Scales]) -> float:
        """Twice the negative logarithm of the posterior density, but for what deviations add."""
        total = float((self.prior.gaps(vector) ** 2).sum())
        for one, p, scale in zip(self.indentations, self.split(vector), scales, strict=True):
            gaps = residuals(one, p)
            soft = np.sqrt(1 + (gaps.motion / (ROBUST * scale.motion)) ** 2) - 1
            total += float((gaps.depth**2).sum() + 2 * ROBUST**2 * soft.sum() / scale.sharing)
        return total

    def with_deviations(self, vector: NDArray, *, first: bool = False) -> "_Joint":
        """The same with deviations as these unknowns leave them; at first the depths' alone."""
        found = []
        for one, p in zip(self.indentations, self.split(vector), strict=True):
            seen = one if first else with_pattern(one, p, self.options)
            found.append(with_depth_errors(seen, p, self.options, likeliest=not first))
        return _Joint(tuple(found), self.options)

    def minimise(
        self, vector: NDArray, scales: Sequence[Scales], least: float = LEAST
    ) -> tuple[NDArray, bool]:
        """Unknowns of least cost, and whether they converged: no step lowers it further."""
        cost = self.cost_at(vector, scales)
        for _ in range(ITERATIONS):
            step, gain = self.step(vector, scales)
            # Halved until it does not raise the cost.
            for part in 0.5 ** np.arange(6):
                moved = np.clip(vector + part * step, *self.bounds)
                if (now := self.cost_at(moved, scales)) <= cost + 1e-9 * abs(cost):
                    break
            else:
                break
            vector, cost = moved, now
            if gain < least:
                break
        return vector, gain < CONVERGED

    def step(self, vector: NDArray, scales: Sequence[Scales]) -> tuple[NDArray, float]:
        """Gauss and Newton's, within bounds, and by how much it is to lower the cost."""
        matrix, slope = self.summed(self.blocks_at(vector, scales))
        slope += self.prior.rows.T @ self.prior.gaps(vector)
        low, high = (end - vector for end in self.bounds)
        held = slice(len(LARGEST_STEP))
        low[held], high[held] = np.clip((low[held], high[held]), -LARGEST_STEP, LARGEST_STEP)
        step = _bounded_solution(matrix, -slope, low, high)
        return step, float(-(2 * slope + matrix @ step) @ step)


@dataclass(frozen=True)
class Solution(_Joint):
    """Least cost of captures, with the deviations that were found.

    Unknowns (size,) are (log E, nu, q, m, gain, fractions, and what each capture has for itself);
    there are scales of each capture, and whether the last steps were small.
    """

    vector: NDArray
    scales: tuple[Scales, ...]
    converged: bool = True

    @cached_property
    def parameters(self) -> tuple[Parameters, ...]:
        """Of each capture; moduli, laws, gain and fractions are the same in all."""
        return self.split(self.vector)

    @cached_property
    def blocks(self) -> tuple[Blocks, ...]:
        """Of each capture, of displacements by patch."""
        return self.blocks_at(self.vector, self.scales, apart=True)

    @cached_property
    def covariance(self) -> NDArray:
        """Of the unknowns, (size, size)."""
        return scaled_inverse(self.summed(self.blocks_at(self.vector, self.scales)).matrix)

    @property
    def std(self) -> NDArray:
        """Standard deviations of the unknowns, (size,)."""
        return np.sqrt(np.diag(self.covariance))


def fit_direct(
    indentations: Sequence[DirectIndentation], options: Fit, *starts: Parameters
) -> Solution:
    """Minimise over the moduli, the law and the nuisances of all captures.

    All captures start at each of ``starts``; with deviations as stated, the one of least cost goes
    on.
    """
    joint, scales = _Joint(tuple(indentations), options), (Scales(),) * len(indentations)
    vectors = []
    for start in starts:
        shared, own = np.split(start.vector, [-OWN])
        vectors.append(np.clip([*shared, *np.tile(own, len(indentations))], *joint.bounds))
    joint = joint.with_deviations(vectors[0], first=True)
    found = [joint.minimise(vector, scales, LEAST_OF_STARTS)[0] for vector in vectors]
    vector = min(found, key=lambda vector: joint.cost_at(vector, scales))
    for _ in range(ROUNDS):
        joint = joint.with_deviations(vector)
        scales = tuple(map(scales_of, joint.indentations, joint.linearised(vector)))
        vector, converged = joint.minimise(vector, scales)
    return Solution(joint.indentations, options, vector, scales, converged)


def held_at(best: Solution, nu: float) -> Solution:
    """Least cost with Poisson's ratio held within its bounds; deviations stay as estimated."""
    joint = _Joint(best.indentations, best.options)
    for end in joint.bounds:  # its own arrays, which nobody else has
        end[NU] = nu
    by_nu = best.covariance[:, NU] / best.covariance[NU, NU]
    start = np.clip(best.vector + (nu - best.vector[NU]) * by_nu, *joint.bounds)
    vector, converged = joint.minimise(start, best.scales)
    return replace(best, vector=vector, converged=converged)


def _bounded_solution(matrix: NDArray, right: NDArray, low: NDArray, high: NDArray) -> NDArray:
    """Minimum of x' M x / 2 - b' x within bounds, for positive definite M."""
    scale = 1 / np.sqrt(np.diag(matrix))
    root = np.linalg.cholesky(matrix * scale * scale[:, None] + 1e-12 * np.eye(len(matrix)))
    target = np.linalg.solve(root, right * scale)
    low, high = np.minimum(low, 0) / scale, np.maximum(high, 0) / scale
    tiny = 1e-12 * (1 + np.abs(low))
    found = lsq_linear(root.T, target, bounds=(low - tiny, high + tiny), method="bvls")
    return found.x * scale
