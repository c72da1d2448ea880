"""The probe through the frames of a capture: its poses, chain of transforms, filter."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from palpate.capture.images import demosaic, grey
from palpate.capture.poses import LARGEST_GAP_S, PoseRecord
from palpate.config.sensor import asks_for_base, said_of_base
from palpate.vision.board import FlatBoard
from palpate.vision.camera import PinholeCamera, camera_from_spec
from palpate.vision.marker import CornerFollower, board_of
from palpate.vision.options import ProbePose
from palpate.vision.photometric import BoardRefiner
from palpate.vision.pose import (
    MEASUREMENT_STD_M,
    MarkerPose,
    candidate_poses,
    point_covariance,
    settle,
    smooth_tip,
)
from palpate.yaml_files import mismatch

QUATERNION = ["marker_qx", "marker_qy", "marker_qz", "marker_qw"]
MARKER = ["marker_x_m", "marker_y_m", "marker_z_m"]
RAW_TIP = ["raw_tip_x_m", "raw_tip_y_m", "raw_tip_z_m"]
ALONG_STD = "raw_tip_std_along_m"
TIP_STD = ["raw_tip_std_x_m", "raw_tip_std_y_m", "raw_tip_std_z_m", ALONG_STD]
TIP = ["tip_x_m", "tip_y_m", "tip_z_m"]
AXIS = ["axis_x", "axis_y", "axis_z"]
# The second of the two planar poses stays in the running up to this many times the first's error.
AMBIGUOUS_RATIO = 4.0
# Of a press from the direction that is declared, about the vertical or not.
LARGEST_SLANT_DEG = 45.0
QUARTER_TURN = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
LOST = MarkerPose(np.full((4, 4), np.nan), np.full((6, 6), np.nan))


def marker_from_tip(probe: Mapping) -> NDArray:
    """Fixed part of the chain of Eq. 4.20, shape (4, 4)."""
    return np.array(probe["marker_from_force"]) @ np.array(probe["force_from_tip"])


def track_probe(
    images: Iterable[NDArray], time_s: NDArray, sensor: Mapping, probe: Mapping, options: ProbePose
) -> pd.DataFrame:
    """Follow the probe through a capture.

    Parameters
    ----------
    images : iterable of uint8 arrays
        Frames of the reference camera as it sampled them (`palpate.capture.images.read_samples`),
        one for each time.
    time_s : (n,) array
        Times of the frames [s].
    sensor, probe : mapping
        The sensor's file and the probe's.
    options : ProbePose

    Returns
    -------
    DataFrame
        ``frame, time_s, detected``, inliers and reprojection error of the corners, ``refined``,
        marker pose, raw tip and its standard deviations along the camera's axes and the pressing
        direction, filtered tip [m] and pressing direction, all in the camera frame. The poses of
        frames without the marker, ``detected = 0``, are interpolated.

    Raises
    ------
    ValueError
        If no frame shows the marker, or it is lost for longer than allowed.
    """
    found = recorded_poses(images, sensor, probe["marker"], options)
    within = f"{sensor['marker']['reprojection_threshold_px']:g} px"
    sought = f"marker: expected its corners, and a pose that leaves most of them within {within}"
    return pose_table(found, time_s, probe, options, sought=sought)


def pose_table(
    poses: Sequence[MarkerPose | None],
    time_s: NDArray,
    probe: Mapping,
    options: ProbePose,
    *,
    sought: str,
) -> pd.DataFrame:
    """Path of a probe by its poses at some frames, whatever they come from; see `track_probe`.

    Parameters
    ----------
    poses : sequence of MarkerPose or None
        Of each frame.
    time_s, probe, options
        As of `track_probe`.
    sought : str
        What was sought in each frame, as messages say it: subject, colon, what was expected.

    Raises
    ------
    ValueError
        If there is no pose, or the probe is lost for longer than allowed.
    """
    fixed = marker_from_tip(probe)
    _check_gaps(poses, options.largest_gap_frames, sought)
    time_s = np.asarray(time_s)
    seen = [k for k, pose in enumerate(poses) if pose is not None]
    transforms = np.stack([poses[k].camera_from_marker for k in seen])
    if len(seen) < len(poses):
        record = PoseRecord(time_s[seen], transforms, np.full(len(seen), np.nan))
        transforms = record.at(time_s, largest_gap_s=np.inf)[0]
    tips = transforms @ fixed
    table = pd.DataFrame({"frame": range(len(poses)), "time_s": time_s})
    table["detected"] = [int(pose is not None) for pose in poses]
    known = [pose or LOST for pose in poses]
    table["inliers"] = [pose.inliers for pose in known]
    table["reprojection_error_px"] = [pose.reprojection_error_px for pose in known]
    table["refined"] = [int(pose.refined) for pose in known]
    table = table.join(marker_columns(transforms))
    table[RAW_TIP] = tips[:, :3, 3]
    table[TIP_STD] = [_tip_std(pose, fixed) for pose in known]
    measured = np.where(table[["detected"]] == 1, tips[:, :3, 3], np.nan)
    std_m = np.hypot(np.nan_to_num(table[TIP_STD[:3]].to_numpy(float)), MEASUREMENT_STD_M)
    table[TIP] = smooth_tip(time_s, measured, std_m)
    table[AXIS] = tips[:, :3, 2]
    return table


def placed_poses(record: PoseRecord, time_s: NDArray, sensor: Mapping) -> list[MarkerPose | None]:
    """Poses of a tracked frame in the camera frame at some times (n,) [s], with their own noise.

    None inside a gap of the record (`PoseRecord.at`). The error of ``camera_from_base``, by which
    the sensor's file places the record's base, is not in their covariance: all of them share it.

    Raises
    ------
    ValueError
        If a time is outside of the record, or nobody places the base.
    """
    if asks_for_base(sensor):
        expected = "the hand_eye.json that the sensor's file asks for"
        raise mismatch("base.camera_from_base", expected, "none")
    noise_m, noise_rad = (said_of_base(sensor, name) for name in ("pose_std_m", "pose_std_rad"))
    poses, std_m = record.filled(noise_m).at(time_s, largest_gap_s=LARGEST_GAP_S)
    camera_from_base = np.array(sensor["base"]["camera_from_base"])
    return [
        MarkerPose(pose, np.diag([noise_rad**2] * 3 + [std**2] * 3)) if np.isfinite(std) else None
        for pose, std in zip(camera_from_base @ poses, std_m, strict=True)
    ]


def recorded_poses(
    images: Iterable[NDArray], sensor: Mapping, marker: Mapping, options: ProbePose
) -> list[MarkerPose | None]:
    """`board_poses` of images as `track_probe` takes them, of a probe file's ``marker`` block."""
    camera, board = camera_from_spec(sensor["color"]), board_of(marker)
    encoding, follow, refine = sensor["color"]["encoding"], CornerFollower(board), None
    if options.refinement == "photometric":
        refine = BoardRefiner(camera, board, encoding=encoding)
    raw = encoding == "bayer_rggb8"
    frames = (
        (follow(grey(demosaic(image, encoding))), image if raw else grey(image)) for image in images
    )
    threshold_px = sensor["marker"]["reprojection_threshold_px"]
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
) -> list[MarkerPose | None]:
    """Pose of the board in each frame, refined on the picture where that can be.

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
        found, likely = [], []
        if corners is not None:
            found = candidate_poses(corners, camera, board, threshold_px=threshold_px)
        for pose in found:
            count, error_px = pose.inliers, pose.reprojection_error_px
            if error_px > AMBIGUOUS_RATIO * found[0].reprojection_error_px:
                continue
            hidden = ~np.isfinite(corners[:, 0])
            if better := refine and refine(samples, pose.camera_from_marker, hidden):
                pose = replace(better, inliers=count, reprojection_error_px=error_px)
            likely.append(pose)
        candidates.append(likely)
    return settle(candidates)


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


def from_pictures(poses: pd.DataFrame) -> bool:
    """Whether poses are of a target in pictures; from elsewhere none has corners."""
    return bool(poses["inliers"].any())


def check_steepness(
    poses: pd.DataFrame,
    probe: Mapping,
    up: NDArray,
    point: Mapping,
    support: Mapping,
    base: Mapping | None = None,
) -> None:
    """Reject a probe that comes from far beside the declared direction, by its steepness.

    Parameters
    ----------
    poses : DataFrame
        Of `track_probe`.
    probe, point, support : mapping
        The probe's file, and blocks of object.yaml.
    up : (3,) array
        The table's normal, camera frame.
    base : mapping, optional
        The block of a sensor's file, of poses in it.

    Raises
    ------
    ValueError
        That names the board where counting its corners the other way round would do, and of poses
        from elsewhere what was taken for another thing.
    """
    normal = np.array(support["plane_normal"], dtype=float)
    declared = _angle_deg(np.array(point.get("direction", -normal), dtype=float), normal)
    turns, axis = marker_transforms(poses)[:, :3, :3], marker_from_tip(probe)[:3, 2]

    def off_deg(turns: NDArray) -> float:
        return abs(_angle_deg((turns @ axis).mean(axis=0), up) - declared)

    found = off_deg(turns)
    if found <= LARGEST_SLANT_DEG:
        return
    cause = "marker_from_force in the probe's file?"
    if base is not None and not from_pictures(poses):
        camera_from_base = np.array(base["camera_from_base"])[:3, :3]
        inside = camera_from_base.T @ turns
        written = Rotation.from_matrix(inside).as_quat(scalar_first=True)
        taken = {
            "quaternions with the scalar last?": Rotation.from_quat(written).as_matrix(),
            "poses of the base in the tracked frame?": inside.swapaxes(1, 2),
        }
        near = (k for k, v in taken.items() if off_deg(camera_from_base @ v) <= LARGEST_SLANT_DEG)
        other = "marker_from_force? base.camera_from_base? poses of another tool?"
        cause = f"probe_poses.csv: {next(near, other)}"
    # A board counted the other way round has its axes turned by a right angle.
    elif "inner_corners" in probe.get("marker", {}) and any(
        off_deg(turns @ turn) <= LARGEST_SLANT_DEG for turn in (QUARTER_TURN, QUARTER_TURN.T)
    ):
        columns, rows = probe["marker"]["inner_corners"]
        cause = f"marker.inner_corners {rows}, {columns} in the probe's file?"
    expected = f"to press within {LARGEST_SLANT_DEG:g} degrees of the declared direction"
    raise mismatch("probe", expected, f"it {found:.0f} beside it ({cause})")


def _angle_deg(first: NDArray, second: NDArray) -> float:
    cosine = first @ second / (np.linalg.norm(first) * np.linalg.norm(second))
    return float(np.degrees(np.arccos(np.clip(cosine, -1, 1))))


def _tip_std(pose: MarkerPose, fixed: NDArray) -> NDArray:
    """Standard deviations of the tip along x, y, z and the pressing direction, (4,) [m]."""
    covariance = point_covariance(pose.camera_from_marker, pose.covariance, fixed[:3, 3])
    axis = pose.camera_from_marker[:3, :3] @ fixed[:3, 2]
    return np.sqrt([*np.diag(covariance), axis @ covariance @ axis])


def _check_gaps(poses: Sequence[MarkerPose | None], largest: int, sought: str) -> None:
    lost, subject = [k for k, pose in enumerate(poses) if pose is None], sought.partition(":")[0]
    if len(lost) == len(poses):
        raise ValueError(f"{sought}, found in none of {len(poses)} frames")
    for edge in (0, len(poses) - 1):
        if poses[edge] is None:
            raise mismatch(subject, "in the first and last frame", f"it lost in frame {edge}")
    runs = np.split(np.array(lost, dtype=int), np.flatnonzero(np.diff(lost) > 1) + 1)
    longest = max(runs, key=len)
    if len(longest) > largest:
        found = f"it lost in frames {longest[0]} to {longest[-1]}"
        raise mismatch(subject, f"to be lost for at most {largest} frames at a time", found)
