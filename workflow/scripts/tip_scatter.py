"""Scatter of a resting tip at the points of the workspace (Section 4.2.3)."""

from pathlib import Path

import pandas as pd
from frames import REFERENCE_STREAM
from job import run
from palpate.capture.images import read_image
from palpate.capture.tables import read_frames, read_table, write_table
from palpate.study.fidelity import tip_scatter
from palpate.vision.camera import camera_from_spec


def main(snakemake):
    """Write one row a point."""
    folder, sensor = Path(snakemake.input.workspace), snakemake.params.sensor
    stream = REFERENCE_STREAM[sensor["kind"]]
    rows = []
    for point in read_table(folder / "grid.csv").itertuples():
        place = folder / f"{int(point.point):02d}"
        files = read_frames(place)[stream]
        images = (read_image(place / str(file), "mono8") for file in files)
        found = tip_scatter(
            images,
            camera_from_spec(sensor["color"]),
            snakemake.params.probe,
            threshold_px=sensor["marker"]["reprojection_threshold_px"],
        )
        rows.append({"point": point.point, "row": point.row, "column": point.column} | found)
    write_table(snakemake.output.scatter, pd.DataFrame(rows))


run(main, snakemake)
