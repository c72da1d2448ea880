"""A checkerboard as a part of a scene."""

from dataclasses import dataclass

import numpy as np
import trimesh
from numpy.typing import NDArray

# Linear reflectance of paper and ink.
WHITE, BLACK = 0.80, 0.030
BOARD_MARGIN_M = 0.016
BOARD_THICKNESS_M = 0.003


@dataclass(frozen=True)
class Board:
    """A checkerboard whose first outer square is black.

    Attributes
    ----------
    squares : tuple of int
        Squares along x and y.
    square_m : float
    """

    squares: tuple[int, int]
    square_m: float

    def mesh(self) -> tuple[NDArray, NDArray]:
        """Vertices (n, 3) [m] and triangles of the board in its own frame (first inner corner)."""
        square, (columns, rows) = self.square_m, self.squares
        margin = square + BOARD_MARGIN_M
        low = np.array([-margin, -margin, 0.0])
        last = np.array([columns - 2, rows - 2]) * square + margin
        high = np.array([*last, BOARD_THICKNESS_M])
        box = trimesh.creation.box(extents=high - low)
        return box.vertices + (low + high) / 2, box.faces

    def colour(self, points_m: NDArray, footprint_m: NDArray) -> NDArray:
        """Reflectance at points of the board's frame, box-filtered over footprints, (n, 3)."""
        x, y, z = (points_m / self.square_m).T
        width = footprint_m / self.square_m
        # The origin corner lies one square in from the outer corner, whose square is black.
        dark = 0.5 + 0.5 * _square_wave(x + 1, width) * _square_wave(y + 1, width)
        dark *= _inside(x + 1, self.squares[0], width) * _inside(y + 1, self.squares[1], width)
        dark *= z < 0.5 * BOARD_THICKNESS_M / self.square_m
        return np.repeat((WHITE + (BLACK - WHITE) * dark)[:, None], 3, axis=1)


def _square_wave(x: NDArray, width: NDArray) -> NDArray:
    """Mean over a width of the wave that is 1 on [0, 1) and -1 on [1, 2)."""

    def integral(s: NDArray) -> NDArray:
        return 1 - np.abs(np.mod(s, 2) - 1)

    return (integral(x + width / 2) - integral(x - width / 2)) / width


def _inside(x: NDArray, size: float, width: NDArray) -> NDArray:
    return np.clip(np.minimum(x, size - x) / width + 0.5, 0, 1)
