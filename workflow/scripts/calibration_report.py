"""Table 4.1, Equation 4.12, Figures 4.9 and 4.10: one of them."""

from pathlib import Path

import pandas as pd
from artefact_files import draw, write_table
from job import run
from palpate.capture.images import read_image
from palpate.capture.tables import read_frames
from palpate.study import calibration
from study_inputs import read_all

TITLES = {
    "table_4_1": "Table 4.1: focal lengths and principal points (px)",
    "equation_4_12": "Equation 4.12: transform from the infrared to the colour camera",
}


def main(snakemake):
    """Write the table or draw the figure that the rule is named after."""
    source, output, name = snakemake.input, snakemake.output, snakemake.params.artefact
    (result,) = read_all(source.calibration)
    if name in TITLES:
        table = getattr(calibration, name)(result, pd.read_csv(source.published))
        write_table(output, table, title=TITLES[name])
    elif name == "figure_4_9":
        draw(output, lambda: calibration.figure_4_9(result, *pair_of(source.pairs[0], result)))
    else:
        draw(output, lambda: calibration.figure_4_10(result))


def pair_of(folder, result):
    """First pair of pictures that the calibration used, by stream, and its name."""
    view, frames = sorted(result["pair_errors_px"])[0], read_frames(folder)
    images = {
        stream: read_image(Path(folder) / str(frames[stream].iloc[int(view)]), "mono8")
        for stream in ("infrared", "color")
    }
    return images, view


run(main, snakemake)
