"""Errors of the trackers against the virtual lab's truth, drawn."""

import pandas as pd
from job import run
from palpate.capture.files import whole_file
from palpate.study import style, tracking_dots


def main(snakemake):
    """Draw the figure."""
    table = pd.read_csv(snakemake.input.table, dtype={"capture": str, "point": str})
    with style.journal():
        figure = tracking_dots.tracking_accuracy(table)
        with whole_file(snakemake.output.png) as png, whole_file(snakemake.output.svg) as svg:
            style.save(figure, png, svg)


run(main, snakemake)
