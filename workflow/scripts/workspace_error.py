"""Deviation of a resting tip at the points of the workspace (Section 4.2.3)."""

from pathlib import Path

import pandas as pd
from frames import REFERENCE_STREAM, sensor_of
from job import run
from palpate.capture.images import read_image
from palpate.capture.tables import read_frames, read_table, write_table
from palpate.study.workspace import REFINED, point_row, threshold_rows
from palpate.vision.camera import camera_from_spec
from palpate.vision.marker import CornerFollower
from palpate.vision.photometric import BoardRefiner
from palpate.vision.probe import board_poses, marker_from_tip


def main(snakemake):
    """Write one row for each point and way of tracking."""
    folder, sensor = Path(snakemake.input.workspace), sensor_of(snakemake)
    camera, probe = camera_from_spec(sensor["color"]), snakemake.params.probe
    stream, fixed = REFERENCE_STREAM[sensor["kind"]], marker_from_tip(probe)
    refine = BoardRefiner(camera, probe["marker"], encoding="mono8")
    rows = []
    for point in read_table(folder / "grid.csv").itertuples():
        place = folder / f"{int(point.point):02d}"
        images = [read_image(place / str(f), "mono8") for f in read_frames(place)[stream]]
        follow = CornerFollower(probe["marker"])
        corners = [follow(image) for image in images]
        found = threshold_rows(corners, camera, probe["marker"], fixed)
        poses = board_poses(
            zip(corners, images, strict=True),
            camera,
            probe["marker"],
            threshold_px=sensor["marker"]["reprojection_threshold_px"],
            refine=refine,
        )
        row = point_row([pose if done else None for pose, done in poses], fixed)
        known = {"point": point.point, "row": point.row, "column": point.column}
        known |= {"x_m": point.x_m, "y_m": point.y_m}
        rows += [known | part for part in [*found, {"method": REFINED} | row]]
    if not any(row["found"] for row in rows):
        raise ValueError(
            f"workspace: expected the marker in its frames, found it in none of {folder}"
        )
    write_table(snakemake.output.table, pd.DataFrame(rows))


run(main, snakemake)
