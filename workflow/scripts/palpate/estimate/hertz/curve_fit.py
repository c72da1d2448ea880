"""E* of a bare curve: its fit, what was chosen for it, and warnings against trusting it."""

from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, fields, replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from palpate.estimate.hertz.curve_setup import CONE, Setup
from palpate.estimate.hertz.fit import RESIDUALS, ContactFit, fit_free_contact
from palpate.estimate.hertz.indentation import SHALLOW
from palpate.estimate.hertz.laws import INDENTERS, check_ratio
from palpate.units import PERCENT, readable

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# An approach determines the baseline if it is so long beside the indentation, has so many samples,
# and its force rises by no more than this part of the whole.
LEAST_APPROACH, FEWEST_APPROACH, FLAT = 0.1, 5, 0.02
# Part of the way at either end that stands for the free and the indented force.
END = 0.05
# A force that rises by fewer deviations of its noise, or whose scatter a law explains less of than
# this, is none.
RISE_DEVIATIONS, LEAST_EXPLAINED = 3.0, 0.5
# Beyond one radius no law of a sphere holds; beyond so many it is a unit in error.
DEEP, ABSURD = 1.0, 5.0
# Contact so far before the record, as part of the indentation depth, is a guess.
BEFORE = 0.02
# An interval this narrow is of made-up data.
EXACT = 1e-6
FEWEST_IN_CONTACT, FEWEST_FITTED = 10, 3
# Residuals are a pattern, not noise, where fewer of them than this part are independent.
INDEPENDENT = 0.1
# An approach that rises or falls by more than this part of the peak is none of a level.
SLOPING = 0.05
# Smaller changes of E* are not worth a line.
LEAST_CHANGE = 0.01
# Rms of the residuals over the peak, and what is said of it.
QUALITIES = ((0.01, "good"), (0.03, "fair"), (np.inf, "poor"))
# How much of the approach is drawn, as part of the indentation depth.
SHOWN = 1.0
ARRAYS = ("depth_m", "force_n", "fitted_n", "weights")


@dataclass(frozen=True, repr=False)
class HertzFit:
    """Reduced modulus of a curve, and all that it follows from.

    Attributes
    ----------
    reduced_modulus_pa : float
        E* = E / (1 - nu^2) [Pa].
    reduced_modulus_interval_pa : (float, float)
        Of 95 %, of the residuals' scatter and what is expected of the contact alone [Pa].
    contact_m, contact_std_m : float
        Depth at which contact begins, and its standard deviation [m].
    baseline_n : float
        Constant force before contact; 0 where it was not fitted [N].
    rms_n : float
        Of the residuals [N].
    effective_samples : float
        Number of independent residuals that their serial correlation leaves.
    indenter, support : str
        Law that was fitted.
    baseline : bool
        Whether the constant force was fitted.
    setup : Setup
        What was asked for.
    chosen : dict of str to str
        What was chosen by the curve, and why.
    others : dict of str to float
        E* by what else could be chosen [Pa].
    depth_m, force_n, fitted_n : (n,) arrays
        Samples that were fitted, the tip's depth, and the law at them [m, N, N].
    weights : (n,) array or None
        Of their squared residuals.
    """

    reduced_modulus_pa: float
    reduced_modulus_interval_pa: tuple[float, float]
    contact_m: float
    contact_std_m: float
    baseline_n: float
    rms_n: float
    effective_samples: float
    indenter: str
    support: str
    baseline: bool
    setup: Setup
    chosen: Mapping[str, str]
    others: Mapping[str, float]
    depth_m: NDArray
    force_n: NDArray
    fitted_n: NDArray
    weights: NDArray | None = None

    def __repr__(self) -> str:
        warned = f"; warnings: {'; '.join(self.doubts)}" if self.doubts else ""
        law = f"{self.indenter}, {self.support}"
        return f"HertzFit(E* {self.modulus_text}; {law}; {self.quality}{warned})"

    @property
    def modulus_text(self) -> str:
        """E* with its interval, in the unit that it is read best in."""
        return modulus_text(self.reduced_modulus_pa, self.reduced_modulus_interval_pa)

    @property
    def residual_n(self) -> NDArray:
        """Force less the law, (n,) [N]."""
        return self.force_n - self.fitted_n

    @property
    def press_m(self) -> float:
        """Maximum indentation depth, from the contact [m]."""
        return float(self.depth_m.max()) - self.contact_m

    @property
    def samples_in_contact(self) -> int:
        """Number of samples deeper than the contact."""
        return int((self.depth_m > self.contact_m).sum())

    @property
    def doubts(self) -> tuple[str, ...]:
        """Warnings against trusting the modulus, a line each."""
        return (*_warnings_of_depth(self), *_warnings_of_samples(self))

    @property
    def hangs_on(self) -> tuple[str, ...]:
        """Other choices that would move E* out of its interval, a line each."""
        return tuple(_outside(self))

    @property
    def quality(self) -> str:
        """How well the law follows the samples, in words."""
        part = self.rms_n / float(np.ptp(self.fitted_n))
        word = next(name for limit, name in QUALITIES if part <= limit)
        return f"{word} fit, residuals of {PERCENT * part:.2g} % of the peak"

    def youngs_modulus_pa(self, poisson_ratio: float) -> float:
        """Young's modulus for a known Poisson's ratio [Pa].

        Raises
        ------
        ValueError
            If the ratio is not from 0 to 0.5, or another than a layer's E* goes with.
        """
        return self.reduced_modulus_pa * self._of_reduced(poisson_ratio)

    def youngs_modulus_interval_pa(self, poisson_ratio: float) -> tuple[float, float]:
        """Interval of 95 % of Young's modulus for a known Poisson's ratio [Pa]."""
        part = self._of_reduced(poisson_ratio)
        low, high = (end * part for end in self.reduced_modulus_interval_pa)
        return low, high

    def _of_reduced(self, poisson_ratio: float) -> float:
        """Young's modulus over the reduced one."""
        check_ratio(poisson_ratio, "poisson_ratio")
        assumed = self.setup.poisson_ratio
        if self.support != "half_space" and poisson_ratio != assumed:
            expected = f"expected {assumed:g}, which the layer was fitted with"
            raise ValueError(f"poisson_ratio: {expected}, found {poisson_ratio:g}")
        return 1 - poisson_ratio**2

    def told(self) -> dict:
        """All of it but the samples, as JSON has it."""
        kept = {one.name: getattr(self, one.name) for one in fields(self)}
        nu = self.setup.poisson_ratio
        return {name: value for name, value in kept.items() if name not in ARRAYS} | {
            "doubts": self.doubts,
            "youngs_modulus_pa": self.youngs_modulus_pa(nu),
            "youngs_modulus_interval_pa": self.youngs_modulus_interval_pa(nu),
            "quality": self.quality,
            "hangs_on": self.hangs_on,
            "press_m": self.press_m,
            "samples": len(self.depth_m),
            "samples_in_contact": self.samples_in_contact,
            "effective_radius_m": self.setup.effective_radius_m,
            "setup": asdict(self.setup),
        }

    def plot(self, axes: "Axes") -> None:
        """Draw samples and law, force over indentation, into axes of Matplotlib."""
        way, length = readable(self.press_m, "m")
        load, force = readable(float(np.ptp(self.fitted_n)), "N")
        order = np.argsort(self.depth_m)
        depth = way * (self.depth_m - self.contact_m)
        axes.plot(depth, load * self.force_n, ".", ms=3, color="#9A9A9A", label="measured")
        law = f"{self.indenter}, {self.support}".replace("_", "-")
        law = f"{law}\nE* {self.modulus_text}"
        axes.plot(depth[order], load * self.fitted_n[order], color="#D55E00", label=law)
        axes.axvline(0, lw=0.6, color="#1A1A1A")
        # A long approach would leave no room for the indentation.
        axes.set_xlim(max(depth.min(), -SHOWN * depth.max()), 1.05 * depth.max())
        axes.set(xlabel=f"indentation ({length})", ylabel=f"force ({force})")
        axes.legend()


def modulus_text(value_pa: float, interval_pa: tuple[float, float]) -> str:
    """A modulus with its interval, in the unit that it is read best in."""
    scale, unit = readable(value_pa, "Pa")
    low, high = (scale * end for end in interval_pa)
    return f"{scale * value_pa:.4g} {unit} (95 %: {low:.4g} to {high:.4g})"


def fit_curve(
    depth_m: NDArray, force_n: NDArray, setup: Setup, weights: NDArray | None = None
) -> HertzFit:
    """Fit E* and the depth of first contact to approach and loading.

    Parameters
    ----------
    depth_m, force_n : (n,) arrays
    setup : Setup
    weights : (n,) array, optional
        Of the squared residuals; samples of none are left out.

    Raises
    ------
    ValueError
        If the force does not rise above its noise, no contact is found, or a layer is thinner than
        its series holds for.
    """
    if weights is not None:
        depth_m, force_n, weights = (one[weights > 0] for one in (depth_m, force_n, weights))
    depth = setup.tip_depth(depth_m, force_n)
    _require_rise(depth, force_n)
    fitted = partial(_fitted, depth, force_n, weights, setup)
    indenter, baseline, chosen = setup.indenter or INDENTERS[0], setup.baseline, {}
    if baseline is None:
        with_it = fitted(indenter, baseline=True)
        baseline, chosen["baseline"] = _chosen_baseline(depth, force_n, with_it)
    found = fitted(indenter, baseline=baseline)
    if setup.indenter is None:
        indenter, chosen["indenter"] = _chosen_indenter(depth, found, setup)
        found = fitted(indenter, baseline=baseline)
    _require_contact(depth, found.contact_depth_m)
    setup.check_layer(float(depth.max()) - found.contact_depth_m)
    unit = setup.law(indenter)(depth - found.contact_depth_m)
    result = HertzFit(
        reduced_modulus_pa=found.reduced_modulus_pa,
        reduced_modulus_interval_pa=found.reduced_modulus_interval_pa,
        contact_m=found.contact_depth_m,
        contact_std_m=found.contact_depth_std_m,
        baseline_n=found.baseline_n,
        rms_n=found.rms_n,
        effective_samples=found.effective_samples,
        indenter=indenter,
        support=setup.support,
        baseline=baseline,
        setup=setup,
        chosen=chosen,
        others={},
        depth_m=depth,
        force_n=force_n,
        fitted_n=found.reduced_modulus_pa * unit + found.baseline_n,
        weights=weights,
    )
    others = {
        name: fitted(**{"indenter": indenter, "baseline": baseline} | change).reduced_modulus_pa
        for name, change in _other_choices(result)
    }
    return replace(result, others=others)


def _fitted(
    depth_m: NDArray,
    force_n: NDArray,
    weights: NDArray | None,
    setup: Setup,
    indenter: str,
    *,
    baseline: bool,
    residual: str | None = None,
    level_n: float = 0.0,
) -> ContactFit:
    """Fit of a law, to the force above a level."""
    expected, std = setup.contact_m or (0.0, None)
    found = fit_free_contact(
        depth_m - expected,
        force_n - level_n,
        setup.law(indenter),
        baseline=baseline,
        residual=residual or setup.residual,
        weights=weights,
        depth_std_m=std,
    )
    return replace(found, contact_depth_m=found.contact_depth_m + expected)


def _other_choices(found: HertzFit) -> Iterator[tuple[str, dict]]:
    """Other baseline, indenter and residual, each alone: what it is called, and what it changes."""
    if not found.baseline:
        yield "with a free baseline", {"baseline": True}
    elif "baseline" not in found.chosen:
        # Where the approach shows it, a fit without is of another curve.
        yield "without a baseline", {"baseline": False}
    if found.indenter != CONE:
        other = next(name for name in INDENTERS if name != found.indenter)
        yield f"by {other}", {"indenter": other}
    other = next(name for name in RESIDUALS if name != found.setup.residual)
    # A power of the force is one of the force above its level.
    level = {"baseline": False, "level_n": found.baseline_n}
    yield f"with {other} compared", level | {"residual": other}


def _chosen_baseline(depth_m: NDArray, force_n: NDArray, with_it: ContactFit) -> tuple[bool, str]:
    """Whether a constant force is fitted, and why: where the approach determines it.

    Without an approach a free constant takes up the toe of the curve, and E* with it.
    """
    before = depth_m < with_it.contact_depth_m
    depth = float(depth_m.max()) - with_it.contact_depth_m
    length = with_it.contact_depth_m - float(depth_m.min())
    if before.sum() < FEWEST_APPROACH or length < LEAST_APPROACH * depth:
        return False, "none, since no approach determines it"
    slope = np.polyfit(depth_m[before] - depth_m.min(), force_n[before], 1)[0]
    # A short one that rises is the toe of an indentation.
    if length < depth and abs(slope) * length > FLAT * np.ptp(force_n):
        return False, "none, since the approach is short and rises"
    return True, f"fitted, since {int(before.sum())} samples lie before the contact"


def _chosen_indenter(depth_m: NDArray, found: ContactFit, setup: Setup) -> tuple[str, str]:
    """Law of the sphere, and why: by depth over radius."""
    part = (float(depth_m.max()) - found.contact_depth_m) / setup.effective_radius_m
    name, than = ("sneddon", "above") if part > SHALLOW else ("parabola", "up to")
    return name, f"{name}, since the indentation is {part:.3g} radii deep ({than} {SHALLOW:g})"


def _require_rise(depth_m: NDArray, force_n: NDArray) -> None:
    """Reject a record whose force does not rise above its noise."""
    place = (depth_m - depth_m.min()) / np.ptp(depth_m)
    free, loaded = force_n[place <= END], force_n[place >= 1 - END]
    # The free end's own scatter where it has enough samples; a slope is no noise of steps.
    noise = float(free.std(ddof=1)) if len(free) > 2 else 0.0
    rise = float(loaded.mean() - free.mean())
    if rise < RISE_DEVIATIONS * noise:
        scale, unit = readable(max(rise, noise), "N")
        found = f"{scale * rise:.2g} {unit} in noise of {scale * noise:.2g} {unit}"
        raise ValueError(f"force: expected a rise of three times its noise, found {found}")


def _require_contact(depth_m: NDArray, contact_m: float) -> None:
    """Reject a fit whose contact lies at the record's end."""
    found = int((depth_m > contact_m).sum())
    if found < FEWEST_FITTED or not depth_m.max() > contact_m:
        expected = f"expected {FEWEST_FITTED} samples or more deeper than the contact"
        hint = "(is it an indentation, the force's sign right, the approach flat?)"
        raise ValueError(f"contact: {expected}, found {found} {hint}")


def _outside(found: HertzFit) -> Iterator[str]:
    low, high = found.reduced_modulus_interval_pa
    for name, modulus in found.others.items():
        part = modulus / found.reduced_modulus_pa - 1
        if not low <= modulus <= high and abs(part) >= LEAST_CHANGE:
            scale, unit = readable(modulus, "Pa")
            yield f"{name} E* would be {scale * modulus:.4g} {unit} ({PERCENT * part:+.2g} %)"


def _warnings_of_depth(found: HertzFit) -> Iterator[str]:
    radius = found.setup.effective_radius_m
    if radius is not None and found.press_m > DEEP * radius:
        why = "no law of a sphere holds there"
        if found.press_m > ABSURD * radius:
            why = "is the unit of the depth, or the radius, another?"
        yield f"the indentation is {found.press_m / radius:.3g} radii of the sphere deep: {why}"
    before = float(found.depth_m.min()) - found.contact_m
    if before > BEFORE * found.press_m:
        scale, unit = readable(before, "m")
        yield (
            f"contact lies {scale * before:.3g} {unit} before the record's first sample, where"
            " nothing was measured"
        )


def _warnings_of_samples(found: HertzFit) -> Iterator[str]:
    count = found.samples_in_contact
    if count < FEWEST_IN_CONTACT:
        yield f"{count} samples lie in contact: expected {FEWEST_IN_CONTACT} or more"
    low, high = found.reduced_modulus_interval_pa
    if high - low < EXACT * found.reduced_modulus_pa:
        yield "the samples lie on the law exactly, as made-up ones do: the interval says nothing"
        return
    power = float(np.sum((found.force_n - found.force_n.mean()) ** 2))
    explained = 1 - float(np.sum(found.residual_n**2)) / power
    if explained < LEAST_EXPLAINED:
        yield f"the law explains {PERCENT * explained:.2g} % of the force's scatter"
    count, left = len(found.force_n), found.effective_samples
    if left < INDEPENDENT * count:
        yield (
            f"the residuals follow a pattern, as of {left:.0f} samples and not {count}: law,"
            " baseline or range is another"
        )
    yield from _warnings_of_approach(found)


def _warnings_of_approach(found: HertzFit) -> Iterator[str]:
    """An approach that slopes, as of a drifting or a tilted baseline."""
    before = found.depth_m < found.contact_m
    if before.sum() < FEWEST_IN_CONTACT:
        return
    depth, force = found.depth_m[before], found.force_n[before]
    slope = float(np.polyfit(depth - depth.mean(), force, 1)[0])
    rise = slope * float(np.ptp(depth)) / float(np.ptp(found.fitted_n))
    if abs(rise) > SLOPING:
        yield (
            f"the approach slopes, by {PERCENT * rise:+.2g} % of the peak: a tilted or drifting"
            " baseline (--range-mm leaves it out)"
        )
