"""Corners of a flat target in a picture: refined, and compared with all others."""

from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

# Corners to each number of a lens that one picture determines, and the most such numbers.
CORNERS_A_TERM, MOST_TERMS = 12, 2
FEWEST, EVALUATIONS = 6, 30
# Corners all as near to one homography as this need no closer look [px].
CLEAR_PX = 0.25
# What a corner may be off before it counts for less [px].
LEAST_DEVIATION_PX = 0.1
# A corner is wrong this many deviations from where the others put it, but never nearer than the
# first of these, and always beyond the second [px].
OUTLIER, LIMITS_PX = 6.0, (1.0, 1.5)
# Half the window of a refinement, as a part of the least distance between corners, and its most
# pixels: what lies beyond the next corner's edges is that one's.
REFINE_SHARE, REFINE_MOST_PX = 0.4, 5
REFINED = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, 60, 1e-4)


class Region(NamedTuple):
    """Part of an image: rows ``y0`` to ``y1`` and columns ``x0`` to ``x1``, ends left out [px]."""

    x0: int
    y0: int
    x1: int
    y1: int

    def cut(self, grey: NDArray) -> NDArray:
        """The part of an image (h, w)."""
        return np.ascontiguousarray(grey[self.y0 : self.y1, self.x0 : self.x1])


def off_others(corners_px: NDArray, points_m: NDArray, shape: tuple[int, int]) -> NDArray:
    """How far each corner is from where all others put it: a homography through a lens.

    The lens bends radially about the picture's middle, by as many terms as the corners determine.

    Parameters
    ----------
    corners_px : (n, 2) array
        Corners, NaN where one was not seen [px].
    points_m : (n, 2) or (n, 3) array
        Their places on the target [m].
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
    H, _ = cv2.findHomography(places, pixels)
    plane = np.inf if H is None else cv2.perspectiveTransform(places[:, None], H)[:, 0]
    off = np.linalg.norm(pixels - plane, axis=1) * scale
    found[seen] = _off_bent(places, pixels, scale) * scale if off.max() > CLEAR_PX else off
    return found


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
    """Places on a target in a picture about its middle, (n, 2) [half pictures]."""
    H, lens = np.append(parameters[:8], 1).reshape(3, 3), parameters[8:]
    x, y, w = H @ np.column_stack([places, np.ones(len(places))]).T
    straight = np.column_stack([x / w, y / w])
    r2 = (straight**2).sum(axis=1)
    bend = 1 + sum(k * r2 ** (i + 1) for i, k in enumerate(lens))
    return straight * np.reshape(bend, (-1, 1))


def without_outliers(corners_px: NDArray, points_m: NDArray, shape: tuple[int, int]) -> NDArray:
    """Corners without those that all others contradict, (n, 2), right or NaN [px].

    See `off_others` for the parameters.
    """
    kept = corners_px.copy()
    while True:
        off = off_others(kept, points_m, shape)
        if not np.isfinite(off).any():
            return kept
        # Of a coordinate, by the median of distances (Rayleigh).
        deviation = max(np.nanmedian(off) / np.sqrt(2 * np.log(2)), LEAST_DEVIATION_PX)
        outlying = off > np.clip(OUTLIER * deviation, *LIMITS_PX)
        if not outlying.any():
            return kept
        kept[outlying] = np.nan


def subpixel(grey: NDArray, corners_px: NDArray, points_m: NDArray) -> NDArray:
    """Corners refined on the brightness about them (`cv2.cornerSubPix`), (n, 2) [px].

    The window does not reach the next corner; corners that are NaN stay so.
    """
    seen = np.isfinite(corners_px[:, 0])
    if not seen.any():
        return corners_px
    start = np.ascontiguousarray(corners_px[seen], dtype=np.float32)
    apart = np.linalg.norm(points_m[seen, None, :2] - points_m[seen, :2], axis=-1)
    np.fill_diagonal(apart, np.inf)
    step = np.linalg.norm(corners_px[seen] - corners_px[seen][apart.argmin(axis=1)], axis=1).min()
    reach = int(np.clip(REFINE_SHARE * step, 1, REFINE_MOST_PX))
    found = corners_px.copy()
    found[seen] = cv2.cornerSubPix(grey, start, (reach, reach), (-1, -1), REFINED)
    return found
