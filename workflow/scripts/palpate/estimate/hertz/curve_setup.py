"""What a bare curve is fitted with, and which values go together."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from palpate.estimate.hertz import laws
from palpate.estimate.hertz.fit import RESIDUALS
from palpate.units import readable

FLAT = "flat"
SHARP = {"cone": laws.cone_force, "pyramid": laws.pyramid_force}
# What an indenter that is no sphere is called; the spheres' layers and curved objects are not its.
OTHERS = {"cone": "cone", "pyramid": "pyramid", FLAT: "flat punch"}
# An approach determines the baseline if it is so long beside the indentation, has so many samples,
# and its force rises by no more than this part of the whole.
LEAST_APPROACH, FEWEST_APPROACH, LEVEL = 0.1, 5, 0.02
# Depths of so many radii are of a unit in error.
ABSURD = 5.0
# Part of the way at either end that stands for the free and the indented force.
END = 0.05
# A force that rises by fewer deviations of its noise is none.
RISE_DEVIATIONS = 3.0
FEWEST_FITTED = 3


@dataclass(frozen=True)
class Setup:
    """What a curve is fitted with: arguments of `palpate.hertz.fit`, which says what they are.

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
    base: str = "bonded"
    contact_m: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        """Reject what does not go together."""
        laws.check_ratio(self.poisson_ratio, "poisson_ratio")
        known = {"indenter": (*laws.INDENTERS, *OTHERS), "residual": RESIDUALS, "base": laws.LAYERS}
        for name, names in known.items():
            found = getattr(self, name)
            if found not in names and (found is not None or name != "indenter"):
                raise ValueError(f"{name}: expected one of {', '.join(names)}, found {found}")
        contact = np.array((0.0, 1.0) if self.contact_m is None else self.contact_m, dtype=float)
        if contact.shape != (2,) or not np.isfinite(contact).all() or not contact[1] > 0:
            found = f"found {self.contact_m}"
            raise ValueError(f"contact_m: expected a depth and a deviation above 0, {found}")
        if self.thickness_m is None and self.base != laws.LAYERS[0]:
            raise ValueError(
                f"base: expected with thickness_m, of a layer, found {self.base} alone"
            )
        for name in ("radius_m", "thickness_m"):
            found = getattr(self, name)
            if found is not None and not 0 < found < np.inf:
                raise ValueError(f"{name}: expected above 0, found {found}")
        needed, other = ("radius_m", "radius"), "half_angle_rad"
        if self.indenter in SHARP:
            needed, other = ("half_angle_rad", "half angle"), "radius_m"
        of_spheres = ("object_radius_m", "thickness_m") if self.indenter in OTHERS else ()
        for name in (other, *of_spheres):
            if getattr(self, name) is not None:
                why = " (a layer's factor is a sphere's)" if name == "thickness_m" else ""
                raise ValueError(f"{name}: expected none with a {self.body}{why}, found one")
        if getattr(self, needed[0]) is None:
            raise ValueError(f"{needed[0]}: expected the {self.body}'s {needed[1]}, found none")
        angle = self.half_angle_rad
        if angle is not None and not 0 < angle < np.pi / 2:
            raise ValueError(f"half_angle_rad: expected above 0 and below pi/2, found {angle}")
        radius = self.object_radius_m
        if radius is not None and not (radius > 0 or radius < -self.radius_m):
            expected = "expected above 0, or below minus the sphere's where the object is hollow"
            raise ValueError(f"object_radius_m: {expected}, found {radius}")

    @property
    def body(self) -> str:
        """What the indenter is called."""
        return OTHERS.get(self.indenter, "sphere")

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

    def law(self, indenter: str) -> laws.Law:
        """Force over depth at E* = 1."""
        if indenter in SHARP:
            return partial(SHARP[indenter], half_angle_rad=self.half_angle_rad)
        if indenter == FLAT:
            return partial(laws.flat_force, radius_m=self.radius_m)
        layer = {"thickness_m": self.thickness_m or np.inf, "nu": self.poisson_ratio}
        bent = {"radius_m": self.radius_m, "curvature_per_m": 1 / (self.object_radius_m or np.inf)}
        return laws.contact_law(indenter, self.support, **bent, **layer)

    def others(self, indenter: str, baseline: bool, level_n: float) -> Iterator[tuple[str, dict]]:
        """Other baseline, indenter, residual and layer, each alone, and what it is called."""
        if not baseline:
            yield "with a free baseline", {"baseline": True}
        elif self.baseline is not None:
            # Where the approach shows it, a fit without is of another curve.
            yield "without a baseline", {"baseline": False}
        if indenter in laws.INDENTERS:
            other = next(name for name in laws.INDENTERS if name != indenter)
            yield f"by {other}", {"indenter": other}
        other = next(name for name in RESIDUALS if name != self.residual)
        # A power of the force is one of the force above its level.
        of_level = {"baseline": False, "level_n": level_n, "of": replace(self, residual=other)}
        yield f"with {other} compared", of_level
        if self.thickness_m is not None:
            other = next(name for name in laws.LAYERS if name != self.base)
            yield f"with the layer {other.replace('_', ' ')}", {"of": replace(self, base=other)}
            nu = 0.5 if self.poisson_ratio < 0.4 else 0.3
            yield f"for nu {nu:g}", {"of": replace(self, poisson_ratio=nu)}

    def check_indentation(self, depth_m: NDArray, contact_m: float) -> None:
        """Reject a contact at the record's end, and too thin a layer, by a `ValueError`."""
        count, depth = int((depth_m > contact_m).sum()), float(depth_m.max()) - contact_m
        if count < FEWEST_FITTED:
            expected = f"expected {FEWEST_FITTED} samples or more deeper than the contact"
            hint = "(is it an indentation, the force's sign right, the approach flat?)"
            raise ValueError(f"contact: {expected}, found {count} {hint}")
        if self.thickness_m is None:
            return
        radius, thickness = self.effective_radius_m, self.thickness_m
        least = np.sqrt(radius * depth) / laws.LARGEST_CHI
        if thickness < least and depth > ABSURD * radius:
            expected = f"expected an indentation of up to {ABSURD:g} radii"
            hint = "(is the unit of the depth, or the radius, another?)"
            raise ValueError(f"depth_m: {expected}, found {depth / radius:.3g} {hint}")
        if thickness < least:
            expected = f"expected at least {1e3 * least:.3g} mm for this indentation"
            found = f"(no series holds for thinner), found {1e3 * thickness:.3g} mm"
            raise ValueError(f"thickness_m: {expected} {found}")


def curve_setup(spec: Mapping, probe: Mapping) -> Setup:
    """What an object's curves are fitted with, of object.yaml and the probe's file."""
    nu, radius_m = float(np.mean(spec["curves"]["poisson_ratio"])), probe["indenter"]["radius_m"]
    return Setup(radius_m, poisson_ratio=nu)


def chosen_baseline(depth_m: NDArray, force_n: NDArray, contact_m: float) -> tuple[bool, str]:
    """Whether a constant force is fitted, and why: where the approach determines it.

    Without an approach a free constant takes up the toe of the curve, and E* with it.
    """
    before = depth_m < contact_m
    depth, length = float(depth_m.max()) - contact_m, contact_m - float(depth_m.min())
    if before.sum() < FEWEST_APPROACH or length < LEAST_APPROACH * depth:
        return False, "none, since no approach determines it"
    slope = np.polyfit(depth_m[before] - depth_m.min(), force_n[before], 1)[0]
    # A short one that rises is the toe of an indentation.
    if length < depth and abs(slope) * length > LEVEL * np.ptp(force_n):
        return False, "none, since the approach is short and rises"
    return True, f"fitted, since {int(before.sum())} samples lie before the contact"


def check_rise(depth_m: NDArray, force_n: NDArray) -> None:
    """Reject a record whose force does not rise above its noise, by a `ValueError`."""
    place = (depth_m - depth_m.min()) / np.ptp(depth_m)
    free, loaded = force_n[place <= END], force_n[place >= 1 - END]
    # The free end's own scatter where it has enough samples; a slope is no noise of steps.
    noise = float(free.std(ddof=1)) if len(free) > 2 else 0.0
    rise = float(loaded.mean() - free.mean())
    if rise < RISE_DEVIATIONS * noise:
        scale, unit = readable(max(rise, noise), "N")
        found = f"{scale * rise:.2g} {unit} in noise of {scale * noise:.2g} {unit}"
        raise ValueError(f"force: expected a rise of three times its noise, found {found}")
