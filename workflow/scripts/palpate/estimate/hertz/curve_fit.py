"""E* of a bare curve: its fit, what was chosen for it, and warnings against trusting it."""

from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, replace
from operator import attrgetter
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from palpate.estimate.hertz.curve_setup import ABSURD, FLAT, Setup, check_rise, chosen_baseline
from palpate.estimate.hertz.fit import ContactFit, fit_free_contact
from palpate.estimate.hertz.laws import INDENTERS, SHALLOW, check_ratio, layer_factor
from palpate.modulus import modulus_text
from palpate.units import PERCENT, readable

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# So thick a layer, in contact radii, stands for what a half-space leaves out.
RADII = 10.0
# An interval this narrow is of made-up data; a law that explains less of the scatter is none.
EXACT, LEAST_EXPLAINED = 1e-6, 0.5
FEWEST_IN_CONTACT = 10
# Deeper than so many radii no law holds; contact so far before the record, over the indentation
# depth, is a guess; an approach that changes by more than this part of the peak slopes; and fewer
# independent residuals than this part are a pattern.
DEEP, BEFORE, SLOPING, INDEPENDENT = 1.0, 0.02, 0.05, 0.1
# Shallower than so many radii is a radius in another unit.
LEAST_DEEP = 1e-3
# A flat end: so far below a sphere's residuals, which are this part of the peak or more.
PROPORTIONAL, LEAST_PATTERN = 0.5, 0.005
# Smaller changes of E* are not worth a line.
LEAST_CHANGE = 0.01
# Rms of the residuals over the peak, and what is said of it.
QUALITIES = ((0.01, "good"), (0.03, "fair"), (np.inf, "poor"))
# Attributes that a row of a table has, beside those that `HertzFit.row` computes.
ROW = ("reduced_modulus_pa", "reduced_modulus_interval_pa", "contact_m", "contact_std_m")
ROW += ("baseline_n", "rms_n", "effective_samples", "indenter", "support", "baseline", "chosen")
ROW += ("others", "warnings", "quality", "depends_on", "assumes", "press_m", "samples_in_contact")


@dataclass(frozen=True, repr=False, kw_only=True)
class HertzFit(ContactFit):
    """Reduced modulus of a curve, and all that it follows from.

    Attributes
    ----------
    indenter, support : str
        Law that was fitted.
    baseline : bool
        Whether the constant force was fitted.
    setup : Setup
        What was asked for.
    chosen, others : dict
        What was chosen by the curve, and why; E* by what else could be chosen [Pa].
    depth_m, force_n, fitted_n : (n,) arrays
        Samples that were fitted, the tip's depth, and the law at them [m, N, N].
    weights : (n,) array or None
        Of their squared residuals.
    notes : tuple of str
        Warnings of how samples and law were chosen.
    """

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
    notes: tuple[str, ...] = ()

    def __repr__(self) -> str:
        warned = f"; warnings: {'; '.join(self.warnings)}" if self.warnings else ""
        law = f"{self.indenter}, {self.support}"
        return f"HertzFit(E* {self.modulus_text}; {law}; {self.quality}{warned})"

    @property
    def modulus_text(self) -> str:
        """E* with its interval, in the unit that it is read best in."""
        return modulus_text(self.reduced_modulus_pa, self.reduced_modulus_interval_pa)

    contact_m = property(attrgetter("contact_depth_m"), doc="Depth at which contact begins [m].")
    contact_std_m = property(attrgetter("contact_depth_std_m"), doc="Its standard deviation [m].")

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
    def warnings(self) -> tuple[str, ...]:
        """Warnings against trusting the modulus, a line each."""
        return (*self.notes, *_warnings(self))

    @property
    def depends_on(self) -> tuple[str, ...]:
        """Other choices that would move E* out of its interval, a line each."""
        (low, high), lines = self.reduced_modulus_interval_pa, []
        for name, modulus in self.others.items():
            part = modulus / self.reduced_modulus_pa - 1
            if not low <= modulus <= high and abs(part) >= LEAST_CHANGE:
                scale, unit = readable(modulus, "Pa")
                value = f"{scale * modulus:.4g} {unit} ({PERCENT * part:+.2g} %)"
                lines.append(f"{name} E* would be {value}")
        return tuple(lines)

    @property
    def assumes(self) -> str:
        """What of a half-space E* would change most, a layer on a rigid base; empty of a layer."""
        if self.support != "half_space":
            return ""
        law, step_m = self.setup.law(self.indenter), 1e-4 * self.press_m
        # Of all indenters dF/dd = 2 E* a (I. N. Sneddon, 1965), a the contact radius.
        radius = float(np.diff(law(self.press_m + step_m * np.array([-1, 1])))[0]) / (4 * step_m)
        part = 1 / float(layer_factor(1 / RADII, self.setup.poisson_ratio, "bonded")) - 1
        scale, unit = readable(RADII * radius, "m")
        layer = f"a bonded layer of {RADII:g} contact radii ({scale * RADII * radius:.3g} {unit})"
        return f"a half-space; {layer} would change E* by about {PERCENT * part:+.2g} %"

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
        check_ratio(poisson_ratio, "poisson_ratio")
        assumed = self.setup.poisson_ratio
        if self.support != "half_space" and poisson_ratio != assumed:
            expected = f"expected {assumed:g}, which the layer was fitted with"
            raise ValueError(f"poisson_ratio: {expected}, found {poisson_ratio:g}")
        return self.reduced_modulus_pa * (1 - poisson_ratio**2)

    def youngs_modulus_interval_pa(self, poisson_ratio: float) -> tuple[float, float]:
        """Interval of 95 % of Young's modulus for a known Poisson's ratio [Pa]."""
        part = self.youngs_modulus_pa(poisson_ratio) / self.reduced_modulus_pa
        low, high = self.reduced_modulus_interval_pa
        return low * part, high * part

    def row(self) -> dict:
        """All of it but the samples, as JSON has it."""
        nu = self.setup.poisson_ratio
        return {name: getattr(self, name) for name in ROW} | {
            "youngs_modulus_pa": self.youngs_modulus_pa(nu),
            "youngs_modulus_interval_pa": self.youngs_modulus_interval_pa(nu),
            "samples": len(self.depth_m),
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
        law = f"{self.indenter}, {self.support}\nE* {self.modulus_text}".replace("_", "-")
        axes.plot(depth[order], load * self.fitted_n[order], color="#D55E00", label=law)
        axes.axvline(0, lw=0.6, color="#1A1A1A")
        # A long approach would leave no room for the indentation.
        axes.set_xlim(max(depth.min(), -depth.max()), 1.05 * depth.max())
        axes.set(xlabel=f"indentation ({length})", ylabel=f"force ({force})")
        axes.legend()


def fit_curve(
    depth_m: NDArray, force_n: NDArray, setup: Setup, weights: NDArray | None = None
) -> HertzFit:
    """Fit E* and the depth of first contact to approach and loading, as `palpate.hertz.fit` does.

    Raises
    ------
    ValueError
        If the force does not rise above its noise, no contact is found, or a layer is too thin.
    """
    depth = depth_m
    if weights is not None:
        depth, force_n, weights = (one[weights > 0] for one in (depth_m, force_n, weights))
    check_rise(depth, force_n)
    expected_m, std_m = setup.contact_m or (0.0, None)

    def fitted(
        indenter: str, baseline: bool, *, of: Setup = setup, level_n: float = 0.0
    ) -> ContactFit:
        at, force, law = depth - expected_m, force_n - level_n, of.law(indenter)
        known = {"residual": of.residual, "weights": weights, "depth_std_m": std_m}
        found = fit_free_contact(at, force, law, baseline=baseline, **known)
        return replace(found, contact_depth_m=found.contact_depth_m + expected_m)

    indenter, baseline, chosen = setup.indenter or INDENTERS[0], setup.baseline, {}
    if baseline is None:
        contact_m = fitted(indenter, baseline=True).contact_depth_m
        baseline, chosen["baseline"] = chosen_baseline(depth, force_n, contact_m)
    found = fitted(indenter, baseline)
    if setup.indenter is None:
        radii = (float(depth.max()) - found.contact_depth_m) / setup.effective_radius_m
        indenter, than = ("sneddon", "above") if radii > SHALLOW else (INDENTERS[0], "up to")
        why = f"since the indentation is {radii:.3g} radii deep ({than} {SHALLOW:g})"
        chosen["indenter"] = f"{indenter}, {why}"
        found = fitted(indenter, baseline)
    setup.check_indentation(depth, found.contact_depth_m)
    unit = setup.law(indenter)(depth - found.contact_depth_m)
    fitted_n = found.reduced_modulus_pa * unit + found.baseline_n
    samples = {"depth_m": depth, "force_n": force_n, "fitted_n": fitted_n, "weights": weights}
    same = {"indenter": indenter, "baseline": baseline}
    asked = {"setup": setup, "support": setup.support, "chosen": chosen}
    result = HertzFit(**vars(found), **same, **samples, **asked, others={})
    choices = setup.others(indenter, baseline, found.baseline_n)
    others = {name: fitted(**same | other).reduced_modulus_pa for name, other in choices}
    notes = _notes(result, fitted(FLAT, baseline)) if indenter in INDENTERS else ()
    return replace(result, others=others, notes=notes)


def _notes(found: HertzFit, flat: ContactFit) -> tuple[str, ...]:
    """Warning of a force in proportion to depth."""
    least = LEAST_PATTERN * np.ptp(found.fitted_n)
    if found.rms_n < least or flat.rms_n > PROPORTIONAL * found.rms_n:
        return ()
    value = modulus_text(flat.reduced_modulus_pa, flat.reduced_modulus_interval_pa)
    why = f"of a flat punch (--indenter flat) E* would be {value}"
    return (f"the force grows in proportion to depth, as under a flat end: {why}",)


def _warnings(found: HertzFit) -> Iterator[str]:
    radius = found.setup.effective_radius_m
    if radius is not None and found.press_m > DEEP * radius:
        body, radii = found.setup.body, found.press_m / radius
        other = "is the unit of the depth, or the radius, another?"
        why = other if radii > ABSURD else f"no law of a {body} holds there"
        yield f"the indentation is {radii:.3g} radii of the {body} deep: {why}"
    elif radius is not None and found.press_m < LEAST_DEEP * radius:
        radii = found.press_m / radius
        yield f"the indentation is {radii:.2g} radii deep: is the unit of the radius another?"
    unmeasured_m = float(found.depth_m.min()) - found.contact_m
    if unmeasured_m > BEFORE * found.press_m:
        scale, unit = readable(unmeasured_m, "m")
        where = f"{scale * unmeasured_m:.3g} {unit} before the record's first sample"
        yield f"contact lies {where}, where nothing was measured"
    count = found.samples_in_contact
    if count < FEWEST_IN_CONTACT:
        yield f"{count} samples lie in contact: expected {FEWEST_IN_CONTACT} or more"
    if np.ptp(found.reduced_modulus_interval_pa) < EXACT * found.reduced_modulus_pa:
        yield "the samples lie on the law exactly, as made-up ones do: the interval says nothing"
        return
    explained = 1 - float(np.mean(found.residual_n**2) / np.var(found.force_n))
    if explained < LEAST_EXPLAINED:
        yield f"the law explains {PERCENT * explained:.2g} % of the force's scatter"
    count, left = len(found.force_n), found.effective_samples
    if left < INDEPENDENT * count:
        other = "law, baseline or range is another"
        yield f"the residuals follow a pattern, as of {left:.0f} samples and not {count}: {other}"
    before = found.depth_m < found.contact_m
    if before.sum() < FEWEST_IN_CONTACT:
        return
    depth = found.depth_m[before]
    slope = float(np.polyfit(depth - depth.mean(), found.force_n[before], 1)[0])
    rise = slope * float(np.ptp(depth) / np.ptp(found.fitted_n))
    if abs(rise) > SLOPING:
        part = f"{PERCENT * rise:+.2g} % of the peak"
        other = "a tilted or drifting baseline (--range-mm leaves it out)"
        yield f"the approach slopes, by {part}: {other}"
