"""Corners of a flat board in a picture: held to all others and to the print, and refined."""

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from palpate.vision.board_picture import Print

# Corners to each number of a lens that one picture tells, and the most such numbers.
CORNERS_A_TERM, MOST_TERMS = 12, 2
FEWEST, EVALUATIONS = 6, 30
# Corners all as near to one homography as this need no closer look [px].
CLEAR_PX = 0.25
# What a corner may be off before it counts for less [px].
LEAST_DEVIATION_PX = 0.1
# A corner is wrong this many deviations from where the others put it, but never nearer than the
# first of these, and always beyond the second [px].
OUTLIER, LIMITS_PX = 6.0, (1.0, 1.5)
# Where the picture about a corner is held to the print: places from it, and blur [units].
PATCH, PATCH_BLUR, ALIKE = np.linspace(-0.3, 0.3, 9), 0.06, 0.7
# Half the window of a refinement, as a part of the least distance between corners, and its most
# pixels: what lies beyond the next corner's edges is that one's.
REFINE_SHARE, REFINE_MOST_PX = 0.4, 5
# Corners found without a window are kept where refined ones agree so much worse.
WORSE = 1.2
REFINED = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, 60, 1e-4)


@dataclass(frozen=True)
class Region:
    """Part of an image: rows ``y0`` to ``y1`` and columns ``x0`` to ``x1``, ends left out [px]."""

    x0: int
    y0: int
    x1: int
    y1: int

    def cut(self, grey: NDArray) -> NDArray:
        """The part of an image (h, w)."""
        return np.ascontiguousarray(grey[self.y0 : self.y1, self.x0 : self.x1])


def whole(grey: NDArray) -> Region:
    """All of an image (h, w)."""
    return Region(0, 0, grey.shape[1], grey.shape[0])


def off_others(corners_px: NDArray, points_m: NDArray, shape: tuple[int, int]) -> NDArray:
    """How far each corner is from where all others put it: a homography through a lens.

    The lens bends radially about the picture's middle, by as many terms as the corners tell.

    Parameters
    ----------
    corners_px : (n, 2) array
        Corners, NaN where one was not seen [px].
    points_m : (n, 2) or (n, 3) array
        Their places on the board [m].
    shape : (h, w)
        Of the picture [px].

    Returns
    -------
    (n,) array
        Distances [px]; NaN where a corner was not seen, or where too few were.
    """
    seen, found = np.isfinite(corners_px[:, 0]), np.full(len(corners_px), np.nan)
    if seen.sum() < FEWEST:
        return found
    scale = max(shape) / 2
    places = points_m[seen, :2] - points_m[seen, :2].mean(axis=0)
    places = places / max(np.abs(places).max(), 1e-12)
    pixels = (corners_px[seen] - [(shape[1] - 1) / 2, (shape[0] - 1) / 2]) / scale
    off = _off_plane(places, pixels) * scale
    if off.max() > CLEAR_PX:
        off = _off_bent(places, pixels, scale) * scale
    found[seen] = off
    return found


def _off_plane(places: NDArray, pixels: NDArray) -> NDArray:
    """Distances (n,) from one homography; infinite where there is none."""
    H, _ = cv2.findHomography(places, pixels)
    if H is None:
        return np.full(len(places), np.inf)
    return np.linalg.norm(pixels - cv2.perspectiveTransform(places[:, None], H)[:, 0], axis=1)


def _off_bent(places: NDArray, pixels: NDArray, scale: float) -> NDArray:
    """Distances (n,) from a homography and a lens that few corners do not pull."""
    H, _ = cv2.findHomography(places, pixels, cv2.LMEDS)
    if H is None or abs(H[2, 2]) < 1e-9:
        return np.full(len(places), np.inf)
    terms = min(len(places) // CORNERS_A_TERM, MOST_TERMS)
    known, off = np.concatenate([(H / H[2, 2]).ravel()[:8], np.zeros(terms)]), None
    # Heavy tails have many minima: they come after what is convex.
    for loss in ("soft_l1", "cauchy"):
        fit = least_squares(
            lambda q: (_seen(places, q) - pixels).ravel(),
            known,
            loss=loss,
            f_scale=LEAST_DEVIATION_PX / scale,
            x_scale="jac",
            max_nfev=EVALUATIONS,
        )
        known, off = fit.x, fit.fun
    return np.linalg.norm(off.reshape(-1, 2), axis=1)


def _seen(places: NDArray, parameters: NDArray) -> NDArray:
    """Places on a board in a picture about its middle, (n, 2) [half pictures]."""
    H, lens = np.append(parameters[:8], 1).reshape(3, 3), parameters[8:]
    x, y, w = H @ np.column_stack([places, np.ones(len(places))]).T
    straight = np.column_stack([x / w, y / w])
    r2 = (straight**2).sum(axis=1)
    bend = 1 + sum(k * r2 ** (i + 1) for i, k in enumerate(lens))
    return straight * np.reshape(bend, (-1, 1))


def _deviation(off: NDArray) -> float:
    """Standard deviation of a coordinate, by the median of distances (Rayleigh)."""
    return max(float(np.median(off)) / np.sqrt(2 * np.log(2)), LEAST_DEVIATION_PX)


def without_outliers(corners_px: NDArray, points_m: NDArray, shape: tuple[int, int]) -> NDArray:
    """Corners without those that all others contradict.

    Parameters
    ----------
    corners_px : (n, 2) array
        NaN where a corner was not seen [px].
    points_m : (n, 2) or (n, 3) array
        Places on the board [m].
    shape : (h, w)
        Of the picture [px].

    Returns
    -------
    (n, 2) array
        Right or NaN [px].
    """
    kept = corners_px.copy()
    while True:
        off = off_others(kept, points_m, shape)
        if not np.isfinite(off).any():
            return kept
        limit = np.clip(OUTLIER * _deviation(off[np.isfinite(off)]), *LIMITS_PX)
        if not np.nanmax(off) > limit:
            return kept
        kept[off > limit] = np.nan


def refined(grey: NDArray, corners_px: NDArray, points_m: NDArray) -> NDArray:
    """Corners refined on the picture, or as found where they agree better with each other.

    Parameters
    ----------
    grey : (h, w) uint8 array
    corners_px : (n, 2) array
        NaN where a corner was not seen [px].
    points_m : (n, 2) or (n, 3) array
        Places on the board [m].

    Returns
    -------
    (n, 2) array [px]
    """
    better = subpixel(grey, corners_px, points_m)
    before, after = (rms_off(ways, points_m, grey.shape) for ways in (corners_px, better))
    return corners_px if WORSE * before < after else better


def rms_off(corners_px: NDArray, points_m: NDArray, shape: tuple[int, int]) -> float:
    """Root mean square of `off_others` [px]; NaN where too few corners were seen."""
    off = off_others(corners_px, points_m, shape)
    off = off[np.isfinite(off)]
    return float(np.sqrt((off**2).mean())) if len(off) else float("nan")


def subpixel(grey: NDArray, corners_px: NDArray, points_m: NDArray) -> NDArray:
    """Corners refined on the brightness about them (`cv2.cornerSubPix`), (n, 2) [px]."""
    seen = np.isfinite(corners_px[:, 0])
    if not seen.any():
        return corners_px
    reach = half_window(corners_px[seen], points_m[seen])
    start = np.ascontiguousarray(corners_px[seen], dtype=np.float32).reshape(-1, 1, 2)
    found = corners_px.copy()
    found[seen] = cv2.cornerSubPix(grey, start, (reach, reach), (-1, -1), REFINED).reshape(-1, 2)
    return found


def half_window(corners_px: NDArray, points_m: NDArray) -> int:
    """Half size of a window that does not reach the next corner [px]."""
    places = np.linalg.norm(points_m[:, None, :2] - points_m[:, :2], axis=-1)
    np.fill_diagonal(places, np.inf)
    nearest = places.argmin(axis=1)
    step = np.linalg.norm(corners_px - corners_px[nearest], axis=1).min()
    return int(np.clip(REFINE_SHARE * step, 1, REFINE_MOST_PX))


def likeness(
    grey: NDArray, corners_px: NDArray, points_m: NDArray, unit_m: float, printed: Print
) -> NDArray:
    """How much the picture about each corner is like what is printed there.

    Parameters
    ----------
    grey : (h, w) uint8 array
    corners_px : (n, 2) array
        NaN where a corner was not seen [px].
    points_m : (n, 3) array
        Places on the board [m].
    unit_m : float
        Unit of what is printed.
    printed : Print

    Returns
    -------
    (n,) array
        Coefficients of correlation; 0 where the picture is even, NaN where a corner was not seen.
    """
    seen, found = np.isfinite(corners_px[:, 0]), np.full(len(corners_px), np.nan)
    if seen.sum() < FEWEST:
        return found
    places, pixels = points_m[seen, :2] / unit_m, corners_px[seen]
    H, _ = cv2.findHomography(places, pixels, cv2.LMEDS)
    if H is None:
        return found
    x, y = (axis.ravel() for axis in np.meshgrid(PATCH, PATCH))
    about = places[:, None] + np.column_stack([x, y])
    straight = cv2.perspectiveTransform(places[:, None], H)
    # Where the lens moves a corner it moves what is about it.
    at = cv2.perspectiveTransform(about.reshape(-1, 1, 2), H).reshape(about.shape)
    at = (at - straight + pixels[:, None]).astype(np.float32)
    values = cv2.remap(
        grey, at[..., 0], at[..., 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
    )
    u, v = about.reshape(-1, 2).T
    blur = np.full(len(u), PATCH_BLUR)
    expected = printed.blurred(u, v, blur, blur).white.reshape(values.shape)
    one, other = (
        part - part.mean(axis=1, keepdims=True) for part in (values.astype(float), expected)
    )
    size = np.linalg.norm(one, axis=1) * np.linalg.norm(other, axis=1)
    found[seen] = (one * other).sum(axis=1) / np.maximum(size, 1e-9)
    return found


def in_sight(grey: NDArray, corners_px: NDArray, board: Any) -> NDArray:
    """Corners that look like what is printed about them and agree with all others, else NaN.

    Parameters
    ----------
    grey : (h, w) uint8 array
    corners_px : (n, 2) array
        NaN where a corner was not seen [px].
    board : palpate.vision.board.FlatBoard

    Returns
    -------
    (n, 2) array [px]
    """
    kept = without_outliers(corners_px, board.points_m, grey.shape)
    alike = likeness(grey, kept, board.points_m, board.unit_m, board.print)
    if board.ambiguous and np.nanmedian(alike) < 0:
        # Whose first outer square is black or white; no order hangs on it.
        alike = -alike
    kept[~(alike > ALIKE)] = np.nan
    return kept
