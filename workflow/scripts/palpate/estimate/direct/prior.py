"""What is known of the direct estimate's unknowns before anything is measured."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import chain
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular

from palpate.estimate.direct import indentation as unknown
from palpate.estimate.direct.indentation import DirectIndentation
from palpate.estimate.direct.options import Fit

# Unknowns without a prior: log E and nu.
FREE = 2
RATIO, STEPS = "given Poisson's ratio", "relaxation times"
# Of the material-law parameter of the force, either way: below -2 (of one table; of others -3 to
# -14) the force falls with depth.
FARTHEST_LAW = 2.0
# Deviation of motions that do not happen [m, rad], and variance by which unknowns differ that an
# error moves alike, as part of theirs.
UNMOVED, ALIKE = 1e-12, 1e-6


class PriorError(NamedTuple):
    """An error that the unknowns' expectations may have.

    `std` is its standard uncertainty in its unit, and `response` (k, size) what the right side of
    the normal equations changes by, of errors of one deviation each.
    """

    name: str
    unit: str
    std: float
    response: NDArray


@dataclass(frozen=True)
class Prior:
    """What is known of the unknowns beforehand, as equations of errors of deviation 1.

    Attributes
    ----------
    rows : (r, size) array
    values : (r,) array
    errors : tuple of PriorError
    """

    rows: NDArray
    values: NDArray
    errors: tuple[PriorError, ...]

    def gaps(self, vector: NDArray) -> NDArray:
        """How far unknowns are from what was expected, in deviations, (r,)."""
        return self.rows @ vector - self.values

    @cached_property
    def information(self) -> NDArray:
        """Inverse covariance, (size, size)."""
        return self.rows.T @ self.rows

    def and_known(self, name: str, std: float, rows: NDArray, values: NDArray) -> "Prior":
        """The same with further equations, (k, size) and (k,), of a source without a unit."""
        every = np.vstack([self.rows, rows]), np.append(self.values, values)
        return Prior(*every, (*self.errors, PriorError(name, "1", std, rows)))


def scaled_inverse(information: NDArray) -> NDArray:
    """Covariance (size, size) of unknowns whose deviations differ by many orders."""
    scale = 1 / np.sqrt(np.maximum(np.diag(information), 1e-12))
    scaled = information * scale * scale[:, None] + 1e-12 * np.eye(len(information))
    return np.linalg.inv(scaled) * scale * scale[:, None]


def prior_of(indentations: Sequence[DirectIndentation], options: Fit) -> Prior:
    """Priors of the unknowns of captures, in the order of `Solution.vector`.

    Errors of the tip in the target's frame, of the camera in the base frame and of the object's
    base are the same in all captures; others each capture has anew. There is none of log E, and of
    nu where it is known beforehand.

    Soft tissue and foam relax with a flat spectrum over many decades of time (Fung's quasi-linear
    viscoelasticity, 1981), so neighbouring times have about the same amplitude: without this the
    shortest takes up what else is wrong.
    """
    terms, count = len(options.relaxation_times_s), len(indentations)
    size = unknown.SHARED + terms + unknown.OWN * count
    mean, unit = np.zeros(size), np.eye(size)
    own = unknown.SHARED + terms + unknown.OWN * np.arange(count)[:, None] + np.arange(unknown.OWN)
    mean[own[:, unknown.CLOCK]] = [one.clock_expected_s for one in indentations]
    mean[own[:, unknown.PLACE]] = [one.place_expected_m for one in indentations]

    def each(places: NDArray, stds: Sequence[float]) -> NDArray:
        """Errors of one unknown each."""
        return unit[:, places] * np.asarray(stds)

    def of_captures(places: slice | list[int], stds: Sequence[float]) -> NDArray:
        """The same of unknowns of each capture, of a deviation for each."""
        at = own[:, places].reshape(count, -1)
        return each(at.ravel(), np.repeat(stds, at.shape[1]))

    def of_all(places: slice, axes: Sequence[NDArray]) -> NDArray:
        """Errors that all captures share, which move their unknowns along axes of their own."""
        root = np.zeros((size, axes[0].shape[1]))
        root[own[:, places].ravel()] = np.concatenate(axes)
        return root

    def shared(name: str) -> NDArray:
        """What errors of a source move of all captures; nothing of those that lack it."""
        none = np.zeros_like(next(each[name] for each in roots if name in each))
        places = [unknown.OFFSET, *range(*unknown.PLACE.indices(unknown.OWN))]
        return of_all(places, [each.get(name, none) for each in roots])

    roots = [one.shared_roots_m for one in indentations]
    names = "offset_std_m", "clock_std_s", "camera_clock_std_s", "place_std_m"
    offsets, clocks, cameras, away = ([getattr(one, k) for one in indentations] for k in names)
    moving = [np.diag(one.support_axes.std) for one in indentations]
    shifts = [options.shift_std_m] * count
    fractions = unknown.SHARED + np.arange(terms)
    # Stated are force and poses against the camera: what the poses are off by moves both unknowns.
    of_poses = sum(of_captures([place], cameras) for place in (unknown.CLOCK, unknown.CAMERA_CLOCK))
    known = [
        ("law of the force", "1", each([unknown.FORCE_LAW], [options.force_law_std])),
        ("law of the displacement", "1", each([unknown.MOTION_LAW], [options.motion_law_std])),
        ("scale of the camera", "1", each([unknown.GAIN], [options.gain_std])),
        ("relaxation amplitudes", "1", each(fractions, [options.fraction_std] * terms)),
        *((name, "m", shared(name)) for name in dict.fromkeys(chain(*roots))),
        ("offset of the depth", "m", of_captures([unknown.OFFSET], offsets)),
        ("clocks of camera and force", "s", of_captures([unknown.CLOCK], clocks)),
        ("clocks of poses and camera", "s", of_poses),
        ("offset of the displacement", "m", of_captures([unknown.SHIFT], shifts)),
        ("place of the contact", "m", of_captures(unknown.PLACE, away)),
        ("support: sinking", "m", of_all(unknown.SUPPORT, [one[:, :1] for one in moving])),
        ("support: rocking", "rad", of_all(unknown.SUPPORT, [one[:, 1:] for one in moving])),
    ]
    covariance = sum(root @ root.T for *_, root in known)[FREE:, FREE:]
    stds = np.sqrt(np.maximum(np.diag(covariance), UNMOVED**2))
    correlation = covariance / np.outer(stds, stds)
    np.fill_diagonal(correlation, 1 + ALIKE)
    rows = np.zeros((size - FREE, size))
    rows[:, FREE:] = solve_triangular(
        np.linalg.cholesky(correlation), np.diag(1 / stds), lower=True
    )
    whitened = rows.T @ rows
    errors = [
        PriorError(name, unit, float(np.linalg.norm(root, axis=1).max()), root.T @ whitened)
        for name, unit, root in known
    ]
    prior = Prior(rows, rows @ mean, tuple(errors))
    if terms > 1:
        between = (unit[fractions[:-1]] - unit[fractions[1:]]) / options.fraction_step_std
        prior = prior.and_known(STEPS, options.fraction_step_std, between, np.zeros(terms - 1))
    if options.poisson_ratio is None:
        return prior
    ratio, std = options.poisson_ratio, options.poisson_ratio_std
    return prior.and_known(RATIO, std, unit[[unknown.NU]] / std, np.array([ratio / std]))
