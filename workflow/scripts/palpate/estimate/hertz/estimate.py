"""Reduced modulus of a capture: the study's fit, one with its contact free, the recommended one."""

from dataclasses import asdict

import numpy as np

from palpate.estimate.direct.options import Rig
from palpate.estimate.hertz.fit import fit_free_contact, fit_study
from palpate.estimate.hertz.laws import contact_law
from palpate.estimate.hertz.models import (
    Indentation,
    fit_held,
    fit_models,
    later_modulus,
    recommended,
    widened,
)
from palpate.estimate.hertz.options import Hertz
from palpate.estimate.hertz.record import Record


def estimate_hertz(
    indentation: Indentation,
    record: Record | None,
    options: Hertz,
    *,
    rig: Rig | None = None,
    clock_std_s: float = 0.0,
) -> dict:
    """Fit the study's model and the recommended one to a press, the latter to its hold too.

    Parameters
    ----------
    indentation : Indentation
    record : Record or None
        Of the same press with its hold; None where too few samples tell of it.
    options : Hertz
    rig : Rig, optional
        Uncertainties that are the recommended interval's too; none by default.
    clock_std_s : float, optional
        Standard deviation of the offset between the forces' clock and the frames' [s].

    Returns
    -------
    dict
        ``study``, as the study fits; ``free_contact``, the same with the contact free;
        ``models``, ``relaxation`` and ``recommended``, as `palpate.estimate.hertz.models` has them;
        and what they rest on.
    """
    law = contact_law(
        "parabola",
        "half_space",
        radius_m=indentation.radius_m,
        thickness_m=indentation.thickness_m,
        nu=0.0,
    )
    fitted = {"baseline": options.baseline, "residual": options.residual}
    of_layers = {"nu": options.assumed_poisson_ratio, "series": options.layer_series}
    models = fit_models(indentation, **of_layers, **fitted)
    best, relaxation = recommended(indentation, models), {"verdict": "too few samples"}
    if record is None:
        best["doubts"].append("too few samples to allow for relaxation and finite strain")
    else:
        row, relaxation = fit_held(
            indentation, record, best, series=options.layer_series, beliefs=options.relaxation
        )
        models.append(row)
        best = recommended(indentation, models)
    std = _rig_std(indentation, rig) if rig else 0.0
    if record is not None and clock_std_s > 0:
        given = of_layers | fitted | {"beliefs": options.relaxation}
        others = [
            later_modulus(indentation, record, best, after_s, **given)
            for after_s in (-clock_std_s, clock_std_s)
        ]
        by_clock = np.log(np.array(others) / best["reduced_modulus_pa"])
        std = float(np.hypot(std, np.sqrt(np.mean(by_clock**2))))
    best = widened(best, std)
    used = slice(indentation.onset, None)
    return {
        "radius_m": indentation.radius_m,
        "thickness_m": indentation.thickness_m,
        "depth_std_m": indentation.depth_std_m,
        "shape": asdict(indentation.shape),
        "depth_over_radius": indentation.depth_over_radius,
        "chi": indentation.chi,
        "study": asdict(
            fit_study(
                indentation.depth_m[used], indentation.magnitude_n[used], indentation.radius_m
            )
        ),
        "free_contact": asdict(
            fit_free_contact(indentation.depth_m, indentation.force_n, law, **fitted)
        ),
        "assumed_poisson_ratio": options.assumed_poisson_ratio,
        "layer_series": options.layer_series,
        "models": models,
        "relaxation": relaxation,
        "recommended": best,
    }


def _rig_std(indentation: Indentation, rig: Rig) -> float:
    """Relative standard deviation of E* by the rig: E* goes with F R^(-1/2) d^(-3/2)."""
    force = float(indentation.force_n.max())
    parts = (
        rig.force_scale_std,
        float(np.hypot(rig.force_zero_std_n, rig.force_drift_std_n)) / force,
        rig.radius_std_m / indentation.radius_m / 2,
        rig.curvature_std_per_m * indentation.radius_m / 2,
        1.5 * rig.compliance_std_m_n * force / max(float(indentation.depth_m.max()), 1e-9),
    )
    return float(np.linalg.norm(parts))
