"""Options of the error minimisation."""

from dataclasses import dataclass
from typing import Literal

from palpate.options import Options, option

RATIOS = {"least": 0, "below": 0.5}


@dataclass(frozen=True, kw_only=True)
class Load(Options):
    """What the solid is loaded with, and what of it is compared."""

    force_rule: Literal["conserve", "area_ratio", "hertz_patch"] = option(
        "conserve",
        "area_ratio: Eq. 3.27 as printed; hertz_patch: Hertz's pressure, whatever the mesh",
    )
    turn_force: bool = option(True, "to the normal of the contact triangle (Section 5.2.2)")
    leave_out_radii: float = option(
        0, "displacements within so many contact radii of the contact don't count", least=0, most=10
    )
    strain: Literal["linear", "corotational"] = option(
        "linear", "corotational: after the rotations of the tracked displacement"
    )


@dataclass(frozen=True, kw_only=True)
class Minimise(Load):
    """Nelder-Mead over the moduli (Section 3.3)."""

    parametrisation: Literal["modulus", "lame"] = option(
        "modulus", "(log E, nu); lame: (lambda, mu) as printed"
    )
    iterations: int = option(100, "at most", least=1)
    youngs_modulus_bounds_pa: tuple[float, float] = option((100.0, 1e8), "of the search", above=0)
    poisson_ratio_bounds: tuple[float, float] = option((0.0, 0.499), "of the search", **RATIOS)
    start_poisson_ratios: tuple[float, ...] = option(
        (0.05, 0.10, 0.15, 0.20, 0.25, 0.30, 0.35, 0.40, 0.45), "tried first", fewest=1, **RATIOS
    )
    profile_poisson_ratios: tuple[float, ...] = option(
        (0.0, 0.05, 0.10, 0.15, 0.20, 0.25, 0.30, 0.35, 0.40, 0.45, 0.475, 0.49, 0.499),
        "of the profile",
        fewest=3,
        **RATIOS,
    )
    patch_m: float = option(
        0.02, "gaps of surface nodes farther apart are taken as independent", above=0, most=0.2
    )
