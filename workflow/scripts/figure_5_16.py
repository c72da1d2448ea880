"""Figure 5.16: the ear's picture, cloud and tracked surface."""

from job import run
from palpate.capture.files import whole_file
from palpate.study import style, tracking_figures
from palpate.study.tracking_views import view_from
from palpate.surface.pose import to_object
from tracking_inputs import last_frames, photos_of, recordings_of, surface_of


def main(snakemake):
    """Draw the figure of the first sensor that recorded the ear."""
    inputs, params = snakemake.input, snakemake.params
    recordings, frames = recordings_of(inputs, params.probes), last_frames(inputs)
    pose, frame = recordings[0].alignment.camera_from_object, frames[0]
    photo = photos_of(inputs, params.sensors, recordings, frames)[0]
    cloud = to_object(pose, recordings[0].clouds[frame][0])
    surface = surface_of(inputs.tracked[0], frame)
    with style.journal():
        figure = tracking_figures.figure_5_16(
            params.captures[0], photo, view_from(pose), cloud, surface
        )
        with whole_file(snakemake.output.png) as png, whole_file(snakemake.output.svg) as svg:
            style.save(figure, png, svg)


run(main, snakemake)
