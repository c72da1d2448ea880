"""What is known of the direct estimate's unknowns before anything is measured."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from palpate.estimate.direct.indentation import AXES, OWN, PLACES, SHARED, DirectIndentation
from palpate.estimate.direct.options import Fit

# Unknowns without a prior: log E and nu.
FREE = 2
RATIO, NU = "Poisson's ratio", 1
STEPS = "relaxing shares of neighbouring times"
# Of a foot between one that sticks, 0, and one that slides, 1.
MIDDLE = 0.5
# Deviation of motions that do not happen [m, rad].
UNMOVED = 1e-12


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


def scaled_inverse(information: NDArray) -> NDArray:
    """Covariance (size, size) of unknowns whose deviations differ by many orders."""
    scale = 1 / np.sqrt(np.maximum(np.diag(information), 1e-12))
    scaled = information * scale * scale[:, None] + 1e-12 * np.eye(len(information))
    return np.linalg.inv(scaled) * scale * scale[:, None]


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
    # What cannot slide is held by a deviation that is nothing.
    slides = any(one.table.slides for one in indentations)
    foot = (MIDDLE, options.foot_std) if slides else (0.0, UNMOVED)
    known += [("friction of the foot", "1", *foot)]
    known += [("relaxing shares", "1", 0.0, options.fraction_std)] * terms
    # One foot settles alike in all captures, and two cameras stand alike: the mean of all captures
    # keeps the deviation of one.
    alike = np.sqrt(sum(bool(indentation.support_axes.std.any()) for indentation in indentations))
    for indentation in indentations:
        known += [("zero of the depth", "m", 0.0, indentation.offset_std_m)]
        known += [("clocks", "s", indentation.clock_expected_s, indentation.clock_std_s)]
        known += [("zero of the motion", "m", 0.0, indentation.shift_std_m)] * AXES
        for at in indentation.place_expected_m:
            known += [("place of the contact", "m", at, indentation.place_std_m)]
        picture_std_m = np.sqrt(len(indentations)) * indentation.picture_std_m
        known += [("place in the picture", "m", 0.0, picture_std_m)] * PLACES
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
    free = [np.inf] * (SHARED - FREE - 1)
    low = [low_E, low_nu, *np.negative(free), 0.0, *[0.0] * terms, *np.negative(wide)]
    return np.array(low), np.array([high_E, high_nu, *free, 1.0, *[most] * terms, *wide])
