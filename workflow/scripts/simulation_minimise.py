"""Error minimisation on the simulated block for one kind of data and one error option."""

import json
from dataclasses import asdict

import numpy as np
from job import naming, run
from palpate.capture.files import whole_file
from palpate.estimate.fit import fit_moduli
from palpate.estimate.objective import Objective
from palpate.estimate.simulation import pressed_area_modulus
from palpate.solid.mesh import write_solid
from simulation_problem import read_problem


def main(snakemake):
    """Write the minimum with its trace, and tracked and computed displacement of each node."""
    options, wildcards = snakemake.params.options, snakemake.wildcards
    triangle, problem = read_problem(
        snakemake.input.steps, snakemake.input.tracked, snakemake.params.support
    )
    with naming(snakemake.input.steps):
        full = Objective(problem.mesh, problem.sets, problem.measurement, option=wildcards.error)
    E_star = pressed_area_modulus(problem, triangle)
    found = fit_moduli(full, E_star, options, nodes_m=problem.mesh.nodes_m)
    result = asdict(found.minimum) | {
        "error_option": wildcards.error,
        "data": wildcards.data,
        "start_reduced_modulus_pa": E_star,
        "nodes": len(problem.mesh.nodes_m),
        "least_squares": {norm: asdict(fit) for norm, fit in found.least_squares.items()},
        "profile": asdict(found.profile),
        "reduced_model": asdict(found.reduced_model),
    }
    with whole_file(snakemake.output.result) as part:
        part.write_text(json.dumps(result, indent=2) + "\n", encoding="utf-8")
    data = compared(full, found.minimum)
    with whole_file(snakemake.output.mismatch) as part:
        write_solid(part, problem.mesh, point_data=data)


def compared(objective, minimum):
    """Tracked and computed displacement of each node and, on the surface, their distance."""
    computed = objective.displacement(minimum.lame_lambda_pa, minimum.lame_mu_pa)
    tracked, gap = np.nan_to_num(objective.u), np.zeros(len(computed))
    gap[objective.surface] = np.linalg.norm((computed - tracked)[objective.surface], axis=1)
    return {
        "tracked_displacement_m": tracked,
        "computed_displacement_m": computed,
        "mismatch_m": gap,
    }


run(main, snakemake)
