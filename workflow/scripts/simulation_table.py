"""Moduli of the simulated block by method and data."""

import pandas as pd
from job import run
from palpate.capture.files import whole_file
from palpate.study import simulation_tables, tables
from study_inputs import read_all, read_one


def main(snakemake):
    """Write the table as CSV and Markdown."""
    inputs = snakemake.input
    linear = dict(zip(snakemake.params.data, read_all(inputs.linear), strict=True))
    published = pd.read_csv(inputs.published)
    found = simulation_tables.simulation_table(
        linear, read_all(inputs.minima), published, read_one(inputs.truth)
    )
    title = "Sections 3.3.2 to 3.3.4: Lame parameters, E (Pa) and nu of the simulated block"
    with whole_file(snakemake.output.csv) as csv, whole_file(snakemake.output.md) as md:
        tables.write(tables.rounded(found), csv, md, title=title)


run(main, snakemake)
