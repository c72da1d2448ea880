"""Table 5.2: reduced modulus from the Hertz fit at the block's points."""

import pandas as pd
from job import run
from palpate.capture.files import whole_file
from palpate.study import hertz_tables, tables
from study_inputs import read_all

TITLE = "Table 5.2: reduced modulus E* from the Hertz fit (Pa)"
HOMOGENEOUS_NOTE = (
    "The virtual lab's block is homogeneous, and its edges make it at most 1 to 2 % softer: the"
    " published pattern of stiff centre and soft border cannot come from simulated captures."
)


def main(snakemake):
    """Write the table as CSV and Markdown, and its correlation with the published one."""
    params, output = snakemake.params, snakemake.output
    hertz = hertz_tables.hertz_table(params.captures, read_all(snakemake.input.fits))
    published = pd.read_csv(snakemake.input.published)
    table = tables.rounded(hertz_tables.table_5_2(hertz, published, block=params.block))
    pattern = hertz_tables.pattern_correlation(table)
    with (
        whole_file(output.csv) as csv,
        whole_file(output.md) as md,
        whole_file(output.pattern) as part,
    ):
        tables.write(table, csv, md, title=TITLE, more_notes=notes(table, pattern))
        pattern.to_csv(part, index=False, lineterminator="\n")


def notes(table, pattern):
    """Say how far the pattern agrees with the published one, and why it need not."""
    found = pattern.dropna(subset=["pearson"])
    said = [
        f"{row.modulus}, {row.sensor}: {row.pearson:.2f} ({row.points} points)"
        for row in found.itertuples()
    ]
    lines = [f"Correlation with the published values: {'; '.join(said)}."] if said else []
    simulated = (table["provenance"] == "simulated").any()
    return lines + [HOMOGENEOUS_NOTE] * bool(simulated)


run(main, snakemake)
