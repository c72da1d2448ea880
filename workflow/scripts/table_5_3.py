"""Table 5.3: E, nu and E* of the block's points from error minimisation."""

import pandas as pd
from job import run
from palpate.capture.files import whole_file
from palpate.study import tables
from study_inputs import minima_by_key


def main(snakemake):
    """Write the table as CSV and Markdown."""
    params = snakemake.params
    minima = minima_by_key(params.captures, params.errors, snakemake.input.results)
    ours = tables.minimum_table(params.captures, minima)
    published = pd.read_csv(snakemake.input.published)
    table = tables.rounded(tables.table_5_3(ours, published, block=params.block))
    title = "Table 5.3: E (Pa), nu and E* (Pa) from error minimisation"
    with whole_file(snakemake.output.csv) as csv, whole_file(snakemake.output.md) as md:
        tables.write(table, csv, md, title=title)


run(main, snakemake)
