"""Depth images of stereo pairs [m]."""

from collections.abc import Mapping

import cv2
import numpy as np
from numpy.typing import NDArray

from palpate.vision.highlights import highlights
from palpate.vision.options import Stereo
from palpate.vision.windows import derivative, grey, local_plane, mean, warped

# Both matchers count disparity in sixteenths of a pixel, and search multiples of 16 pixels.
SUBPIXELS = 16
SEARCH_STEP = 16
# Neighbours on one surface differ by less.
SPECKLE_STEP_PX = 1
TEXTURE_THRESHOLD = 10
UNIQUENESS_PERCENT = {"block": 5, "semi_global": 10}
# A small block, and the penalties that OpenCV's documentation gives for one channel.
SEMI_GLOBAL_BLOCK_PX = 5
PENALTIES = 8 * SEMI_GLOBAL_BLOCK_PX**2, 32 * SEMI_GLOBAL_BLOCK_PX**2
# Refinement: converged after two steps. What lies farther than this from one surface, or from where
# the matcher put it, straddles an edge; the damping [grey levels^2] holds what has no texture.
REFINEMENT_STEPS = 2
SURFACE_TOLERANCE_PX = 0.75
DAMPING = 4.0
# Of an image only this much around what is wanted is matched.
SURROUNDINGS_PX = 40


def stereo_depth(
    left: NDArray, right: NDArray, sensor: Mapping, wanted: NDArray | None = None
) -> NDArray:
    """Depth of the left image of a rectified pair (Section 4.1.2).

    Parameters
    ----------
    left, right : (h, w, 3) or (h, w) uint8 arrays
    sensor : mapping
        The sensor's file.
    wanted : (h, w) bool array, optional
        Pixels of the left image; outside their surroundings nothing is matched.

    Returns
    -------
    (h, w) array
        Depth along the camera's axis [m]; NaN where nothing matches.

    Raises
    ------
    ValueError
        If the sensor asks for a method that does not exist.
    """
    if wanted is None:
        disparity = stereo_disparity(left, right, sensor)
    else:
        rows, columns = _surroundings(wanted, sum(_search_range(sensor)))
        disparity = np.full(wanted.shape, np.nan)
        pair = (image[rows, columns] for image in (left, right))
        disparity[rows, columns] = stereo_disparity(*pair, sensor)
    product = sensor["color"]["fx_px"] * sensor["stereo"]["baseline_m"]
    return product / disparity


def stereo_disparity(left: NDArray, right: NDArray, sensor: Mapping) -> NDArray:
    """Disparity of the left image, (h, w) [px], NaN where nothing matches; see `stereo_depth`.

    ``stereo.method`` matches blocks, as the study does, or semi-globally. Matches are validated
    back and forth between the images, and surfaces of few pixels dropped. ``stereo.subpixel``
    leaves the fraction of a pixel to the matcher, or refines it (`refined_disparity`).
    """
    options, colours = Stereo.read(sensor["stereo"]), (left, right)
    left, right = grey(left), grey(right)
    disparity = _matched_both_ways(left, right, options, *_search_range(sensor))
    disparity = _without_speckles(disparity, options.speckle_size_px)
    if options.subpixel == "least_squares":
        disparity = refined_disparity(left, right, disparity, options.window_px)
    if options.highlights == "drop" and colours[0].ndim == 3:
        false = highlights(*colours, disparity, options.window_px)
        disparity = np.where(false, np.float32(np.nan), disparity)
    return disparity.astype(float)


def refined_disparity(left: NDArray, right: NDArray, disparity: NDArray, window_px: int) -> NDArray:
    """Refine disparities by least squares of grey values over windows that follow the surface.

    Matchers favour whole pixels, and windows of constant disparity blur what is slanted. Here the
    right image is warped by the plane through each window's disparities, and the rest is found as
    by Lucas and Kanade (1981), with both images' mean gradient (Benhimane and Malis 2004).

    Parameters
    ----------
    left, right : (h, w) uint8 arrays
        Rectified pair; a window's mean brightness may differ between them.
    disparity : (h, w) array
        As matched [px]; NaN where nothing matches.
    window_px : int
        Side of the window, odd [px].

    Returns
    -------
    (h, w) float32 array
        Disparity [px]; NaN also where a window holds more than one surface.
    """
    valid = np.isfinite(disparity)
    matched = np.where(valid, disparity, 0).astype(np.float32)
    surface = np.where(valid, local_plane(matched, valid, window_px), 0)
    apart = mean(np.abs(matched - surface), valid, window_px)
    found = surface + _offset(left, right, surface, valid, window_px)
    for _ in range(REFINEMENT_STEPS - 1):
        surface = np.where(valid, local_plane(found, valid, window_px), 0)
        found = surface + _offset(left, right, surface, valid, window_px)
    kept = (apart < SURFACE_TOLERANCE_PX) & (np.abs(found - matched) < SURFACE_TOLERANCE_PX)
    return np.where(kept & valid, found, np.float32(np.nan))


def _matched_both_ways(
    left: NDArray, right: NDArray, options: Stereo, first: int, count: int
) -> NDArray:
    """Disparity of the left image that the right image's own matches confirm [px], else NaN."""
    matcher = _matcher(options, first, count)
    there = _matched(matcher, left, right, first, count)
    # Seen in a mirror, the right image is the left one.
    back = _matched(matcher, right[:, ::-1], left[:, ::-1], first, count)[:, ::-1]
    column = np.arange(there.shape[1]) - np.round(np.nan_to_num(there)).astype(int)
    confirmed = np.take_along_axis(back, np.maximum(column, 0), axis=1)
    agree = np.abs(there - confirmed) <= options.max_left_right_px
    return np.where(agree & (column >= 0), there, np.float32(np.nan))


def _matcher(options: Stereo, first: int, count: int) -> cv2.StereoMatcher:
    """Matcher without validation of its own."""
    method = options.method
    if method == "block":
        matcher = cv2.StereoBM.create(count, options.window_px)
        matcher.setTextureThreshold(TEXTURE_THRESHOLD)
    else:
        matcher = cv2.StereoSGBM.create(0, count, SEMI_GLOBAL_BLOCK_PX, *PENALTIES)
        matcher.setMode(cv2.STEREO_SGBM_MODE_SGBM_3WAY)
    matcher.setMinDisparity(first)
    matcher.setUniquenessRatio(UNIQUENESS_PERCENT[method])
    matcher.setDisp12MaxDiff(-1)
    return matcher


def _matched(
    matcher: cv2.StereoMatcher, left: NDArray, right: NDArray, first: int, count: int
) -> NDArray:
    """Disparity of the left image [px], NaN where nothing matches."""
    # The matcher drops columns that its range can't reach; a margin keeps them.
    margin = first + count
    wide = [
        cv2.copyMakeBorder(image, 0, 0, margin, 0, cv2.BORDER_REPLICATE) for image in (left, right)
    ]
    raw = matcher.compute(*wide)[:, margin:]
    return np.where(raw >= first * SUBPIXELS, raw / np.float32(SUBPIXELS), np.float32(np.nan))


def _without_speckles(disparity: NDArray, size_px: int) -> NDArray:
    """Drop connected surfaces of no more than ``size_px`` pixels."""
    counts = np.where(np.isfinite(disparity), disparity * SUBPIXELS, -SUBPIXELS).astype(np.int16)
    cv2.filterSpeckles(counts, -SUBPIXELS, size_px, SPECKLE_STEP_PX * SUBPIXELS)
    return np.where(counts >= 0, disparity, np.float32(np.nan))


def _offset(
    left: NDArray, right: NDArray, surface: NDArray, valid: NDArray, window_px: int
) -> NDArray:
    """Disparity beyond the surface that each window's grey values ask for, (h, w) [px]."""
    left, there = left.astype(np.float32), warped(right, surface)
    slope = (derivative(left) + derivative(there)) / 2
    rest = there - left
    mean_slope, mean_rest = (mean(image, valid, window_px) for image in (slope, rest))
    variance = mean(slope * slope, valid, window_px) - mean_slope**2
    covariance = mean(slope * rest, valid, window_px) - mean_slope * mean_rest
    # Beyond a pixel the linearisation says nothing but the direction.
    return np.clip(covariance / (variance + DAMPING), -1, 1)


def _surroundings(wanted: NDArray, reach_px: int) -> tuple[slice, slice]:
    """Rows and columns around pixels, with those to the left that the right image shows them in."""
    rows, columns = (np.flatnonzero(wanted.any(axis=axis)) for axis in (1, 0))
    if not len(rows):
        return slice(0, wanted.shape[0]), slice(0, wanted.shape[1])
    top, left = rows[0] - SURROUNDINGS_PX, columns[0] - SURROUNDINGS_PX - reach_px
    return (
        slice(max(top, 0), rows[-1] + 1 + SURROUNDINGS_PX),
        slice(max(left, 0), columns[-1] + 1 + SURROUNDINGS_PX),
    )


def _search_range(sensor: Mapping) -> tuple[int, int]:
    """First disparity and number of disparities (a multiple of 16) for the sensor's range."""
    nearest_m, farthest_m = sensor["range_m"]
    product = sensor["color"]["fx_px"] * sensor["stereo"]["baseline_m"]
    first = int(product / farthest_m)
    return first, int(np.ceil((product / nearest_m - first) / SEARCH_STEP)) * SEARCH_STEP
