"""Figure 5.7: the dent tracked without and with refined triangles at the contact."""

from job import run
from palpate.capture.files import whole_file
from palpate.study import style, tracking_figures
from palpate.surface.pose import to_object
from tracking_inputs import last_frames, recordings_of, surface_of


def main(snakemake):
    """Draw the figure."""
    inputs, params = snakemake.input, snakemake.params
    recorded, frame = recordings_of(inputs, params.probes)[0], last_frames(inputs)[0]
    pair = [surface_of(path, frame) for path in (inputs.unrefined[0], inputs.tracked[0])]
    cloud = to_object(recorded.alignment.camera_from_object, recorded.clouds[frame][0])
    with style.journal():
        figure = tracking_figures.figure_5_7(params.captures[0], *pair, cloud)
        with whole_file(snakemake.output.png) as png, whole_file(snakemake.output.svg) as svg:
            style.save(figure, png, svg)


run(main, snakemake)
