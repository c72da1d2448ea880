"""How places of a surface move in the picture of a camera that stands still.

By windows whose grey values are followed (B. D. Lucas and T. Kanade, Proc. 7th Int. Joint Conf. on
Artificial Intelligence, 1981, 674), from the mean of the pictures at rest to each.
"""

from collections.abc import Iterable, Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from palpate.vision.windows import grey

# A step up the pyramid, so far as a hand moves a surface from one picture to the next.
LEVELS = 1
CRITERIA = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 30, 0.002)
# A window that is not where it came from, when it is followed back, was another one [px].
BACK_PX = 0.3
# Grey values that are as different as so many times what is usual at rest, and as such a part of
# their contrast, are of something else.
UNLIKE, UNLIKE_PART = 3.0, 0.25
# Texture has at least so many times the variance of a picture's noise.
LEAST_TEXTURE = 4.0
# Contrast of a window, in grey levels, that is no more than a camera's noise.
LEAST_CONTRAST = 2.0
# Of the normalised picture: deviation of its grey values, and their mean.
SPREAD, MIDDLE = 40.0, 128.0
# Places of the background, whose motion is the camera's.
BACKGROUND_PLACES, FEWEST_PLACES, QUALITY = 400, 10, 0.05


def picture_flow(
    pictures: Sequence[NDArray],
    rest: NDArray,
    places_px: NDArray,
    background: NDArray,
    *,
    window_px: int,
) -> NDArray:
    """Motion of places in each picture against the mean of those at rest.

    What the background moves by is the camera's shake and is taken off, where the background has
    places that can be followed.

    Parameters
    ----------
    pictures : sequence of (h, w, 3) or (h, w) uint8 arrays
    rest : (r,) int array
        Pictures in which nothing moves.
    places_px : (c, 2) array
        Where they show the places [px].
    background : (h, w) bool array
        Pixels that show nothing but the background in any picture.
    window_px : int
        Side of a window, odd.

    Returns
    -------
    (f, c, 2) array
        [px]; NaN where a place was not found.
    """
    mean, noise = _mean_and_noise(pictures, rest)
    first = _normalised(mean, window_px)
    textured = _textured(mean, noise, places_px, window_px)
    still = _background_places(first, background, window_px)
    flow, unlike = np.full((2, len(pictures), len(places_px), 2), np.nan)
    guess = np.zeros((len(places_px), 2), dtype=np.float32)
    for k, picture in enumerate(map(grey, pictures)):
        now = _normalised(picture, window_px)
        moved, error = _followed(first, now, places_px, guess, window_px)
        found = np.isfinite(error) & textured
        guess = np.where(found[:, None], moved, guess).astype(np.float32)
        flow[k], unlike[k] = np.where(found[:, None], moved, np.nan), error[:, None]
        flow[k] -= _shake(first, now, still, window_px)
    # Of places that are never found at rest there is no usual, and no motion.
    usual = np.median(np.nan_to_num(unlike[rest], nan=-np.inf), axis=0)
    most = np.where(usual >= 0, np.maximum(UNLIKE * usual, UNLIKE_PART * SPREAD), -1.0)
    return np.where(unlike <= most, flow, np.nan)


def _mean_and_noise(pictures: Sequence[NDArray], rest: NDArray) -> tuple[NDArray, float]:
    """Mean of the pictures at rest, (h, w), and the variance of one picture's noise."""
    total, squares = 0.0, 0.0
    for k in rest:
        values = grey(pictures[k]).astype(np.float64)
        total, squares = total + values, squares + values**2
    mean = total / len(rest)
    spread = np.maximum(squares - total * mean, 0.0) / max(len(rest) - 1, 1)
    return mean.astype(np.float32), float(spread.mean())


def _textured(mean: NDArray, noise: float, places_px: NDArray, window_px: int) -> NDArray:
    """Whether grey values about places (c, 2) differ by more than noise makes them, (c,)."""
    size = (window_px, window_px)
    contrast = cv2.blur(mean**2, size) - cv2.blur(mean, size) ** 2
    columns, rows = np.clip(np.rint(places_px), 0, np.array(mean.shape[::-1]) - 1).astype(int).T
    return contrast[rows, columns] > LEAST_TEXTURE * noise


def _normalised(picture: NDArray, window_px: int) -> NDArray:
    """Picture of which every window has the same mean and contrast, whatever light falls on it."""
    values, blur = np.asarray(picture, dtype=np.float32), window_px / 2
    values = values - cv2.GaussianBlur(values, (0, 0), blur)
    contrast = np.sqrt(cv2.GaussianBlur(values**2, (0, 0), blur) + LEAST_CONTRAST**2)
    return np.clip(SPREAD * values / contrast + MIDDLE, 0, 255).round().astype(np.uint8)


def _followed(
    first: NDArray, now: NDArray, places_px: NDArray, guess_px: NDArray, window_px: int
) -> tuple[NDArray, NDArray]:
    """Motion of places (c, 2) [px] and how unlike their windows became, (c,); NaN if not found."""
    if not len(places_px):
        return np.zeros((0, 2)), np.zeros(0)
    start = np.ascontiguousarray(places_px, dtype=np.float32).reshape(-1, 1, 2)
    chosen = {
        "winSize": (window_px, window_px),
        "maxLevel": LEVELS,
        "criteria": CRITERIA,
        "flags": cv2.OPTFLOW_USE_INITIAL_FLOW,
    }
    end = start + guess_px.reshape(-1, 1, 2)
    end, found, error = cv2.calcOpticalFlowPyrLK(first, now, start, end, **chosen)
    back, again, _ = cv2.calcOpticalFlowPyrLK(now, first, end, start.copy(), **chosen)
    same = np.linalg.norm((back - start)[:, 0], axis=1) < BACK_PX
    good = (found[:, 0] > 0) & (again[:, 0] > 0) & same
    return (end - start)[:, 0], np.where(good, error[:, 0], np.nan)


def _background_places(first: NDArray, background: NDArray, window_px: int) -> NDArray:
    """Places of the background that can be followed, (n, 2) [px]."""
    size = 2 * window_px + 1
    clear = cv2.erode(background.astype(np.uint8), np.ones((size, size), dtype=np.uint8))
    found = cv2.goodFeaturesToTrack(first, BACKGROUND_PLACES, QUALITY, window_px, mask=clear)
    return np.zeros((0, 2)) if found is None else found.reshape(-1, 2)


def _shake(first: NDArray, now: NDArray, still_px: NDArray, window_px: int) -> NDArray:
    """Median motion of places of the background, (2,) [px]; 0 where there are too few."""
    moved, error = _followed(first, now, still_px, np.zeros_like(still_px), window_px)
    found = np.isfinite(error)
    return np.median(moved[found], axis=0) if found.sum() >= FEWEST_PLACES else np.zeros(2)


def never_covered(masks: Iterable[NDArray]) -> NDArray:
    """Pixels that no mask covers, (h, w) bool."""
    covered = None
    for mask in masks:
        covered = mask.astype(bool) if covered is None else covered | mask
    return ~covered
