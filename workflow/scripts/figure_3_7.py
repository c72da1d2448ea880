"""Figure 3.7: linear method on tracked data of the simulated block."""

import pandas as pd
from job import run
from palpate.capture.files import whole_file
from palpate.study import simulation_figures, style
from study_inputs import read_one


def main(snakemake):
    """Draw the figure."""
    inputs = snakemake.input
    truth, published = read_one(inputs.truth), pd.read_csv(inputs.published)
    lines = simulation_figures.known_values(
        truth, published, method="linear_method", data="tracked"
    )
    with style.journal():
        figure = simulation_figures.linear_traces(read_one(inputs.result), lines)
        with whole_file(snakemake.output.png) as png, whole_file(snakemake.output.svg) as svg:
            style.save(figure, png, svg)


run(main, snakemake)
