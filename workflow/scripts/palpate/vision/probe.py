"""The probe through the frames of a capture: marker, chain of transforms, filter."""

from collections.abc import Iterable, Mapping
from dataclasses import replace

import cv2
import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation, Slerp

from palpate.capture.images import demosaic
from palpate.vision.board import FlatBoard
from palpate.vision.camera import PinholeCamera
from palpate.vision.kalman import filter_tip
from palpate.vision.marker import CornerFollower, board_of
from palpate.vision.options import PoseFilter
from palpate.vision.photometric import BoardRefiner
from palpate.vision.pose import MarkerPose, candidate_poses, point_covariance, settle

QUATERNION = ["marker_qx", "marker_qy", "marker_qz", "marker_qw"]
MARKER = ["marker_x_m", "marker_y_m", "marker_z_m"]
RAW_TIP = ["raw_tip_x_m", "raw_tip_y_m", "raw_tip_z_m"]
TIP_STD = ["raw_tip_std_x_m", "raw_tip_std_y_m", "raw_tip_std_z_m"]
ALONG_STD = "raw_tip_std_along_m"
TIP = ["tip_x_m", "tip_y_m", "tip_z_m"]
# The second of the two planar poses stays in the running up to this many times the first's error.
AMBIGUOUS_RATIO = 4.0
AXIS = ["axis_x", "axis_y", "axis_z"]
# Of a press from the direction that is declared, about the vertical or not.
LARGEST_SLANT_DEG = 45.0
QUARTER_TURN = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])


def marker_from_tip(probe: Mapping) -> NDArray:
    """Fixed part of the chain of Eq. 4.20, shape (4, 4)."""
    return np.array(probe["marker_from_force"]) @ np.array(probe["force_from_tip"])


def track_probe(
    images: Iterable[NDArray],
    time_s: NDArray,
    camera: PinholeCamera,
    probe: Mapping,
    *,
    encoding: str,
    threshold_px: float,
    refinement: str,
    largest_gap_frames: int,
    filter_by: PoseFilter,
) -> pd.DataFrame:
    """Follow the probe through a capture.

    Parameters
    ----------
    images : iterable of uint8 arrays
        Frames of the reference camera as it sampled them (`palpate.capture.images.read_samples`),
        one for each time.
    time_s : (n,) array
        Times of the frames [s].
    camera : PinholeCamera
    probe : mapping
        The probe's file.
    encoding : str
        Encoding of the images.
    threshold_px : float
        RANSAC threshold of the sensor [px].
    refinement : {"photometric", "corners"}
        Whether the pose is refined on the board's picture, or stays as the corners give it.
    largest_gap_frames : int
        Longest run of frames without a marker that is interpolated; such frames keep
        ``detected = 0``.
    filter_by : PoseFilter

    Returns
    -------
    DataFrame
        ``frame, time_s, detected``, inliers and reprojection error of the corners, ``refined``,
        marker pose, raw tip and its standard deviations along the camera's axes and the pressing
        direction, filtered tip [m] and pressing direction, all in the camera frame.

    Raises
    ------
    ValueError
        If no frame shows the marker, or it is lost for longer than allowed.
    """
    poses = film_poses(
        images,
        camera,
        board_of(probe["marker"]),
        encoding=encoding,
        threshold_px=threshold_px,
        refinement=refinement,
    )
    _check_gaps([pose for pose, _ in poses], largest_gap_frames, threshold_px)
    transforms = _bridged(time_s, [pose for pose, _ in poses])
    tips = transforms @ marker_from_tip(probe)
    table = pd.DataFrame({"frame": range(len(poses)), "time_s": time_s})
    table["detected"] = [int(pose is not None) for pose, _ in poses]
    table["inliers"] = [pose.inliers if pose else 0 for pose, _ in poses]
    table["reprojection_error_px"] = [
        pose.reprojection_error_px if pose else np.nan for pose, _ in poses
    ]
    table["refined"] = [int(refined) for _, refined in poses]
    table = table.join(marker_columns(transforms))
    table[RAW_TIP] = tips[:, :3, 3]
    table[[*TIP_STD, ALONG_STD]] = [_tip_std(pose, probe) for pose, _ in poses]
    measured = np.where(table[["detected"]] == 1, tips[:, :3, 3], np.nan)
    table[TIP] = filter_tip(
        np.asarray(time_s),
        measured,
        table[TIP_STD].to_numpy(float),
        method=filter_by.method,
        measurement_std_m=filter_by.measurement_std_m,
        acceleration_std_m_s2=filter_by.acceleration_std_m_s2,
    )
    table[AXIS] = tips[:, :3, 2]
    return table


def film_poses(
    images: Iterable[NDArray],
    camera: PinholeCamera,
    board: FlatBoard,
    *,
    encoding: str,
    threshold_px: float,
    refinement: str,
) -> list[tuple[MarkerPose | None, bool]]:
    """`board_poses` of images as `track_probe` takes them."""
    mosaic = encoding == "bayer_rggb8"
    refine = None
    if refinement == "photometric":
        refine = BoardRefiner(camera, board, encoding=encoding)
    follow = CornerFollower(board)
    frames = (
        (follow(_grey(demosaic(image, encoding))), image if mosaic else _grey(image))
        for image in images
    )
    found = board_poses(frames, camera, board, threshold_px=threshold_px, refine=refine)
    follow.require_right()
    return found


def board_poses(
    frames: Iterable[tuple[NDArray | None, NDArray]],
    camera: PinholeCamera,
    board: FlatBoard,
    *,
    threshold_px: float,
    refine: BoardRefiner | None,
) -> list[tuple[MarkerPose | None, bool]]:
    """Pose of the board in each frame, and whether it was refined on the picture.

    Of the two poses that a plane allows the ones are taken that make one smooth motion.

    Parameters
    ----------
    frames : iterable of ((n, 2) array or None, (h, w) uint8 array)
        Corners as `CornerFollower` finds them [px], and the grey image or mosaic to refine on.
    camera : PinholeCamera
    board : FlatBoard
    threshold_px : float
        RANSAC threshold [px].
    refine : BoardRefiner or None
    """
    candidates = []
    for corners, samples in frames:
        found = (
            []
            if corners is None
            else candidate_poses(corners, camera, board, threshold_px=threshold_px)
        )
        hidden = None if corners is None else ~np.isfinite(corners[:, 0])
        candidates.append([_refined(pose, refine, samples, hidden) for pose in _likely(found)])
    chosen = settle([[pose for pose, _ in poses] for poses in candidates])
    refined = {id(pose): done for poses in candidates for pose, done in poses}
    return [(pose, pose is not None and refined[id(pose)]) for pose in chosen]


def marker_transforms(table: pd.DataFrame) -> NDArray:
    """Transforms camera_from_marker of a pose table, shape (n, 4, 4)."""
    transforms = np.tile(np.eye(4), (len(table), 1, 1))
    transforms[:, :3, :3] = Rotation.from_quat(table[QUATERNION].to_numpy()).as_matrix()
    transforms[:, :3, 3] = table[MARKER].to_numpy()
    return transforms


def marker_columns(transforms: NDArray) -> pd.DataFrame:
    """Columns of transforms camera_from_marker (n, 4, 4), as `marker_transforms` reads them."""
    turns = Rotation.from_matrix(transforms[:, :3, :3]).as_quat(canonical=True)
    return pd.DataFrame(np.hstack([turns, transforms[:, :3, 3]]), columns=[*QUATERNION, *MARKER])


def check_steepness(
    poses: pd.DataFrame, probe: Mapping, up: NDArray, point: Mapping, support: Mapping
) -> None:
    """Refuse a probe that comes from far beside the declared direction, as steepness tells.

    Parameters
    ----------
    poses : DataFrame
        Of `track_probe`.
    probe : mapping
        The probe's file.
    up : (3,) array
        The table's normal, camera frame.
    point, support : mapping
        Of object.yaml.

    Raises
    ------
    ValueError
        That names the board where counting its corners the other way round would do.
    """
    normal = np.array(support["plane_normal"], dtype=float)
    declared = _angle_deg(np.array(point.get("direction", -normal), dtype=float), normal)
    turns, axis = marker_transforms(poses)[:, :3, :3], marker_from_tip(probe)[:3, 2]

    def off_deg(turn: NDArray) -> float:
        return abs(_angle_deg((turns @ turn @ axis).mean(axis=0), up) - declared)

    found = off_deg(np.eye(3))
    if found <= LARGEST_SLANT_DEG:
        return
    # A board counted the other way round has its axes turned by a right angle.
    swapped = min(off_deg(QUARTER_TURN), off_deg(QUARTER_TURN.T)) <= LARGEST_SLANT_DEG
    cause = "marker_from_force"
    if swapped and "inner_corners" in probe["marker"]:
        columns, rows = probe["marker"]["inner_corners"]
        cause = f"marker.inner_corners {rows}, {columns}"
    raise ValueError(
        f"probe: expected to press within {LARGEST_SLANT_DEG:g} degrees of the declared direction,"
        f" found it {found:.0f} beside it ({cause} in the probe's file?)"
    )


def _angle_deg(first: NDArray, second: NDArray) -> float:
    cosine = first @ second / (np.linalg.norm(first) * np.linalg.norm(second))
    return float(np.degrees(np.arccos(np.clip(cosine, -1, 1))))


def _likely(poses: list[MarkerPose]) -> list[MarkerPose]:
    """The best pose, and the other where it fits about as well."""
    return [
        pose
        for pose in poses
        if pose.reprojection_error_px <= AMBIGUOUS_RATIO * poses[0].reprojection_error_px
    ]


def _refined(
    pose: MarkerPose, refine: BoardRefiner | None, samples: NDArray, hidden: NDArray | None
) -> tuple[MarkerPose, bool]:
    """A pose refined on the picture, where that succeeds."""
    better = None if refine is None else refine(samples, pose.camera_from_marker, hidden)
    if better is None:
        return pose, False
    return replace(
        pose, camera_from_marker=better.camera_from_marker, covariance=better.covariance
    ), True


def _tip_std(pose: MarkerPose | None, probe: Mapping) -> NDArray:
    """Standard deviations of the tip along x, y, z and the pressing direction, (4,) [m]."""
    if pose is None:
        return np.full(4, np.nan)
    fixed = marker_from_tip(probe)
    covariance = point_covariance(pose.camera_from_marker, pose.covariance, fixed[:3, 3])
    axis = pose.camera_from_marker[:3, :3] @ fixed[:3, 2]
    return np.sqrt([*np.diag(covariance), axis @ covariance @ axis])


def _grey(image: NDArray) -> NDArray:
    return image if image.ndim == 2 else cv2.cvtColor(image, cv2.COLOR_RGB2GRAY)


def _check_gaps(poses: list[MarkerPose | None], largest: int, threshold_px: float) -> None:
    lost = [k for k, pose in enumerate(poses) if pose is None]
    if len(lost) == len(poses):
        raise ValueError(
            "marker: expected its corners, and a pose that leaves most of them within"
            f" {threshold_px:g} px, found in none of {len(poses)} frames"
        )
    if lost and (lost[0] == 0 or lost[-1] == len(poses) - 1):
        edge = lost[0] if lost[0] == 0 else lost[-1]
        raise ValueError(
            f"marker: expected in the first and last frame, found it lost in frame {edge}"
        )
    runs = np.split(np.array(lost, dtype=int), np.flatnonzero(np.diff(lost) > 1) + 1)
    longest = max(runs, key=len)
    if len(longest) > largest:
        raise ValueError(
            f"marker: expected to be lost for at most {largest} frames at a time,"
            f" found it lost in frames {longest[0]} to {longest[-1]}"
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
