"""Error minimisation of one simulated capture with one change after the other, and each alone.

The true surface serves rows of its own, which show what a perfect tracker would leave.
"""

import json
import logging
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
from palpate.json_fields import read_one
from palpate.surface.tracked import Tracked, load_tracked
from palpate.workflow.job import naming

from thesis.minimise.fit import fit_moduli
from thesis.minimise.objective import Objective
from thesis.minimise.options import Minimise, Solid
from thesis.minimise.problem import read_problem

FIRST, ADDED, ALONE, TRUE = "as configured", "added", "alone", "true surface"
# What a tracker takes for granted would come back as the data's.
VERDICT, NOT_JUDGED = "poisson_ratio_verdict", "not judged"
MINIMUM = ("youngs_modulus_pa", "poisson_ratio", "reduced_modulus_pa", "error_m", "at_bound")


@dataclass(frozen=True)
class Variant:
    """The error minimisation with some of its options changed.

    Attributes
    ----------
    step : str
        Name of the change; ``as configured`` for none.
    kind : {"as configured", "added", "alone", "true surface"}
        Without a change, with this change and all before it, or with this one only; or with all up
        to this one on the true surface instead of a tracked one, which is what a perfect tracker
        would leave.
    changes : dict
        Options that differ from the configured ones.
    """

    step: str
    kind: str
    changes: dict


def variants(steps: Mapping[str, Mapping]) -> list[Variant]:
    """Variants that show what each step changes, in the order of the steps.

    Parameters
    ----------
    steps : mapping
        Changed options by step.

    Returns
    -------
    list of Variant
        The configured one, then with one step more each, with each step alone, and with one step
        more each on the true surface, where a step that just changes the tracker has no place.

    Raises
    ------
    ValueError
        If there is no step.
    """
    if not steps:
        raise ValueError("steps: expected at least one, found none")
    added, together = [], {}
    for name, changes in steps.items():
        together = together | dict(changes)
        added.append(Variant(name, ADDED, together))
    alone = [Variant(name, ALONE, dict(changes)) for name, changes in steps.items()]
    first = Variant(FIRST, FIRST, {})
    true = [
        Variant(variant.step, TRUE, {k: v for k, v in variant.changes.items() if k != "tracker"})
        for variant in (first, *added)
        if set(steps.get(variant.step, {})) != {"tracker"}
    ]
    return [first, *added, *alone, *true]


def true_surface(tracked: Tracked, truth: Mapping) -> Tracked:
    """The true surface in the place of a tracked one, at the pose that the pipeline found.

    Parameters
    ----------
    tracked : Tracked
        With f frames.
    truth : mapping
        Arrays of the lab's truth.npz: ``surface_m`` (f, n, 3) [m] in the object's frame and
        ``surface_faces``.

    Raises
    ------
    ValueError
        If the truth has other frames than the tracked surface.
    """
    surface_m, frames = np.asarray(truth["surface_m"], dtype=float), len(tracked.vertices_m)
    if len(surface_m) != frames:
        raise ValueError(f"surface_m: expected {frames} frames, found {len(surface_m)}")
    pose = tracked.camera_from_object
    vertices_m = surface_m @ pose[:3, :3].T + pose[:3, 3]
    return replace(
        tracked,
        template_m=surface_m[0],
        faces=np.asarray(truth["surface_faces"]),
        rest_m=vertices_m[0],
        vertices_m=vertices_m,
        observed=np.ones(vertices_m.shape[:2], dtype=bool),
        prior="",
    )


def make_minimise_steps(inputs: Any, params: Any) -> dict:
    """Minima of all steps and error options (minimise_steps.json)."""
    files = zip(params.trackers, inputs.tracked, strict=True)
    surfaces = {name: load_tracked(path) for name, path in files}
    with naming(inputs.truth), np.load(inputs.truth, allow_pickle=False) as truth:
        surfaces[TRUE] = true_surface(surfaces[params.tracker], truth)
    found: dict[str, list] = {}
    kept: dict[tuple, Any] = {}
    rows = []
    for variant in variants(params.steps):
        tracker = variant.changes.get("tracker", params.tracker)
        surface = TRUE if variant.kind == TRUE else tracker
        key = json.dumps([surface, variant.changes], sort_keys=True)
        if key not in found:
            logging.info("%s, %s", variant.step, variant.kind)
            found[key] = _minima(inputs, params, variant.changes, surfaces[surface], kept)
        rows += [asdict(variant) | {"surface": surface} | minimum for minimum in found[key]]
    return {"result": rows}


def _minima(inputs: Any, params: Any, changes: Mapping, tracked: Tracked, kept: dict) -> list[dict]:
    """Minimum of each error option with some options changed."""
    fit, options = read_one(inputs.fit), Minimise.read(_changed(params.options, changes))
    solid = Solid.read(_changed(params.solid, changes))
    problem = read_problem(
        inputs, fit, tracked=tracked, probe=params.probe, options=options, solid=solid
    )
    rows = []
    for error in params.errors:
        objective = Objective(problem, error, kept)
        E_star = fit["study"]["reduced_modulus_pa"]
        moduli = fit_moduli(objective, E_star, options, norms=["length"])
        rows.append(
            {"error": error, "nodes": len(problem.mesh.nodes_m)}
            | {name: getattr(moduli.minimum, name) for name in MINIMUM}
            | {
                "left_out_nodes": len(objective.surface) - len(objective.compared),
                VERDICT: NOT_JUDGED if tracked.prior else moduli.profile.verdict,
                "reduced_model_error": moduli.reduced_model_error,
            }
        )
    return rows


def _changed(options: Mapping, changes: Mapping) -> dict:
    return {name: changes.get(name, value) for name, value in options.items()}
