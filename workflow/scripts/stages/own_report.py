"""Page of one object, in one file for a browser."""

from pathlib import Path

import pandas as pd
from palpate.capture.files import whole_file
from palpate.report import table_page
from palpate.report.own_page import CAPTIONS, own_page, press_of
from palpate.run.job import naming, run
from palpate.run.read_files import read_all


def main(snakemake):
    """Write the page."""
    inputs, captures = snakemake.input, snakemake.params.captures
    files = zip(captures, read_all(inputs.fits), read_all(inputs.direct), strict=True)
    presses = [press_of(*of_one) for of_one in files]
    pictures = {name: Path(inputs[name]).read_bytes() for name in CAPTIONS}
    name = snakemake.wildcards.object
    summary = pd.read_csv(inputs.summary, dtype={"capture": str, "point": str})
    joints = zip(snakemake.params.groups, read_all(inputs.joint), strict=True)
    budgets = {group["sensor"]: found["budget"] for group, found in joints}
    with naming(inputs.summary):
        text = own_page(name, summary, presses, pictures, budgets)
    with whole_file(snakemake.output.page) as part:
        part.write_text(table_page.page(text, title=name), encoding="utf-8")


run(main, snakemake)
