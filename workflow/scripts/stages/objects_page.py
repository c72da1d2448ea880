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
    rows = recommended_rows(inputs.summary)
    advised = {(row["object"], row["sensor"]): row for row in rows}
    views = []
    for capture, tracked, fit in zip(
        params.captures, inputs.tracked, read_all(inputs.fits), strict=True
    ):
        key = tuple(capture[name] for name in ("object", "sensor", "capture"))
        by_error = {error: minima[*key, error] for error in params.errors * (capture in known)}
        with naming(tracked):
            shown = objects_page.Shown(
                capture, load_tracked(tracked), fit, by_error, advised.get(key[:2])
            )
            views.append(objects_page.view(shown))
    text = objects_page.page(
        Path(inputs.page).read_text(encoding="utf-8"),
        behaviour=Path(inputs.behaviour).read_text(encoding="utf-8"),
        plotly=get_plotlyjs(),
        views=views,
        tracker=params.tracker,
        estimates=objects_table.section(rows, params.pages),
    )
    write_text(snakemake.output.page, text)


def recommended_rows(path):
    """Recommended rows: one of each object and sensor, and of each curve."""
    with naming(path):
        table = pd.read_csv(path, dtype={"capture": str, "point": str})
        return table[table["recommended"]].to_dict("records")


run(main, snakemake)
