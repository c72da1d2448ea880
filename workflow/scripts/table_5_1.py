"""Table 5.1: reduced modulus of repeated presses of one point."""

import pandas as pd
from job import run
from palpate.capture.files import whole_file
from palpate.study import hertz_tables, tables
from study_inputs import read_all


def main(snakemake):
    """Write the table as CSV and Markdown."""
    hertz = hertz_tables.hertz_table(snakemake.params.captures, read_all(snakemake.input.fits))
    published = pd.read_csv(snakemake.input.published)
    table = tables.rounded(hertz_tables.table_5_1(hertz, published))
    title = "Table 5.1: reduced modulus E* of repeated presses (Pa)"
    with whole_file(snakemake.output.csv) as csv, whole_file(snakemake.output.md) as md:
        tables.write(table, csv, md, title=title)


run(main, snakemake)
