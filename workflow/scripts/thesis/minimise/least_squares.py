"""Levenberg-Marquardt on the objective, with exact derivatives and standard errors.

Eq. 3.31 sums lengths of gaps, not their squares. A gap divided by the root of its length has its
length as square: so least squares minimises the study's objective itself (``norm="length"``), or
the plain sum of squares (``norm="square"``).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from palpate.solid.laws import lame_from_engineering, reduced_modulus
from scipy.optimize import least_squares

from thesis.minimise.reduced_objective import ReducedObjective
from thesis.minimise.scatter import (
    NORMS,
    Scatter,
    lame_derivatives,
    moduli_scatter,
    rounding_of,
)
from thesis.minimise.search import outside_bounds, touches_bound

TOLERANCE = 1e-12
FORCE_TERM, AT_BOUND, ALIKE = "force term", "at a bound", "gaps agree over the surface"
REASONS = (FORCE_TERM, AT_BOUND, ALIKE)


@dataclass(frozen=True)
class LeastSquaresFit:
    """Moduli by least squares.

    Standard errors are None where scatter says nothing of the moduli, for one of the `REASONS`:
    with the force term, since noise of the displacement goes through K into it as a bias; at a
    bound; and where gaps agree over so much of the surface that too few patches are independent.

    Attributes
    ----------
    youngs_modulus_pa, poisson_ratio, reduced_modulus_pa : float
    youngs_modulus_std_pa, poisson_ratio_std : float or None
    correlation : float or None
        Of the errors of log E and nu.
    error_m : float
        The study's objective at the fit [m].
    error_rise_m : float or None
        By how much one standard error of nu raises that objective at the best E for it [m]; None
        with ``norm="square"``, which minimises another sum.
    evaluations : int
        Evaluations of the gaps and their derivatives.
    converged, at_bound : bool
    patches : int
        Parts of the surface whose gaps are taken as independent of each other.
    patch_m : float
        Their size [m].
    norm : str
    unknown : str or None
        Why there are no standard errors.
    """

    youngs_modulus_pa: float
    youngs_modulus_std_pa: float | None
    poisson_ratio: float
    poisson_ratio_std: float | None
    correlation: float | None
    reduced_modulus_pa: float
    error_m: float
    error_rise_m: float | None
    evaluations: int
    converged: bool
    at_bound: bool
    patches: int
    patch_m: float
    norm: str
    unknown: str | None


def fit_least_squares(
    objective: ReducedObjective,
    start: tuple[float, float],
    *,
    youngs_modulus_bounds_pa: tuple[float, float],
    poisson_ratio_bounds: tuple[float, float],
    nodes_m: NDArray,
    least_patch_m: float,
    norm: str = "length",
) -> LeastSquaresFit:
    """Minimise the objective over (log E, nu).

    Parameters
    ----------
    objective : ReducedObjective
    start : (float, float)
        E [Pa] and nu.
    youngs_modulus_bounds_pa, poisson_ratio_bounds : (float, float)
    nodes_m : (n, 3) array
        Nodes of the solid [m].
    least_patch_m : float
        Least size of parts of the surface that are taken as independent [m].
    norm : {"length", "square"}

    Raises
    ------
    ValueError
        If the start lies outside the bounds, the norm is unknown, or there are no more gaps than
        parameters.
    """
    if norm not in NORMS:
        raise ValueError(f"norm: expected one of {', '.join(NORMS)}, found {norm}")
    limits = youngs_modulus_bounds_pa, poisson_ratio_bounds
    outside_bounds(start, *limits)
    if sum(len(nodes) for nodes in objective.node_sets) <= 2:
        raise ValueError("nodes: expected more than 2 with a displacement, found fewer")
    first = _search(objective, start, limits, norm)
    # Once more with lengths rounded off as the gaps at the fit have them, not those at the start.
    E, nu, converged, again = _search(objective, first[:2], limits, norm)
    at_bound = touches_bound(E, nu, *limits)
    scatter = moduli_scatter(
        objective, E, nu, norm=norm, nodes_m=nodes_m, least_patch_m=least_patch_m
    )
    unknown = _unknown(objective, at_bound, scatter)
    covariance, known = scatter.covariance, unknown is None
    std = np.sqrt(np.diag(covariance)) if known else None
    return LeastSquaresFit(
        youngs_modulus_pa=E,
        youngs_modulus_std_pa=E * float(std[0]) if known else None,
        poisson_ratio=nu,
        poisson_ratio_std=float(std[1]) if known else None,
        correlation=float(covariance[0, 1] / (std[0] * std[1])) if known else None,
        reduced_modulus_pa=reduced_modulus(E, nu),
        error_m=objective(*lame_from_engineering(E, nu)),
        error_rise_m=scatter.error_rise if known and norm == "length" else None,
        evaluations=first[3] + again,
        converged=converged,
        at_bound=at_bound,
        patches=scatter.patches,
        patch_m=scatter.patch_m,
        norm=norm,
        unknown=unknown,
    )


def _unknown(objective: ReducedObjective, at_bound: bool, scatter: Scatter) -> str | None:
    """First reason for which scatter does not tell how well the moduli are known."""
    found = objective.option != "displacement", at_bound, scatter.covariance is None
    return next((reason for reason, holds in zip(REASONS, found, strict=True) if holds), None)


def _search(
    objective: ReducedObjective,
    start: tuple[float, float],
    limits: tuple[tuple[float, float], tuple[float, float]],
    norm: str,
) -> tuple[float, float, bool, int]:
    """E, nu, whether it converged, and evaluations."""
    residuals = _Residuals(objective, norm, start)
    (E_low, E_high), (nu_low, nu_high) = limits
    bounds = ([np.log(E_low), nu_low], [np.log(E_high), nu_high])
    found = least_squares(
        residuals.values,
        np.clip([np.log(start[0]), start[1]], *bounds),
        jac=residuals.derivatives,
        bounds=bounds,
        x_scale=[1.0, 0.3],
        xtol=TOLERANCE,
        ftol=TOLERANCE,
        gtol=TOLERANCE,
    )
    E, nu = np.clip([np.exp(found.x[0]), found.x[1]], [E_low, nu_low], [E_high, nu_high])
    return float(E), float(nu), bool(found.success), residuals.evaluations


class _Residuals:
    """Residuals of least squares at (log E, nu), with their derivatives."""

    def __init__(self, objective: ReducedObjective, norm: str, start: tuple[float, float]):
        self.objective, self.norm, self.evaluations = objective, norm, 0
        gaps = objective.gaps(*lame_from_engineering(*start))
        self.rounding = [rounding_of(gap) for _, gap, _ in gaps]
        # The optimiser's tolerances expect numbers near one.
        power = 1 if norm == "length" else 2
        size = sum(w**power * (np.linalg.norm(gap, axis=1) ** power).sum() for w, gap, _ in gaps)
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


def _rooted(gap: NDArray, slope: NDArray, rounding: float) -> tuple[NDArray, NDArray]:
    """Gaps over the root of their rounded length, whose square is that length, and derivatives."""
    size = np.sqrt((gap**2).sum(axis=1) + rounding**2)
    along = np.einsum("ki,kij->kj", gap, slope)
    shrink = 1 / np.sqrt(size)
    turned = -0.5 * (shrink / size**2)[:, None, None] * gap[:, :, None] * along[:, None, :]
    return shrink[:, None] * gap, shrink[:, None, None] * slope + turned
