"""Figure 5.10: mismatch of tracked and computed deformation."""

from job import run
from mismatch_inputs import mismatch_of
from palpate.capture.files import whole_file
from palpate.study import style, surface_figures


def main(snakemake):
    """Draw the figure."""
    paths = zip(snakemake.input.mismatches, snakemake.input.tracked, strict=True)
    views = [mismatch_of(*pair) for pair in paths]
    with style.journal():
        figure = surface_figures.figure_5_10(snakemake.params.captures, views)
        with whole_file(snakemake.output.png) as png, whole_file(snakemake.output.svg) as svg:
            style.save(figure, png, svg)


run(main, snakemake)
