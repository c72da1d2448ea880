"""Summary of all objects, each run on its own."""

import pandas as pd
from palpate.capture.files import whole_file
from palpate.run.job import naming, run


def main(snakemake):
    """Write the rows of all objects' summary.csv, in the objects' order, as texts."""
    tables = []
    for path in snakemake.input.summaries:
        with naming(path):
            table = pd.read_csv(path, dtype=str, keep_default_na=False)
            if tables and list(table.columns) != list(tables[0].columns):
                raise ValueError(
                    f"columns: expected {', '.join(tables[0].columns)},"
                    f" found {', '.join(table.columns)}"
                )
        tables.append(table)
    with whole_file(snakemake.output.csv) as part:
        pd.concat(tables).to_csv(part, index=False, lineterminator="\n")


run(main, snakemake)
