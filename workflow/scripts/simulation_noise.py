"""What noise on exact displacements does to the linear method and to error minimisation."""

import numpy as np
from job import run
from palpate.capture.files import whole_file
from palpate.estimate.simulation import pose_simulation
from palpate.study import simulation_figures, simulation_tables, style, tables
from palpate.surface.simulation import read_steps
from study_inputs import read_one


def main(snakemake):
    """Write the table and draw the figure."""
    options, output = snakemake.params.options, snakemake.output
    steps, truth = read_steps(snakemake.input.steps), read_one(snakemake.input.truth)
    problem = pose_simulation(steps, options["support"])
    rng = np.random.default_rng(snakemake.params.seed)
    found = []
    for std in options["noise"]["std_m"]:
        for _ in range(options["noise"]["repeats"]):
            noisy = simulation_tables.with_noise(problem, std, rng)
            estimates = simulation_tables.both_methods(
                noisy, steps.triangle, linear=options["linear"], search=snakemake.params.search
            )
            found += [
                {
                    "method": method,
                    "std_m": std,
                    "lame_lambda_pa": estimate.lame_lambda_pa,
                    "lame_mu_pa": estimate.lame_mu_pa,
                }
                for method, estimate in zip(
                    ("linear_method", "minimise_displacement"), estimates, strict=True
                )
            ]
    table = simulation_tables.noise_table(found, truth)
    title = "Simulated block: Lame parameters (Pa) from exact displacements with noise (m)"
    with whole_file(output.csv) as csv, whole_file(output.md) as md:
        tables.write(tables.rounded(table), csv, md, title=title)
    with style.journal():
        figure = simulation_figures.noise_figure(table)
        with whole_file(output.png) as png, whole_file(output.svg) as svg:
            style.save(figure, png, svg)


run(main, snakemake)
