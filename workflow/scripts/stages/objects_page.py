"""The tracked objects in three dimensions."""

from pathlib import Path

from palpate.capture.files import whole_file
from palpate.report import objects_page
from palpate.run.job import naming, run
from palpate.run.read_files import minima_by_key, read_all
from palpate.surface.tracked import load_tracked
from plotly.offline import get_plotlyjs


def main(snakemake):
    """Write the page."""
    inputs, params = snakemake.input, snakemake.params
    known = [capture for capture in params.captures if capture in params.minimised]
    minima = minima_by_key(known, params.errors, inputs.minima)
    views = []
    for capture, tracked, fit in zip(
        params.captures, inputs.tracked, read_all(inputs.fits), strict=True
    ):
        key = tuple(capture[name] for name in ("object", "sensor", "capture"))
        by_error = {error: minima[*key, error] for error in params.errors * (capture in known)}
        with naming(tracked):
            shown = objects_page.Shown(capture, load_tracked(tracked), fit, by_error)
            views.append(objects_page.view(shown))
    text = objects_page.page(
        Path(inputs.page).read_text(encoding="utf-8"),
        behaviour=Path(inputs.behaviour).read_text(encoding="utf-8"),
        plotly=get_plotlyjs(),
        views=views,
        tracker=params.tracker,
    )
    with whole_file(snakemake.output.page) as part:
        part.write_text(text, encoding="utf-8")


run(main, snakemake)
