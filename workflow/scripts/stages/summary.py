"""Summary: one row for each object, sensor, capture and method."""

from io import StringIO

import pandas as pd
from palpate.report import hertz_tables, outputs, table_page, tables
from palpate.report import moduli_table as direct_tables
from palpate.report.curve_rows import curve_rows
from palpate.run.job import run
from palpate.run.read_files import minima_by_key, read_all


def main(snakemake):
    """Write summary.csv."""
    params = snakemake.params
    hertz = hertz_tables.hertz_table(params.captures, read_all(snakemake.input.fits))
    minima = minima_by_key(params.minimised, params.errors, snakemake.input.results)
    searched = [
        table(params.minimised, minima)
        for table in (tables.minimum_table, tables.least_squares_table)
    ]
    direct = direct_tables.direct_rows(
        params.estimated,
        read_all(snakemake.input.direct),
        params.groups,
        read_all(snakemake.input.joint),
    )
    curves = curve_rows(params.curves, read_all(snakemake.input.curves))
    whole = tables.rounded(tables.summary(hertz, *searched, direct, curves))
    made = {"csv": whole}
    if "page" in snakemake.output.keys():
        made["page"] = table_page.page(as_markdown(whole), title="summary")
    outputs.write(made, snakemake.output)


def as_markdown(whole):
    """The table as people read it, of the texts that the CSV has."""
    read = pd.read_csv(StringIO(whole.to_csv(index=False)), dtype=str, keep_default_na=False)
    notes = [tables.SIMULATED_NOTE] if (read["provenance"] == "simulated").any() else []
    return tables.to_markdown(read, title="Summary", notes=notes)


run(main, snakemake)
