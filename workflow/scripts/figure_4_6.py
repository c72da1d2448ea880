"""Figure 4.6: force and displacement against time while loading and holding."""

import pandas as pd
from job import run
from palpate.capture.files import whole_file
from palpate.study import style
from palpate.study.probe_figures import figure_4_6


def main(snakemake):
    """Draw the figure."""
    source, params, output = snakemake.input, snakemake.params, snakemake.output
    frames, forces = (
        {name: pd.read_csv(path) for name, path in zip(params.names, paths, strict=True)}
        for paths in (source.frames, source.forces)
    )
    with style.journal(), whole_file(output.png) as png, whole_file(output.svg) as svg:
        figure = figure_4_6(frames, forces, set(params.provenance.values()))
        style.save(figure, png, svg)


run(main, snakemake)
