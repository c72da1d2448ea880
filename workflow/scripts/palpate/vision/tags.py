"""Boards with tags, which say which of their corners are seen: ChArUco and AprilGrid.

Tags are read by OpenCV; they only say where corners are about. The corners themselves are found on
the picture, each held to all others.
"""

from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np
from numpy.typing import NDArray

from palpate.vision.board_picture import Print
from palpate.vision.corners import (
    Region,
    in_sight,
    off_others,
    subpixel,
    whole,
    without_outliers,
)

# Fewest tags whose corners hold each other.
FEWEST_TAGS = 2
FEWEST_CORNERS = 6
# A corner is looked for where the corners of so many tags, the nearest, put it, if one of them is
# this near [units]; and it is another's when it is found farther away than this [units].
NEAREST_TAGS, REACH, FARTHEST = 4, 1.3, 0.1
# Tags are turned where so many or more are off by more than this [px], and by less than this part
# of it when each is turned.
FEWEST_TURNED, OFF_PX, TURNED = 4, 2.0, 0.2
# And elsewhere where so many, and more than this part of them, are off by more than this [units]: a
# tag that is none has another's number now and then, two in a dozen have not. Boards of the other
# order differ in one tag of every second row alone. Of a picture too coarse for most tags, those of
# which less than this part is read, the rest are misread too.
FEWEST_ELSEWHERE, SOME_ELSEWHERE, ELSEWHERE = 2, 0.1, 2.0
LEAST_READ = 1 / 3


@dataclass(frozen=True)
class TaggedBoard:
    """A board with tags; a `palpate.vision.board.FlatBoard`.

    Attributes
    ----------
    points_m : (n, 3) array
        Corners in the board's frame: origin at the upper left one, x right, y down, z into the
        board.
    tags_m : (k, 4, 2) array
        Corners of the tags, clockwise from their upper left, as they are read.
    ids : (k,) array
    unit_m : float
        Side of a square (ChArUco) or a tag (AprilGrid).
    dictionary : str
        OpenCV's name of the family, without DICT_.
    border : int
        Cells of a tag's black border.
    outline_m : (2, 2) array
        Least and largest x, y of what is printed.
    black_m : (m, 2, 2) array
        Least and largest x, y of each black square.
    others_m : (k, 4, 2) array, optional
        Corners of the tags where the other squares are white.
    """

    points_m: NDArray
    tags_m: NDArray
    ids: NDArray
    unit_m: float
    dictionary: str
    border: int
    outline_m: NDArray
    black_m: NDArray
    others_m: NDArray | None = None

    ambiguous = False

    @property
    def described(self) -> str:
        """What a message calls it."""
        return f"a board with {len(self.ids)} tags of {self.dictionary}"

    @cached_property
    def print(self) -> Print:
        """Squares and the cells of all tags."""
        cells = [
            self._cells(tag, int(name)) for tag, name in zip(self.tags_m, self.ids, strict=True)
        ]
        black = np.concatenate([self.black_m, *cells]) / self.unit_m
        u, v = (np.unique(np.round(black[..., axis], 9)) for axis in (0, 1))
        white = np.ones((len(v) + 1, len(u) + 1))
        for (left, top), (right, bottom) in black.round(9):
            columns = slice(np.searchsorted(u, left) + 1, np.searchsorted(u, right) + 1)
            white[np.searchsorted(v, top) + 1 : np.searchsorted(v, bottom) + 1, columns] = 0
        return Print(u, v, white)

    def _cells(self, tag_m: NDArray, name: int) -> NDArray:
        """Least and largest x, y of a tag's black cells, (m, 2, 2) [m]."""
        dictionary = dictionary_of(self.dictionary)
        count = dictionary.markerSize + 2 * self.border
        bits = dictionary.generateImageMarker(name, count, borderBits=self.border)
        row, column = np.nonzero(bits == 0)
        origin, along, down = tag_m[0], tag_m[1] - tag_m[0], tag_m[3] - tag_m[0]
        ends = [
            origin + np.outer((column + k) / count, along) + np.outer((row + k) / count, down)
            for k in (0, 1)
        ]
        return np.stack([np.minimum(*ends), np.maximum(*ends)], axis=1)

    def find(self, grey: NDArray, region: Region | None = None) -> NDArray | None:
        """Find the corners that the tags say are in sight.

        Parameters
        ----------
        grey : (h, w) uint8 array
        region : Region, optional
            Where the board is looked for.

        Returns
        -------
        (n, 2) array or None
            Pixel coordinates, NaN where a corner is hidden or not right; None when too little of
            the board is seen.

        Raises
        ------
        ValueError
            If its tags are turned or elsewhere against what its file says.
        """
        seen = self._tags(grey, region or whole(grey))
        if seen is None:
            return None
        places, pixels = seen
        about = self._expected(places, pixels)
        about[((about < 0) | (about > np.array(grey.shape[::-1]) - 1)).any(axis=1)] = np.nan
        found = subpixel(grey, about, self.points_m)
        step = self._step_px(places, pixels)
        found[np.linalg.norm(found - about, axis=1) > FARTHEST * step] = np.nan
        found = in_sight(grey, found, self)
        return found if np.isfinite(found[:, 0]).sum() >= FEWEST_CORNERS else None

    def _tags(self, grey: NDArray, region: Region) -> tuple[NDArray, NDArray] | None:
        """Corners of the tags in sight on the board [m] and in the picture [px], (k, 4, 2) each."""
        options = cv2.aruco.DetectorParameters()
        options.markerBorderBits = self.border
        options.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
        detector = cv2.aruco.ArucoDetector(dictionary_of(self.dictionary), options)
        part = region.cut(grey)
        corners, names, _ = detector.detectMarkers(part)
        if names is None or len(names) < len(self.ids):
            twice = cv2.resize(part, None, fx=2, fy=2, interpolation=cv2.INTER_CUBIC)
            larger, more, _ = detector.detectMarkers(twice)
            if more is not None and len(more) > (0 if names is None else len(names)):
                # A pixel's middle is a quarter beside that of the first of its four.
                corners, names = [part / 2 - 0.25 for part in larger], more
        if names is None:
            return None
        names = names.ravel()
        known = np.isin(names, self.ids) & (np.bincount(names)[names] == 1)
        if known.sum() < FEWEST_TAGS:
            return None
        pixels = np.concatenate(corners)[known].astype(float) + [region.x0, region.y0]
        places = self.tags_m[np.searchsorted(self.ids, names[known])]
        if self.border > 1:
            # The outlines of tags that touch squares are cut at their corners.
            flat = subpixel(grey, pixels.reshape(-1, 2), places.reshape(-1, 2))
            pixels = flat.reshape(pixels.shape)
        flat = places.reshape(-1, 2)
        off = off_others(pixels.reshape(-1, 2), flat, grey.shape)
        if len(places) >= FEWEST_TURNED and np.median(off) > OFF_PX:
            self._check_turn(flat, pixels, float(np.median(off)), grey.shape)
            self._check_order(names[known], pixels, float(np.median(off)), grey.shape)
        self._check_places(off.reshape(-1, 4), self._step_px(places, pixels))
        kept = without_outliers(pixels.reshape(-1, 2), flat, grey.shape)
        right = np.isfinite(kept.reshape(-1, 8)).all(axis=1)
        return (places[right], pixels[right]) if right.sum() >= FEWEST_TAGS else None

    def _check_turn(
        self, flat: NDArray, pixels: NDArray, off_px: float, shape: tuple[int, int]
    ) -> None:
        """Refuse tags that fit the board only if each is turned by the same right angles."""
        for turns in (1, 2, 3):
            turned = np.roll(pixels, turns, axis=1).reshape(-1, 2)
            if np.median(off_others(turned, flat, shape)) < TURNED * off_px:
                raise ValueError(
                    f"marker: expected tags as {self.dictionary} has them, found each turned by"
                    f" {90 * turns} degrees (tag_turns?)"
                )

    def _check_order(
        self, names: NDArray, pixels: NDArray, off_px: float, shape: tuple[int, int]
    ) -> None:
        """Reject tags that fit the board only in the other squares."""
        if self.others_m is None:
            return
        others = self.others_m[np.searchsorted(self.ids, names)].reshape(-1, 2)
        if np.median(off_others(pixels.reshape(-1, 2), others, shape)) < TURNED * off_px:
            raise ValueError(
                "marker: expected its tags where the file's white_first puts them, found them in"
                " the other squares (white_first: true or false?)"
            )

    def _check_places(self, off_px: NDArray, step_px: float) -> None:
        """Refuse tags elsewhere than the file says, by their corners' distances (k, 4)."""
        far = np.median(off_px, axis=1) > ELSEWHERE * step_px
        if len(far) < max(FEWEST_TURNED, LEAST_READ * len(self.ids)):
            return
        if far.sum() >= FEWEST_ELSEWHERE and far.mean() > SOME_ELSEWHERE:
            raise ValueError(
                "marker: expected its tags where the file's counts, sides and white_first put them,"
                f" found {far.sum()} of {len(far)} elsewhere"
            )

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


def dictionary_of(name: str) -> "cv2.aruco.Dictionary":
    """A dictionary of OpenCV by its name without DICT_."""
    return cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, f"DICT_{name}"))


def charuco(
    squares: tuple[int, int], square_m: float, tag_m: float, dictionary: str, *, white_first: bool
) -> TaggedBoard:
    """A checkerboard with a tag in each white square.

    Parameters
    ----------
    squares : (int, int)
        Along x and y.
    square_m, tag_m : float
        Sides of a square and of a tag, its border included.
    dictionary : str
        OpenCV's name of the family, without DICT_, with a tag for each white square.
    white_first : bool
        Whether the upper left square is white, as OpenCV's boards of an even number of rows were
        before its version 4.6 (``setLegacyPattern``).

    Raises
    ------
    ValueError
        If the tags do not fit into the squares, or there are too few.
    """
    columns, rows = squares
    if not 0 < tag_m < square_m:
        raise ValueError(f"tag_m: expected less than square_m ({square_m:g}), found {tag_m:g}")
    row, column = np.indices((rows, columns))
    white = (row + column) % 2 == (0 if white_first else 1)
    _check_ids(dictionary, int(white.sum()))
    lower = np.stack([column, row], axis=-1) * square_m - square_m
    gap_m = (square_m - tag_m) / 2
    y, x = np.mgrid[: rows - 1, : columns - 1]
    return TaggedBoard(
        points_m=np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)]) * square_m,
        tags_m=_squares(lower[white] + gap_m, tag_m),
        ids=np.arange(white.sum()),
        unit_m=square_m,
        dictionary=dictionary,
        border=1,
        outline_m=np.array([[-1, -1], [columns - 1, rows - 1]]) * square_m,
        black_m=np.stack([lower[~white], lower[~white] + square_m], axis=1),
        others_m=_squares(lower[~white] + gap_m, tag_m) if white.size % 2 == 0 else None,
    )


def april_grid(
    tags: tuple[int, int], tag_m: float, gap_m: float, dictionary: str, *, turns: int = 0
) -> TaggedBoard:
    """Tags with black squares between their corners, as Kalibr prints them.

    Tag 0 is at the lower left; they are counted to the right, then up. The frame's origin is the
    upper left tag's upper left corner.

    Parameters
    ----------
    tags : (int, int)
        Along x and y.
    tag_m, gap_m : float
        Side of a tag, its border of two cells included, and what is between two.
    dictionary : str
        OpenCV's name of the family, without DICT_, as APRILTAG_36H11.
    turns : int
        Right angles, clockwise, by which each tag is turned against OpenCV's.

    Raises
    ------
    ValueError
        If there are too few tags.
    """
    columns, rows = tags
    _check_ids(dictionary, columns * rows)
    row, column = np.indices((rows, columns))
    step_m = tag_m + gap_m
    upper = np.stack([column, rows - 1 - row], axis=-1).reshape(-1, 2) * step_m
    corners = _squares(upper, tag_m)
    y, x = np.mgrid[: rows + 1, : columns + 1]
    between = np.column_stack([x.ravel(), y.ravel()]) * step_m - gap_m
    flat = corners.reshape(-1, 2)
    last = np.array([columns, rows]) * step_m
    return TaggedBoard(
        points_m=np.column_stack([flat, np.zeros(len(flat))]),
        tags_m=np.roll(corners, -turns, axis=1),
        ids=np.arange(columns * rows),
        unit_m=tag_m,
        dictionary=dictionary,
        border=2,
        outline_m=np.array([[-gap_m, -gap_m], last]),
        black_m=np.stack([between, between + gap_m], axis=1),
    )


def _squares(lower_m: NDArray, side_m: float) -> NDArray:
    """Corners (k, 4, 2) of squares, clockwise from the upper left [m]."""
    return lower_m[:, None] + side_m * np.array([[0, 0], [1, 0], [1, 1], [0, 1]])


def _check_ids(dictionary: str, count: int) -> None:
    available = len(dictionary_of(dictionary).bytesList)
    if count > available:
        raise ValueError(
            f"dictionary: expected one with {count} tags or more, found {dictionary} with"
            f" {available}"
        )
