"""Rows of each object, sensor, capture and method."""

from palpate.json_fields import minima_by_key, read_all
from palpate.report import hertz_tables, outputs, tables
from palpate.report import moduli_table as direct_tables
from palpate.report.curve_rows import curve_rows
from palpate.workflow.job import run


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
    made = {"csv": tables.rounded(tables.summary(hertz, *searched, direct, curves))}
    if "origin" in snakemake.output.keys():
        made["origin"] = f"{params.origin}\n"
    outputs.write(made, snakemake.output)


run(main, snakemake)
