"""Error minimisation of one simulated capture with one change after the other.

The true surface serves a row of its own, which tells what a perfect tracker would leave.
"""

import json
import logging
from dataclasses import asdict
from pathlib import Path

import numpy as np
from job import naming, run
from minimise_inputs import read_problem
from palpate.capture.files import whole_file
from palpate.estimate.fit import fit_moduli
from palpate.study.step_variants import TRUE, true_surface, variants
from palpate.surface.tracked import load_tracked

# What a tracker takes for granted would come back as the data's.
NOT_JUDGED = "not judged"
MINIMUM = ("youngs_modulus_pa", "poisson_ratio", "reduced_modulus_pa", "error_m", "at_bound")


def main(snakemake):
    """Write the minima of all steps and error options."""
    fit = json.loads(Path(snakemake.input.fit).read_text(encoding="utf-8"))
    surfaces, found, kept, rows = read_surfaces(snakemake), {}, {}, []
    for variant in variants(snakemake.params.steps):
        tracker = variant.changes.get("tracker", snakemake.params.tracker)
        surface = TRUE if variant.kind == TRUE else tracker
        key = json.dumps([surface, variant.changes], sort_keys=True)
        if key not in found:
            logging.info("%s, %s", variant.step, variant.kind)
            found[key] = minima(snakemake, fit, variant.changes, surfaces[surface], kept)
        rows += [asdict(variant) | {"surface": surface} | minimum for minimum in found[key]]
    with whole_file(snakemake.output.result) as part:
        part.write_text(json.dumps(rows, indent=2) + "\n", encoding="utf-8")


def read_surfaces(snakemake):
    """Read the tracked surfaces by tracker, and the true one."""
    trackers, inputs = snakemake.params.trackers, snakemake.input
    surfaces = {
        name: load_tracked(path) for name, path in zip(trackers, inputs.tracked, strict=True)
    }
    with naming(inputs.truth), np.load(inputs.truth, allow_pickle=False) as truth:
        return surfaces | {TRUE: true_surface(surfaces[snakemake.params.tracker], truth)}


def minima(snakemake, fit, changes, tracked, kept):
    """Find the minimum of each error option with some options changed."""
    params = snakemake.params
    solid = {name: changes.get(name, value) for name, value in params.solid.items()}
    options = {name: changes.get(name, value) for name, value in params.options.items()}
    problem = read_problem(snakemake, fit, tracked=tracked, options=options, solid=solid)
    nodes_m, rows = problem.mesh.nodes_m, []
    first = problem.objective(params.errors[0])
    share_models(first, problem, kept)
    for error in params.errors:
        full = first.with_option(error)
        start_pa = fit["study"]["reduced_modulus_pa"]
        moduli = fit_moduli(full, start_pa, options, nodes_m=nodes_m, norms=("length",))
        rows.append(
            {"error": error, "nodes": len(nodes_m)}
            | {name: getattr(moduli.minimum, name) for name in MINIMUM}
            | {
                "left_out_nodes": len(full.surface) - len(full.compared),
                "poisson_ratio_verdict": NOT_JUDGED if tracked.prior else moduli.profile.verdict,
                "reduced_model_error_bound": moduli.reduced_model.largest_error_bound,
            }
        )
    return rows


def share_models(objective, problem, kept):
    """Take over reduced models of the same system: most of the time goes into making them.

    With linear strain that of the displacement follows from mesh and load, that of the interior
    from mesh and surface.
    """
    if problem.rotations is not None:
        return
    mesh = problem.mesh.nodes_m.tobytes()
    load, surface = problem.measurement.force_n, problem.measurement.displacement_m
    objective.displacement_models = kept.setdefault((mesh, "load", load.tobytes()), {})
    objective.interior_models = kept.setdefault((mesh, "surface", surface.tobytes()), {})


run(main, snakemake)
