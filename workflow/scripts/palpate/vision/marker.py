"""The target that a file describes, followed through images by its corners (Section 4.2.2)."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from palpate.vision.board import Board, FlatBoard
from palpate.vision.corners import Region
from palpate.vision.tags import april_grid, charuco

# Margin of the region in which the target is looked for, as a part of the corners' extent: the
# outer squares take up to half of it, the rest is for motion.
MARGIN = 0.9


def board_of(marker: Mapping) -> FlatBoard:
    """Make the target of a ``marker`` block that `palpate.config.probe.TargetSpec` has checked."""
    tagged = {"charuco": charuco, "aprilgrid": april_grid}
    if make := tagged.get(marker.get("kind")):
        return make(marker)
    return Board(*marker["inner_corners"], float(marker["square_m"]))


def expected_region(last: NDArray, before: NDArray | None, shape: tuple[int, int]) -> Region | None:
    """Where the target should be next, moving on as it did.

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
    """Find the target frame by frame: where its motion leads, then in the whole picture.

    Parameters
    ----------
    board : FlatBoard

    Attributes
    ----------
    faults : list of ValueError
        Of pictures that seem to show another target, which count as not showing it.
    """

    def __init__(self, board: FlatBoard) -> None:
        self.board, self.last, self.before = board, None, None
        self.faults, self.seen = [], 0

    def __call__(self, grey: NDArray) -> NDArray | None:
        """Corners (n, 2) in the next frame, a (h, w) uint8 array [px]; None when it is not seen."""
        region, corners = None, None
        if self.last is not None:
            region = expected_region(self.last, self.before, grey.shape)
        try:
            if region is not None:
                corners = self.board.find(grey, region)
            if corners is None:
                corners = self.board.find(grey)
        except ValueError as error:
            self.faults.append(error)
        if corners is None:
            self.before = None
        else:
            self.before, self.last, self.seen = self.last, corners, self.seen + 1
        return corners

    def require_right(self) -> None:
        """Reject a recording most of whose pictures seem to show another, by a `ValueError`."""
        if len(self.faults) > self.seen:
            count = f"{len(self.faults)} of {len(self.faults) + self.seen} pictures with tags"
            raise ValueError(f"{self.faults[0]} (so in {count})")
