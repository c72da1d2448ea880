"""How places of a surface move in the picture of a camera that stands still.

By windows whose grey values are followed (B. D. Lucas and T. Kanade, Proc. 7th Int. Joint Conf. on
Artificial Intelligence, 1981, 674), from the mean of the pictures at rest to each.
"""

from collections.abc import Iterable, Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from palpate.vision.windows import grey

# Windows are followed in pictures of so many times the size, smoothed by so many of their pixels:
# straight lines between pixels make 0.12 px of 0.10 (Schreier, Braasch and Sutton, Opt. Eng. 39,
# 2000, 2915), cubics and this 0.098 to 0.102.
ENLARGED, SMOOTHED_PX = 2, 0.8
# Steps up the pyramid, so far as a hand moves a surface from one picture to the next.
LEVELS = 2
CRITERIA = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 30, 0.002)
# A window that is not where it came from, when it is followed back, was another one [px].
BACK_PX = 0.3
# Grey values that are as different as so many times what is usual at rest, and as such a part of
# their contrast, are of something else.
UNLIKE, UNLIKE_PART = 3.0, 0.25
# Texture has at least so many times the variance of noise, which whole grey levels have too.
LEAST_TEXTURE, ROUNDING = 4.0, 1 / 12
# Deviation of the Gaussian that light is told from texture by, as a part of a window. What changes
# more slowly is shading, gloss and soft shadow, which stay with the light while the surface moves.
FINE = 1 / 5
# Light that falls on a window's parts as differently from at rest, of its mean, comes past an edge
# of shadow.
UNEVEN = 0.015
# Contrast of a window, in grey levels, that is no more than a camera's noise.
LEAST_CONTRAST = 2.0
# Share of the pictures in which a pixel that is no part of the object shows the background.
MOSTLY = 0.5
# Of the normalised picture: deviation of its grey values, and their mean.
SPREAD, MIDDLE = 40.0, 128.0
# Places of the background, whose motion is the camera's.
BACKGROUND_PLACES, FEWEST_PLACES, QUALITY = 400, 10, 0.05


def picture_flow(
    pictures: Sequence[NDArray],
    rest: NDArray,
    places_px: NDArray,
    uncovered: NDArray,
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
    uncovered : (h, w) array
        Share of the pictures in which each pixel shows the background.
    window_px : int
        Side of a window, odd.

    Returns
    -------
    (f, c, 2) array
        [px]; NaN where a place was not found, or its window holds some of the background.
    """
    mean, within, noise = _mean_and_noise(pictures, rest, window_px)
    first = _normalised(mean, window_px)
    whole = _whole(uncovered, places_px, window_px)
    textured = _textured(within, noise, places_px, window_px) & whole
    still = _background_places(first, uncovered >= 1, window_px)
    flow = np.full((len(pictures), len(places_px), 2), np.nan)
    unlike, uneven = np.full((2, len(pictures), len(places_px)), np.nan)
    light = _light(mean, places_px, window_px)
    guess = np.zeros((len(places_px), 2), dtype=np.float32)
    for k, picture in enumerate(map(grey, pictures)):
        now = _normalised(picture, window_px)
        moved, error = _followed(first, now, places_px, guess, window_px)
        found = np.isfinite(error) & textured
        guess = np.where(found[:, None], moved, guess).astype(np.float32)
        flow[k] = np.where(found[:, None], moved, np.nan) - _shake(first, now, still, window_px)
        unlike[k] = error
        uneven[k] = _unevenness(light, _light(picture, places_px + moved, window_px))
    as_usual = (unlike <= _most(unlike[rest], UNLIKE_PART * SPREAD)) & (
        uneven <= _most(uneven[rest], UNEVEN)
    )
    return np.where(as_usual[..., None], flow, np.nan)


def _most(rest: NDArray, least: float) -> NDArray:
    """What is still as it is at rest, (c,), of values (r, c) at rest."""
    # Of places that are never found at rest there is no usual, and no motion.
    usual = np.median(np.nan_to_num(rest, nan=-np.inf), axis=0)
    return np.where(usual >= 0, np.maximum(UNLIKE * usual, least), -1.0)


def _light(picture: NDArray, places_px: NDArray, window_px: int) -> NDArray:
    """Light and shade in windows about places (c, 2), (c, w, w)."""
    if not len(places_px):
        return np.zeros((0, window_px, window_px))
    steps = np.arange(window_px, dtype=np.float32) - window_px // 2
    columns, rows = np.asarray(places_px, dtype=np.float32).T[..., None, None]
    shape = (len(places_px), window_px, window_px)
    grids = [np.broadcast_to(grid, shape) for grid in (columns + steps, rows + steps[:, None])]
    maps = [np.ascontiguousarray(grid.reshape(len(grid), -1)) for grid in grids]
    shade = _smooth(picture, window_px) + LEAST_CONTRAST
    kinds = cv2.INTER_LINEAR, None, cv2.BORDER_REPLICATE
    return cv2.remap(shade, *maps, *kinds).reshape(shape)


def _unevenness(before: NDArray, now: NDArray) -> NDArray:
    """Deviation, (c,), of the light on windows (c, w, w) from what it was, of its mean.

    Light that is brighter, or falls on all of a window beside what was, is even.
    """
    mean = now.mean(axis=(1, 2))
    before, now = (of - of.mean(axis=(1, 2), keepdims=True) for of in (before, now))
    squares = np.maximum((before**2).sum(axis=(1, 2), keepdims=True), np.finfo(np.float32).tiny)
    gain = (before * now).sum(axis=(1, 2), keepdims=True) / squares
    return (now - gain * before).std(axis=(1, 2)) / mean


def _mean_and_noise(
    pictures: Sequence[NDArray], rest: NDArray, window_px: int
) -> tuple[NDArray, NDArray, NDArray]:
    """Mean of the pictures at rest, that of their fine texture, and the variance of its noise."""
    size = (window_px, window_px)
    mean, within, squares = 0.0, 0.0, 0.0
    for k in rest:
        values = grey(pictures[k]).astype(np.float32)
        differing = _fine(values, window_px).astype(np.float64)
        mean, within = mean + values / len(rest), within + differing / len(rest)
        squares = squares + differing**2
    spread = np.maximum(squares - len(rest) * within**2, 0.0) / max(len(rest) - 1, 1)
    return mean, within, np.maximum(cv2.blur(spread, size) / len(rest), ROUNDING)


def _textured(within: NDArray, noise: NDArray, places_px: NDArray, window_px: int) -> NDArray:
    """Whether grey values about places (c, 2) differ by more than noise makes them, (c,)."""
    return _at(places_px, cv2.blur(within**2, (window_px, window_px)) > LEAST_TEXTURE * noise)


def _whole(uncovered: NDArray, places_px: NDArray, window_px: int) -> NDArray:
    """Whether windows about places (c, 2) hold nothing of the background, which stays, (c,).

    The arm may cover a pixel of it now and then.
    """
    outside = (uncovered > MOSTLY).astype(np.uint8)
    held = cv2.dilate(outside, np.ones((window_px, window_px), dtype=np.uint8))
    return _at(places_px, held == 0)


def _at(places_px: NDArray, picture: NDArray) -> NDArray:
    """Values of a picture at places (c, 2), (c,)."""
    columns, rows = np.clip(np.rint(places_px), 0, np.array(picture.shape[::-1]) - 1).astype(int).T
    return picture[rows, columns]


def _smooth(picture: NDArray, window_px: int) -> NDArray:
    """Light and shade."""
    return cv2.GaussianBlur(np.asarray(picture, dtype=np.float32), (0, 0), FINE * window_px)


def _fine(picture: NDArray, window_px: int) -> NDArray:
    """Grey values against those about them."""
    return np.asarray(picture, dtype=np.float32) - _smooth(picture, window_px)


def _normalised(picture: NDArray, window_px: int) -> NDArray:
    """Fine texture of an enlarged picture, with one contrast in all windows, whatever the light."""
    values = _fine(picture, window_px)
    contrast = np.sqrt(cv2.GaussianBlur(values**2, (0, 0), window_px / 2) + LEAST_CONTRAST**2)
    larger = cv2.resize(
        SPREAD * values / contrast, None, fx=ENLARGED, fy=ENLARGED, interpolation=cv2.INTER_CUBIC
    )
    larger = cv2.GaussianBlur(larger, (0, 0), SMOOTHED_PX)
    return np.clip(larger + MIDDLE, 0, 255).round().astype(np.uint8)


def _in_larger(places_px: NDArray) -> NDArray:
    """Places of a picture in the enlarged one: whole numbers are middles of pixels in both."""
    return (ENLARGED * (np.asarray(places_px) + 0.5) - 0.5).astype(np.float32)


def _followed(
    first: NDArray, now: NDArray, places_px: NDArray, guess_px: NDArray, window_px: int
) -> tuple[NDArray, NDArray]:
    """Motion of places (c, 2) [px] and how unlike their windows became, (c,); NaN if not found."""
    if not len(places_px):
        return np.zeros((0, 2)), np.zeros(0)
    start = _in_larger(places_px).reshape(-1, 1, 2)
    chosen = {
        "winSize": (ENLARGED * window_px | 1,) * 2,
        "maxLevel": LEVELS,
        "criteria": CRITERIA,
        "flags": cv2.OPTFLOW_USE_INITIAL_FLOW,
    }
    end = start + np.float32(ENLARGED) * guess_px.reshape(-1, 1, 2)
    end, found, error = cv2.calcOpticalFlowPyrLK(first, now, start, end, **chosen)
    back, again, _ = cv2.calcOpticalFlowPyrLK(now, first, end, start.copy(), **chosen)
    same = np.linalg.norm((back - start)[:, 0], axis=1) < ENLARGED * BACK_PX
    good = (found[:, 0] > 0) & (again[:, 0] > 0) & same
    return (end - start)[:, 0] / ENLARGED, np.where(good, error[:, 0], np.nan)


def _background_places(first: NDArray, background: NDArray, window_px: int) -> NDArray:
    """Places of the background that can be followed, (n, 2) [px]."""
    size = 2 * window_px + 1
    clear = cv2.erode(background.astype(np.uint8), np.ones((size, size), dtype=np.uint8))
    clear = clear.repeat(ENLARGED, axis=0).repeat(ENLARGED, axis=1)
    apart = ENLARGED * window_px
    found = cv2.goodFeaturesToTrack(first, BACKGROUND_PLACES, QUALITY, apart, mask=clear)
    found = np.zeros((0, 2)) if found is None else found.reshape(-1, 2)
    return ((found + 0.5) / ENLARGED - 0.5).astype(np.float32)


def _shake(first: NDArray, now: NDArray, still_px: NDArray, window_px: int) -> NDArray:
    """Median motion of places of the background, (2,) [px]; 0 where there are too few."""
    moved, error = _followed(first, now, still_px, np.zeros_like(still_px), window_px)
    found = np.isfinite(error)
    return np.median(moved[found], axis=0) if found.sum() >= FEWEST_PLACES else np.zeros(2)


def uncovered_share(masks: Iterable[NDArray]) -> NDArray:
    """Share of masks that do not cover each pixel, (h, w)."""
    covered, count = 0, 0
    for mask in masks:
        covered, count = covered + mask.astype(bool), count + 1
    return 1 - covered / count
