"""Figure 1.1: the way from a capture to its parameters."""

from job import run
from palpate.capture.files import whole_file
from palpate.study import rule_graph, style


def main(snakemake):
    """Draw the figure."""
    with style.journal():
        figure = rule_graph.figure_1_1(snakemake.params.rules)
        with whole_file(snakemake.output.png) as png, whole_file(snakemake.output.svg) as svg:
            style.save(figure, png, svg)


run(main, snakemake)
