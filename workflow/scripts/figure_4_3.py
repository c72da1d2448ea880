"""Figure 4.3: triangulation of a stereo pair."""

from job import run
from palpate.capture.files import whole_file
from palpate.study import style, triangulation


def main(snakemake):
    """Draw the figure."""
    params = snakemake.params
    with style.journal():
        figure = triangulation.figure_4_3(params.sensor, depth_m=params.depth_m)
        with whole_file(snakemake.output.png) as png, whole_file(snakemake.output.svg) as svg:
            style.save(figure, png, svg)


run(main, snakemake)
