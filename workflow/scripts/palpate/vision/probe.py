"""The probe through the frames of a capture: marker, chain of transforms, filter."""

from collections.abc import Iterable, Mapping

import cv2
import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation, Slerp

from palpate.vision.camera import PinholeCamera
from palpate.vision.kalman import filter_tip
from palpate.vision.marker import MarkerPose, marker_pose

QUATERNION = ["marker_qx", "marker_qy", "marker_qz", "marker_qw"]
MARKER = ["marker_x_m", "marker_y_m", "marker_z_m"]
RAW_TIP = ["raw_tip_x_m", "raw_tip_y_m", "raw_tip_z_m"]
TIP = ["tip_x_m", "tip_y_m", "tip_z_m"]
AXIS = ["axis_x", "axis_y", "axis_z"]


def marker_from_tip(probe: Mapping) -> NDArray:
    """Fixed part of the chain of Eq. 4.20, shape (4, 4)."""
    return np.array(probe["marker_from_force"]) @ np.array(probe["force_from_tip"])


def track_probe(
    images: Iterable[NDArray],
    time_s: NDArray,
    camera: PinholeCamera,
    probe: Mapping,
    *,
    threshold_px: float,
    largest_gap_frames: int,
    filter_options: Mapping,
) -> pd.DataFrame:
    """Follow the probe through a capture.

    Parameters
    ----------
    images : iterable of (h, w, 3) or (h, w) uint8 arrays
        Frames of the reference camera, one for each time.
    time_s : (n,) array
        Times of the frames [s].
    camera : PinholeCamera
    probe : mapping
        The probe's file.
    threshold_px : float
        RANSAC threshold of the sensor [px].
    largest_gap_frames : int
        Longest run of frames without a marker that is interpolated; such frames keep
        ``detected = 0``.
    filter_options : mapping
        Options of `filter_tip`.

    Returns
    -------
    DataFrame
        ``frame, time_s, detected, inliers, reprojection_error_px``, marker pose, raw and filtered
        tip [m] and pressing direction, all in the camera frame.

    Raises
    ------
    ValueError
        If no frame shows the marker, or it is lost for longer than allowed.
    """
    poses: list[MarkerPose | None] = []
    last = None
    for image in images:
        found = marker_pose(
            _grey(image), camera, probe["marker"], threshold_px=threshold_px, previous=last
        )
        last = found or last
        poses.append(found)
    _check_gaps(poses, largest_gap_frames)
    transforms = _bridged(time_s, poses)
    tips = transforms @ marker_from_tip(probe)
    table = pd.DataFrame({"frame": range(len(poses)), "time_s": time_s})
    table["detected"] = [int(pose is not None) for pose in poses]
    table["inliers"] = [pose.inliers if pose else 0 for pose in poses]
    table["reprojection_error_px"] = [
        pose.reprojection_error_px if pose else np.nan for pose in poses
    ]
    table[QUATERNION] = Rotation.from_matrix(transforms[:, :3, :3]).as_quat(canonical=True)
    table[MARKER] = transforms[:, :3, 3]
    table[RAW_TIP] = tips[:, :3, 3]
    table[TIP] = filter_tip(np.asarray(time_s), tips[:, :3, 3], **filter_options)
    table[AXIS] = tips[:, :3, 2]
    return table


def marker_transforms(table: pd.DataFrame) -> NDArray:
    """Transforms camera_from_marker of a pose table, shape (n, 4, 4)."""
    transforms = np.tile(np.eye(4), (len(table), 1, 1))
    transforms[:, :3, :3] = Rotation.from_quat(table[QUATERNION].to_numpy()).as_matrix()
    transforms[:, :3, 3] = table[MARKER].to_numpy()
    return transforms


def _grey(image: NDArray) -> NDArray:
    return image if image.ndim == 2 else cv2.cvtColor(image, cv2.COLOR_RGB2GRAY)


def _check_gaps(poses: list[MarkerPose | None], largest: int) -> None:
    lost = [k for k, pose in enumerate(poses) if pose is None]
    if len(lost) == len(poses):
        raise ValueError(f"marker: expected in the frames, found in none of {len(poses)}")
    if lost and (lost[0] == 0 or lost[-1] == len(poses) - 1):
        edge = lost[0] if lost[0] == 0 else lost[-1]
        raise ValueError(f"marker: expected in the first and last frame, lost in frame {edge}")
    runs = np.split(np.array(lost, dtype=int), np.flatnonzero(np.diff(lost) > 1) + 1)
    longest = max(runs, key=len)
    if len(longest) > largest:
        raise ValueError(
            f"marker: expected to be lost for at most {largest} frames at a time,"
            f" lost in frames {longest[0]} to {longest[-1]}"
        )


def _bridged(time_s: NDArray, poses: list[MarkerPose | None]) -> NDArray:
    """Transforms of all frames, those without a marker interpolated between their neighbours."""
    seen = [k for k, pose in enumerate(poses) if pose is not None]
    known = np.stack([poses[k].camera_from_marker for k in seen])
    if len(seen) == len(poses):
        return known
    times = np.asarray(time_s)
    transforms = np.tile(np.eye(4), (len(poses), 1, 1))
    turns = Slerp(times[seen], Rotation.from_matrix(known[:, :3, :3]))
    transforms[:, :3, :3] = turns(times).as_matrix()
    for axis in range(3):
        transforms[:, axis, 3] = np.interp(times, times[seen], known[:, axis, 3])
    return transforms
