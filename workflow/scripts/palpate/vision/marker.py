"""The probe's board in an image: its corners (Section 4.2.2)."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from palpate.vision.board import Board, FlatBoard
from palpate.vision.corners import Region
from palpate.vision.tags import april_grid, charuco

# Margin of the region in which the board is looked for, as a part of the corners' extent: the
# outer squares take up to half of it, the rest is for motion.
MARGIN = 0.9


def board_of(marker: Mapping) -> FlatBoard:
    """Make the board that a ``marker`` block of a probe's file, or a board's file, describes.

    Raises
    ------
    ValueError
        If no such board can be printed.
    """
    kind = marker.get("kind", "checkerboard")
    if kind == "checkerboard":
        return Board(*marker["inner_corners"], float(marker["square_m"]))
    if kind == "charuco":
        sides_m = float(marker["square_m"]), float(marker["tag_m"])
        first = marker.get("white_first", False)
        return charuco(tuple(marker["squares"]), *sides_m, marker["dictionary"], white_first=first)
    sides_m, turns = (float(marker["tag_m"]), float(marker["gap_m"])), marker.get("tag_turns", 0)
    return april_grid(tuple(marker["tags"]), *sides_m, marker["dictionary"], turns=turns)


def find_corners(grey: NDArray, board: FlatBoard, region: Region | None = None) -> NDArray | None:
    """Find the board's corners.

    Parameters
    ----------
    grey : (h, w) uint8 array
    board : FlatBoard
    region : Region, optional
        Part of the image to look in; the whole is searched when nothing is found there.

    Returns
    -------
    (n, 2) array or None
        Pixel coordinates, NaN where a corner is not seen [px]; None when the board is not seen.
    """
    corners = None if region is None else board.find(grey, region)
    return board.find(grey) if corners is None else corners


def expected_region(last: NDArray, before: NDArray | None, shape: tuple[int, int]) -> Region | None:
    """Where the board should be next, moving on as it did.

    Parameters
    ----------
    last, before : (n, 2) arrays
        Corners in the last frame and in the one before it, if they were found; NaN where one was
        hidden [px].
    shape : (h, w)
        Size of the image.

    Returns
    -------
    Region or None
        None when it leaves the image.
    """
    both = np.zeros(0) if before is None else np.isfinite((last - before)[:, 0])
    moved = np.median((last - before)[both], axis=0) if both.any() else np.zeros(2)
    low, high = np.nanmin(last, axis=0) + moved, np.nanmax(last, axis=0) + moved
    margin = MARGIN * (high - low).max()
    x0, y0 = np.floor(low - margin).astype(int).clip(0)
    x1, y1 = np.minimum(np.ceil(high + margin).astype(int), shape[::-1])
    return Region(int(x0), int(y0), int(x1), int(y1)) if x1 > x0 and y1 > y0 else None


class CornerFollower:
    """Find the board frame by frame: where its motion leads, then in the whole picture.

    Parameters
    ----------
    board : FlatBoard

    Attributes
    ----------
    faults : list of ValueError
        Of pictures that seem to show another board, which count as not showing it.
    """

    def __init__(self, board: FlatBoard) -> None:
        self.board, self.last, self.before = board, None, None
        self.faults, self.seen = [], 0

    def __call__(self, grey: NDArray) -> NDArray | None:
        """Corners (n, 2) in the next frame, a (h, w) uint8 array [px]; None when it is not seen."""
        region = None
        if self.last is not None:
            region = expected_region(self.last, self.before, grey.shape)
        try:
            corners = find_corners(grey, self.board, region)
        except ValueError as error:
            self.faults.append(error)
            corners = None
        if corners is None:
            self.before = None
        else:
            self.before, self.last, self.seen = self.last, corners, self.seen + 1
        return corners

    def require_right(self) -> None:
        """Reject a film most of whose pictures seem to show another board, by a `ValueError`."""
        if len(self.faults) > self.seen:
            count = f"{len(self.faults)} of {len(self.faults) + self.seen} pictures with tags"
            raise ValueError(f"{self.faults[0]} (so in {count})")
