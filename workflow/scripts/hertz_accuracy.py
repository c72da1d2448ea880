"""Hertz models of all simulated captures against the lab's true reduced modulus."""

from pathlib import Path

from job import run
from palpate.capture.files import whole_file
from palpate.study import hertz_tables, tables
from study_inputs import read_all

TITLE = "Hertz models against the virtual lab's truth"
NOTES = (
    "The truth of median_ratio and of the intervals is the instantaneous E*, that of the later"
    " columns E* the time later_s after a step (hertz.relaxation.at_s)."
    " The material relaxes while it is pressed: models with relaxation prony allow for it and for"
    " finite strain, and their intervals hold the stated errors of depth, force and contact law;"
    " prony leaves Poisson's ratio open, prony_assumed_nu takes hertz.assumed_poisson_ratio for it."
    " Intervals of the others cover scatter and the stated error of the depth alone."
    " The study's fit is the parabola on a half-space with known contact.",
)


def main(snakemake):
    """Write all rows as CSV, those of each sensor and model as CSV and Markdown."""
    params, output = snakemake.params, snakemake.output
    names = [Path(path).parent.name for path in snakemake.input.materials]
    materials = dict(zip(names, read_all(snakemake.input.materials), strict=True))
    fits = read_all(snakemake.input.fits)
    whole = hertz_tables.accuracy_table(params.captures, fits, materials)
    short = hertz_tables.accuracy_summary(whole)
    with (
        whole_file(output.csv) as csv,
        whole_file(output.summary) as summary,
        whole_file(output.md) as md,
    ):
        tables.rounded(whole).to_csv(csv, index=False, lineterminator="\n")
        tables.write(short, summary, md, title=TITLE, more_notes=NOTES)


run(main, snakemake)
