"""Error minimisation of one capture for one error option."""

import logging

from palpate.json_fields import read_fields
from palpate.report import outputs
from palpate.surface.tracked import load_tracked
from palpate.workflow.job import run
from thesis.minimise.fit import fit_moduli, minimum_files
from thesis.minimise.objective import Objective
from thesis.minimise.options import Minimise, Solid
from thesis.minimise.problem import read_problem


def main(snakemake):
    """Write the minimum with its trace, and the mismatch of each node."""
    inputs, params = snakemake.input, snakemake.params
    options, fit = Minimise.read(params.options), read_fields(inputs.fit)
    problem = read_problem(
        inputs,
        fit,
        tracked=load_tracked(inputs.tracked),
        probe=params.probe,
        options=options,
        solid=Solid.read(params.solid),
    )
    mesh, E_star = problem.mesh, fit["study"]["reduced_modulus_pa"]
    logging.info("%d nodes, %d on the support", len(mesh.nodes_m), len(problem.sets.support))
    objective = Objective(problem, snakemake.wildcards.error)
    moduli = fit_moduli(objective, E_star, options)
    logging.info("Poisson's ratio: %s", moduli.profile.verdict)
    known = {
        "hertz_reduced_modulus_pa": E_star,
        "frame": fit["range"]["last_frame"],
        "nodes": len(mesh.nodes_m),
        "left_out_nodes": len(objective.surface) - len(objective.compared),
    }
    outputs.write(minimum_files(objective, moduli, mesh, known), snakemake.output)


run(main, snakemake)
