"""Joint robust least squares of E, nu, the law and nuisances over all frames of captures."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from palpate.estimate.direct.blocks import (
    Blocks,
    Scales,
    blocks_of,
    bounded_solution,
    sharing_of,
)
from palpate.estimate.direct.deviations import ROBUST, robust_scale, with_pattern
from palpate.estimate.direct.indentation import (
    OWN,
    SHARED,
    DirectIndentation,
    Linearised,
    Parameters,
    linearised,
    residuals,
    with_depth_std,
)
from palpate.estimate.direct.options import Fit

# Unknowns without a prior: log E and nu; and the law's: q and m.
FREE, LAWS = 2, 2
RATIO, NU = "Poisson's ratio", 1
STEPS = "relaxing shares of neighbouring times"
# Deviation of motions that do not happen [m, rad].
UNMOVED = 1e-12
ITERATIONS = 40
ROUNDS = 3
# Steps of log E, nu, q and m are held to these; below the last numbers they have converged.
LARGEST_STEP = np.array([0.5, 0.1, 0.5, 0.5])
SMALLEST_STEP = np.array([1e-5, 1e-5, 1e-4, 1e-4])


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
    """

    parameters: tuple[Parameters, ...]
    cost: float
    scales: tuple[Scales, ...]
    blocks: tuple[Blocks, ...]
    indentations: tuple[DirectIndentation, ...]

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

    Raises
    ------
    ValueError
        If a record has fewer frames than unknowns.
    """
    check_count(indentations, options)
    given = scales is not None
    scales = tuple(scales) if given else (Scales(),) * len(indentations)
    joint = _Joint(indentations, options)
    parameters = (start,) * len(indentations)
    parameters = split(np.clip(_joined(parameters), joint.low, joint.high), joint)
    if not given:
        joint = joint.with_depths(parameters)
    for _ in range(0 if given else ROUNDS):
        parameters = joint.minimise(parameters, scales)
        joint = joint.with_patterns(parameters)
        scales = joint.scales_at(parameters)
    parameters = joint.minimise(parameters, scales)
    blocks, cost = joint.blocks_at(parameters, scales), joint.cost(parameters, scales)
    return Solution(parameters, cost, scales, blocks, joint.indentations)


def check_count(indentations: Sequence[DirectIndentation], options: Fit) -> None:
    """Refuse records with fewer frames than a capture has unknowns.

    Raises
    ------
    ValueError
    """
    for indentation in indentations:
        free = OWN - int((indentation.support_axes.std == 0).sum())
        # The law is held by its priors where frames don't tell it.
        unknowns = SHARED - LAWS + len(options.relaxation_times_s) + free
        if len(indentation.time_s) < unknowns:
            raise ValueError(
                f"frames: expected at least {unknowns}, as many as there are unknowns (moduli,"
                f" relaxing shares, nuisances), found {len(indentation.time_s)}"
            )


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

    def minimise(self, parameters, scales):
        for _ in range(ITERATIONS):
            blocks = self.blocks_at(parameters, scales)
            matrix, slope = self.normal_equations(parameters, blocks)
            step = self.step(matrix, slope, _joined(parameters))
            before, parameters = parameters, self._moved(parameters, step, scales)
            if parameters is before or (np.abs(step[: len(SMALLEST_STEP)]) < SMALLEST_STEP).all():
                break
        return parameters

    def with_depths(self, parameters) -> "_Joint":
        """The same with the deviations of the depths that these parameters make."""
        return self._each(with_depth_std, parameters)

    def with_patterns(self, parameters) -> "_Joint":
        """The same with the deviations of motions and depths that these parameters leave."""
        return self._each(with_pattern, parameters)

    def _each(self, changed, parameters) -> "_Joint":
        pairs = zip(self.indentations, parameters, strict=True)
        return _Joint([changed(*pair, times_s=self.times_s) for pair in pairs], self.options)

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
            total += float((gaps.depth**2).sum()) / scale.depth**2
            soft = np.sqrt(1 + (gaps.motion / (ROBUST * scale.motion)) ** 2) - 1
            total += 2 * ROBUST**2 * float(soft.sum()) / scale.sharing
        return total

    def scales_at(self, parameters) -> tuple[Scales, ...]:
        """Scatter and sharing as the residuals show them."""
        found = []
        for indentation, line in zip(self.indentations, self.linearised(parameters), strict=True):
            gaps = line.residuals
            unit = Scales(motion=robust_scale(gaps.motion))
            depth = max(1.0, robust_scale(gaps.depth - np.median(gaps.depth)))
            sharing = sharing_of(blocks_of(indentation, line, unit))
            found.append(Scales(unit.motion, depth, sharing))
        return tuple(found)


@dataclass(frozen=True)
class Prior:
    """What is known of the unknowns beforehand, as equations of errors of deviation 1.

    Attributes
    ----------
    rows : (r, size) array
    values : (r,) array
    sources : tuple of str
        What each equation is about.
    units : dict of str to str
        By source.
    """

    rows: NDArray
    values: NDArray
    sources: tuple[str, ...]
    units: dict[str, str]

    def gaps(self, vector: NDArray) -> NDArray:
        """How far unknowns are from what was expected, in deviations, (r,)."""
        return self.rows @ vector - self.values

    @cached_property
    def information(self) -> NDArray:
        """Inverse covariance, (size, size)."""
        return self.rows.T @ self.rows


def prior_of(indentations: Sequence[DirectIndentation], options: Fit) -> Prior:
    """Priors of the unknowns of captures, in the order of `Solution.vector`.

    There is none of log E, and of nu where it is known beforehand.

    Soft tissue and foam relax over many decades of time, with a flat spectrum (Fung's
    quasi-linear viscoelasticity, 1981), so neighbouring times have about the same share: without
    this the shortest, of which a press tells the least, takes up what else is wrong.
    """
    terms = len(options.relaxation_times_s)
    known = [("law of the force", "1", 0.0, options.force_law_std)]
    known += [("law of the motion", "1", 0.0, options.motion_law_std)]
    known += [("scale of the camera", "1", 0.0, options.gain_std)]
    known += [("relaxing shares", "1", 0.0, options.fraction_std)] * terms
    # One foot settles alike in all captures: their mean keeps the deviation of one.
    alike = np.sqrt(sum(bool(indentation.support_axes.std.any()) for indentation in indentations))
    for indentation in indentations:
        known += [("zero of the depth", "m", 0.0, indentation.offset_std_m)]
        known += [("clocks", "s", indentation.clock_expected_s, indentation.clock_std_s)]
        known += [("zero of the motion", "m", 0.0, indentation.shift_std_m)]
        # What does not move at all is held by a deviation that is nothing beside any motion.
        stds = np.maximum(alike * indentation.support_axes.std, UNMOVED)
        known += [("sinking", "m", 0.0, stds[0])]
        known += [("rocking", "rad", 0.0, std) for std in stds[1:]]
    sources, units, means, stds = zip(*known, strict=True)
    steps = max(terms - 1, 0)
    rows = np.zeros((len(known) + steps, FREE + len(known)))
    rows[np.arange(len(known)), FREE + np.arange(len(known))] = 1 / np.array(stds)
    for k in range(steps):
        at = SHARED + k
        rows[len(known) + k, [at, at + 1]] = np.array([1, -1]) / options.fraction_step_std
    values = np.append(np.array(means) / np.array(stds), np.zeros(steps))
    named = dict(zip(sources, units, strict=True)) | {STEPS: "1", RATIO: "1"}
    prior = Prior(rows, values, (*sources, *[STEPS] * steps), named)
    return prior if options.poisson_ratio is None else _with_ratio(prior, options)


def _with_ratio(prior: Prior, options: Fit) -> Prior:
    """The same with a Poisson's ratio that is known beforehand."""
    row = np.zeros((1, prior.rows.shape[1]))
    row[0, NU] = 1 / options.poisson_ratio_std
    values = np.append(prior.values, options.poisson_ratio / options.poisson_ratio_std)
    return replace(
        prior, rows=np.vstack([prior.rows, row]), values=values, sources=(*prior.sources, RATIO)
    )


def parameter_bounds(captures: int, options: Fit) -> tuple[NDArray, NDArray]:
    """Least and greatest value of each unknown."""
    terms = len(options.relaxation_times_s)
    low_nu, high_nu = options.poisson_ratio_bounds
    low_E, high_E = np.log(options.youngs_modulus_bounds_pa)
    most = 0.95 / max(terms, 1)
    wide = [np.inf] * (OWN * captures)
    free = [np.inf] * (SHARED - FREE)
    low = [low_E, low_nu, *np.negative(free), *[0.0] * terms, *np.negative(wide)]
    return np.array(low), np.array([high_E, high_nu, *free, *[most] * terms, *wide])


def split(vector: NDArray, joint: _Joint) -> tuple[Parameters, ...]:
    """Parameters of each capture from the joint vector."""
    return tuple(Parameters.of(vector[joint.places(k)]) for k in range(len(joint.indentations)))


def _joined(parameters: Sequence[Parameters]) -> NDArray:
    own = [p.vector[-OWN:] for p in parameters]
    return np.concatenate([parameters[0].vector[:-OWN], *own])
