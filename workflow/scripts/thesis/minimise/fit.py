"""The moduli of one measured deformation: start, search, profile, and what they are worth."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import partial

import numpy as np
from palpate.modulus import CONFIDENCE, NOT_IDENTIFIED, NOT_JUDGED, verdict_of_nu
from palpate.solid.laws import reduced_modulus
from palpate.solid.mesh import SolidMesh, write_solid
from scipy.optimize import brentq, minimize_scalar
from scipy.special import stdtrit

from thesis.minimise.objective import Objective
from thesis.minimise.options import Minimise
from thesis.minimise.search import Minimum, hertz_start, minimise_error, touches_bound
from thesis.minimise.uncertainty import gradient, independent_patches, scatter

NORMS = ("length", "square")
# Of the error by reduced models, over the largest displacement.
TOLERANCE = 1e-5
FORCE_TERM, AT_BOUND, ALIKE = "force term", "at a bound", "gaps agree over the surface"


@dataclass(frozen=True)
class Best:
    """Moduli at the bottom of the valley of the error, without Nelder and Mead.

    Standard errors are None where scatter says nothing of the moduli: with the force term, since
    noise of the displacement goes through K into it as a bias; at a bound; and where gaps agree
    over so much of the surface that too few patches are independent.

    Attributes
    ----------
    youngs_modulus_pa, poisson_ratio, reduced_modulus_pa : float
    youngs_modulus_std_pa, poisson_ratio_std : float or None
    error_m : float
        The study's objective there [m].
    error_rise_m : float or None
        By how much one standard error of nu raises that objective at the best E for it [m]; None
        for squares, which are another sum.
    at_bound : bool
    patches : int
        Parts of the surface whose gaps are taken as independent of each other.
    patch_m : float
        Their size [m].
    unknown : str or None
        Why there are no standard errors.
    """

    youngs_modulus_pa: float
    youngs_modulus_std_pa: float | None
    poisson_ratio: float
    poisson_ratio_std: float | None
    reduced_modulus_pa: float
    error_m: float
    error_rise_m: float | None
    at_bound: bool
    patches: int
    patch_m: float
    unknown: str | None


@dataclass(frozen=True)
class PoissonProfile:
    """Smallest error for each Poisson's ratio, which shows whether nu is identifiable at all.

    Attributes
    ----------
    poisson_ratios : tuple of float
    youngs_moduli_pa : tuple of float
        E that minimises the error at each [Pa].
    errors_m : tuple of float
        That error [m].
    interval : (float, float) or None
        Poisson's ratios that the error does not distinguish from the best, at 95 %.
    verdict : {"identified", "bounded", "not identified", "not judged"}
        Inside the range and narrow; reaching one end of it, or wide; reaching both, or nothing but
        gaps that agree over the surface or a minimum at a bound; with the force term, which is
        biased.
    """

    poisson_ratios: tuple[float, ...]
    youngs_moduli_pa: tuple[float, ...]
    errors_m: tuple[float, ...]
    interval: tuple[float, float] | None
    verdict: str


@dataclass(frozen=True)
class ModuliFit:
    """Minimum with its trace, best moduli by norm, profile over nu.

    ``reduced_model_error`` is the largest difference between the error by reduced models and by
    whole solutions, at the minimum and at the profile's ends, over the largest displacement.
    """

    minimum: Minimum
    least_squares: dict[str, Best]
    profile: PoissonProfile
    reduced_model_error: float


def fit_moduli(
    objective: Objective, E_star: float, options: Minimise, *, norms: Sequence[str] = NORMS
) -> ModuliFit:
    """Search the moduli from Hertz's start as the study does, and along the error's valley.

    Parameters
    ----------
    objective : Objective
    E_star : float
        Reduced modulus of the Hertz fit [Pa].
    options : Minimise
    norms : sequence of str, optional
        Of the valleys; "length", which judges the profile, among them.

    Raises
    ------
    ValueError
        If the start lies outside the bounds, or reduced models differ from whole solutions.
    """
    start = hertz_start(objective, E_star, options.start_poisson_ratios)
    minimum = minimise_error(objective, start, options)
    valleys = {norm: Valley(objective, options, norm) for norm in norms}
    fits = {norm: valley.best() for norm, valley in valleys.items()}
    profile = poisson_profile(valleys["length"], fits["length"])
    along = list(zip(profile.youngs_moduli_pa, profile.poisson_ratios, strict=True))
    places = [(minimum.youngs_modulus_pa, minimum.poisson_ratio), along[0], along[-1]]
    error = max(abs(objective(*at) - objective.full(*at)) for at in places) / objective.largest_m
    if error > TOLERANCE:
        expected = f"ratios for which reduced models are right to {TOLERANCE:g}"
        raise ValueError(f"poisson_ratio_bounds: expected {expected}, found {error:.2g}")
    return ModuliFit(minimum, fits, profile, error)


class Valley:
    """The error, or the sum of squares, at the best E for each Poisson's ratio.

    Parameters
    ----------
    objective : Objective
    options : Minimise
        Its bounds and the ratios of the profile.
    norm : {"length", "square"}

    Attributes
    ----------
    floor : list of (nu, E, error)
        At these ratios and, where it lies between them, at the minimum.
    """

    def __init__(self, objective: Objective, options: Minimise, norm: str) -> None:
        self.objective, self.norm = objective, norm
        self.bounds = options.youngs_modulus_bounds_pa, options.poisson_ratio_bounds
        self.patch_m = options.patch_m
        nus = sorted({*options.profile_poisson_ratios, *options.poisson_ratio_bounds})
        self.floor = [self.at(nu) for nu in nus]
        best = int(np.argmin([error for *_, error in self.floor]))
        ends = nus[max(best - 1, 0)], nus[min(best + 1, len(nus) - 1)]
        found = minimize_scalar(
            lambda nu: self.at(nu)[2], bounds=ends, method="bounded", options={"xatol": 1e-9}
        )
        if found.fun < self.floor[best][2]:
            self.floor = sorted([*self.floor, self.at(float(found.x))])

    def at(self, nu: float) -> tuple[float, float, float]:
        """Poisson's ratio, the best E for it [Pa], and what is least there."""
        # Unimodal in E, but flat far from the minimum: a grid finds the right part.
        grid = np.linspace(*np.log(self.bounds[0]), 60)
        best = int(np.argmin([self.objective(np.exp(x), nu, self.norm) for x in grid]))
        low, high = grid[max(best - 1, 0)], grid[min(best + 1, len(grid) - 1)]

        def slope(x: float) -> float:
            return gradient(self.objective, np.exp(x), nu, self.norm)[0]

        between = slope(low) < 0 < slope(high)
        x = brentq(slope, low, high, xtol=1e-14) if between else grid[best]
        E = float(np.exp(x))
        return nu, E, self.objective(E, nu, self.norm)

    def best(self) -> Best:
        """Moduli where the valley is lowest, with their standard errors.

        What all gaps have in common, and errors of the model, are not in these.
        """
        objective, (nu, E, _) = self.objective, min(self.floor, key=lambda place: place[2])
        at_bound = touches_bound(E, nu, *self.bounds)
        patches, count, patch_m = independent_patches(objective, E, nu, least_m=self.patch_m)
        covariance, rise = scatter(objective, E, nu, self.norm, patches, count)
        reasons = {
            FORCE_TERM: objective.option != "displacement",
            AT_BOUND: at_bound,
            ALIKE: covariance is None,
        }
        unknown = next((reason for reason, holds in reasons.items() if holds), None)
        std = None if unknown else np.sqrt(np.diag(covariance)).tolist()
        return Best(
            youngs_modulus_pa=E,
            youngs_modulus_std_pa=E * std[0] if std else None,
            poisson_ratio=nu,
            poisson_ratio_std=std[1] if std else None,
            reduced_modulus_pa=reduced_modulus(E, nu),
            error_m=objective(E, nu),
            error_rise_m=rise if std and self.norm == "length" else None,
            at_bound=at_bound,
            patches=count,
            patch_m=patch_m,
            unknown=unknown,
        )


def poisson_profile(valley: Valley, best: Best) -> PoissonProfile:
    """Judge what the rise of the error along its valley says of nu.

    The interval ends where the error has risen by as much as the quantile of Student's t times
    the standard error of nu raises it where it is quadratic (a likelihood ratio, scaled to the
    gaps' own scatter). Without a standard error there is no interval.

    Parameters
    ----------
    valley : Valley
        Of the norm "length".
    best : Best
        Its bottom.
    """
    nus, moduli, errors = zip(*valley.floor, strict=True)
    interval, verdict = None, NOT_JUDGED if best.unknown == FORCE_TERM else NOT_IDENTIFIED
    if best.error_rise_m is not None:
        quantile = float(stdtrit(best.patches - 2, (1 + CONFIDENCE) / 2))
        limit = min(errors) + quantile**2 * best.error_rise_m
        interval = _crossing(valley, limit, -1), _crossing(valley, limit, 1)
        verdict = verdict_of_nu(*interval, (nus[0], nus[-1]))
    return PoissonProfile(nus, moduli, errors, interval, verdict)


def _crossing(valley: Valley, limit: float, step: int) -> float:
    """Poisson's ratio on one side of the bottom where the error reaches a limit, or the end."""
    nus, _, errors = zip(*valley.floor[::step], strict=True)
    bottom = int(np.argmin(errors))
    beyond = next((k for k in range(bottom, len(nus)) if errors[k] > limit), None)
    if beyond is None:
        return nus[-1]
    return brentq(lambda nu: valley.at(nu)[2] - limit, nus[beyond - 1], nus[beyond], xtol=1e-7)


def minimum_files(
    objective: Objective, found: ModuliFit, mesh: SolidMesh, known: Mapping
) -> dict[str, object]:
    """The minimum with its trace (``result``) and the mismatch of each node (``mismatch``).

    ``known`` are fields of the result beside those of the fit.
    """
    minimum = found.minimum
    result = asdict(minimum) | {"error_option": objective.option} | dict(known)
    result |= {name: value for name, value in asdict(found).items() if name != "minimum"}
    computed = objective.displacement(minimum.youngs_modulus_pa, minimum.poisson_ratio)
    tracked, gap = np.nan_to_num(objective.u), np.zeros(len(computed))
    gap[objective.surface] = np.linalg.norm((computed - tracked)[objective.surface], axis=1)
    data = {
        "tracked_displacement_m": tracked,
        "computed_displacement_m": computed,
        "mismatch_m": gap,
    }
    return {"result": result, "mismatch": partial(write_solid, mesh=mesh, point_data=data)}
