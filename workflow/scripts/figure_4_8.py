"""Figure 4.8: pinhole camera model."""

from job import run
from palpate.capture.files import whole_file
from palpate.study import pinhole_figure, style


def main(snakemake):
    """Draw the figure."""
    params = snakemake.params
    with style.journal():
        figure = pinhole_figure.figure_4_8(
            params.sensor["color"], depth_m=params.depth_m, name=params.sensor["sensor"]
        )
        with whole_file(snakemake.output.png) as png, whole_file(snakemake.output.svg) as svg:
            style.save(figure, png, svg)


run(main, snakemake)
