"""Summary of all objects, of the summary of each."""

from io import StringIO

import pandas as pd
from palpate.report import outputs, pages, tables
from palpate.report.objects_page import overview
from palpate.workflow.job import naming, run


def main(snakemake):
    """Write the rows of all objects' summary.csv, in the objects' order, as texts."""
    found = []
    for path in snakemake.input.summaries:
        with naming(path):
            table = pd.read_csv(path, dtype=str, keep_default_na=False)
            if found and list(table.columns) != list(found[0].columns):
                raise ValueError(
                    f"columns: expected {', '.join(found[0].columns)},"
                    f" found {', '.join(table.columns)}"
                )
        found.append(table)
    whole = pd.concat(found, ignore_index=True)
    text = tables.markdown(whole, title="Summary")
    numbers = pd.read_csv(StringIO(whole.to_csv(index=False)), dtype={"capture": str})
    made = {"csv": whole, "page": pages.page(text, title="summary")}
    made["overview"] = overview(numbers[numbers["recommended"]], snakemake.params.pages)
    outputs.write(made, snakemake.output)


run(main, snakemake)
