"""Table 5.2: reduced modulus from the Hertz fit at the block's points."""

import pandas as pd
from job import run
from palpate.capture.files import whole_file
from palpate.study import tables
from study_inputs import read_all


def main(snakemake):
    """Write the table as CSV and Markdown."""
    params = snakemake.params
    hertz = tables.hertz_table(params.captures, read_all(snakemake.input.fits))
    published = pd.read_csv(snakemake.input.published)
    table = tables.rounded(tables.table_5_2(hertz, published, block=params.block))
    with whole_file(snakemake.output.csv) as csv, whole_file(snakemake.output.md) as md:
        tables.write(table, csv, md, title="Table 5.2: reduced modulus E* from the Hertz fit (Pa)")


run(main, snakemake)
