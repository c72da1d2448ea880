"""The moduli of one measured deformation: start, search, derivatives, and what they are worth."""

from collections.abc import Sequence
from dataclasses import dataclass

from numpy.typing import NDArray
from palpate.solid.laws import lame_from_engineering

from thesis.minimise.least_squares import NORMS, LeastSquaresFit, fit_least_squares
from thesis.minimise.objective import Objective
from thesis.minimise.options import Minimise
from thesis.minimise.profile import PoissonProfile, poisson_profile
from thesis.minimise.reduced import SHIFTS
from thesis.minimise.reduced_objective import TOLERANCE, ReducedObjective
from thesis.minimise.search import Minimum, hertz_start, minimise_error

MOST_SHIFTS = 6


@dataclass(frozen=True)
class ReducedAccuracy:
    """How well the reduced models stand for the full one.

    Attributes
    ----------
    shifts : int
        Factorisations that each took.
    modes : int
        Of the largest.
    relative_error_bound : float or None
        At the minimum, in the energy norm; None where it was solved in full.
    largest_error_bound : float
        Over the profile's Poisson's ratios too.
    """

    shifts: int
    modes: int
    relative_error_bound: float | None
    largest_error_bound: float


@dataclass(frozen=True)
class ModuliFit:
    """Minimum with its trace, least squares by norm, profile over nu, accuracy of the model."""

    minimum: Minimum
    least_squares: dict[str, LeastSquaresFit]
    profile: PoissonProfile
    reduced_model: ReducedAccuracy


def fit_moduli(
    full: Objective,
    E_star: float,
    options: Minimise,
    *,
    nodes_m: NDArray,
    norms: Sequence[str] = NORMS,
) -> ModuliFit:
    """Search the moduli from Hertz's start, as the study does and with derivatives.

    Parameters
    ----------
    full : Objective
        Its reduced models are refined until they agree with it at the minimum.
    E_star : float
        Reduced modulus of the Hertz fit [Pa].
    options : Minimise
    nodes_m : (n, 3) array
        Nodes of the solid [m].
    norms : sequence of str, optional
        Of the least squares; "length", which judges the profile, among them.

    Raises
    ------
    ValueError
        If the start lies outside the bounds, or the reduced models can't be made right in the
        range of Poisson's ratios.
    """
    for shifts in range(SHIFTS, MOST_SHIFTS + 1):
        objective = ReducedObjective(
            full, poisson_ratios=options.poisson_ratio_bounds, shifts=shifts
        )
        start = hertz_start(objective, E_star, options.start_poisson_ratios)
        minimum = minimise_error(objective, start, options)
        accuracy = _accuracy(objective, minimum, options.profile_poisson_ratios)
        if accuracy.largest_error_bound <= TOLERANCE:
            break
    else:
        found = f"{accuracy.largest_error_bound:.2g} with {MOST_SHIFTS} ratios"
        raise ValueError(
            f"poisson_ratio_bounds: expected a range that the reduced model can hold to"
            f" {TOLERANCE:g}, found {found}"
        )
    bounds = {
        "youngs_modulus_bounds_pa": options.youngs_modulus_bounds_pa,
        "poisson_ratio_bounds": options.poisson_ratio_bounds,
    }
    surface = {"nodes_m": nodes_m, "least_patch_m": options.patch_m}
    fits = {
        norm: fit_least_squares(objective, start, norm=norm, **surface, **bounds) for norm in norms
    }
    profile = poisson_profile(
        objective,
        options.profile_poisson_ratios,
        youngs_modulus_bounds_pa=options.youngs_modulus_bounds_pa,
        fit=fits["length"],
    )
    return ModuliFit(minimum, fits, profile, accuracy)


def _accuracy(
    objective: ReducedObjective, minimum: Minimum, poisson_ratios: Sequence[float]
) -> ReducedAccuracy:
    places = [lame_from_engineering(minimum.youngs_modulus_pa, nu) for nu in poisson_ratios]
    minima = [(minimum.lame_lambda_pa, minimum.lame_mu_pa)]
    minima = minima if objective.holds(*minima[0]) else []
    bounds = objective.error_bounds(minima + places)
    return ReducedAccuracy(
        shifts=objective.shifts,
        modes=max(len(model.poles) for model in objective.models.values() if model),
        relative_error_bound=float(bounds[0]) if minima else None,
        largest_error_bound=float(bounds.max()),
    )
