"""Deviation of a resting tip at the points of the workspace (Section 4.2.3)."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pandas as pd
from numpy.typing import NDArray
from palpate.capture.images import read_image
from palpate.capture.tables import STREAMS, read_frames, read_table
from palpate.report import outputs
from palpate.vision.camera import camera_from_spec, sensor_with_optics
from palpate.vision.marker import CornerFollower, board_of
from palpate.vision.photometric import BoardRefiner
from palpate.vision.pose import REFINED
from palpate.vision.probe import board_poses, marker_from_tip

from thesis.chapter4.workspace import point_row, threshold_rows

# Columns of the grid's file that name a point.
PLACE = ("point", "row", "column", "x_m", "y_m")


def make_workspace_error(inputs: Any, params: Any) -> dict:
    """One row for each point and way of tracking."""
    folder, sensor = Path(inputs.workspace), sensor_with_optics(params.sensor, inputs.optics)
    board = board_of(params.probe["marker"])
    refine = BoardRefiner(camera_from_spec(sensor["color"]), board, encoding="mono8")
    rows = []
    for point in read_table(folder / "grid.csv").itertuples():
        images = point_images(folder / f"{int(point.point):02d}", sensor)
        known = {name: getattr(point, name) for name in PLACE}
        rows += [known | part for part in tip_rows(images, sensor, params.probe, refine)]
    if not any(row["found"] for row in rows):
        raise ValueError(
            f"workspace: expected the marker in its frames, found it in none of {folder}"
        )
    return {"table": outputs.exact(pd.DataFrame(rows))}


def point_images(folder: Path, sensor: Mapping) -> list[NDArray]:
    """Grey images of the reference camera at one point."""
    stream = STREAMS[sensor["kind"]][0]
    return [read_image(folder / str(name), "mono8") for name in read_frames(folder)[stream]]


def tip_rows(
    images: Sequence[NDArray], sensor: Mapping, probe: Mapping, refine: BoardRefiner
) -> list[dict]:
    """Rows of one point: at each threshold, and refined on the board's picture."""
    camera, board = camera_from_spec(sensor["color"]), board_of(probe["marker"])
    follow, fixed = CornerFollower(board), marker_from_tip(probe)
    corners = [follow(image) for image in images]
    found = threshold_rows(corners, camera, board, fixed)
    poses = board_poses(
        zip(corners, images, strict=True),
        camera,
        board,
        threshold_px=sensor["marker"]["reprojection_threshold_px"],
        refine=refine,
    )
    row = point_row([pose if done else None for pose, done in poses], fixed)
    return [*found, {"method": REFINED} | row]
