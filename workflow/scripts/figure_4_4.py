"""Figure 4.4: plane fitted to a vertex and its neighbours."""

import json
from pathlib import Path

from job import run
from palpate.capture.files import whole_file
from palpate.study import normal_figure, style
from palpate.vision.clouds import read_clouds


def main(snakemake):
    """Draw the figure, of each capture's last frame."""
    params, inputs = snakemake.params, snakemake.input
    planes = [
        normal_figure.pressed_plane(
            read_clouds(clouds)[-1],
            json.loads(Path(alignment).read_text(encoding="utf-8")),
            neighbours=params.neighbours,
        )
        for clouds, alignment in zip(inputs.clouds, inputs.alignments, strict=True)
    ]
    with style.journal():
        figure = normal_figure.figure_4_4(params.captures, planes)
        with whole_file(snakemake.output.png) as png, whole_file(snakemake.output.svg) as svg:
            style.save(figure, png, svg)


run(main, snakemake)
