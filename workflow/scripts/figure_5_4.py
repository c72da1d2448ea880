"""Figure 5.4: reduced modulus over the block."""

import pandas as pd
from job import run
from palpate.capture.files import whole_file
from palpate.study import hertz_maps, hertz_tables, style
from study_inputs import read_all


def main(snakemake):
    """Draw the figure."""
    params, published = snakemake.params, pd.read_csv(snakemake.input.published)
    hertz = hertz_tables.hertz_table(params.captures, read_all(snakemake.input.fits))
    table = hertz_tables.table_5_2(hertz, published, block=params.block)
    with style.journal():
        figure = hertz_maps.figure_5_4(params.captures, table)
        with whole_file(snakemake.output.png) as png, whole_file(snakemake.output.svg) as svg:
            style.save(figure, png, svg)


run(main, snakemake)
