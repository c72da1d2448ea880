"""Error of the probe's tip over the workspace (Section 4.2.3): Table 4.2 and what leads to it."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from palpate.units import CENTIMETRES
from palpate.vision.board import FlatBoard
from palpate.vision.camera import PinholeCamera
from palpate.vision.pose import (
    CORNERS,
    REFINED,
    MarkerPose,
    averages,
    candidate_poses,
    select_threshold,
    settle,
)

from thesis import published
from thesis.chapter4.sensor_files import by_sensor

# Section 4.2.3: 0.05 to 0.6 pixels in steps of 0.05.
THRESHOLDS_PX = tuple(round(0.05 * k, 2) for k in range(1, 13))
AXES = ("x", "y", "z")
TITLE = "Table 4.2: mean standard deviation of the resting tip over the workspace (cm)"


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
        deviation of the angle between the board's normal and the camera's axis [rad], mean number
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
        Corners in each frame, None where the board was not seen.
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


def make_table_4_2(inputs: Any, params: Any) -> dict:
    """Table 4.2, with the threshold of each sensor's file."""
    used_px = {
        name: params.sensors[name]["marker"]["reprojection_threshold_px"] for name in params.names
    }
    found = by_sensor(params.names, inputs.tables)
    table = table_4_2(found, used_px, pd.read_csv(inputs.published))
    table["provenance"] = table["sensor"].map(params.provenance)
    return published.table(table, title=TITLE)


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
        on the board's picture.
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
