"""Pose of the probe's checkerboard in one image (Section 4.2.2)."""

from collections.abc import Mapping
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from palpate.vision.camera import PinholeCamera

DETECTION = cv2.CALIB_CB_ADAPTIVE_THRESH | cv2.CALIB_CB_NORMALIZE_IMAGE
SUBPIXEL_STOP = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_MAX_ITER, 40, 1e-3)
REFINE_STOP = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_MAX_ITER, 50, 1e-10)
RANSAC_ITERATIONS = 200
FEWEST_INLIERS = 6
# The two planar solutions count as equal when their errors differ by less than this factor.
AMBIGUOUS_RATIO = 2.0


@dataclass(frozen=True)
class MarkerPose:
    """Where the checkerboard is.

    Attributes
    ----------
    camera_from_marker : (4, 4) array
        Rigid transform [m].
    inliers : int
        Corners that RANSAC kept.
    reprojection_error_px : float
        Root mean square over the inliers [px].
    """

    camera_from_marker: NDArray
    inliers: int
    reprojection_error_px: float


def board_points(marker: Mapping) -> NDArray:
    """Inner corners in the marker frame, row by row from the origin, shape (n, 3) [m]."""
    columns, rows = marker["inner_corners"]
    y, x = np.mgrid[:rows, :columns]
    flat = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
    return flat * float(marker["square_m"])


def find_corners(grey: NDArray, marker: Mapping) -> NDArray | None:
    """Find the board's inner corners in the order of `board_points`.

    OpenCV may give the corners from either end; the outer corner square beside the origin is
    black and the one at the other end white, which settles it.

    Parameters
    ----------
    grey : (h, w) uint8 array
    marker : mapping
        ``marker`` block of the probe's file.

    Returns
    -------
    (n, 2) array or None
        Pixel coordinates [px]; None when the board is not seen.
    """
    columns, rows = marker["inner_corners"]
    found, corners = cv2.findChessboardCorners(grey, (columns, rows), flags=DETECTION)
    if not found:
        return None
    corners = np.ascontiguousarray(corners, dtype=np.float32).reshape(-1, 2)
    half = _half_window(corners.reshape(rows, columns, 2))
    start = corners.reshape(-1, 1, 2)
    refined = cv2.cornerSubPix(grey, start, (half, half), (-1, -1), SUBPIXEL_STOP)
    return _ordered(refined.reshape(rows, columns, 2).astype(float), grey)


def marker_pose(
    grey: NDArray,
    camera: PinholeCamera,
    marker: Mapping,
    *,
    threshold_px: float,
    previous: MarkerPose | None = None,
) -> MarkerPose | None:
    """Find the board and its pose.

    RANSAC picks the corners whose reprojection stays below the threshold; both solutions of the
    planar problem are refined on them, and of two that fit about alike the one nearer to the
    previous frame's is taken.

    Parameters
    ----------
    grey : (h, w) uint8 array
    camera : PinholeCamera
    marker : mapping
        ``marker`` block of the probe's file.
    threshold_px : float
        Largest reprojection error of an inlier [px] (Section 4.2.3).
    previous : MarkerPose, optional
        Pose in the frame before.

    Returns
    -------
    MarkerPose or None
        None when the board is not seen or too few corners agree.
    """
    corners = find_corners(grey, marker)
    return (
        None
        if corners is None
        else pose_from_corners(
            corners, camera, marker, threshold_px=threshold_px, previous=previous
        )
    )


def pose_from_corners(
    corners_px: NDArray,
    camera: PinholeCamera,
    marker: Mapping,
    *,
    threshold_px: float,
    previous: MarkerPose | None = None,
) -> MarkerPose | None:
    """Pose of the board from its corners; see `marker_pose`."""
    points = board_points(marker)
    lens = camera.matrix, np.array(camera.distortion)
    done, _, _, kept = cv2.solvePnPRansac(
        points,
        corners_px,
        *lens,
        iterationsCount=RANSAC_ITERATIONS,
        reprojectionError=threshold_px,
    )
    if not done or kept is None or len(kept) < FEWEST_INLIERS:
        return None
    kept = np.sort(kept.ravel())
    candidates = _both_poses(points[kept], corners_px[kept], lens)
    best = min(candidates, key=lambda pose: pose.reprojection_error_px)
    if previous is None:
        return best
    limit = AMBIGUOUS_RATIO * best.reprojection_error_px
    alike = [pose for pose in candidates if pose.reprojection_error_px <= limit]
    return min(alike, key=lambda pose: _turn(pose, previous))


def _both_poses(points: NDArray, corners: NDArray, lens: tuple) -> list[MarkerPose]:
    _, turns, shifts, _ = cv2.solvePnPGeneric(points, corners, *lens, flags=cv2.SOLVEPNP_IPPE)
    return [_refined(points, corners, lens, r, t) for r, t in zip(turns, shifts, strict=True)]


def _refined(
    points: NDArray, corners: NDArray, lens: tuple, turn: NDArray, shift: NDArray
) -> MarkerPose:
    turn, shift = cv2.solvePnPRefineLM(points, corners, *lens, turn, shift, REFINE_STOP)
    projected, _ = cv2.projectPoints(points, turn, shift, *lens)
    error = np.sqrt(((projected.reshape(-1, 2) - corners) ** 2).sum(axis=1).mean())
    pose = np.eye(4)
    pose[:3, :3] = cv2.Rodrigues(turn)[0]
    pose[:3, 3] = shift.ravel()
    return MarkerPose(pose, len(points), float(error))


def _turn(pose: MarkerPose, other: MarkerPose) -> float:
    """Cosine of the angle between two poses, negated: smaller is nearer."""
    relative = pose.camera_from_marker[:3, :3].T @ other.camera_from_marker[:3, :3]
    return -float(np.trace(relative))


def _half_window(grid: NDArray) -> int:
    """Half size of the sub-pixel window: it must not reach the next corner."""
    steps = [np.linalg.norm(np.diff(grid, axis=axis), axis=-1).min() for axis in (0, 1)]
    return int(np.clip(round(0.35 * min(steps)), 2, 11))


def _ordered(grid: NDArray, grey: NDArray) -> NDArray | None:
    """Corners from the end with the black outer square; None where an end is out of sight."""
    along, down = grid[0, -1] - grid[0, 0], grid[-1, 0] - grid[0, 0]
    if along[0] * down[1] - along[1] * down[0] < 0:
        grid = grid[:, ::-1]
    turned = grid[::-1, ::-1]
    first, last = _outer_intensity(grid, grey), _outer_intensity(turned, grey)
    if first is None or last is None:
        return None
    if first > last:
        grid = turned
    return np.ascontiguousarray(grid.reshape(-1, 2))


def _outer_intensity(grid: NDArray, grey: NDArray) -> float | None:
    """Brightness of the outer square beside a grid's first corner; None outside the image."""
    across, down = grid[0, 1] - grid[0, 0], grid[1, 0] - grid[0, 0]
    x, y = np.round(grid[0, 0] - 0.5 * across - 0.5 * down).astype(int)
    height, width = grey.shape
    patch = grey[max(y - 1, 0) : min(y + 2, height), max(x - 1, 0) : min(x + 2, width)]
    return float(patch.mean()) if patch.size else None
