"""Figure 3.1: mechanical quantities and their laws."""

from job import run
from palpate.capture.files import whole_file
from palpate.study import diagrams_3, style


def main(snakemake):
    """Draw the figure."""
    with style.journal():
        figure = diagrams_3.figure_3_1()
        with whole_file(snakemake.output.png) as png, whole_file(snakemake.output.svg) as svg:
            style.save(figure, png, svg)


run(main, snakemake)
