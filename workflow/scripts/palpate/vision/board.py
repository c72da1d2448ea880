"""A checkerboard and its corners in pictures (Section 4.1.4)."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

# Half the window in which a corner is refined: part of a square's side, and never more pixels. On
# real boards larger windows bias the focal length, and the corners of OpenCV's SB detector have
# residuals a quarter larger.
REFINE_SHARE, REFINE_MOST_PX = 0.4, 5
REFINED = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, 60, 1e-4)


@dataclass(frozen=True)
class Board:
    """A checkerboard.

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
    def ambiguous(self) -> bool:
        """Whether half a turn maps the board's colours onto themselves."""
        return (self.columns + self.rows) % 2 == 0


def find_board(grey: NDArray, board: Board) -> NDArray | None:
    """Find a board's corners to sub-pixel precision, row by row.

    The order starts at the corner beside a black outer square where the board allows to tell
    (one odd and one even number of corners).

    Parameters
    ----------
    grey : (h, w) uint8 array
    board : Board

    Returns
    -------
    (n, 2) array or None
        Pixel coordinates; None when the board is not seen whole.
    """
    size = (board.columns, board.rows)
    found, corners = cv2.findChessboardCorners(grey, size)
    if not found:
        found, corners = cv2.findChessboardCornersSB(grey, size)
    if not found:
        return None
    corners = corners.reshape(board.rows, board.columns, 2).astype(np.float32)
    steps = (
        np.linalg.norm(np.diff(corners, axis=0), axis=-1).min(),
        np.linalg.norm(np.diff(corners, axis=1), axis=-1).min(),
    )
    reach = int(np.clip(REFINE_SHARE * min(steps), 1, REFINE_MOST_PX))
    corners = cv2.cornerSubPix(grey, corners.reshape(-1, 1, 2), (reach, reach), (-1, -1), REFINED)
    corners = corners.reshape(-1, 2).astype(float)
    if board.ambiguous:
        return corners
    return corners if _starts_at_black(grey, corners, board) else corners[::-1].copy()


def _starts_at_black(grey: NDArray, corners: NDArray, board: Board) -> bool:
    """Whether the squares at even places from the first corner are the dark ones."""
    grid = corners.reshape(board.rows, board.columns, 2)
    middles = (grid[:-1, :-1] + grid[:-1, 1:] + grid[1:, :-1] + grid[1:, 1:]) / 4
    place = middles.astype(np.float32)
    values = cv2.remap(grey, place[..., 0], place[..., 1], cv2.INTER_LINEAR).astype(float)
    even = np.indices(values.shape).sum(axis=0) % 2 == 0
    return bool(values[even].mean() < values[~even].mean())


def board_views(
    images: Sequence[tuple[str, NDArray]], board: Board
) -> tuple[dict[str, NDArray], dict[str, str]]:
    """Find the board in images: corners of each view that shows it, and the rest's reason."""
    corners, missing = {}, {}
    for name, grey in images:
        found = find_board(grey, board)
        if found is None:
            missing[name] = "the board was not found whole"
        else:
            corners[name] = found
    return corners, missing
