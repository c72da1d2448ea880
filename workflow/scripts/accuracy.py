"""E and nu of every method against the lab's true materials."""

from pathlib import Path

import pandas as pd
from job import run
from palpate.capture.files import whole_file
from palpate.study import direct_tables, tables
from study_inputs import read_all

TITLE = "E and nu against the virtual lab's truth"
SHORT_TITLE = "Errors and coverage of the intervals, by object, sensor and method"
NOTES = (
    "true_youngs_modulus_pa is the instantaneous modulus; true_youngs_modulus_1s_pa is what a step"
    " of strain leaves of it after a second, as the material relaxes while it is pressed.",
    "Errors of moduli are relative, those of Poisson's ratio absolute; intervals are at 95 %.",
)


def main(snakemake):
    """Write all rows, and their errors by object, sensor and method."""
    output = snakemake.output
    names = [Path(path).parent.name for path in snakemake.input.materials]
    materials = dict(zip(names, read_all(snakemake.input.materials), strict=True))
    text = {name: str for name in ("capture", "point")}
    rows = pd.read_csv(snakemake.input.summary, dtype=text)
    rows = rows[rows["object"].isin(materials)]
    whole = direct_tables.accuracy_table(rows, materials)
    short = direct_tables.coverage_table(whole)
    with (
        whole_file(output.csv) as csv,
        whole_file(output.md) as md,
        whole_file(output.summary) as summary,
        whole_file(output.summary_md) as summary_md,
    ):
        tables.write(tables.rounded(whole), csv, md, title=TITLE, more_notes=NOTES)
        tables.write(short, summary, summary_md, title=SHORT_TITLE, more_notes=NOTES)


run(main, snakemake)
