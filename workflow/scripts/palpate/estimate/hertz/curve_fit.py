"""E* of a bare curve: what was chosen for it, what it hangs on, and what speaks against it."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from palpate.estimate.hertz.curve_doubts import (
    doubts_of,
    hangs_on,
    quality_of,
    require_contact,
    require_press,
)
from palpate.estimate.hertz.curve_setup import (
    CONE,
    Setup,
    check_ratio,
    chosen_baseline,
    chosen_indenter,
)
from palpate.estimate.hertz.fit import RESIDUALS, ContactFit, fit_free_contact
from palpate.estimate.hertz.laws import INDENTERS
from palpate.units import readable

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# How much of the approach is drawn, as part of the press.
SHOWN = 1.0
ARRAYS = ("depth_m", "force_n", "fitted_n", "weights")


@dataclass(frozen=True, repr=False)
class HertzFit:
    """Reduced modulus of a curve, and all that it rests on.

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
    doubts : tuple of str
        What speaks against trusting it, a line each.
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
    doubts: tuple[str, ...]
    depth_m: NDArray
    force_n: NDArray
    fitted_n: NDArray
    weights: NDArray | None = None

    def __repr__(self) -> str:
        doubts = f"; doubtful: {'; '.join(self.doubts)}" if self.doubts else ""
        law = f"{self.indenter}, {self.support}"
        return f"HertzFit(E* {self.modulus_text}; {law}; {self.quality}{doubts})"

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
        """Depth of the press, from the contact [m]."""
        return float(self.depth_m.max()) - self.contact_m

    @property
    def hangs_on(self) -> tuple[str, ...]:
        """Other choices that would move E* out of its interval, a line each."""
        return tuple(hangs_on(self))

    @property
    def quality(self) -> str:
        """How well the law follows the samples, in words."""
        return quality_of(self.rms_n, self.fitted_n)

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
        check_ratio(poisson_ratio)
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
            "youngs_modulus_pa": self.youngs_modulus_pa(nu),
            "youngs_modulus_interval_pa": self.youngs_modulus_interval_pa(nu),
            "quality": self.quality,
            "hangs_on": self.hangs_on,
            "press_m": self.press_m,
            "samples": len(self.depth_m),
            "samples_in_contact": int((self.depth_m > self.contact_m).sum()),
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
        # A long approach would leave no room for the press.
        axes.set_xlim(max(depth.min(), -SHOWN * depth.max()), 1.05 * depth.max())
        axes.set(xlabel=f"indentation ({length})", ylabel=f"force ({force})")
        axes.legend()


def modulus_text(value_pa: float, interval_pa: tuple[float, float]) -> str:
    """A modulus with its interval, in the unit that it is read best in."""
    scale, unit = readable(value_pa, "Pa")
    low, high = (scale * end for end in interval_pa)
    return f"{scale * value_pa:.4g} {unit} (95 %: {low:.4g} to {high:.4g})"


@dataclass(frozen=True)
class _Samples:
    """What is fitted: samples of a loading, and with what."""

    depth_m: NDArray
    force_n: NDArray
    weights: NDArray | None
    setup: Setup

    @property
    def deepest_m(self) -> float:
        return float(self.depth_m.max())

    def fitted(
        self, indenter: str, baseline: bool, residual: str | None = None, level_n: float = 0.0
    ) -> ContactFit:
        """Fit of a law, to the force above a level."""
        expected, std = self.setup.contact_m or (0.0, None)
        found = fit_free_contact(
            self.depth_m - expected,
            self.force_n - level_n,
            self.setup.law(indenter),
            baseline=baseline,
            residual=residual or self.setup.residual,
            weights=self.weights,
            depth_std_m=std,
        )
        return replace(found, contact_depth_m=found.contact_depth_m + expected)


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
    samples = _Samples(setup.tip_depth(depth_m, force_n), force_n, weights, setup)
    require_press(samples.depth_m, force_n)
    found, law = _chosen(samples)
    require_contact(samples.depth_m, found.contact_depth_m)
    setup.check_layer(samples.deepest_m - found.contact_depth_m)
    result = _result(samples, found, **law)
    result = replace(result, others=_others(result, samples))
    return replace(result, doubts=tuple(doubts_of(result)))


def _chosen(samples: _Samples) -> tuple[ContactFit, dict]:
    """Fit with the law that was asked for, or that the curve chooses: which, and why."""
    setup, chosen = samples.setup, {}
    indenter, baseline = setup.indenter or "parabola", setup.baseline
    if baseline is None:
        with_it = samples.fitted(indenter, True)
        baseline, chosen["baseline"] = chosen_baseline(samples.depth_m, samples.force_n, with_it)
    found = samples.fitted(indenter, baseline)
    if setup.indenter is None:
        press = samples.deepest_m - found.contact_depth_m
        indenter, chosen["indenter"] = chosen_indenter(press, setup)
        found = samples.fitted(indenter, baseline)
    return found, {"indenter": indenter, "baseline": baseline, "chosen": chosen}


def _result(
    samples: _Samples, found: ContactFit, indenter: str, baseline: bool, chosen: dict
) -> HertzFit:
    unit = samples.setup.law(indenter)(samples.depth_m - found.contact_depth_m)
    return HertzFit(
        reduced_modulus_pa=found.reduced_modulus_pa,
        reduced_modulus_interval_pa=found.reduced_modulus_interval_pa,
        contact_m=found.contact_depth_m,
        contact_std_m=found.contact_depth_std_m,
        baseline_n=found.baseline_n,
        rms_n=found.rms_n,
        effective_samples=found.effective_samples,
        indenter=indenter,
        support=samples.setup.support,
        baseline=baseline,
        setup=samples.setup,
        chosen=chosen,
        others={},
        doubts=(),
        depth_m=samples.depth_m,
        force_n=samples.force_n,
        fitted_n=found.reduced_modulus_pa * unit + found.baseline_n,
        weights=samples.weights,
    )


def _others(found: HertzFit, samples: _Samples) -> dict[str, float]:
    """E* with the other indenter, baseline and residual, each alone."""
    used = {"indenter": found.indenter, "baseline": found.baseline}
    changes = {}
    if not found.baseline:
        changes["with a free baseline"] = {"baseline": True}
    elif "baseline" not in found.chosen:
        # Where the approach shows it, a fit without is of another curve.
        changes["without a baseline"] = {"baseline": False}
    if found.indenter != CONE:
        other = next(name for name in INDENTERS if name != found.indenter)
        changes[f"by {other}"] = {"indenter": other}
    other = next(name for name in RESIDUALS if name != found.setup.residual)
    # A power of the force is one of the force above its level.
    of_power = {"residual": other, "baseline": False, "level_n": found.baseline_n}
    changes[f"with {other} compared"] = of_power
    return {
        name: samples.fitted(**(used | change)).reduced_modulus_pa
        for name, change in changes.items()
    }
