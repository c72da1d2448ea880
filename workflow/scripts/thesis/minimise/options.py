"""Options of the error minimisation."""

from typing import Annotated, Literal, Self

from palpate.config.model import Count, Length, Model, Positive, Ratio, constant, increasing, option
from pydantic import model_validator


class Solid(Model):
    """Solid of the error minimisation (Section 3.3)."""

    refine_radius_m: Positive = option(0.020, "refined around the contact")
    refine_edge_m: Positive = option(0.007, "longest edges there")
    element_order: Literal[1, 2] = option(1, "2: ten-node tetrahedra, which do not lock")


class Load(Model):
    """What the solid is loaded with, and what of it is compared."""

    force_rule: Literal["conserve", "area_ratio", "hertz_patch"] = option(
        "conserve",
        "area_ratio: Eq. 3.27 as printed; hertz_patch: Hertz's pressure, whatever the mesh",
    )
    turn_force: bool = option(True, "to the normal of the contact triangle (Section 5.2.2)")
    leave_out_radii: float = option(
        0, "displacements within so many contact radii of the contact don't count", ge=0, le=10
    )


class Minimise(Load):
    """Nelder-Mead over the moduli (Section 3.3)."""

    parametrisation: Literal["modulus", "lame"] = option(
        "modulus", "(log E, nu); lame: (lambda, mu) as printed"
    )
    iterations: Count = option(100, "at most", ge=1)
    youngs_modulus_bounds_pa: tuple[Positive, Positive] = constant((100.0, 1e8), "of the search")
    poisson_ratio_bounds: tuple[Ratio, Ratio] = constant((0.0, 0.499), "of the search")
    start_poisson_ratios: tuple[Ratio, ...] = option(
        (0.05, 0.10, 0.15, 0.20, 0.25, 0.30, 0.35, 0.40, 0.45), "tried first", min_length=1
    )
    profile_poisson_ratios: Annotated[tuple[Ratio, ...], increasing] = option(
        (0.0, 0.05, 0.10, 0.15, 0.20, 0.25, 0.30, 0.35, 0.40, 0.45, 0.475, 0.49, 0.499),
        "of the profile, beside the ends of the search",
        min_length=3,
    )
    patch_m: Length = constant(0.02, "gaps of surface nodes farther apart are taken as independent")

    @model_validator(mode="after")
    def _within_bounds(self) -> Self:
        low, high = self.poisson_ratio_bounds
        for name in ("start_poisson_ratios", "profile_poisson_ratios"):
            if outside := [nu for nu in getattr(self, name) if not low <= nu <= high]:
                expected = f"within poisson_ratio_bounds, {low:g} to {high:g}"
                raise ValueError(f"{name}: expected {expected}, found {outside[0]:g}")
        return self
