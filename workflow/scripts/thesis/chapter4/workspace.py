"""Error of the probe's tip over the workspace (Section 4.2.3): Table 4.2 and what leads to it."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from palpate.capture.images import read_image
from palpate.capture.tables import STREAMS, read_frames, read_table
from palpate.report import outputs
from palpate.units import CENTIMETRES
from palpate.vision.board import FlatBoard
from palpate.vision.camera import PinholeCamera, camera_from_spec, sensor_with_optics
from palpate.vision.marker import CornerFollower, board_of
from palpate.vision.photometric import BoardRefiner
from palpate.vision.pose import (
    CORNERS,
    REFINED,
    MarkerPose,
    averages,
    candidate_poses,
    select_threshold,
    settle,
)
from palpate.vision.probe import board_poses, marker_from_tip

# Section 4.2.3: 0.05 to 0.6 pixels in steps of 0.05.
THRESHOLDS_PX = tuple(round(0.05 * k, 2) for k in range(1, 13))
AXES = ("x", "y", "z")
# Columns of the grid's file that name a point.
PLACE = ("point", "row", "column", "x_m", "y_m")


def by_sensor(names: Sequence[str], paths: Sequence[str], read: Callable = pd.read_csv) -> dict:
    """Read a file of each sensor, a table by default."""
    return {name: read(path) for name, path in zip(names, paths, strict=True)}


def make_workspace_error(inputs: Any, params: Any) -> dict:
    """One row for each point and method of tracking."""
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
    """Rows of one point: at each threshold, and refined on the target's picture."""
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
    row = point_row([pose if pose and pose.refined else None for pose in poses], fixed)
    return [*found, {"method": REFINED} | row]


def point_row(
    poses: Sequence[MarkerPose | None], marker_from_tip: NDArray
) -> dict[str, float | int]:
    """What the frames of one grid point say of a resting tip.

    Parameters
    ----------
    poses : sequence of MarkerPose or None
        One for each frame.
    marker_from_tip : (4, 4) array
        Fixed part of the chain of Eq. 4.20.

    Returns
    -------
    dict
        ``frames, found``, the tip's farthest place from its mean, mean and standard deviation of
        the tip in the camera frame [m], standard
        deviation of the angle between the target's normal and the camera's axis [rad], mean number
        of inliers, and mean reprojection error, the sum of squares of Eq. 4.10 [px^2].
    """
    seen = [pose for pose in poses if pose is not None]
    row = {"frames": len(poses), "found": len(seen)}
    if not seen:
        return row
    transforms = np.stack([pose.camera_from_marker for pose in seen])
    tips = (transforms @ marker_from_tip)[:, :3, 3]
    angles = np.arccos(np.clip(np.abs(transforms[:, 2, 2]), 0, 1))
    away = np.linalg.norm(tips - tips.mean(axis=0), axis=1)
    row["farthest_m"] = away.max()
    for k, axis in enumerate(AXES):
        row |= {f"mean_{axis}_m": tips[:, k].mean(), f"std_{axis}_m": tips[:, k].std()}
    square = [pose.inliers * pose.reprojection_error_px**2 for pose in seen]
    return row | {
        "std_angle_rad": angles.std(),
        "inliers": np.mean([pose.inliers for pose in seen]),
        "reprojection_error_px2": np.mean(square),
    }


def threshold_rows(
    corners_px: Sequence[NDArray | None],
    camera: PinholeCamera,
    board: FlatBoard,
    marker_from_tip: NDArray,
) -> list[dict]:
    """Rows of one grid point, one for each reprojection threshold (Eq. 4.22).

    Parameters
    ----------
    corners_px : sequence of (n, 2) arrays or None
        Corners in each frame, None where the target was not seen.
    """
    found = [
        [[]] * len(THRESHOLDS_PX)
        if corners is None
        else [candidate_poses(corners, camera, board, threshold_px=t) for t in THRESHOLDS_PX]
        for corners in corners_px
    ]
    rows = []
    for k, threshold_px in enumerate(THRESHOLDS_PX):
        poses = settle([candidates[k] for candidates in found])
        row = {"method": CORNERS, "threshold_px": threshold_px}
        rows.append(row | point_row(poses, marker_from_tip))
    return rows


def make_table_4_2(inputs: Any, params: Any) -> pd.DataFrame:
    """Table 4.2, with the threshold of each sensor's file."""
    used_px = {
        name: params.sensors[name]["marker"]["reprojection_threshold_px"] for name in params.names
    }
    found = by_sensor(params.names, inputs.tables)
    table = table_4_2(found, used_px, pd.read_csv(inputs.published))
    return table.assign(provenance=table["sensor"].map(params.provenance))


def table_4_2(
    tables: dict[str, pd.DataFrame], used_px: dict[str, float], published: pd.DataFrame
) -> pd.DataFrame:
    """Mean standard deviation of the resting tip at the selected threshold, beside Table 4.2.

    Parameters
    ----------
    tables : dict
        Sensor to its rows of all points.
    used_px : dict
        Sensor to the threshold that its file states.
    published : DataFrame
        config/published/table_4_2.csv.

    Returns
    -------
    DataFrame
        A row for each sensor and axis [cm]; ``refined_std_cm`` is the same after the refinement
        on the target's picture.
    """
    printed, rows = published.set_index("axis"), []
    for sensor, table in sorted(tables.items()):
        selected = select_threshold(table)
        at = averages(table).loc[selected]
        refined = table[table["method"] == REFINED]
        for axis in AXES:
            name, column = f"std_{axis}_m", f"{sensor}_cm"
            known = printed.loc[axis, column] if column in printed else np.nan
            rows.append(
                {
                    "sensor": sensor,
                    "axis": axis,
                    "std_cm": round(float(at[name]) * CENTIMETRES, 5),
                    "refined_std_cm": round(float(refined[name].mean()) * CENTIMETRES, 5),
                    "published_std_cm": known,
                    "selected_threshold_px": selected,
                    "sensor_file_threshold_px": used_px[sensor],
                    "points": int(refined["point"].nunique()),
                }
            )
    return pd.DataFrame(rows)
