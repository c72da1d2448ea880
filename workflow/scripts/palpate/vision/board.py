"""A checkerboard and its corners in pictures (Section 4.1.4)."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import cv2
import numpy as np
from numpy.typing import NDArray

from palpate.vision.board_picture import Print
from palpate.vision.corners import Region, in_sight, refined, whole

# OpenCV's detector by quadrangles is fast and may put edge corners on wrong spots: where not all of
# its corners are right, the one by sectors is asked too. That one finds some boards in a picture of
# normalised brightness alone, others in the picture as it is, and without CALIB_CB_ACCURACY gives
# now one answer, now another, of one small picture.
BY_QUADS = cv2.CALIB_CB_ADAPTIVE_THRESH | cv2.CALIB_CB_NORMALIZE_IMAGE | cv2.CALIB_CB_FAST_CHECK
BY_SECTORS = cv2.CALIB_CB_ACCURACY
DETECTORS = (
    (cv2.findChessboardCorners, BY_QUADS),
    (cv2.findChessboardCornersSB, BY_SECTORS),
    (cv2.findChessboardCornersSB, BY_SECTORS | cv2.CALIB_CB_NORMALIZE_IMAGE),
)
# Parts of all corners, and of those of each outer row and column, that have to be right: else the
# grid may be a row beside, or a part of a larger board.
SEEN, SIDE_SEEN = 0.85, 0.5


class FlatBoard(Protocol):
    """What any printed board has.

    Attributes
    ----------
    points_m : (n, 3) array
        Corners in the board's frame: origin at the upper left one, x right, y down, z into the
        board.
    outline_m : (2, 2) array
        Least and largest x, y of what is printed.
    unit_m : float
        Side of a square or a tag.
    print : Print
        What is printed, in units.
    ambiguous : bool
        Whether half a turn maps it onto itself.
    described : str
        What a message calls it.
    """

    points_m: NDArray
    outline_m: NDArray
    unit_m: float
    print: Print
    ambiguous: bool
    described: str

    def find(self, grey: NDArray, region: Region | None = None) -> NDArray | None:
        """Corners in a (h, w) uint8 picture, (n, 2) [px]; NaN where one is not seen, or None."""


@dataclass(frozen=True)
class Board:
    """A checkerboard; a `FlatBoard`.

    Attributes
    ----------
    columns, rows : int
        Inner corners.
    square_m : float
    """

    columns: int
    rows: int
    square_m: float

    @property
    def points_m(self) -> NDArray:
        """Corners in the board's frame, row by row, shape (columns * rows, 3)."""
        y, x = np.mgrid[: self.rows, : self.columns]
        points = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
        return points * self.square_m

    @property
    def outline_m(self) -> NDArray:
        """Least and largest x, y of the outer squares, (2, 2)."""
        return np.array([[-1, -1], [self.columns, self.rows]]) * self.square_m

    @property
    def unit_m(self) -> float:
        """Side of a square."""
        return self.square_m

    @property
    def print(self) -> Print:
        """Black and white squares, in squares; the one beside the first corner is black."""
        white = np.indices((self.rows + 1, self.columns + 1)).sum(axis=0) % 2
        return Print(np.arange(self.columns), np.arange(self.rows), white)

    @property
    def ambiguous(self) -> bool:
        """Whether half a turn maps the board's colours onto themselves."""
        return (self.columns + self.rows) % 2 == 0

    @property
    def described(self) -> str:
        """What a message calls it."""
        return f"a board of {self.columns} x {self.rows} inner corners"

    def find(self, grey: NDArray, region: Region | None = None) -> NDArray | None:
        """Find the corners to sub-pixel precision, row by row.

        They are counted clockwise from the corner beside a black outer square, where the board
        allows to tell (one odd and one even number of corners).

        Parameters
        ----------
        grey : (h, w) uint8 array
        region : Region, optional
            Where the board is looked for.

        Returns
        -------
        (n, 2) array or None
            Pixel coordinates, NaN where a corner is not right; None when the board is not seen.
        """
        region = region or whole(grey)
        part = region.cut(grey)
        best = np.full((self.columns * self.rows, 2), np.nan)
        for detect, flags in DETECTORS:
            found, corners = detect(part, (self.columns, self.rows), flags=flags)
            if found:
                corners = corners.reshape(-1, 2) + [region.x0, region.y0]
                best = max(best, self._right(grey, corners), key=_count)
            if _count(best) == len(best):
                break
        return best if self._whole(np.isfinite(best[:, 0])) else None

    def _right(self, grey: NDArray, corners: NDArray) -> NDArray:
        """Those of a detector's corners that are right, in the board's order, (n, 2) [px]."""
        grid = corners.reshape(self.rows, self.columns, 2).astype(float)
        corners = refined(grey, _face_up(grid).reshape(-1, 2), self.points_m)
        turns = [corners] if self.ambiguous else [corners, corners[::-1].copy()]
        return max((in_sight(grey, turned, self) for turned in turns), key=_count)

    def _whole(self, seen: NDArray) -> bool:
        """Whether enough corners are seen on all sides: else the grid may be a row beside."""
        grid = seen.reshape(self.rows, self.columns)
        sides = (grid[0], grid[-1], grid[:, 0], grid[:, -1])
        return grid.mean() >= SEEN and all(side.mean() >= SIDE_SEEN for side in sides)


def _count(corners: NDArray) -> int:
    return int(np.isfinite(corners[:, 0]).sum())


def _face_up(grid: NDArray) -> NDArray:
    """Corners (rows, columns, 2) counted clockwise: nobody sees a board from behind."""
    along, down = grid[0, -1] - grid[0, 0], grid[-1, 0] - grid[0, 0]
    return grid[:, ::-1] if along[0] * down[1] - along[1] * down[0] < 0 else grid


def board_views(
    images: Sequence[tuple[str, NDArray]], board: FlatBoard
) -> tuple[dict[str, NDArray], dict[str, str]]:
    """Find the board in images: corners of each view that shows it, and the rest's reason."""
    corners, missing = {}, {}
    for name, grey in images:
        found = board.find(grey)
        if found is None:
            missing[name] = "the board was not found"
        else:
            corners[name] = found
    return corners, missing
