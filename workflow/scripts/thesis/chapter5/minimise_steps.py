"""Error minimisation of one simulated capture with one change after the other.

The true surface serves a row of its own, which tells what a perfect tracker would leave.
"""

import json
import logging
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

import numpy as np
from numpy.typing import NDArray
from palpate.json_fields import read_one
from palpate.surface.tracked import Tracked, load_tracked
from palpate.workflow.job import naming

from thesis.chapter5.minimise_inputs import read_problem
from thesis.chapter5.step_variants import TRUE, true_surface, variants
from thesis.minimise.fit import fit_moduli
from thesis.minimise.objective import Objective
from thesis.minimise.options import Minimise, Solid
from thesis.minimise.problem import Problem

# What a tracker takes for granted would come back as the data's.
VERDICT, NOT_JUDGED = "poisson_ratio_verdict", "not judged"
MINIMUM = ("youngs_modulus_pa", "poisson_ratio", "reduced_modulus_pa", "error_m", "at_bound")


def make_minimise_steps(inputs: Any, params: Any) -> dict:
    """Minima of all steps and error options (minimise_steps.json)."""
    surfaces = _read_surfaces(inputs, params)
    found: dict[str, list] = {}
    kept: dict[tuple, dict] = {}
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


def _read_surfaces(inputs: Any, params: Any) -> dict[str, Tracked]:
    """Tracked surfaces by tracker, and the true one."""
    files = zip(params.trackers, inputs.tracked, strict=True)
    surfaces = {name: load_tracked(path) for name, path in files}
    with naming(inputs.truth), np.load(inputs.truth, allow_pickle=False) as truth:
        return surfaces | {TRUE: true_surface(surfaces[params.tracker], truth)}


def _minima(inputs: Any, params: Any, changes: Mapping, tracked: Tracked, kept: dict) -> list[dict]:
    """Minimum of each error option with some options changed."""
    fit, options = read_one(inputs.fit), Minimise.read(_changed(params.options, changes))
    problem = read_problem(
        inputs,
        fit,
        tracked=tracked,
        probe=params.probe,
        options=options,
        solid=Solid.read(_changed(params.solid, changes)),
    )
    first = problem.objective(params.errors[0])
    _share_models(first, problem, kept)
    start_pa, nodes_m = fit["study"]["reduced_modulus_pa"], problem.mesh.nodes_m
    rows = [_minimum(first.with_option(e), start_pa, options, nodes_m) for e in params.errors]
    return [row | {VERDICT: NOT_JUDGED} for row in rows] if tracked.prior else rows


def _changed(options: Mapping, changes: Mapping) -> dict:
    return {name: changes.get(name, value) for name, value in options.items()}


def _minimum(full: Objective, start_pa: float, options: Minimise, nodes_m: NDArray) -> dict:
    """Row of one error option."""
    moduli = fit_moduli(full, start_pa, options, nodes_m=nodes_m, norms=("length",))
    return (
        {"error": full.option, "nodes": len(nodes_m)}
        | {name: getattr(moduli.minimum, name) for name in MINIMUM}
        | {
            "left_out_nodes": len(full.surface) - len(full.compared),
            VERDICT: moduli.profile.verdict,
            "reduced_model_error_bound": moduli.reduced_model.largest_error_bound,
        }
    )


def _share_models(objective: Objective, problem: Problem, kept: dict) -> None:
    """Take over reduced models of the same system: most of the time goes into making them.

    That of the displacement follows from mesh and load, that of the interior from mesh and surface.
    """
    mesh = problem.mesh.nodes_m.tobytes()
    load, surface = problem.measurement.force_n, problem.measurement.displacement_m
    objective.displacement_models = kept.setdefault((mesh, "load", load.tobytes()), {})
    objective.interior_models = kept.setdefault((mesh, "surface", surface.tobytes()), {})
