"""Figures 5.8, 5.9, 5.14 and 5.17: Lame parameters and error against iteration."""

from job import run
from palpate.capture.files import whole_file
from palpate.study import figures, style
from study_inputs import read_all


def main(snakemake):
    """Draw the figure."""
    params = snakemake.params
    with style.journal():
        minima = read_all(snakemake.input.results)
        figure = figures.figure_5_8(
            params.captures, minima, error=params.error, iterations=params.get("iterations")
        )
        with whole_file(snakemake.output.png) as png, whole_file(snakemake.output.svg) as svg:
            style.save(figure, png, svg)


run(main, snakemake)
