"""Figure 3.10: mismatch of tracked and computed deformation of the simulated block."""

import meshio
from job import run
from palpate.capture.files import whole_file
from palpate.study import simulation_views, style
from palpate.surface.simulation import read_steps


def main(snakemake):
    """Draw the figure."""
    values = meshio.read(snakemake.input.mismatch).point_data
    steps = read_steps(snakemake.input.steps)
    with style.journal():
        figure = simulation_views.figure_3_10(
            steps, values["tracked_displacement_m"], values["computed_displacement_m"]
        )
        with whole_file(snakemake.output.png) as png, whole_file(snakemake.output.svg) as svg:
            style.save(figure, png, svg)


run(main, snakemake)
