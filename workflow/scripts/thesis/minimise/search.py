"""Displacement error minimisation: Nelder-Mead from a Hertz start (Section 3.3.4)."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from palpate.solid.laws import (
    engineering_from_lame,
    lame_from_engineering,
    reduced_modulus,
)
from scipy.optimize import minimize

from thesis.minimise.options import Minimise

Cost = Callable[[float, float], float]
AT_BOUND = 1e-3
# Of the first simplex, in log E and in nu.
FIRST_STEPS = np.array([0.3, 0.05])


@dataclass(frozen=True)
class Minimum:
    """Result of a minimisation.

    Attributes
    ----------
    youngs_modulus_pa, poisson_ratio, reduced_modulus_pa : float
    lame_lambda_pa, lame_mu_pa : float
    error_m : float
        Value of the objective [m].
    evaluations : int
    converged : bool
        Whether the simplex collapsed before the iterations ran out.
    at_bound : bool
        Whether the minimum lies on a bound of E or nu, or beyond (``lame`` has no bounds).
    start_poisson_ratio : float
        Poisson's ratio of the chosen start.
    trace : tuple of dict
        Best vertex after each iteration: iteration, lame_lambda_pa, lame_mu_pa, error_m, and
        evaluations so far.
    """

    youngs_modulus_pa: float
    poisson_ratio: float
    reduced_modulus_pa: float
    lame_lambda_pa: float
    lame_mu_pa: float
    error_m: float
    evaluations: int
    converged: bool
    at_bound: bool
    start_poisson_ratio: float
    trace: tuple[dict, ...]


def hertz_start(cost: Cost, E_star: float, poisson_ratios: list[float]) -> tuple[float, float]:
    """Best of the pairs (E, nu) that agree with Hertz's E*, over a grid of nu.

    Parameters
    ----------
    cost : callable
        Objective of (E, nu).
    E_star : float
        Reduced modulus of the Hertz fit [Pa].
    poisson_ratios : list of float

    Returns
    -------
    E, nu : float
    """
    starts = [(E_star * (1 - nu**2), nu) for nu in poisson_ratios]
    return min(starts, key=lambda start: cost(*start))


def minimise_error(cost: Cost, start: tuple[float, float], options: Minimise) -> Minimum:
    """Minimise an objective over the elastic moduli by Nelder and Mead's method.

    Parameters
    ----------
    cost : callable
        Objective of (E, nu) [m].
    start : (float, float)
        E [Pa] and nu.
    options : Minimise

    Returns
    -------
    Minimum

    Raises
    ------
    ValueError
        If the start lies outside the bounds.
    """
    E_bounds, nu_bounds = options.youngs_modulus_bounds_pa, options.poisson_ratio_bounds
    for name, value, (low, high) in zip(("E", "nu"), start, (E_bounds, nu_bounds), strict=True):
        if not low <= value <= high:
            raise ValueError(f"start: expected {name} within {(low, high)}, found {value:g}")
    search = {"modulus": _by_modulus, "lame": _by_lame}[options.parametrisation]
    to_lame, simplex, bounds = search(start, E_bounds, nu_bounds)
    trace: list[dict] = []
    count = 0

    def function(x: NDArray) -> float:
        nonlocal count
        count += 1
        lam, mu = to_lame(x)
        # Resists shear and compression.
        stable = mu > 0 and 3 * lam + 2 * mu > 0
        return cost(*engineering_from_lame(lam, mu)) if stable else np.inf

    def note(intermediate_result) -> None:
        lam, mu = to_lame(intermediate_result.x)
        trace.append(
            {
                "iteration": len(trace) + 1,
                "lame_lambda_pa": float(lam),
                "lame_mu_pa": float(mu),
                "error_m": float(intermediate_result.fun),
                "evaluations": count,
            }
        )

    limits = {"maxiter": options.iterations, "xatol": 1e-7, "fatol": 1e-13}
    limits["initial_simplex"] = simplex
    found = minimize(
        function, simplex[0], method="Nelder-Mead", bounds=bounds, callback=note, options=limits
    )
    lam, mu = (float(value) for value in to_lame(found.x))
    E, nu = engineering_from_lame(lam, mu)
    return Minimum(
        youngs_modulus_pa=E,
        poisson_ratio=nu,
        reduced_modulus_pa=reduced_modulus(E, nu),
        lame_lambda_pa=lam,
        lame_mu_pa=mu,
        error_m=float(found.fun),
        evaluations=count,
        converged=bool(found.success),
        at_bound=touches_bound(E, nu, E_bounds, nu_bounds),
        start_poisson_ratio=float(start[1]),
        trace=tuple(trace),
    )


def _by_modulus(start: tuple, E_bounds: list, nu_bounds: list) -> tuple:
    def to_lame(x: NDArray) -> tuple[float, float]:
        return lame_from_engineering(float(np.exp(x[0])), float(x[1]))

    bounds = [tuple(np.log(E_bounds)), tuple(nu_bounds)]
    first = np.array([np.log(start[0]), start[1]])
    # Towards the middle: a simplex that a bound cuts flat never leaves it.
    inward = np.sign(np.mean(bounds, axis=1) - first) + (np.mean(bounds, axis=1) == first)
    return to_lame, first + np.vstack([np.zeros(2), np.diag(inward * FIRST_STEPS)]), bounds


def _by_lame(start: tuple, E_bounds: list, nu_bounds: list) -> tuple:
    lam, mu = lame_from_engineering(*start)
    scale = np.array([lam or mu, mu])

    def to_lame(x: NDArray) -> tuple[float, float]:
        lam, mu = x * scale
        return float(lam), float(mu)

    first = np.array([lam, mu]) / scale
    # SciPy's own first simplex: 5 %, and a little where a start is zero.
    steps = np.where(first == 0, 0.00025, 0.05 * first)
    return to_lame, first + np.vstack([np.zeros(2), np.diag(steps)]), None


def touches_bound(
    E: float, nu: float, E_bounds: Sequence[float], nu_bounds: Sequence[float]
) -> bool:
    """Whether E or nu lies on a bound, beyond, or within a thousandth of the range of one."""
    logs = np.log(E), np.log(E_bounds)
    return any(
        min(value - low, high - value) < AT_BOUND * (high - low)
        for value, (low, high) in (logs, (nu, nu_bounds))
    )
