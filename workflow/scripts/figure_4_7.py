"""Figure 4.7: capture setup of each sensor."""

from job import run
from palpate.capture.files import whole_file
from palpate.study import rig_views, style


def main(snakemake):
    """Draw the figure."""
    with style.journal():
        figure = rig_views.figure_4_7(snakemake.params.setups, provenance="simulated")
        with whole_file(snakemake.output.png) as png, whole_file(snakemake.output.svg) as svg:
            style.save(figure, png, svg)


run(main, snakemake)
