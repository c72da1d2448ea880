"""Reduced modulus of an indentation: the study's fit, one with its contact free, the recommended.

Which model is recommended follows from the geometry and from what of the indentation was held.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, replace
from functools import partial

import numpy as np
from scipy.special import ndtri

from palpate.estimate.direct.options import Rig
from palpate.estimate.hertz import laws
from palpate.estimate.hertz.fit import LEVEL, ContactFit, fit_free_contact, fit_known_contact
from palpate.estimate.hertz.indentation import Indentation
from palpate.estimate.hertz.options import Hertz
from palpate.estimate.hertz.relaxation import (
    RelaxationFit,
    fit_relaxation,
    relaxation_times,
    verdict,
)
from palpate.estimate.hertz.shape import INSTEAD

# What the study fits: contact at the surface.
OF_STUDY = {"indenter": "parabola", "support": "half_space", "contact": "known"}
# Of a thin layer whose ratio no fit assumes: rubber's, for which the base counts most.
LARGEST_POISSON_RATIO = 0.499
# No side takes more of a force than leaves this part.
LEAST_LEFT = 0.1
# Poisson's ratios that the fit with relaxation takes for equally likely.
HELD_POISSON_RATIOS = tuple((np.arange(8) / 16 + 1 / 32).tolist())
# Of each row: E*, and E* a time after a step.
INTERVALS = {
    "reduced_modulus_interval_pa": "reduced_modulus_pa",
    "later_reduced_modulus_interval_pa": "later_reduced_modulus_pa",
}


def estimate_hertz(
    indentation: Indentation, options: Hertz, *, rig: Rig | None = None, clock_std_s: float = 0.0
) -> dict:
    """Fit the study's model and the recommended one to an indentation, the latter to its hold too.

    The models' intervals hold the uncertainties of ``rig``, none by default, and the standard
    deviation of the offset between the forces' clock and the frames' [s].

    Returns
    -------
    dict
        ``study``, as the study fits; ``free_contact``, the same with the contact free;
        ``models`` of `fit_models` and one that allows for relaxation and finite strain;
        ``relaxation``, its ``verdict``, ``held_s``, what was held likely and the fit's fields;
        ``recommended``; and the geometry. A model's ``rig_std`` is the relative deviation by rig
        and clock. Where the probe was held for the shortest relaxation time at least, a model's
        ``relaxation`` is prony, to which Poisson's ratios from 0 to 0.5 are equally likely. Else it
        is unheld: the modulus without relaxation, its interval widened by what relaxation and nu
        may have done.
    """
    models = list(fit_models(indentation, options))
    best, relaxation = recommended(indentation, models), {"verdict": "too few samples"}
    if indentation.allows_relaxation:
        found, held_s = _fit_relaxing(indentation, best, options), indentation.held_s
        held = held_s >= found.times_s[0]
        relaxation = {"verdict": verdict(found, held=held), "held_s": held_s}
        relaxation |= vars(options.relaxation) | vars(found)
        if held:
            best = {name: best[name] for name in OF_STUDY} | {"relaxation": "prony"} | vars(found)
        else:
            wide = _reaching(best, found.reduced_modulus_interval_pa)
            best = wide | {"relaxation": "unheld"}
        models.append(best)
    std = _clock_std(indentation, best, options, clock_std_s) if clock_std_s > 0 else 0.0
    if rig:
        used = indentation.approach
        force_n, depth_m = (one[used].max() for one in (indentation.force_n, indentation.depth_m))
        of = {"depth_m": max(float(depth_m), 1e-9), "radius_m": indentation.radius_m}
        std = float(np.hypot(std, rig.modulus_std(force_n=float(force_n), **of)))
    models = [_with_error(one, std) for one in models]
    best = recommended(indentation, models)
    if not indentation.allows_relaxation:
        best["warnings"].append("too few samples to allow for relaxation and finite strain")
    used, radius = indentation.loading, indentation.radius_m
    depth, force = indentation.depth_m[used], indentation.magnitude_n[used]
    paraboloid = partial(laws.parabola_force, radius_m=radius)
    study = vars(fit_known_contact(depth, force, paraboloid, depth_std_m=0.0))
    flat = replace(indentation, shape=replace(indentation.shape, curvature_per_m=0.0))
    return {
        "radius_m": radius,
        "thickness_m": indentation.thickness_m,
        "depth_std_m": indentation.contact_std_m,
        "shape": asdict(indentation.shape),
        "depth_over_radius": indentation.depth_over_radius,
        "chi": indentation.chi,
        "study": {name: study[name] for name in ("reduced_modulus_pa", "rms_n")},
        "free_contact": asdict(fit_model(flat, options, **OF_STUDY | {"contact": "free"})),
        "assumed_poisson_ratio": options.assumed_poisson_ratio,
        "models": models,
        "relaxation": relaxation,
        "recommended": best,
    }


def fit_models(indentation: Indentation, options: Hertz) -> Iterator[dict]:
    """Fit the study's model, and the recommended one with those that its interval reaches to.

    Yields
    ------
    dict
        ``indenter, support, contact``, ``relaxation`` (none), the fit's fields, and for layers
        ``poisson_ratio``, which E* goes with. First the study's paraboloid on a half-space with
        the contact known; then the recommended indenter with the contact weighted, on the
        recommended support and, with a warning against its law, on all others.
    """
    weighted = {"indenter": indentation.indenter, "contact": "weighted"}
    for name in [OF_STUDY, *(weighted | {"support": one} for one in indentation.supports)]:
        found = vars(fit_model(indentation, options, **name))
        layer = name["support"] in laws.LAYERS
        of_layer = {"poisson_ratio": options.assumed_poisson_ratio} if layer else {}
        yield name | {"relaxation": "none"} | found | of_layer


def fit_model(
    indentation: Indentation, options: Hertz, *, indenter: str, support: str, contact: str
) -> ContactFit:
    """Fit one model, with the contact point ``known``, ``free`` or ``weighted``."""
    law = indentation.law(indenter, support, options.assumed_poisson_ratio)
    std = indentation.contact_std_m
    used = indentation.loading if contact == "known" else indentation.approach
    depth, force = indentation.depth_m[used], indentation.force_n[used]
    if contact == "known":
        return fit_known_contact(depth, force, law, depth_std_m=std)
    given = {"baseline": options.baseline, "residual": options.residual}
    given |= {"depth_std_m": std} if contact == "weighted" else {}
    return fit_free_contact(depth, force, law, **given)


def recommended(indentation: Indentation, models: Sequence[Mapping]) -> dict:
    """Choose a model by the indentation's geometry and by what of it was held.

    The indenter by the depth over the radius; the layer or the round base where the shape is one,
    and the layer's series holds, else the half-space; the weighted contact, since it leaves neither
    the surface nor the force unused; and relaxation allowed for wherever it was fitted. The model
    has ``rule`` in words, and ``warnings``, why no law holds, a line each: the interval then
    reaches to those of all supports, and as far as side or base move it.
    """
    indenter, support, chi = indentation.indenter, indentation.shape.support, indentation.chi
    warnings = [*indentation.shape.warnings]
    if indentation.thin:
        support = "half_space"
        warnings.append(f"the layer is thin, chi {chi:.2f} above {laws.LARGEST_CHI}: {INSTEAD}")
    alike = [m for m in models if (m["indenter"], m["contact"]) == (indenter, "weighted")]
    # What allows for relaxation follows its own model without.
    best = [m for m in alike if m["support"] == support][-1]
    rule = (
        f"depth over radius {indentation.depth_over_radius:.2f}, chi {chi:.2f};"
        f" sneddon above {laws.SHALLOW:g}, a layer up to chi {laws.LARGEST_CHI:g},"
        f" contact weighted, relaxation {best['relaxation']}"
    )
    if warnings:
        ends = [end for m in alike for end in m["reduced_modulus_interval_pa"]]
        # A free side leaves an object softer than it is; a thin layer's base makes it stiffer.
        ends.append(max(ends) / max(1 - indentation.shape.side_part, LEAST_LEFT))
        if indentation.thin:
            nu, chi = best.get("poisson_ratio", LARGEST_POISSON_RATIO), np.array(chi)
            ends += [min(ends) / float(laws.layer_factor(chi, nu, layer)) for layer in laws.LAYERS]
        best = _reaching(best, ends)
    return dict(best) | {"rule": rule, "warnings": warnings}


def _fit_relaxing(indentation: Indentation, model: Mapping, options: Hertz) -> RelaxationFit:
    """Fit with relaxation; finite strain makes the law depend on nu far more than a layer does."""
    radius = indentation.radius_m
    bend = 1 / radius + indentation.shape.curvature_per_m
    # A round base goes in as the powers -1/3 of the radii; its part of the depth is no strain.
    part = 1 / (1 + np.cbrt(indentation.shape.foot_curvature_per_m / bend))

    def strained(nu: float) -> laws.Law:
        law = indentation.law(model["indenter"], model["support"], nu)
        return lambda depth_m: (
            law(depth_m) * laws.finite_strain_factor(part * depth_m / radius, nu) ** part
        )

    by_nu = {nu: strained(nu) for nu in HELD_POISSON_RATIOS}
    times_s = relaxation_times(indentation.time_s[indentation.onset :])
    known = {"beliefs": options.relaxation, "contact_m": model["contact_depth_m"]}
    return fit_relaxation(indentation, by_nu, times_s=times_s, **known)


def _clock_std(indentation: Indentation, row: Mapping, options: Hertz, clock_std_s: float) -> float:
    """Relative standard deviation of E* by the clocks: the fit with later and earlier forces."""
    time, depth, moduli = indentation.time_s, indentation.depth_m, []
    for after_s in (-clock_std_s, clock_std_s):
        late = replace(indentation, depth_m=np.interp(time + after_s, time, depth))
        if row["relaxation"] == "prony":
            found = _fit_relaxing(late, row, options)
        else:
            found = fit_model(late, options, **{name: row[name] for name in OF_STUDY})
        moduli.append(found.reduced_modulus_pa)
    return float(np.sqrt(np.mean(np.log(np.array(moduli) / row["reduced_modulus_pa"]) ** 2)))


def _with_error(model: Mapping, std: float) -> dict:
    """A model whose intervals hold a further relative error of a standard deviation too."""
    wider = {"rig_std": std}
    for name, of in INTERVALS.items():
        if name in model:
            sides = np.log(np.array(model[name]) / model[of])
            ends = model[of] * np.exp(np.hypot(sides, ndtri(LEVEL) * std) * [-1, 1])
            wider[name] = tuple(ends.tolist())
    return dict(model) | wider


def _reaching(model: Mapping, others: Sequence[float]) -> dict:
    """A model whose interval reaches to other ends too."""
    ends = [*model["reduced_modulus_interval_pa"], *others]
    return dict(model) | {"reduced_modulus_interval_pa": (min(ends), max(ends))}
