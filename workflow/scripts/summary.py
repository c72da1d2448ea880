"""Summary: one row for each object, sensor, capture and method."""

from job import run
from palpate.capture.files import whole_file
from palpate.study import direct_tables, hertz_tables, tables
from study_inputs import minima_by_key, read_all


def main(snakemake):
    """Write summary.csv."""
    params = snakemake.params
    hertz = hertz_tables.hertz_table(params.captures, read_all(snakemake.input.fits))
    minima = minima_by_key(params.tracked, params.errors, snakemake.input.results)
    searched = [
        table(params.tracked, minima)
        for table in (tables.minimum_table, tables.least_squares_table)
    ]
    direct = direct_tables.direct_rows(
        params.estimated,
        read_all(snakemake.input.direct),
        params.groups,
        read_all(snakemake.input.joint),
    )
    whole = tables.summary(hertz, *searched, direct)
    with whole_file(snakemake.output.csv) as part:
        tables.rounded(whole).to_csv(part, index=False, lineterminator="\n")


run(main, snakemake)
