"""Rows of each object, sensor, capture and method."""

from palpate.json_fields import minima_by_key, read_all
from palpate.report import outputs, tables
from palpate.report.estimate_rows import curve_rows, direct_rows, hertz_rows, summary
from palpate.workflow.job import run


def main(snakemake):
    """Write summary.csv."""
    inputs, params = snakemake.input, snakemake.params
    minima = minima_by_key(params.minimised, params.errors, inputs.results)
    direct = read_all(inputs.direct), params.groups, read_all(inputs.joint)
    rows = [
        *hertz_rows(params.captures, read_all(inputs.fits)),
        *direct_rows(params.estimated, *direct),
        *curve_rows(params.curves, read_all(inputs.curves)),
    ]
    if minima:  # the study's method
        from thesis.chapter5.moduli_tables import least_squares_rows, minimum_rows

        rows += [*minimum_rows(params.minimised, minima)]
        rows += [*least_squares_rows(params.minimised, minima)]
    made = {"csv": tables.rounded(summary(rows)), "origin": f"{params.origin}\n"}
    outputs.write(made, snakemake.output)


run(main, snakemake)
