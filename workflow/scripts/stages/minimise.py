"""Error minimisation of one capture for one error option."""

import json
import logging
from dataclasses import asdict
from pathlib import Path

import numpy as np
from palpate.capture.files import whole_file, write_json
from palpate.estimate.minimise.fit import fit_moduli
from palpate.estimate.minimise.options import Minimise, Solid
from palpate.solid.mesh import write_solid
from palpate.surface.tracked import load_tracked
from palpate.workflow.job import run
from thesis.chapter5.minimise_inputs import read_problem


def main(snakemake):
    """Write the minimum with its trace, and the mismatch of each node."""
    inputs, params = snakemake.input, snakemake.params
    options = Minimise.read(params.options)
    fit = json.loads(Path(inputs.fit).read_text(encoding="utf-8"))
    problem = read_problem(
        inputs,
        fit,
        tracked=load_tracked(inputs.tracked),
        probe=params.probe,
        options=options,
        solid=Solid.read(params.solid),
    )
    mesh, sets = problem.mesh, problem.sets
    logging.info("%d nodes, %d on the support", len(mesh.nodes_m), len(sets.support))
    full = problem.objective(snakemake.wildcards.error)
    E_star = fit["study"]["reduced_modulus_pa"]
    moduli = fit_moduli(full, E_star, options, nodes_m=mesh.nodes_m)
    minimum = moduli.minimum
    logging.info("Poisson's ratio: %s", moduli.profile.verdict)
    result = asdict(minimum) | {
        "error_option": snakemake.wildcards.error,
        "hertz_reduced_modulus_pa": E_star,
        "frame": fit["range"]["last_frame"],
        "nodes": len(mesh.nodes_m),
        "left_out_nodes": len(full.surface) - len(full.compared),
        "least_squares": {norm: asdict(found) for norm, found in moduli.least_squares.items()},
        "profile": asdict(moduli.profile),
        "reduced_model": asdict(moduli.reduced_model),
    }
    write_json(snakemake.output.result, result)
    write_mismatch(snakemake.output.mismatch, full, minimum, mesh)


def write_mismatch(path, objective, minimum, mesh):
    """Write the solid with tracked and computed displacement and their distance at each node."""
    computed = objective.displacement(minimum.lame_lambda_pa, minimum.lame_mu_pa)
    tracked = np.nan_to_num(objective.u)
    gap = np.zeros(len(mesh.nodes_m))
    gap[objective.surface] = np.linalg.norm((computed - tracked)[objective.surface], axis=1)
    data = {
        "tracked_displacement_m": tracked,
        "computed_displacement_m": computed,
        "mismatch_m": gap,
    }
    with whole_file(path) as part:
        write_solid(part, mesh, point_data=data)


run(main, snakemake)
