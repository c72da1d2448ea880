"""What noise on exact displacements does to the linear method and both error options."""

import numpy as np
from job import naming, run
from palpate.capture.files import whole_file
from palpate.estimate.simulation import pose_simulation
from palpate.solid.support import read_support
from palpate.study import simulation_figures, simulation_tables, style, tables
from palpate.surface.simulation import read_steps
from study_inputs import read_one


def main(snakemake):
    """Write the table and draw the figure."""
    options, output = snakemake.params.options, snakemake.output
    steps, truth = read_steps(snakemake.input.steps), read_one(snakemake.input.truth)
    with naming(snakemake.input.steps):
        problem = pose_simulation(steps, read_support(options["support"]))
        rng = np.random.default_rng(snakemake.params.seed)
        found = drawn(problem, steps.triangle, options, snakemake.params.search, rng)
    table = simulation_tables.noise_table(found, truth)
    title = "Simulated block: Lame parameters (Pa) from exact displacements with noise (m)"
    with whole_file(output.csv) as csv, whole_file(output.md) as md:
        tables.write(tables.rounded(table), csv, md, title=title)
    with style.journal():
        figure = simulation_figures.noise_figure(table)
        with whole_file(output.png) as png, whole_file(output.svg) as svg:
            style.save(figure, png, svg)


def drawn(problem, triangle, options, search, rng):
    """Lame parameters by every method, for each draw of each noise."""
    found = []
    for std in options["noise"]["std_m"]:
        for _ in range(options["noise"]["repeats"]):
            noisy = simulation_tables.with_noise(problem, std, rng)
            estimates = simulation_tables.every_method(
                noisy, triangle, linear=options["linear"], search=search
            )
            found += [
                {
                    "method": method,
                    "std_m": std,
                    "lame_lambda_pa": estimate.lame_lambda_pa,
                    "lame_mu_pa": estimate.lame_mu_pa,
                }
                for method, estimate in estimates.items()
            ]
    return found


run(main, snakemake)
