"""Figures 5.15 and 5.18: mismatch on an object that is seen from two sides."""

from job import run
from mismatch_inputs import mismatch_of
from palpate.capture.files import whole_file
from palpate.study import mismatch_views, style
from palpate.study.tracking_views import view_from
from palpate.surface.tracked import load_tracked


def main(snakemake):
    """Draw the figure."""
    inputs, params = snakemake.input, snakemake.params
    shown = [mismatch_of(*pair) for pair in zip(inputs.mismatches, inputs.tracked, strict=True)]
    poses = [load_tracked(path).camera_from_object for path in inputs.tracked]
    views = [view_from(pose, elevation_deg=params.elevation_deg) for pose in poses]
    with style.journal():
        figure = mismatch_views.mismatch_views(params.captures, shown, views)
        with whole_file(snakemake.output.png) as png, whole_file(snakemake.output.svg) as svg:
            style.save(figure, png, svg)


run(main, snakemake)
