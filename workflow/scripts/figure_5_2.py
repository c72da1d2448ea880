"""Figure 5.2: Hertz model fitted to one point per sensor."""

from job import run
from palpate.capture.files import whole_file
from palpate.study import hertz_figures, style
from study_inputs import read_all


def main(snakemake):
    """Draw the figure."""
    fits = read_all(snakemake.input.fits)
    with style.journal():
        figure = hertz_figures.figure_5_2(snakemake.params.captures, fits)
        with whole_file(snakemake.output.png) as png, whole_file(snakemake.output.svg) as svg:
            style.save(figure, png, svg)


run(main, snakemake)
