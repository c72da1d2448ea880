"""Figure 5.1: the grid of sample points on the foam block."""

import json
from pathlib import Path

import numpy as np
from frames import Stream, sensor_of
from job import run
from palpate.capture.files import whole_file
from palpate.capture.schema import load_yaml
from palpate.study import hertz_maps, style
from palpate.surface.pose import to_camera
from palpate.surface.template import read_template
from palpate.vision.camera import camera_from_spec


def main(snakemake):
    """Project the declared points into the capture's first frame and draw the figure."""
    inputs, params = snakemake.input, snakemake.params
    declared = load_yaml(inputs.object)
    points = {
        name: np.array(declared["points"][name]["position_m"], dtype=float)
        for name in sorted(declared["points"])
    }
    alignment = json.loads(Path(inputs.alignment).read_text(encoding="utf-8"))
    camera = camera_from_spec(sensor_of(snakemake)["color"])
    places = to_camera(np.array(alignment["camera_from_object"]), np.array(list(points.values())))
    vertices = read_template(inputs.template, unit=declared["template"]["unit"]).vertices_m[:, :2]
    with style.journal():
        figure = hertz_maps.figure_5_1(
            Stream(inputs.recorded, params.sensor)[0],
            camera.project(places),
            points,
            np.array([vertices.min(axis=0), vertices.max(axis=0)]),
            capture=params.capture,
        )
        with whole_file(snakemake.output.png) as png, whole_file(snakemake.output.svg) as svg:
            style.save(figure, png, svg)


run(main, snakemake)
