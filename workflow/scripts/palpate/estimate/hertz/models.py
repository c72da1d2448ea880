"""The model of a press that its geometry and its hold recommend, beside the study's."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from palpate.estimate.hertz.fit import (
    ContactFit,
    KnownContactFit,
    Law,
    fit_free_contact,
    fit_known_contact,
)
from palpate.estimate.hertz.laws import (
    FOOT,
    LARGEST_CHI,
    LAYERS,
    SUPPORTS,
    contact_law,
    finite_strain_factor,
    layer_factor,
)
from palpate.estimate.hertz.options import Beliefs
from palpate.estimate.hertz.record import Record
from palpate.estimate.hertz.relaxation import RelaxationFit, fit_relaxation, verdict
from palpate.estimate.hertz.relaxation_prior import relaxation_times
from palpate.estimate.hertz.shape import INSTEAD, Shape
from palpate.modulus import CONFIDENCE

# What the study fits: contact at the surface.
OF_STUDY = {"indenter": "parabola", "support": "half_space", "contact": "known"}
# Beyond this depth over radius the paraboloid is too blunt by more than a hundredth.
SHALLOW = 0.1
# Of a thin layer whose ratio no fit has told: rubber's, for which the base counts most.
LARGEST_POISSON_RATIO = 0.499
# A press less deep than so many deviations of its depth tells neither relaxation nor its contact.
SHALLOWEST = 8.0
# No side takes more of a force than leaves this part.
LEAST_LEFT = 0.1
# Poisson's ratios that the fit with relaxation takes for equally likely.
HELD_POISSON_RATIOS = tuple((np.arange(8) / 16 + 1 / 32).tolist())


@dataclass(frozen=True)
class Indentation:
    """Samples of one press up to the end of deformation, and what they rest on.

    Attributes
    ----------
    depth_m, force_n : (n,) arrays
        Depth [m] and force along the press [N], approach included.
    magnitude_n : (n,) array
        Of the force, which the study's fit takes [N].
    onset : int
        First sample in contact.
    radius_m, thickness_m : float
        Of the sphere, and of the object along the press [m].
    depth_std_m : float
        Standard deviation of an error that all depths share [m].
    shape : Shape
        Of the object at the press.
    """

    depth_m: NDArray
    force_n: NDArray
    magnitude_n: NDArray
    onset: int
    radius_m: float
    thickness_m: float
    depth_std_m: float
    shape: Shape = field(default_factory=Shape)

    @property
    def depth_over_radius(self) -> float:
        """Largest depth over the sphere's radius."""
        return max(float(self.depth_m.max()), 0.0) / self.radius_m

    @property
    def chi(self) -> float:
        """Largest sqrt(R d)/h."""
        return self.radius_m * float(np.sqrt(self.depth_over_radius)) / self.thickness_m

    @property
    def indenter(self) -> str:
        """Sneddon's sphere beyond a depth of a tenth of the radius, else the paraboloid."""
        return "sneddon" if self.depth_over_radius > SHALLOW else "parabola"

    @property
    def thin(self) -> bool:
        """Whether the object is a layer thinner than the series holds for."""
        return self.shape.support in LAYERS and self.chi > LARGEST_CHI

    @property
    def supports(self) -> tuple[str, ...]:
        """Of the recommended model, then of those that its interval reaches to if no law holds."""
        if not self.shape.doubts:
            return ("half_space",) if self.thin else (self.shape.support,)
        if self.shape.support == FOOT:
            return (FOOT, SUPPORTS[0])
        return SUPPORTS if self.chi <= LARGEST_CHI else SUPPORTS[:1]


def fit_models(
    indentation: Indentation, *, nu: float, baseline: bool, residual: str, series: str
) -> list[dict]:
    """Fit the study's model, and the recommended one with those that its interval reaches to.

    Parameters
    ----------
    indentation : Indentation
    nu : float
        Poisson's ratio that the layers assume.
    baseline, residual
        Of `fit_free_contact`.
    series : {"consistent", "printed"}
        Of the layers.

    Returns
    -------
    list of dict
        ``indenter, support, contact``, ``relaxation`` (none), the fit's fields, and for layers
        ``poisson_ratio``, which E* goes with. First the study's paraboloid on a half-space with
        the contact known; then the recommended indenter with the contact weighted, on the
        recommended support and, where something speaks against its law, on all others.
    """
    named = {"indenter": indentation.indenter, "contact": "weighted"}
    rows = []
    for name in [OF_STUDY, *(named | {"support": one} for one in indentation.supports)]:
        found = fit_model(
            indentation, **name, nu=nu, baseline=baseline, residual=residual, series=series
        )
        of_layer = {"poisson_ratio": nu} if name["support"] in LAYERS else {}
        rows.append(name | {"relaxation": "none"} | vars(found) | of_layer)
    return rows


def fit_model(
    indentation: Indentation,
    *,
    indenter: str,
    support: str,
    contact: str,
    nu: float,
    baseline: bool,
    residual: str,
    series: str,
) -> ContactFit | KnownContactFit:
    """Fit one model, with the contact point ``known``, ``free`` or ``weighted``."""
    law = _law(indentation, {"indenter": indenter, "support": support}, nu=nu, series=series)
    if contact != "known":
        return fit_free_contact(
            indentation.depth_m,
            indentation.force_n,
            law,
            baseline=baseline,
            residual=residual,
            depth_std_m=indentation.depth_std_m if contact == "weighted" else None,
        )
    used = slice(indentation.onset, None)
    return fit_known_contact(
        indentation.depth_m[used],
        indentation.force_n[used],
        law,
        depth_std_m=indentation.depth_std_m,
    )


def fit_held(
    indentation: Indentation, record: Record, model: Mapping, *, series: str, beliefs: Beliefs
) -> tuple[dict, dict]:
    """Fit a model with relaxation and finite strain to a press and its hold.

    Finite strain makes the law depend on Poisson's ratio far more than a layer does.

    Parameters
    ----------
    indentation : Indentation
    record : Record
        Of the same press, from the approach to the end of the hold.
    model : mapping
        The same model without relaxation, of `fit_models`, contact weighted.
    series
        As in `fit_models`.
    beliefs : Beliefs

    Returns
    -------
    row : dict
        As those of `fit_models`. Where the probe was held for the shortest relaxation time at
        least, ``relaxation`` is prony, to which Poisson's ratios from 0 to 0.5 are equally
        likely. Else it is unheld, or shallow where the deepest depth is less than eight of its
        deviations: the modulus without relaxation, its interval widened by what relaxation and
        nu, and the depth's error, may have done.
    block : dict
        ``verdict``, ``held_s``, the beliefs and the fit's fields.
    """
    times = relaxation_times(record.time_s[indentation.onset :])
    held_s = float(record.time_s[-1] - record.time_s[record.deepest])
    held = held_s >= times[0]
    laws = {at: _strained(indentation, model, nu=at, series=series) for at in HELD_POISSON_RATIOS}
    found = fit_relaxation(record, laws, times_s=times, beliefs=beliefs)
    press, depth_std = _press(record, found)
    shallow = press < SHALLOWEST * depth_std
    said = "too shallow" if shallow else verdict(found, held=held)
    block = {"verdict": said, "held_s": held_s} | vars(beliefs) | vars(found)
    ends = found.reduced_modulus_interval_pa
    if shallow:
        ends = (*ends, *_depth_ends(model, press, depth_std))
        return _widened(model, "shallow", ends), block
    if not held:
        return _widened(model, "unheld", ends), block
    names = {name: model[name] for name in ("indenter", "support", "contact")}
    return names | {"relaxation": "prony"} | vars(found), block


def later_modulus(
    indentation: Indentation,
    record: Record,
    model: Mapping,
    after_s: float,
    *,
    nu: float,
    series: str,
    beliefs: Beliefs,
    **fitted: object,
) -> float:
    """E* that a model finds where the forces were read so much later than they say [Pa].

    Parameters
    ----------
    indentation : Indentation
    record : Record
    model : mapping
        Of `fit_models` or `fit_held`.
    after_s : float
        [s].
    nu, series, beliefs
        As in `fit_held`.
    **fitted
        ``baseline`` and ``residual``, as in `fit_models`.
    """
    moved = np.interp(record.time_s + after_s, record.time_s, record.depth_m)
    if model["relaxation"] == "prony":
        laws = {n: _strained(indentation, model, nu=n, series=series) for n in HELD_POISSON_RATIOS}
        times = relaxation_times(record.time_s[indentation.onset :])
        record = replace(record, depth_m=moved)
        return fit_relaxation(record, laws, times_s=times, beliefs=beliefs).reduced_modulus_pa
    names = {name: model[name] for name in ("indenter", "support", "contact")}
    indentation = replace(indentation, depth_m=moved[: len(indentation.depth_m)])
    return fit_model(indentation, **names, nu=nu, series=series, **fitted).reduced_modulus_pa


def widened(model: Mapping, std: float) -> dict:
    """A model whose interval holds a further relative error of a standard deviation too."""
    E, ends = model["reduced_modulus_pa"], np.array(model["reduced_modulus_interval_pa"])
    sides = np.hypot(np.log(ends / E), ndtri((1 + CONFIDENCE) / 2) * std) * [-1, 1]
    interval = tuple((E * np.exp(sides)).tolist())
    return dict(model) | {"reduced_modulus_interval_pa": interval, "rig_std": std}


def recommended(indentation: Indentation, models: Sequence[Mapping]) -> dict:
    """Choose a model by the press's geometry and by what of it was held.

    The indenter by the depth over the radius; the layer or the round foot where the shape is one,
    and the layer's series holds, else the half-space; the weighted contact, since it leaves
    neither the surface nor the force unused; and relaxation allowed for wherever it was fitted.

    Returns
    -------
    dict
        The model, with ``rule`` in words, and ``doubts``, why no law holds, a line each: the
        interval then reaches to those of all supports, and as far as side or base move it.
    """
    indenter, support = indentation.indenter, indentation.shape.support
    doubts = [*indentation.shape.doubts]
    if indentation.thin:
        support = "half_space"
        doubts.append(
            f"the layer is thin, chi {indentation.chi:.2f} above {LARGEST_CHI}: {INSTEAD}"
        )
    wanted = (indenter, support, "weighted")
    # What allows for relaxation follows its own model without.
    best = [m for m in models if (m["indenter"], m["support"], m["contact"]) == wanted][-1]
    rule = (
        f"depth over radius {indentation.depth_over_radius:.2f}, chi {indentation.chi:.2f};"
        f" sneddon above {SHALLOW:g}, a layer up to chi {LARGEST_CHI:g}, contact weighted,"
        f" relaxation {best['relaxation']}"
    )
    if doubts:
        ends = [
            end
            for m in models
            for end in m["reduced_modulus_interval_pa"]
            if (m["indenter"], m["contact"]) == (indenter, "weighted")
        ]
        # A free side leaves an object softer than it is; a thin layer's base makes it stiffer.
        ends.append(max(ends) / max(1 - indentation.shape.side_part, LEAST_LEFT))
        if indentation.thin:
            chi = np.array(indentation.chi)
            ratio = best.get("poisson_ratio", LARGEST_POISSON_RATIO)
            ends += [min(ends) / float(layer_factor(chi, ratio, layer)) for layer in LAYERS]
        best = _widened(best, best["relaxation"], ends)
    return dict(best) | {"rule": rule, "doubts": doubts}


def _law(indentation: Indentation, model: Mapping, *, nu: float, series: str) -> Law:
    return contact_law(
        model["indenter"],
        model["support"],
        radius_m=indentation.radius_m,
        thickness_m=indentation.thickness_m,
        nu=nu,
        series=series,
        curvature_per_m=indentation.shape.curvature_per_m,
        foot_curvature_per_m=indentation.shape.foot_curvature_per_m,
    )


def _strained(indentation: Indentation, model: Mapping, *, nu: float, series: str) -> Law:
    """Contact law with finite strain, of the sphere's own part of the depth."""
    law = _law(indentation, model, nu=nu, series=series)
    bend = 1 / indentation.radius_m + indentation.shape.curvature_per_m
    # A foot goes in as the powers -1/3 of the radii; what it takes up it also takes from the rise.
    part = 1 / (1 + np.cbrt(indentation.shape.foot_curvature_per_m / bend))

    def strained(depth_m: NDArray) -> NDArray:
        factor = finite_strain_factor(part * depth_m / indentation.radius_m, nu)
        return law(depth_m) * factor**part

    return strained


def _press(record: Record, found: RelaxationFit) -> tuple[float, float]:
    """Greatest depth from the contact that was found, and its deviation [m].

    Of the error that all depths share that is left which the force did not tell.
    """
    press = float(record.depth_m.max()) - found.contact_depth_m
    return press, float(np.hypot(record.frame_std_m, found.contact_depth_std_m))


def _depth_ends(model: Mapping, press_m: float, std_m: float) -> tuple[float, float]:
    """Ends of the modulus, which goes with the depth's power -3/2, by the depth's error alone."""
    part = 1.5 * std_m / max(press_m, std_m)
    width = float(np.exp(ndtri((1 + CONFIDENCE) / 2) * part))
    return model["reduced_modulus_pa"] / width, model["reduced_modulus_pa"] * width


def _widened(model: Mapping, relaxation: str, others: Sequence[float]) -> dict:
    """Effective modulus whose interval reaches to other ends too."""
    ends = [*model["reduced_modulus_interval_pa"], *others]
    interval = (min(ends), max(ends))
    return dict(model) | {"relaxation": relaxation, "reduced_modulus_interval_pa": interval}
