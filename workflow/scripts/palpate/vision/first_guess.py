"""Where a calibration starts: a lens without distortion, and each board's pose in it."""

from collections.abc import Mapping

import cv2
import numpy as np
from numpy.typing import NDArray

from palpate.vision.board import FlatBoard
from palpate.vision.bundle import LENS

# Focal length over the picture's longer side: what lenses of depth cameras have.
FOCAL_RANGE, FOCAL_ELSE = (0.2, 20.0), 1.0


def first_lens(
    corners: Mapping[str, NDArray], board: FlatBoard, size_px: tuple[int, int]
) -> NDArray:
    """A lens with the focal length that the boards' homographies tell (nine numbers).

    Parameters
    ----------
    corners : mapping
        View to its corners (n, 2) [px]; NaN for those not seen.
    board : FlatBoard
    size_px : (width, height)
    """
    kept = [np.isfinite(seen).all(axis=1) for seen in corners.values()]
    points = [board.points_m[seen].astype(np.float32) for seen in kept]
    images = [
        found[seen].astype(np.float32) for found, seen in zip(corners.values(), kept, strict=True)
    ]
    longer = max(size_px)
    try:
        focal = cv2.initCameraMatrix2D(points, images, size_px)[0, 0]
    except cv2.error:  # a view whose corners are all but in one line
        focal = FOCAL_ELSE * longer
    if not FOCAL_RANGE[0] < focal / longer < FOCAL_RANGE[1]:  # also where it is no number
        focal = FOCAL_ELSE * longer
    lens = np.zeros(LENS)
    lens[:4] = focal, focal, (size_px[0] - 1) / 2, (size_px[1] - 1) / 2
    return lens


def board_pose(corners: NDArray, board: FlatBoard, lens: NDArray) -> NDArray:
    """Pose of a board of which some corners are seen: turn and shift, shape (6,)."""
    seen = np.isfinite(corners).all(axis=1)
    matrix = np.array([[lens[0], 0, lens[2]], [0, lens[1], lens[3]], [0, 0, 1]])
    _, turn, shift = cv2.solvePnP(board.points_m[seen], corners[seen], matrix, lens[4:])
    return np.concatenate([turn.ravel(), shift.ravel()])


def matrix_of(pose: NDArray) -> NDArray:
    """Turn and shift as a matrix (4, 4)."""
    matrix = np.eye(4)
    matrix[:3, :3] = cv2.Rodrigues(pose[:3])[0]
    matrix[:3, 3] = pose[3:]
    return matrix


def vector_of(matrix: NDArray) -> NDArray:
    """A matrix (4, 4) as turn and shift."""
    return np.concatenate([cv2.Rodrigues(matrix[:3, :3])[0].ravel(), matrix[:3, 3]])
