"""Figure 4.1: the depth devices of the rig."""

from job import run
from palpate.capture.files import whole_file
from palpate.study import sensor_views, style


def main(snakemake):
    """Draw the figure."""
    with style.journal():
        figure = sensor_views.figure_4_1(**snakemake.params.devices)
        with whole_file(snakemake.output.png) as png, whole_file(snakemake.output.svg) as svg:
            style.save(figure, png, svg)


run(main, snakemake)
