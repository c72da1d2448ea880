"""What a bare curve is fitted with, and which values go together."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from palpate.estimate.hertz.fit import RESIDUALS
from palpate.estimate.hertz.laws import (
    INDENTERS,
    LARGEST_CHI,
    LAYERS,
    Law,
    check_ratio,
    cone_force,
    contact_law,
)

CONE = "cone"


@dataclass(frozen=True)
class Setup:
    """What a curve is fitted with; None is chosen by the curve.

    Attributes
    ----------
    radius_m : float or None
        Of the sphere; a cone has none.
    indenter : {"parabola", "sneddon", "cone"} or None
    half_angle_rad : float or None
        Between a cone's axis and its side.
    object_radius_m : float or None
        Of a curved object at the contact, negative where it is hollow; flat by default.
    thickness_m : float or None
        Of a layer on a rigid base.
    poisson_ratio : float
        That a layer's correction and E assume.
    baseline : bool or None
        Whether a constant force is fitted too.
    residual : {"force", "force_two_thirds"}
        What of the force is compared.
    stiffness_n_m : float or None
        Between the drive, whose way the depth is, and the tip; stiff by default.
    base : {"bonded", "not_bonded"}
        Whether a layer sticks to its base.
    contact_m : (float, float) or None
        Depth at which contact is expected, and that depth's standard deviation.

    Raises
    ------
    ValueError
        If one of them is out of its range, or two don't go together.
    """

    radius_m: float | None = None
    indenter: str | None = None
    half_angle_rad: float | None = None
    object_radius_m: float | None = None
    thickness_m: float | None = None
    poisson_ratio: float = 0.33
    baseline: bool | None = None
    residual: str = "force"
    stiffness_n_m: float | None = None
    base: str = "bonded"
    contact_m: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        """Reject what does not go together."""
        check_ratio(self.poisson_ratio, "poisson_ratio")
        _one_of("indenter", self.indenter, (None, *INDENTERS, CONE))
        _one_of("residual", self.residual, RESIDUALS)
        _one_of("base", self.base, LAYERS)
        known = np.array((0.0, 1.0) if self.contact_m is None else self.contact_m, dtype=float)
        if known.shape != (2,) or not np.isfinite(known).all() or not known[1] > 0:
            expected = "expected a depth and a deviation above 0"
            raise ValueError(f"contact_m: {expected}, found {self.contact_m}")
        if self.thickness_m is None and self.base != LAYERS[0]:
            expected = "expected with thickness_m, of a layer"
            raise ValueError(f"base: {expected}, found {self.base} alone")
        for name in ("radius_m", "thickness_m", "stiffness_n_m"):
            found = getattr(self, name)
            if found is not None and not 0 < found < np.inf:
                raise ValueError(f"{name}: expected above 0, found {found}")
        if self.indenter == CONE:
            self._check_cone()
            return
        if self.half_angle_rad is not None:
            raise ValueError("half_angle_rad: expected none but of a cone, found one of a sphere")
        if self.radius_m is None:
            raise ValueError("radius_m: expected the sphere's radius, found none")
        radius = self.object_radius_m
        if radius is not None and not (radius > 0 or radius < -self.radius_m):
            expected = "expected above 0, or below minus the sphere's where the object is hollow"
            raise ValueError(f"object_radius_m: {expected}, found {radius}")

    @property
    def effective_radius_m(self) -> float | None:
        """1/R = 1/R_sphere + 1/R_object (K. L. Johnson, Contact Mechanics, 4.2) [m]."""
        if self.radius_m is None or self.object_radius_m is None:
            return self.radius_m
        return 1 / (1 / self.radius_m + 1 / self.object_radius_m)

    @property
    def support(self) -> str:
        """What the object stands on, as a law has it."""
        return "half_space" if self.thickness_m is None else self.base

    def tip_depth(self, depth_m: NDArray, force_n: NDArray) -> NDArray:
        """Way of the tip, of that of its drive, (n,) [m]."""
        return depth_m if self.stiffness_n_m is None else depth_m - force_n / self.stiffness_n_m

    def law(self, indenter: str) -> Law:
        """Force over depth at E* = 1."""
        if indenter == CONE:
            return lambda depth_m: cone_force(depth_m, self.half_angle_rad)
        return contact_law(
            indenter,
            self.support,
            radius_m=self.radius_m,
            thickness_m=np.inf if self.thickness_m is None else self.thickness_m,
            nu=self.poisson_ratio,
            curvature_per_m=1 / (self.object_radius_m or np.inf),
        )

    def check_layer(self, depth_m: float) -> None:
        """Reject a layer that is thinner than its series holds for at an indentation depth.

        Raises
        ------
        ValueError
        """
        if self.thickness_m is None:
            return
        least = np.sqrt(self.effective_radius_m * max(depth_m, 0.0)) / LARGEST_CHI
        if self.thickness_m < least:
            expected = f"expected at least {1e3 * least:.3g} mm for this indentation"
            found = f"found {1e3 * self.thickness_m:.3g} mm"
            raise ValueError(f"thickness_m: {expected} (no series holds for thinner), {found}")

    def _check_cone(self) -> None:
        if self.half_angle_rad is None or not 0 < self.half_angle_rad < np.pi / 2:
            found = self.half_angle_rad
            raise ValueError(f"half_angle_rad: expected above 0 and below pi/2, found {found}")
        for name in ("radius_m", "object_radius_m", "thickness_m"):
            if getattr(self, name) is not None:
                raise ValueError(f"{name}: expected none of a cone, found {getattr(self, name)}")


def curve_setup(spec: Mapping, probe: Mapping) -> Setup:
    """What an object's curves are fitted with.

    Parameters
    ----------
    spec, probe : mapping
        object.yaml, and the probe's file or what stands for it.
    """
    block, ratios = spec["curves"], np.atleast_1d(spec["curves"]["poisson_ratio"])
    stiffness_n_m = block.get("stiffness_n_m", probe.get("stiffness_n_m"))
    if isinstance(stiffness_n_m, str):
        expected = "a number in curves, which no camera calibrates, or in the probe's file"
        raise ValueError(f"curves.stiffness_n_m: expected {expected}, found {stiffness_n_m}")
    return Setup(
        probe["indenter"]["radius_m"],
        poisson_ratio=float(np.mean(ratios)),
        stiffness_n_m=stiffness_n_m,
    )


def _one_of(name: str, found: str | None, known) -> None:
    if found not in known:
        names = ", ".join(one for one in known if one)
        raise ValueError(f"{name}: expected one of {names}, found {found}")
