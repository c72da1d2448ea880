"""Levenberg-Marquardt on the objective, with exact derivatives and standard errors.

Eq. 3.31 sums lengths of gaps, not their squares. A gap divided by the root of its length has its
length as square: so least squares minimises the study's objective itself (``norm="length"``), or
the plain sum of squares (``norm="square"``).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from palpate.estimate.moduli import (
    lame_derivatives,
    lame_from_engineering,
    reduced_modulus,
)
from palpate.estimate.reduced_objective import ReducedObjective

NORMS = ("length", "square")
# Lengths are rounded off at this part of their mean, where their root has no derivative.
ROUNDING = 1e-3
TOLERANCE = 1e-12


@dataclass(frozen=True)
class LeastSquaresFit:
    """Moduli by least squares.

    Attributes
    ----------
    youngs_modulus_pa, youngs_modulus_std_pa : float
    poisson_ratio, poisson_ratio_std : float
    correlation : float
        Of the errors of log E and nu.
    reduced_modulus_pa : float
    error_m : float
        The study's objective at the fit [m].
    rise : float
        By how much one standard error of nu raises what is minimised, at the best E for it: with
        ``norm="length"`` the study's objective [m].
    evaluations : int
        Evaluations of the gaps and their derivatives.
    patches : int
        Parts of the surface whose gaps are taken as independent of each other.
    norm : str
    """

    youngs_modulus_pa: float
    youngs_modulus_std_pa: float
    poisson_ratio: float
    poisson_ratio_std: float
    correlation: float
    reduced_modulus_pa: float
    error_m: float
    rise: float
    evaluations: int
    patches: int
    norm: str


def fit_least_squares(
    objective: ReducedObjective,
    start: tuple[float, float],
    *,
    youngs_modulus_bounds_pa: tuple[float, float],
    poisson_ratio_bounds: tuple[float, float],
    patches: NDArray,
    norm: str = "length",
) -> LeastSquaresFit:
    """Minimise the objective over (log E, nu).

    Standard errors are those of an M-estimator whose terms may be correlated within patches of the
    surface but not across them (cluster-robust sandwich); model errors are not in them.

    Parameters
    ----------
    objective : ReducedObjective
    start : (float, float)
        E [Pa] and nu.
    youngs_modulus_bounds_pa, poisson_ratio_bounds : (float, float)
    patches : (n,) int array
        Patch of each node of the solid.
    norm : {"length", "square"}

    Raises
    ------
    ValueError
        If the start lies outside the bounds, the norm is unknown, or there are no more gaps than
        parameters.
    """
    if norm not in NORMS:
        raise ValueError(f"norm: expected one of {', '.join(NORMS)}, found {norm}")
    low, high = zip(youngs_modulus_bounds_pa, poisson_ratio_bounds, strict=True)
    for name, value, least, most in zip(("E", "nu"), start, low, high, strict=True):
        if not least <= value <= most:
            raise ValueError(f"start: expected {name} within ({least}, {most}), found {value:g}")
    if sum(len(nodes) for nodes in objective.node_sets) <= 2:
        raise ValueError("nodes: expected more than 2 with a displacement, found fewer")
    residuals = _Residuals(objective, norm, start)
    bounds = ([np.log(low[0]), low[1]], [np.log(high[0]), high[1]])
    first = np.clip([np.log(start[0]), start[1]], *bounds)
    found = least_squares(
        residuals.values,
        first,
        jac=residuals.derivatives,
        bounds=bounds,
        x_scale=[1.0, 0.3],
        xtol=TOLERANCE,
        ftol=TOLERANCE,
        gtol=TOLERANCE,
    )
    E, nu = float(np.exp(found.x[0])), float(found.x[1])
    covariance, rise = _covariance(objective, E, nu, norm, patches)
    std = np.sqrt(np.diag(covariance))
    return LeastSquaresFit(
        youngs_modulus_pa=E,
        youngs_modulus_std_pa=E * float(std[0]),
        poisson_ratio=nu,
        poisson_ratio_std=float(std[1]),
        correlation=float(covariance[0, 1] / max(std[0] * std[1], 1e-300)),
        reduced_modulus_pa=reduced_modulus(E, nu),
        error_m=objective(*lame_from_engineering(E, nu)),
        rise=rise,
        evaluations=residuals.evaluations,
        patches=len(np.unique(patches[objective.node_sets[0]])),
        norm=norm,
    )


def surface_patches(nodes_m: NDArray, *, size_m: float) -> NDArray:
    """Cell of a cubic grid that each node lies in, shape (n,) int.

    Parameters
    ----------
    nodes_m : (n, 3) array
    size_m : float
        Edge of a cell: gaps of nodes farther apart than about this are taken as independent.
    """
    cells = np.floor((nodes_m - nodes_m.min(axis=0)) / size_m).astype(np.int64)
    return np.unique(cells, axis=0, return_inverse=True)[1].ravel()


class _Residuals:
    """Residuals of least squares at (log E, nu), with their derivatives."""

    def __init__(self, objective: ReducedObjective, norm: str, start: tuple[float, float]):
        self.objective, self.norm, self.evaluations = objective, norm, 0
        gaps = objective.gaps(*lame_from_engineering(*start))
        self.rounding = [ROUNDING * float(_lengths(gap).mean()) for _, gap, _ in gaps]
        # The optimiser's tolerances expect numbers near one.
        power = 1 if norm == "length" else 2
        size = sum(weight**power * (_lengths(gap) ** power).sum() for weight, gap, _ in gaps)
        self.scale = 1 / np.sqrt(max(size, np.finfo(float).tiny))
        self._at, self._both = None, None

    def values(self, x: NDArray) -> NDArray:
        return self._evaluate(x)[0]

    def derivatives(self, x: NDArray) -> NDArray:
        return self._evaluate(x)[1]

    def _evaluate(self, x: NDArray) -> tuple[NDArray, NDArray]:
        if self._at is None or not np.array_equal(x, self._at):
            self.evaluations += 1
            self._at, self._both = x.copy(), self._gaps(float(np.exp(x[0])), float(x[1]))
        return self._both

    def _gaps(self, E: float, nu: float) -> tuple[NDArray, NDArray]:
        chain = lame_derivatives(E, nu)
        values, slopes = [], []
        terms = self.objective.gaps(*lame_from_engineering(E, nu))
        for (weight, gap, by_lame), rounding in zip(terms, self.rounding, strict=True):
            slope = by_lame @ chain
            if self.norm == "length":
                gap, slope = _rooted(gap, slope, rounding)
                weight = np.sqrt(weight)
            values.append(weight * gap.ravel())
            slopes.append(weight * slope.reshape(-1, 2))
        return self.scale * np.concatenate(values), self.scale * np.concatenate(slopes)


def _lengths(gap: NDArray) -> NDArray:
    return np.linalg.norm(gap, axis=1)


def _rooted(gap: NDArray, slope: NDArray, rounding: float) -> tuple[NDArray, NDArray]:
    """Gaps over the root of their rounded length, whose square is that length, and derivatives."""
    square = (gap**2).sum(axis=1)
    size = np.sqrt(square + rounding**2)
    along = np.einsum("ki,kij->kj", gap, slope)
    shrink = 1 / np.sqrt(size)
    turned = -0.5 * (shrink / size**2)[:, None, None] * gap[:, :, None] * along[:, None, :]
    return shrink[:, None] * gap, shrink[:, None, None] * slope + turned


def _covariance(
    objective: ReducedObjective, E: float, nu: float, norm: str, patches: NDArray
) -> tuple[NDArray, float]:
    """Covariance of (log E, nu): inverse curvature, scores summed by patch, inverse curvature.

    And by how much a standard error of nu raises the minimised sum.
    """
    chain = lame_derivatives(E, nu)
    curvature = np.zeros((2, 2))
    scores = np.zeros((patches.max() + 1, 2))
    terms = objective.gaps(*lame_from_engineering(E, nu))
    for (weight, gap, by_lame), nodes in zip(terms, objective.node_sets, strict=True):
        slope = by_lame @ chain
        score = np.einsum("ki,kij->kj", gap, slope)
        normal = np.einsum("kia,kib->kab", slope, slope)
        if norm == "length":
            size = np.maximum(_lengths(gap), ROUNDING * _lengths(gap).mean() + 1e-300)
            score = weight * score / size[:, None]
            across = normal - score[:, :, None] * score[:, None, :] / weight**2
            curvature += weight * (across / size[:, None, None]).sum(axis=0)
        else:
            score = weight**2 * score
            curvature += weight**2 * normal.sum(axis=0)
        np.add.at(scores, patches[nodes], score)
    count = len(np.unique(patches[objective.node_sets[0]]))
    inverse = np.linalg.pinv(curvature)
    covariance = inverse @ (scores.T @ scores) @ inverse * count / max(count - 2, 1)
    return covariance, float(covariance[1, 1] / max(2 * inverse[1, 1], np.finfo(float).tiny))
