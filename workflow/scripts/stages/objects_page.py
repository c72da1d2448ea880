"""All objects beside one another, and tracked surfaces in three dimensions."""

import pandas as pd
from palpate.capture.files import write_text
from palpate.json_fields import minima_by_key, read_all
from palpate.report.objects_page import moduli_of, objects_page
from palpate.report.viewer import view
from palpate.surface.tracked import load_tracked
from palpate.workflow.job import naming, run


def main(snakemake):
    """Write the page."""
    inputs, params = snakemake.input, snakemake.params
    known = [capture for capture in params.captures if capture in params.minimised]
    minima = minima_by_key(known, params.errors, inputs.minima)
    with naming(inputs.summary):
        summary = pd.read_csv(inputs.summary, dtype={"capture": str, "point": str})
        rows = summary[summary["recommended"]].to_dict("records")
    advised = {(row["object"], row["sensor"]): row for row in rows}
    views, moduli = [], []
    shown = params.captures, inputs.tracked, read_all(inputs.fits)
    for capture, tracked, fit in zip(*shown, strict=True):
        key = tuple(capture[name] for name in ("object", "sensor", "capture"))
        by_error = {error: minima[*key, error] for error in params.errors * (capture in known)}
        with naming(tracked):
            views.append(view(capture, load_tracked(tracked), fit))
            moduli.append(moduli_of(fit, by_error, advised.get(key[:2])))
    beside = {"views": views, "moduli": moduli, "tracker": params.tracker}
    write_text(snakemake.output.page, objects_page(rows, pages=params.pages, **beside))


run(main, snakemake)
