"""Linear method on the simulated block, from every start."""

import json
import logging
from dataclasses import asdict

from job import naming, run
from palpate.capture.files import whole_file
from palpate.estimate.linear import linear_method
from simulation_problem import read_problem


def main(snakemake):
    """Write the estimates with their traces."""
    options = snakemake.params.options
    steps = snakemake.input.steps
    _, problem = read_problem(steps, snakemake.input.tracked, options["support"])
    with naming(steps):
        found = from_every_start(problem, options["linear"])
    result = {"data": snakemake.wildcards.data, "estimates": found}
    with whole_file(snakemake.output.result) as part:
        part.write_text(json.dumps(result, indent=2) + "\n", encoding="utf-8")


def from_every_start(problem, linear):
    """Estimates of the linear method, as they are to be written."""
    found = []
    for start in linear["starts_pa"]:
        estimate = linear_method(
            problem.mesh,
            problem.sets,
            problem.measurement,
            start=tuple(start),
            iterations=linear["iterations"],
            tolerance=linear["tolerance"],
        )
        found.append(asdict(estimate) | {"start_pa": start})
        logging.info("from %s Pa: %d iterations", start, estimate.iterations)
    return found


run(main, snakemake)
