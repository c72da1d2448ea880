"""Error minimisation of one capture for one error option."""

import json
import logging
from dataclasses import asdict
from pathlib import Path

import numpy as np
from job import naming, run
from palpate.capture.files import whole_file
from palpate.capture.schema import load_yaml
from palpate.capture.tables import read_table
from palpate.estimate.fit import fit_moduli
from palpate.estimate.objective import Objective
from palpate.estimate.problem import pose_problem
from palpate.solid.mesh import read_solid, write_solid
from palpate.surface.checks import columns_of
from palpate.surface.tracked import load_tracked
from palpate.vision.force import FORCE


def main(snakemake):
    """Write the minimum with its trace, and the mismatch of each node."""
    options = snakemake.params.options
    fit = json.loads(Path(snakemake.input.fit).read_text(encoding="utf-8"))
    problem = read_problem(snakemake, fit)
    mesh, sets = problem.mesh, problem.sets
    logging.info("%d nodes, %d on the support", len(mesh.nodes_m), len(sets.support))
    full = Objective(mesh, sets, problem.measurement, option=snakemake.wildcards.error)
    E_star = fit["study"]["reduced_modulus_pa"]
    moduli = fit_moduli(full, E_star, options, nodes_m=mesh.nodes_m)
    minimum = moduli.minimum
    logging.info("Poisson's ratio: %s", moduli.profile.verdict)
    result = asdict(minimum) | {
        "error_option": snakemake.wildcards.error,
        "hertz_reduced_modulus_pa": E_star,
        "frame": fit["range"]["last_frame"],
        "nodes": len(mesh.nodes_m),
        "least_squares": {norm: asdict(found) for norm, found in moduli.least_squares.items()},
        "profile": asdict(moduli.profile),
        "reduced_model": asdict(moduli.reduced_model),
    }
    with whole_file(snakemake.output.result) as part:
        part.write_text(json.dumps(result, indent=2) + "\n", encoding="utf-8")
    write_mismatch(snakemake.output.mismatch, full, minimum, mesh)


def read_problem(snakemake, fit):
    """Read the inverse problem of the deepest frame of the Hertz fit."""
    inputs, options, frame = snakemake.input, snakemake.params.options, fit["range"]["last_frame"]
    solid, tracked = read_solid(inputs.solid), load_tracked(inputs.tracked)
    with naming(inputs.force):
        force = columns_of(read_table(inputs.force), FORCE)[frame]
    with naming(inputs.object, "support", "contact"):
        return pose_problem(
            solid,
            tracked,
            force,
            frame,
            fit["samples"]["depth_m"][frame],
            load_yaml(inputs.object)["support"],
            indenter_radius_m=snakemake.params.probe["indenter"]["radius_m"],
            force_rule=options["force_rule"],
            turn_force=options["turn_force"],
            **snakemake.params.solid,
        )


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
