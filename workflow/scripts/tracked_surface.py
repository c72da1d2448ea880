"""The tracked surface of one capture per sensor, and a section through its dent."""

import numpy as np
from frames import Stream
from job import run
from palpate.capture.files import whole_file
from palpate.study import style, surface_figures
from palpate.surface.pose import to_object
from palpate.surface.tracked import load_tracked
from palpate.vision.clouds import unpack_clouds
from study_inputs import read_all


def main(snakemake):
    """Draw the figure."""
    inputs = snakemake.input
    views = [
        view_of(*files)
        for files in zip(
            inputs.tracked,
            inputs.clouds,
            read_all(inputs.fits),
            inputs.recorded,
            snakemake.params.sensors,
            strict=True,
        )
    ]
    with style.journal():
        figure = surface_figures.tracked_surface(snakemake.params.captures, views)
        with whole_file(snakemake.output.png) as png, whole_file(snakemake.output.svg) as svg:
            style.save(figure, png, svg)


def view_of(tracked, clouds, fit, recorded, sensor):
    """Read the most deformed frame of one capture."""
    surface, frame = load_tracked(tracked), fit["range"]["last_frame"]
    pose = surface.camera_from_object
    with np.load(clouds, allow_pickle=False) as data:
        cloud = unpack_clouds(data)[frame].points_m
    return surface_figures.TrackedView(
        surface.template_m,
        to_object(pose, surface.vertices_m[frame]),
        surface.faces,
        to_object(pose, cloud),
        surface.contact_point_m,
        Stream(recorded, sensor)[frame],
    )


run(main, snakemake)
