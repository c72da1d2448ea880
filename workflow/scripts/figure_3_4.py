"""Figure 3.4: displacement of the simulated block under its last load."""

from job import run
from palpate.capture.files import whole_file
from palpate.study import simulation_views, style
from palpate.surface.simulation import read_steps


def main(snakemake):
    """Draw the figure."""
    steps = read_steps(snakemake.input.steps)
    with style.journal():
        figure = simulation_views.figure_3_4(steps)
        with whole_file(snakemake.output.png) as png, whole_file(snakemake.output.svg) as svg:
            style.save(figure, png, svg)


run(main, snakemake)
