"""The probe's checkerboard in an image: its corners (Section 4.2.2)."""

from collections.abc import Mapping
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from palpate.vision.board import Board

DETECTION = cv2.CALIB_CB_ADAPTIVE_THRESH | cv2.CALIB_CB_NORMALIZE_IMAGE
SUBPIXEL_STOP = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_MAX_ITER, 40, 1e-3)
# Margin of the region in which the board is looked for, as a part of the corners' extent: the
# outer squares take up to half of it, the rest is for motion.
MARGIN = 0.9


@dataclass(frozen=True)
class Region:
    """Part of an image: rows ``y0`` to ``y1`` and columns ``x0`` to ``x1``, ends left out [px]."""

    x0: int
    y0: int
    x1: int
    y1: int


def board_points(marker: Mapping) -> NDArray:
    """Inner corners in the marker frame, row by row from the origin, shape (n, 3) [m]."""
    return Board(*marker["inner_corners"], float(marker["square_m"])).points_m


def find_corners(grey: NDArray, marker: Mapping, region: Region | None = None) -> NDArray | None:
    """Find the board's inner corners in the order of `board_points`.

    OpenCV may give the corners from either end; the outer corner square beside the origin is
    black and the one at the other end white, which settles it.

    Parameters
    ----------
    grey : (h, w) uint8 array
    marker : mapping
        ``marker`` block of the probe's file.
    region : Region, optional
        Part of the image to look in; the whole is searched when nothing is found there.

    Returns
    -------
    (n, 2) array or None
        Pixel coordinates [px]; None when the board is not seen.
    """
    if region is not None:
        part = np.ascontiguousarray(grey[region.y0 : region.y1, region.x0 : region.x1])
        corners = _detect(part, marker)
        if corners is not None:
            return corners + [region.x0, region.y0]
    return _detect(grey, marker)


def expected_region(last: NDArray, before: NDArray | None, shape: tuple[int, int]) -> Region | None:
    """Where the board should be next, moving on as it did.

    Parameters
    ----------
    last, before : (n, 2) arrays
        Corners in the last frame and in the one before it, if they were found [px].
    shape : (h, w)
        Size of the image.

    Returns
    -------
    Region or None
        None when it leaves the image.
    """
    corners = last if before is None else 2 * last - before
    low, high = corners.min(axis=0), corners.max(axis=0)
    margin = MARGIN * (high - low).max()
    x0, y0 = np.floor(low - margin).astype(int).clip(0)
    x1, y1 = np.minimum(np.ceil(high + margin).astype(int), shape[::-1])
    return Region(int(x0), int(y0), int(x1), int(y1)) if x1 > x0 and y1 > y0 else None


class CornerFollower:
    """Find the board frame by frame: where its motion leads, then in the whole picture.

    Parameters
    ----------
    marker : mapping
        ``marker`` block of the probe's file.
    """

    def __init__(self, marker: Mapping) -> None:
        self.marker, self.last, self.before = marker, None, None

    def __call__(self, grey: NDArray) -> NDArray | None:
        """Corners (n, 2) in the next frame, a (h, w) uint8 array [px]; None when it is not seen."""
        region = None
        if self.last is not None:
            region = expected_region(self.last, self.before, grey.shape)
        corners = find_corners(grey, self.marker, region)
        if corners is None:
            self.before = None
        else:
            self.before, self.last = self.last, corners
        return corners


def _detect(grey: NDArray, marker: Mapping) -> NDArray | None:
    columns, rows = marker["inner_corners"]
    found, corners = cv2.findChessboardCorners(grey, (columns, rows), flags=DETECTION)
    if not found:
        return None
    corners = np.ascontiguousarray(corners, dtype=np.float32).reshape(-1, 2)
    half = _half_window(corners.reshape(rows, columns, 2))
    start = corners.reshape(-1, 1, 2)
    refined = cv2.cornerSubPix(grey, start, (half, half), (-1, -1), SUBPIXEL_STOP)
    return _ordered(refined.reshape(rows, columns, 2).astype(float), grey)


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
    patch = grey[max(y - 1, 0) : max(y + 2, 0), max(x - 1, 0) : max(x + 2, 0)]
    return float(patch.mean()) if patch.size else None
