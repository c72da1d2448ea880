"""Tables 5.3 to 5.5: E, nu and E* of an object's points from error minimisation."""

import pandas as pd
from job import run
from palpate.capture.files import whole_file
from palpate.study import moduli_tables, tables
from study_inputs import minima_by_key, read_one


def main(snakemake):
    """Write the table as CSV and Markdown."""
    params = snakemake.params
    minima = minima_by_key(params.captures, params.errors, snakemake.input.results)
    ours = tables.minimum_table(params.captures, minima)
    published = pd.read_csv(snakemake.input.published)
    material = read_one(snakemake.input.get("material"))
    table = moduli_tables.moduli_table(ours, published, name=params.name, material=material)
    with whole_file(snakemake.output.csv) as csv, whole_file(snakemake.output.md) as md:
        tables.write(tables.rounded(table), csv, md, title=params.title)


run(main, snakemake)
