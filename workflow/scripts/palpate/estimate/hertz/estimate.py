"""All that a press tells by Hertz's theory: every model, relaxation, and the one recommended."""

from dataclasses import asdict

from numpy.typing import NDArray

from palpate.estimate.hertz.fit import RESIDUALS, Law, fit_free_contact, fit_study
from palpate.estimate.hertz.laws import contact_law
from palpate.estimate.hertz.models import Indentation, fit_held, fit_models, recommended
from palpate.estimate.hertz.options import Hertz
from palpate.estimate.hertz.record import Record


def estimate_hertz(indentation: Indentation, record: Record | None, options: Hertz) -> dict:
    """Fit every model to the samples of a press, and the recommended one to its hold too.

    Parameters
    ----------
    indentation : Indentation
    record : Record or None
        Of the same press with its hold; None where too few samples tell of it.
    options : Hertz

    Returns
    -------
    dict
        ``study``, as the study fits; ``free_contact`` and ``residuals``, with the contact free;
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
    relaxation = {"verdict": "too few samples"}
    if record is not None:
        best = recommended(indentation, models)
        rows, relaxation = fit_held(
            indentation, record, best, **of_layers, beliefs=options.relaxation
        )
        models += rows
    used = slice(indentation.onset, None)
    depth, force = indentation.depth_m[used], indentation.force_n[used]
    return {
        "radius_m": indentation.radius_m,
        "thickness_m": indentation.thickness_m,
        "depth_std_m": indentation.depth_std_m,
        "shape": asdict(indentation.shape),
        "depth_over_radius": indentation.depth_over_radius,
        "chi": indentation.chi,
        "study": asdict(fit_study(depth, indentation.magnitude_n[used], indentation.radius_m)),
        "free_contact": asdict(
            fit_free_contact(indentation.depth_m, indentation.force_n, law, **fitted)
        ),
        "residuals": _by_residual(depth, force, law),
        "assumed_poisson_ratio": options.assumed_poisson_ratio,
        "layer_series": options.layer_series,
        "models": models,
        "relaxation": relaxation,
        "recommended": recommended(indentation, models),
    }


def _by_residual(depth_m: NDArray, force_n: NDArray, law: Law) -> dict:
    """Fit the samples in range with each choice of what is compared; it alone can move E*."""
    if len(force_n) <= 2:
        return {}
    return {
        name: asdict(fit_free_contact(depth_m, force_n, law, residual=name)) for name in RESIDUALS
    }
