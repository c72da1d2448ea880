"""Tables of the run, its summary and its configuration as pages of the report."""

from pathlib import Path

import pandas as pd
from job import run
from palpate.capture.files import whole_file
from palpate.study import table_page
from palpate.study.tables import SIMULATED_NOTE, to_markdown


def main(snakemake):
    """Write a page for each table."""
    inputs, outputs = snakemake.input, snakemake.output
    for source, target in zip([*inputs.md, inputs.configuration], pages_of(outputs), strict=True):
        write(Path(source).read_text(encoding="utf-8"), target)
    summary = pd.read_csv(inputs.summary, dtype=str, keep_default_na=False)
    notes = [SIMULATED_NOTE] if (summary["provenance"] == "simulated").any() else []
    write(to_markdown(summary, title="Summary", notes=notes), outputs.summary)


def pages_of(outputs):
    """Pages in the order of the files they are made from."""
    return [*outputs.tables, outputs.configuration]


def write(markdown, target):
    """Write one page."""
    with whole_file(target) as part:
        part.write_text(table_page.page(markdown, title=Path(target).stem), encoding="utf-8")


run(main, snakemake)
