"""Figure 4.5: force sensor with handle, sphere and board."""

from job import run
from palpate.capture.files import whole_file
from palpate.study import probe_view, style


def main(snakemake):
    """Draw the figure."""
    with style.journal():
        figure = probe_view.figure_4_5(snakemake.params.probe)
        with whole_file(snakemake.output.png) as png, whole_file(snakemake.output.svg) as svg:
            style.save(figure, png, svg)


run(main, snakemake)
