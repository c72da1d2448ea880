"""Figure 5.3: repeated recordings at one point, aligned at 0.3 N."""

import pandas as pd
from job import run
from palpate.capture.files import whole_file
from palpate.study import hertz_figures, style
from study_inputs import read_all


def main(snakemake):
    """Draw the figure."""
    fits, published = read_all(snakemake.input.fits), pd.read_csv(snakemake.input.published)
    with style.journal():
        figure = hertz_figures.figure_5_3(snakemake.params.captures, fits, published)
        with whole_file(snakemake.output.png) as png, whole_file(snakemake.output.svg) as svg:
            style.save(figure, png, svg)


run(main, snakemake)
