"""Joint robust least squares of E, nu, the law and nuisances over all frames of captures."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from palpate.estimate.direct.blocks import (
    Blocks,
    Scales,
    blocks_of,
    bounded_solution,
    sharing_of,
)
from palpate.estimate.direct.deviations import (
    ROBUST,
    robust_scale,
    with_depth_errors,
    with_pattern,
)
from palpate.estimate.direct.indentation import (
    KINDS,
    OWN,
    SHARED,
    DirectIndentation,
    Linearised,
    Parameters,
    linearised,
    residuals,
)
from palpate.estimate.direct.options import Fit
from palpate.estimate.direct.prior import parameter_bounds, prior_of

ITERATIONS = 40
ROUNDS = 3
# Steps of log E, nu, q and m are held to these; below the last numbers they have converged.
LARGEST_STEP = np.array([0.5, 0.1, 0.5, 0.5])
SMALLEST_STEP = np.array([1e-5, 1e-5, 1e-4, 1e-4])
ROUNDED = 100.0


@dataclass(frozen=True)
class Solution:
    """Least cost of captures.

    Attributes
    ----------
    parameters : tuple of Parameters
        Of each capture; moduli, laws, gain and fractions are the same in all.
    cost : float
        Twice the negative logarithm of the posterior density, up to a constant.
    scales : tuple of Scales
        Of each capture.
    blocks : tuple of Blocks
        At the minimum.
    indentations : tuple of DirectIndentation
        With the deviations that were found.
    converged : bool
        Whether the last steps were small.
    """

    parameters: tuple[Parameters, ...]
    cost: float
    scales: tuple[Scales, ...]
    blocks: tuple[Blocks, ...]
    indentations: tuple[DirectIndentation, ...]
    converged: bool

    @property
    def vector(self) -> NDArray:
        """(log E, nu, q, m, gain, fractions, and what each capture has for itself)."""
        own = [p.vector[-OWN:] for p in self.parameters]
        return np.concatenate([self.parameters[0].vector[:-OWN], *own])


def fit_direct(
    indentations: Sequence[DirectIndentation],
    options: Fit,
    start: Parameters,
    *,
    scales: Sequence[Scales] | None = None,
) -> Solution:
    """Minimise over the moduli, the law and the nuisances of all captures.

    Parameters
    ----------
    indentations : sequence of DirectIndentation
    options : Fit
    start : Parameters
        Where all captures start.
    scales : sequence of Scales, optional
        Kept as they are, with all deviations; found from the residuals by default.
    """
    given = scales is not None
    scales = tuple(scales) if given else (Scales(),) * len(indentations)
    joint = _Joint(indentations, options)
    parameters = (start,) * len(indentations)
    parameters = split(np.clip(_joined(parameters), joint.low, joint.high), joint)
    if not given:
        joint = joint.with_deviations(parameters, first=True)
    for _ in range(0 if given else ROUNDS):
        parameters, _ = joint.minimise(parameters, scales)
        joint = joint.with_deviations(parameters)
        scales = joint.scales_at(parameters)
    parameters, converged = joint.minimise(parameters, scales)
    blocks = joint.blocks_at(parameters, scales)
    cost = joint.cost(parameters, scales) + joint.log_determinant(scales)
    return Solution(parameters, cost, scales, blocks, joint.indentations, converged)


class _Joint:
    """Normal equations of all captures."""

    def __init__(self, indentations, options: Fit) -> None:
        self.indentations, self.options = tuple(indentations), options
        self.times_s = np.array(options.relaxation_times_s, dtype=float)
        self.shared = SHARED + len(self.times_s)
        self.size = self.shared + OWN * len(indentations)
        self.prior = prior_of(indentations, options)
        self.low, self.high = parameter_bounds(len(indentations), options)

    def places(self, number: int) -> NDArray:
        own = self.shared + OWN * number + np.arange(OWN)
        return np.concatenate([np.arange(self.shared), own])

    def minimise(self, parameters, scales) -> tuple[tuple[Parameters, ...], bool]:
        """Parameters of least cost, and whether they converged: no step lowers it further."""
        for _ in range(ITERATIONS):
            blocks = self.blocks_at(parameters, scales)
            matrix, slope = self.normal_equations(parameters, blocks)
            step = self.step(matrix, slope, _joined(parameters))
            before, parameters = parameters, self._moved(parameters, step, scales)
            over = float((np.abs(step[: len(SMALLEST_STEP)]) / SMALLEST_STEP).max())
            if parameters is before or over < 1:
                break
        # Rounding ends a search a little earlier, or lets it go to and fro.
        return parameters, over < ROUNDED

    def with_deviations(self, parameters, *, first=False) -> "_Joint":
        """The same with deviations as these parameters leave them; at first the depths' alone."""
        found = []
        for one, p in zip(self.indentations, parameters, strict=True):
            pressed = one if first else with_pattern(one, p, times_s=self.times_s)
            found.append(with_depth_errors(pressed, p, self.options, likeliest=not first))
        return _Joint(found, self.options)

    def _moved(self, parameters, step, scales):
        """Take the step, halved until it does not raise the cost."""
        before = self.cost(parameters, scales)
        for part in 0.5 ** np.arange(6):
            moved = split(np.clip(_joined(parameters) + part * step, self.low, self.high), self)
            if self.cost(moved, scales) <= before + 1e-9 * abs(before):
                return moved
        return parameters

    def linearised(self, parameters) -> list[Linearised]:
        return [
            linearised(indentation, p, times_s=self.times_s)
            for indentation, p in zip(self.indentations, parameters, strict=True)
        ]

    def blocks_at(self, parameters, scales) -> tuple[Blocks, ...]:
        lines = self.linearised(parameters)
        return tuple(map(blocks_of, self.indentations, lines, scales))

    def normal_equations(self, parameters, blocks) -> tuple[NDArray, NDArray]:
        matrix, slope = np.zeros((self.size, self.size)), np.zeros(self.size)
        for number, block in enumerate(blocks):
            at = self.places(number)
            part = block.motion_matrix.sum(axis=0) + block.depth_matrix.sum(axis=0)
            matrix[np.ix_(at, at)] += part
            slope[at] += block.motion_slope.sum(axis=0) + block.depth_slope.sum(axis=0)
        matrix += self.prior.information
        slope += self.prior.rows.T @ self.prior.gaps(_joined(parameters))
        return matrix, slope

    def step(self, matrix, slope, vector) -> NDArray:
        low, high = self.low - vector, self.high - vector
        held = slice(len(LARGEST_STEP))
        low[held] = np.maximum(low[held], -LARGEST_STEP)
        high[held] = np.minimum(high[held], LARGEST_STEP)
        return bounded_solution(matrix, -slope, low, high)

    def cost(self, parameters, scales) -> float:
        total = float((self.prior.gaps(_joined(parameters)) ** 2).sum())
        for indentation, p, scale in zip(self.indentations, parameters, scales, strict=True):
            gaps = residuals(indentation, p, times_s=self.times_s)
            total += float((gaps.depth**2).sum())
            motion, sharing = scale.of(indentation.kind)
            soft = np.sqrt(1 + (gaps.motion / (ROBUST * motion)) ** 2) - 1
            total += 2 * ROBUST**2 * float((soft / sharing).sum())
        return total

    def log_determinant(self, scales) -> float:
        """What the cost lacks where deviations differ."""
        total = 0.0
        for one, scale in zip(self.indentations, scales, strict=True):
            total += 2 * float(np.log(np.diag(one.depth_root_m)).sum())
            motion, sharing = scale.of(one.kind)
            total += 2 * float((np.log(one.moved_std_m[one.seen] * motion) / sharing).sum())
        return total

    def scales_at(self, parameters) -> tuple[Scales, ...]:
        """Scatter and sharing as the residuals show them."""
        found = []
        for indentation, line in zip(self.indentations, self.linearised(parameters), strict=True):
            each = [line.residuals.motion[indentation.kind == kind] for kind in range(KINDS)]
            motion = tuple(map(robust_scale, each))
            found.append(Scales(motion, sharing_of(indentation, line, motion)))
        return tuple(found)


def split(vector: NDArray, joint: _Joint) -> tuple[Parameters, ...]:
    """Parameters of each capture from the joint vector."""
    return tuple(Parameters.of(vector[joint.places(k)]) for k in range(len(joint.indentations)))


def _joined(parameters: Sequence[Parameters]) -> NDArray:
    own = [p.vector[-OWN:] for p in parameters]
    return np.concatenate([parameters[0].vector[:-OWN], *own])
