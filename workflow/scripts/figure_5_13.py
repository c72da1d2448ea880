"""Figure 5.13: the ball tracked from one view and from turned clouds."""

from job import run
from palpate.capture.files import whole_file
from palpate.study import style, tracking_figures
from palpate.study.tracking_views import view_from
from palpate.surface.alignment import load_alignment
from tracking_inputs import last_frames, surface_of

ELEVATION_DEG = 10


def main(snakemake):
    """Draw the figure."""
    inputs, params = snakemake.input, snakemake.params
    poses = [load_alignment(path).camera_from_object for path in inputs.alignment]
    views = [view_from(pose, elevation_deg=ELEVATION_DEG) for pose in poses]
    files = zip(inputs.single_view, inputs.tracked, last_frames(inputs), strict=True)
    pairs = [(surface_of(one, k), surface_of(turned, k)) for one, turned, k in files]
    with style.journal():
        figure = tracking_figures.figure_5_13(params.captures, views, pairs)
        with whole_file(snakemake.output.png) as png, whole_file(snakemake.output.svg) as svg:
            style.save(figure, png, svg)


run(main, snakemake)
