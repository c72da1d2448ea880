"""Table and figure of the steps of the error minimisation against the lab's truth."""

from pathlib import Path

from job import run
from palpate.capture.files import whole_file
from palpate.study import minimise_steps, steps_figure, style, tables
from study_inputs import read_all

TITLE = "The study's error minimisation, one change after the other"
NOTES = (
    "Medians over the captures of an object. The force is that of a material that relaxes while it"
    " is pressed: youngs_modulus_ratio is E over the instantaneous truth, relaxed_modulus_ratio"
    " over that a second after a step of strain."
    " The surfaces of the elastic tracker carry its own Poisson's ratio, tracking.trackers of"
    " config.yaml, the block's own: nu found on them is mostly that prior, as the ear shows, and is"
    " not judged.",
)


def main(snakemake):
    """Write all rows as CSV, their medians as Markdown, and draw the displacement's."""
    output, materials = snakemake.output, snakemake.input.materials
    names = [Path(path).parent.name for path in materials]
    truth = dict(zip(names, read_all(materials), strict=True))
    whole = minimise_steps.steps_table(
        snakemake.params.captures, read_all(snakemake.input.results), truth
    )
    short = minimise_steps.steps_summary(whole)
    with style.journal():
        figure = steps_figure.minimise_steps(whole, snakemake.params.shown)
        with whole_file(output.png) as png, whole_file(output.svg) as svg:
            style.save(figure, png, svg)
    notes = [*NOTES, tables.SIMULATED_NOTE]
    text = tables.to_markdown(tables.rounded(short), title=TITLE, notes=notes)
    with whole_file(output.csv) as csv, whole_file(output.md) as md:
        tables.rounded(whole).to_csv(csv, index=False, lineterminator="\n")
        md.write_text(text, encoding="utf-8")


run(main, snakemake)
