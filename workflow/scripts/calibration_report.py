"""Table 4.1, Equation 4.12, Figures 4.9 and 4.10."""

from pathlib import Path

import pandas as pd
from job import run
from palpate.capture.files import whole_file
from palpate.capture.images import read_image
from palpate.capture.tables import read_frames
from palpate.study import calibration, style, tables
from study_inputs import read_all


def main(snakemake):
    """Write the tables and draw the figures."""
    source, output = snakemake.input, snakemake.output
    (result,) = read_all(source.calibration)
    table = calibration.table_4_1(result, pd.read_csv(source.table_4_1))
    title = "Table 4.1: focal lengths and principal points (px)"
    with whole_file(output.table_csv) as csv, whole_file(output.table_md) as md:
        tables.write(table, csv, md, title=title)
    equation = calibration.equation_4_12(result, pd.read_csv(source.equation_4_12))
    title = "Equation 4.12: transform from the infrared to the colour camera"
    with whole_file(output.equation_csv) as csv, whole_file(output.equation_md) as md:
        tables.write(equation, csv, md, title=title)
    view = sorted(result["pair_errors_px"])[0]
    folder, frames = Path(source.pairs[0]), read_frames(source.pairs[0])
    images = {
        stream: read_image(folder / str(frames[stream].iloc[int(view)]), "mono8")
        for stream in ("infrared", "color")
    }
    with style.journal():
        figures = {
            "4_9": calibration.figure_4_9(result, images, view),
            "4_10": calibration.figure_4_10(result),
        }
        for name, figure in figures.items():
            png, svg = output[f"figure_{name}_png"], output[f"figure_{name}_svg"]
            with whole_file(png) as whole_png, whole_file(svg) as whole_svg:
                style.save(figure, whole_png, whole_svg)


run(main, snakemake)
