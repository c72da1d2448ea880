"""The tracked objects in three dimensions."""

from pathlib import Path

import pandas as pd
from palpate.capture.files import write_text
from palpate.json_fields import minima_by_key, read_all
from palpate.report import objects_page, objects_table
from palpate.surface.tracked import load_tracked
from palpate.workflow.job import naming, run
from plotly.offline import get_plotlyjs


def main(snakemake):
    """Write the page."""
    inputs, params = snakemake.input, snakemake.params
    known = [capture for capture in params.captures if capture in params.minimised]
    minima = minima_by_key(known, params.errors, inputs.minima)
    with naming(inputs.summary):
        summary = pd.read_csv(inputs.summary, dtype={"capture": str, "point": str})
        rows = summary[summary["recommended"]].to_dict("records")
    advised = {(row["object"], row["sensor"]): row for row in rows}
    views = []
    shown = params.captures, inputs.tracked, read_all(inputs.fits)
    for capture, tracked, fit in zip(*shown, strict=True):
        key = tuple(capture[name] for name in ("object", "sensor", "capture"))
        by_error = {error: minima[*key, error] for error in params.errors * (capture in known)}
        with naming(tracked):
            found = load_tracked(tracked), fit, by_error, advised.get(key[:2])
            views.append(objects_page.view(objects_page.Shown(capture, *found)))
    text = objects_page.page(
        Path(inputs.page).read_text(encoding="utf-8"),
        behaviour=Path(inputs.behaviour).read_text(encoding="utf-8"),
        plotly=get_plotlyjs(),
        views=views,
        tracker=params.tracker,
        estimates=objects_table.section(rows, params.pages),
    )
    write_text(snakemake.output.page, text)


run(main, snakemake)
