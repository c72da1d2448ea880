"""A flat target and what is printed on it, and a checkerboard's corners (Section 4.1.4)."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.special import erf

from palpate.vision.camera import PinholeCamera
from palpate.vision.corners import FEWEST, Region, off_others, subpixel, without_outliers

# Where the picture about a corner is compared with the print: places from it, and blur [units].
PATCH, PATCH_BLUR, ALIKE = np.linspace(-0.3, 0.3, 9), 0.06, 0.7
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
# Corners found without a window are kept where refined ones agree so much worse.
WORSE = 1.2
# Parts of all corners, and of those of each outer row and column, that have to be right: else the
# grid may be a row beside, or a part of a larger board.
SEEN, SIDE_SEEN = 0.85, 0.5


@dataclass(frozen=True)
class Print:
    """What is printed on a target: fields of black and white between straight lines."""

    # (k,) and (l,), where the lines are, increasing [units of the target]
    u: NDArray
    v: NDArray
    # (l + 1, k + 1), 1 where a field is white, 0 where it is black; the outer ones have no end
    white: NDArray

    def blurred(
        self, u: NDArray, v: NDArray, blur_u: NDArray, blur_v: NDArray
    ) -> tuple[NDArray, ...]:
        """Whiteness (0 to 1) of places (n,) [units], and its derivatives by place and by each blur.

        Blurs are standard deviations; all are (n,).
        """
        (a, da, sa), (b, db, sb) = _parts(u, self.u, blur_u), _parts(v, self.v, blur_v)
        along, down = b @ self.white, a @ self.white.T
        pairs = (along, a), (along, da), (down, db), (along, sa), (down, sb)
        return tuple(np.einsum("ij,ij->i", *pair) for pair in pairs)

    def at(self, u: NDArray, v: NDArray) -> NDArray:
        """Whiteness of places of any shape, not blurred."""
        return self.white[np.searchsorted(self.v, v), np.searchsorted(self.u, u)]


def _parts(place: NDArray, lines: NDArray, blur: NDArray) -> tuple[NDArray, NDArray, NDArray]:
    """Shares (n, k + 1) of the fields between lines, and their derivatives by place and blur."""
    z = (place[:, None] - lines) / blur[:, None]
    beyond = (1 + erf(z / np.sqrt(2))) / 2
    bell = np.exp(-(z**2) / 2) / np.sqrt(2 * np.pi) / blur[:, None]
    steps = ((beyond, 1.0), (bell, 0.0), (-bell * z, 0.0))
    return tuple(-np.diff(step, axis=1, prepend=first, append=0.0) for step, first in steps)


class FlatBoard:
    """A printed target."""

    # (n, 3), corners: origin at the upper left one, x right, y down, z into the target
    points_m: NDArray
    outline_m: NDArray  # (2, 2), least and largest x, y of what is printed
    unit_m: float  # side of a square or a tag
    print: Print  # what is printed, in units
    ambiguous = False  # whether half a turn maps it onto itself
    described: str  # what a message calls it

    def find(self, grey: NDArray, region: Region | None = None) -> NDArray | None:
        """Find the corners to sub-pixel precision.

        Parameters
        ----------
        grey : (h, w) uint8 array
        region : Region, optional
            Where the target is looked for.

        Returns
        -------
        (n, 2) array or None
            Pixel coordinates, NaN where a corner is hidden or not right; None when too few are
            seen.

        Raises
        ------
        ValueError
            If tags are turned or elsewhere against what the target's file says.
        """
        return self._find(grey, region or Region(0, 0, *grey.shape[::-1]))

    def _in_sight(self, grey: NDArray, corners_px: NDArray) -> NDArray:
        """Corners (n, 2) that look like their print and agree with all others, else NaN [px]."""
        kept = without_outliers(corners_px, self.points_m, grey.shape)
        seen = np.isfinite(kept[:, 0])
        alike = self._likeness(grey, kept[seen], self.points_m[seen, :2] / self.unit_m)
        if self.ambiguous and np.median(alike) < 0:
            # Whose first outer square is black or white; no order depends on it.
            alike = -alike
        kept[seen] = np.where((alike > ALIKE)[:, None], kept[seen], np.nan)
        return kept

    def _likeness(self, grey: NDArray, pixels: NDArray, places: NDArray) -> NDArray:
        """Correlation (n,) of the picture about corners with their print [units]; 0 if even."""
        H = None
        if len(pixels) >= FEWEST:
            H, _ = cv2.findHomography(places, pixels, cv2.LMEDS)
        if H is None:
            return np.full(len(pixels), np.nan)
        about = places[:, None] + np.stack(np.meshgrid(PATCH, PATCH), axis=-1).reshape(-1, 2)
        at = cv2.perspectiveTransform(about.reshape(-1, 1, 2), H).reshape(about.shape)
        # Where the lens moves a corner it moves what is about it.
        at = at - cv2.perspectiveTransform(places[:, None], H) + pixels[:, None]
        x, y = np.moveaxis(at.astype(np.float32), 2, 0)
        values = cv2.remap(grey, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        u, v = about.reshape(-1, 2).T
        blur = np.full(len(u), PATCH_BLUR)
        expected = self.print.blurred(u, v, blur, blur)[0].reshape(values.shape)
        one, other = (
            part - part.mean(axis=1, keepdims=True) for part in (values.astype(float), expected)
        )
        size = np.linalg.norm(one, axis=1) * np.linalg.norm(other, axis=1)
        return (one * other).sum(axis=1) / np.maximum(size, 1e-9)


class Board(FlatBoard):
    """A checkerboard, its corners row by row.

    They are counted clockwise from the corner beside a black outer square, where the numbers of
    corners determine it (one odd and one even).

    Parameters
    ----------
    columns, rows : int
        Inner corners.
    square_m : float
    """

    def __init__(self, columns: int, rows: int, square_m: float) -> None:
        self.columns, self.rows, self.unit_m = columns, rows, square_m
        y, x = np.mgrid[:rows, :columns]
        self.points_m = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)]) * square_m
        self.outline_m = np.array([[-1, -1], [columns, rows]]) * square_m
        white = np.indices((rows + 1, columns + 1)).sum(axis=0) % 2
        self.print = Print(np.arange(columns), np.arange(rows), white)
        self.ambiguous = (columns + rows) % 2 == 0
        self.described = f"a board of {columns} x {rows} inner corners"

    def _find(self, grey: NDArray, region: Region) -> NDArray | None:
        part, size = region.cut(grey), (self.columns, self.rows)
        best = np.full((self.columns * self.rows, 2), np.nan)
        for detect, flags in DETECTORS:
            found, corners = detect(part, size, flags=flags)
            if found:
                corners = corners.reshape(self.rows, self.columns, 2) + [region.x0, region.y0]
                best = max(best, self._right(grey, corners), key=_count)
            if _count(best) == len(best):
                break
        seen = np.isfinite(best[:, 0]).reshape(self.rows, self.columns)
        sides = seen[0], seen[-1], seen[:, 0], seen[:, -1]
        whole = seen.mean() >= SEEN and all(side.mean() >= SIDE_SEEN for side in sides)
        return best if whole else None

    def _right(self, grey: NDArray, grid: NDArray) -> NDArray:
        """Those of a detector's corners that are right, in the target's order, (n, 2) [px]."""
        along, down = grid[0, -1] - grid[0, 0], grid[-1, 0] - grid[0, 0]
        if along[0] * down[1] - along[1] * down[0] < 0:
            # Counted clockwise: nobody sees a target from behind.
            grid = grid[:, ::-1]
        corners = grid.reshape(-1, 2)
        better = subpixel(grey, corners, self.points_m)
        before, after = (
            np.sqrt((off_others(found, self.points_m, grey.shape) ** 2).mean())
            for found in (corners, better)
        )
        corners = corners if WORSE * before < after else better
        turns = [corners] if self.ambiguous else [corners, corners[::-1].copy()]
        return max((self._in_sight(grey, turned) for turned in turns), key=_count)


def place_derivatives(
    u: NDArray, v: NDArray, w: NDArray, inverse: NDArray, pose: NDArray, unit_m: float
) -> tuple[NDArray, NDArray]:
    """Derivatives of u and v by rotation vector and shift of the target, (n, 6) each."""
    x, y, z = pose[:3, :2] @ (np.stack([u, v]) * w * unit_m)
    dw = [
        np.stack([z * b - y * c, x * c - z * a, y * a - x * b, -w * a, -w * b, -w * c])
        for a, b, c in inverse
    ]
    return tuple(((dw[k] - place * dw[2]) / w).T for k, place in ((0, u), (1, v)))


def pixel_sizes(
    u: NDArray, v: NDArray, w: NDArray, inverse: NDArray, camera: PinholeCamera
) -> tuple[NDArray, NDArray]:
    """Units of the target per pixel across lines of constant u and of constant v, (n,) each.

    That they change as the target moves is left out of all derivatives: it is small.
    """
    sizes = []
    for k, place in ((0, u), (1, v)):
        across, down = (
            (inverse[k, axis] - place * inverse[2, axis]) / w * (1 / focal)
            for axis, focal in ((0, camera.fx_px), (1, camera.fy_px))
        )
        sizes.append(np.sqrt(across**2 + down**2))
    return tuple(sizes)


def _count(corners: NDArray) -> int:
    return int(np.isfinite(corners[:, 0]).sum())
