"""The target that a file describes, with tags (ChArUco, AprilGrid) or without, through images.

OpenCV reads the tags, which only say about where corners are. The corners themselves are found on
the picture, each compared with all others. (Section 4.2.2)
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np
from numpy.typing import NDArray

from palpate.vision.board import Board, FlatBoard, Print
from palpate.vision.corners import FEWEST, Region, off_others, subpixel, without_outliers
from palpate.yaml_files import mismatch

# Fewest tags whose corners determine where the target is.
FEWEST_TAGS = 2
# A corner is looked for where the corners of so many tags, the nearest, put it, if one of them is
# this near [units]; and it is another's when it is found farther away than this [units].
NEAREST_TAGS, REACH, FARTHEST = 4, 1.3, 0.1
# Tags are turned, or in the other squares, where so many or more are off by more than this [px],
# and by less than this part of it when each is turned or put there.
FEWEST_TURNED, OFF_PX, TURNED = 4, 2.0, 0.2
# And elsewhere where so many, and more than this part of them, are off by more than this [units]: a
# tag that is none has another's number now and then, two in a dozen have not. Targets of the other
# order differ in one tag of every second row alone. Of a picture too coarse for most tags, those of
# which less than this part is read, the rest are misread too.
FEWEST_ELSEWHERE, SOME_ELSEWHERE, ELSEWHERE = 2, 0.1, 2.0
LEAST_READ = 1 / 3
# Margin of the region in which the target is looked for, as a part of the corners' extent: the
# outer squares take up to half of it, the rest is for motion.
MARGIN = 0.9


@dataclass(frozen=True)
class TaggedBoard(FlatBoard):
    """A target with tags."""

    points_m: NDArray
    outline_m: NDArray
    unit_m: float  # side of a square (ChArUco) or a tag (AprilGrid)
    # (k, 4, 2), corners of the tags by their numbers, clockwise from the upper left as read
    tags_m: NDArray
    dictionary: str  # OpenCV's name of the family, without DICT_
    border: int  # cells of a tag's black border
    black_m: NDArray  # (m, 2, 2), least and largest x, y of each black square
    # (k, 4, 2), corners of the tags where the other squares are white
    others_m: NDArray | None = None

    @property
    def described(self) -> str:
        """What a message calls it."""
        return f"a target with {len(self.tags_m)} tags of {self.dictionary}"

    @property
    def family(self) -> "cv2.aruco.Dictionary":
        """The tags, as OpenCV reads them."""
        return cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, f"DICT_{self.dictionary}"))

    @cached_property
    def print(self) -> Print:
        """Squares and the cells of all tags."""
        cells = [self._cells(number) for number in range(len(self.tags_m))]
        black = (np.concatenate([self.black_m, *cells]) / self.unit_m).round(9)
        u, v = (np.unique(black[..., axis]) for axis in (0, 1))
        white = np.ones((len(v) + 1, len(u) + 1))
        for square in black:
            columns, rows = np.searchsorted(u, square[:, 0]), np.searchsorted(v, square[:, 1])
            white[slice(*rows + 1), slice(*columns + 1)] = 0
        return Print(u, v, white)

    def _cells(self, number: int) -> NDArray:
        """Least and largest x, y of a tag's black cells, (m, 2, 2) [m]."""
        count = self.family.markerSize + 2 * self.border
        bits = self.family.generateImageMarker(number, count, borderBits=self.border)
        row, column = np.nonzero(bits == 0)
        origin, right, _, lower = self.tags_m[number]
        ends = [
            origin
            + np.outer((column + k) / count, right - origin)
            + np.outer((row + k) / count, lower - origin)
            for k in (0, 1)
        ]
        return np.stack([np.minimum(*ends), np.maximum(*ends)], axis=1)

    def _find(self, grey: NDArray, region: Region) -> NDArray | None:
        seen = self._tags(grey, region)
        if seen is None:
            return None
        places, pixels = seen
        about = self._expected(places, pixels)
        about[((about < 0) | (about > np.array(grey.shape[::-1]) - 1)).any(axis=1)] = np.nan
        found = subpixel(grey, about, self.points_m)
        step = self._step_px(places, pixels)
        found[np.linalg.norm(found - about, axis=1) > FARTHEST * step] = np.nan
        found = self._in_sight(grey, found)
        return found if np.isfinite(found[:, 0]).sum() >= FEWEST else None

    def _tags(self, grey: NDArray, region: Region) -> tuple[NDArray, NDArray] | None:
        """Corners (k, 4, 2) of the tags in sight: on the target [m], and in the picture [px]."""
        options = cv2.aruco.DetectorParameters()
        options.markerBorderBits = self.border
        options.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
        detector = cv2.aruco.ArucoDetector(self.family, options)
        part = region.cut(grey)
        corners, numbers = _read(detector, part)
        if len(numbers) < len(self.tags_m):
            twice = cv2.resize(part, None, fx=2, fy=2, interpolation=cv2.INTER_CUBIC)
            larger, more = _read(detector, twice)
            if len(more) > len(numbers):
                # A pixel's middle is a quarter beside that of the first of its four.
                corners, numbers = larger / 2 - 0.25, more
        known = (numbers < len(self.tags_m)) & (np.bincount(numbers)[numbers] == 1)
        if known.sum() < FEWEST_TAGS:
            return None
        pixels, numbers = corners[known].astype(float) + [region.x0, region.y0], numbers[known]
        places = self.tags_m[numbers]
        flat = places.reshape(-1, 2)
        if self.border > 1:
            # The outlines of tags that touch squares are cut at their corners.
            pixels = subpixel(grey, pixels.reshape(-1, 2), flat).reshape(pixels.shape)
        self._require_described(numbers, pixels, grey.shape)
        kept = without_outliers(pixels.reshape(-1, 2), flat, grey.shape)
        right = np.isfinite(kept.reshape(-1, 8)).all(axis=1)
        return (places[right], pixels[right]) if right.sum() >= FEWEST_TAGS else None

    def _require_described(self, numbers: NDArray, pixels: NDArray, shape: tuple[int, int]) -> None:
        """Reject tags that are turned, in the other squares, or elsewhere than the file says."""

        def off_px(pixels: NDArray, places: NDArray) -> NDArray:
            return off_others(pixels.reshape(-1, 2), places.reshape(-1, 2), shape)

        places = self.tags_m[numbers]
        off = off_px(pixels, places)
        if len(places) >= FEWEST_TURNED and np.median(off) > OFF_PX:
            limit = TURNED * np.median(off)
            for turns in (1, 2, 3):
                if np.median(off_px(np.roll(pixels, turns, axis=1), places)) < limit:
                    found = f"each turned by {90 * turns} degrees (tag_turns?)"
                    raise mismatch("marker", f"tags as {self.dictionary} has them", found)
            others = None if self.others_m is None else self.others_m[numbers]
            if others is not None and np.median(off_px(pixels, others)) < limit:
                found = "them in the other squares (white_first: true or false?)"
                raise mismatch("marker", "its tags where the file's white_first puts them", found)
        far = np.median(off.reshape(-1, 4), axis=1) > ELSEWHERE * self._step_px(places, pixels)
        enough = len(far) >= max(FEWEST_TURNED, LEAST_READ * len(self.tags_m))
        if enough and far.sum() >= FEWEST_ELSEWHERE and far.mean() > SOME_ELSEWHERE:
            expected = "its tags where the file's counts, sides and white_first put them"
            raise mismatch("marker", expected, f"{far.sum()} of {len(far)} elsewhere")

    def _expected(self, places: NDArray, pixels: NDArray) -> NDArray:
        """Where the nearest tags put each corner, (n, 2) [px]; NaN where none is near."""
        apart = np.linalg.norm(self.points_m[:, None, None, :2] - places, axis=-1).min(axis=2)
        expected = np.full((len(self.points_m), 2), np.nan)
        for k in np.flatnonzero(apart.min(axis=1) < REACH * self.unit_m):
            near = np.argsort(apart[k], kind="stable")[:NEAREST_TAGS]
            middle = self.points_m[k, :2]
            about = (places[near].reshape(-1, 2) - middle) / self.unit_m
            H, _ = cv2.findHomography(about, pixels[near].reshape(-1, 2))
            if H is not None and abs(H[2, 2]) > 0:
                expected[k] = H[:2, 2] / H[2, 2]
        return expected

    def _step_px(self, places: NDArray, pixels: NDArray) -> float:
        """About how many pixels a unit takes."""
        side_m, side_px = (
            np.linalg.norm(np.roll(c, 1, axis=1) - c, axis=-1).mean() for c in (places, pixels)
        )
        return side_px / side_m * self.unit_m


def _read(detector: "cv2.aruco.ArucoDetector", grey: NDArray) -> tuple[NDArray, NDArray]:
    """Corners (k, 4, 2) [px] and numbers (k,) of the tags that OpenCV reads."""
    corners, numbers, _ = detector.detectMarkers(grey)
    if numbers is None:
        return np.zeros((0, 4, 2)), np.zeros(0, dtype=int)
    return np.concatenate(corners), numbers.ravel()


def charuco(marker: Mapping) -> TaggedBoard:
    """Make a checkerboard with a tag in each white square, of a `palpate.config.probe.TargetSpec`.

    OpenCV's boards of an even number of rows had ``white_first`` before its version 4.6
    (``setLegacyPattern``).
    """
    square_m, tag_m = float(marker["square_m"]), float(marker["tag_m"])
    columns, rows = marker["squares"]
    row, column = np.indices((rows, columns))
    white = (row + column) % 2 == (0 if marker.get("white_first") else 1)
    lower = np.stack([column, row], axis=-1) * square_m - square_m
    gap_m = (square_m - tag_m) / 2
    y, x = np.mgrid[: rows - 1, : columns - 1]
    return TaggedBoard(
        points_m=np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)]) * square_m,
        outline_m=np.array([[-1, -1], [columns - 1, rows - 1]]) * square_m,
        unit_m=square_m,
        tags_m=_squares(lower[white] + gap_m, tag_m),
        dictionary=marker["dictionary"],
        border=1,
        black_m=np.stack([lower[~white], lower[~white] + square_m], axis=1),
        others_m=_squares(lower[~white] + gap_m, tag_m) if white.size % 2 == 0 else None,
    )


def april_grid(marker: Mapping) -> TaggedBoard:
    """Make tags with black squares between their corners, of a `palpate.config.probe.TargetSpec`.

    As Kalibr prints them: tag 0 is at the lower left; they are counted to the right, then up. The
    frame's origin is the upper left tag's upper left corner.
    """
    tag_m, gap_m = float(marker["tag_m"]), float(marker["gap_m"])
    columns, rows = marker["tags"]
    row, column = np.indices((rows, columns))
    step_m = tag_m + gap_m
    upper = np.stack([column, rows - 1 - row], axis=-1).reshape(-1, 2) * step_m
    corners = _squares(upper, tag_m)
    flat = corners.reshape(-1, 2)
    y, x = np.mgrid[: rows + 1, : columns + 1]
    between = np.column_stack([x.ravel(), y.ravel()]) * step_m - gap_m
    return TaggedBoard(
        points_m=np.column_stack([flat, np.zeros(len(flat))]),
        outline_m=np.array([[-gap_m, -gap_m], np.array([columns, rows]) * step_m]),
        unit_m=tag_m,
        tags_m=np.roll(corners, -marker.get("tag_turns", 0), axis=1),
        dictionary=marker["dictionary"],
        border=2,
        black_m=np.stack([between, between + gap_m], axis=1),
    )


def _squares(lower_m: NDArray, side_m: float) -> NDArray:
    """Corners (k, 4, 2) of squares, clockwise from the upper left [m]."""
    return lower_m[:, None] + side_m * np.array([[0, 0], [1, 0], [1, 1], [0, 1]])


def board_of(marker: Mapping) -> FlatBoard:
    """Make the target of a ``marker`` block that `palpate.config.probe.TargetSpec` has checked."""
    if make := {"charuco": charuco, "aprilgrid": april_grid}.get(marker.get("kind")):
        return make(marker)
    return Board(*marker["inner_corners"], float(marker["square_m"]))


def expected_region(last: NDArray, before: NDArray | None, shape: tuple[int, int]) -> Region | None:
    """Where the target should be next, moving on as it did; None when it leaves the image.

    By its corners (n, 2) in the last frame and the one before it, NaN where one was hidden [px],
    and the image's ``shape`` (h, w).
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
