"""Figure 5.5: the foam block's picture, cloud with added points and tracked surface."""

from job import run
from palpate.capture.files import whole_file
from palpate.study import style, tracking_figures
from tracking_inputs import added_points, last_frames, photos_of, recordings_of, surface_of


def main(snakemake):
    """Draw the figure."""
    inputs, params = snakemake.input, snakemake.params
    recordings, frames = recordings_of(inputs, params.probes), last_frames(inputs)
    surfaces = [surface_of(*pair) for pair in zip(inputs.tracked, frames, strict=True)]
    files = zip(recordings, inputs.tracked, params.options, frames, strict=True)
    clouds = []
    for captured, _, still, pressed in (added_points(*each) for each in files):
        clouds.append(tracking_figures.AddedCloud(captured, still, pressed))
    photos = photos_of(inputs, params.sensors, recordings, frames)
    with style.journal():
        figure = tracking_figures.figure_5_5(params.captures, photos, clouds, surfaces)
        with whole_file(snakemake.output.png) as png, whole_file(snakemake.output.svg) as svg:
            style.save(figure, png, svg)


run(main, snakemake)
