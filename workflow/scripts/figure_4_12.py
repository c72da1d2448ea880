"""Figure 4.12: transform chain from the probe's tip to the camera."""

from job import run
from palpate.capture.files import whole_file
from palpate.capture.tables import read_table
from palpate.study import style, transform_chain


def main(snakemake):
    """Draw the figure."""
    params = snakemake.params
    with style.journal():
        figure = transform_chain.figure_4_12(
            read_table(snakemake.input.pose),
            params.probe,
            params.sensor["color"],
            provenance=params.capture["provenance"],
        )
        with whole_file(snakemake.output.png) as png, whole_file(snakemake.output.svg) as svg:
            style.save(figure, png, svg)


run(main, snakemake)
