"""Figure 5.11: the ball's cloud, and the cloud turned about the support's normal."""

from job import run
from palpate.capture.files import whole_file
from palpate.study import style, tracking_figures
from palpate.study.tracking_views import view_from
from tracking_inputs import added_points, last_frames, recordings_of

ELEVATION_DEG = 25


def main(snakemake):
    """Draw the figure."""
    inputs, params = snakemake.input, snakemake.params
    recordings = recordings_of(inputs, params.probes)
    views, clouds = [], []
    files = zip(recordings, inputs.tracked, params.options, last_frames(inputs), strict=True)
    for recorded, path, options, frame in files:
        pose = recorded.alignment.camera_from_object
        views.append(view_from(pose, elevation_deg=ELEVATION_DEG))
        rest, pressed = (added_points(recorded, path, options, k)[:3] for k in (0, frame))
        clouds.append(tracking_figures.TurnedClouds(pressed[0], rest, pressed))
    with style.journal():
        figure = tracking_figures.figure_5_11(params.captures, views, clouds)
        with whole_file(snakemake.output.png) as png, whole_file(snakemake.output.svg) as svg:
            style.save(figure, png, svg)


run(main, snakemake)
