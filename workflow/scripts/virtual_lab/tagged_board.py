"""A ChArUco board as OpenCV draws it, as a part of a scene."""

from collections.abc import Mapping
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates

from virtual_lab.probe_board import BLACK, BOARD_THICKNESS_M, WHITE, Board

# Pixels to a square that are tried, so that tags and their cells are whole numbers of them.
PIXELS = range(8, 401)


@dataclass(frozen=True)
class TaggedBoard(Board):
    """A ChArUco board.

    Attributes
    ----------
    squares : tuple of int
        Along x and y.
    square_m : float
    black : (h + 1, w + 1) array
        Sums of the pixels that are black, above and left of each pixel's corner.
    pixels : int
        To a square.
    """

    black: NDArray
    pixels: int

    def colour(self, points_m: NDArray, footprint_m: NDArray) -> NDArray:
        """Reflectance at points of the board's frame, box-filtered over footprints, (n, 3)."""
        x, y, z = (points_m / self.square_m).T
        half = footprint_m / self.square_m / 2
        low, high = (np.stack([y, x]) + 1 + sign * half for sign in (-1, 1))
        sums = [
            map_coordinates(self.black, self.pixels * np.stack(ends), order=1, mode="nearest")
            for ends in (high, (low[0], high[1]), (high[0], low[1]), low)
        ]
        area = (2 * half * self.pixels) ** 2
        dark = (sums[0] - sums[1] - sums[2] + sums[3]) / area
        dark *= z < 0.5 * BOARD_THICKNESS_M / self.square_m
        return np.repeat((WHITE + (BLACK - WHITE) * dark)[:, None], 3, axis=1)


def tagged_board(marker: Mapping) -> TaggedBoard:
    """Draw the board of a ``marker`` block of kind ``charuco``.

    Raises
    ------
    ValueError
        If its tags' cells and squares have no common measure.
    """
    squares, share = tuple(marker["squares"]), marker["tag_m"] / marker["square_m"]
    name = getattr(cv2.aruco, f"DICT_{marker['dictionary']}")
    dictionary = cv2.aruco.getPredefinedDictionary(name)
    cells = dictionary.markerSize + 2
    fitting = (n for n in PIXELS if _whole(n * share / cells) and _whole((n - n * share) / 2))
    pixels = next(fitting, None)
    if pixels is None:
        raise ValueError(
            f"marker.tag_m: expected a simple part of square_m for the lab's board, found {share:g}"
        )
    board = cv2.aruco.CharucoBoard(squares, 1.0, share, dictionary)
    board.setLegacyPattern(bool(marker.get("white_first")))
    image = board.generateImage((squares[0] * pixels, squares[1] * pixels), marginSize=0)
    black = np.pad((image < 128).astype(float), ((1, 0), (1, 0))).cumsum(axis=0).cumsum(axis=1)
    return TaggedBoard(squares, marker["square_m"], black, pixels)


def _whole(value: float) -> bool:
    return abs(value - round(value)) < 1e-6
