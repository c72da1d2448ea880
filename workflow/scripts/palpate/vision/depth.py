"""Depth images of stereo pairs [m]."""

from collections.abc import Mapping

import cv2
import numpy as np
from numpy.typing import NDArray

from palpate.capture.images import grey
from palpate.config.sensor import StereoSpec
from palpate.units import FROM_MEDIAN

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
# What lies farther than this from one surface, or from where the matcher put it, straddles an edge;
# the damping [grey levels^2] holds what has no texture.
SURFACE_TOLERANCE_PX = 0.75
DAMPING = 4.0
# Of an image only this much around what is wanted is matched.
SURROUNDINGS_PX = 40
# Highlights: matched windows may differ in colour by this [grey levels], by what a shift explains
# [px], and by multiples of what is usual between the two cameras.
COLOUR_TOLERANCE, COLOUR_SHIFT_PX, COLOUR_DEVIATIONS = 1.0, 0.25, 3.0
# Brighter and less saturated than what surrounds it, in so many windows' width.
SURROUNDINGS, BRIGHTNESS, SATURATION = 11, 1.1, 0.9
# It counts from this width, and may reach so far beyond where it is certain.
WIDTH_PX, REACH_PX = 5, 7
# Off the plane of what is left in so many windows' width, by so much, it is no part of a surface;
# a plane needs this part of its window.
PLANE, OFF_PLANE_PX, LEAST_AROUND = 3, 0.5, 0.02
# Neighbours on one surface differ by less, and it keeps together without a rim of this width; one
# that is a highlight by this part goes as a whole.
SURFACE_STEP_PX, SURFACE_RIM_PX, LARGEST_PART = 1.0, 3, 0.3
# Beyond all disparities.
UNMATCHED_PX = 1e6
# Central difference of fourth order.
DERIVATIVE = np.array([[1, -8, 0, 8, -1]], dtype=np.float32) / 12


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
    part, disparity = np.s_[:, :], np.full(left.shape[:2], np.nan)
    if wanted is not None and wanted.any():
        part = _surroundings(wanted, sum(_search_range(sensor)))
    disparity[part] = stereo_disparity(left[part], right[part], sensor)
    return _focal_baseline(sensor) / disparity


def stereo_disparity(left: NDArray, right: NDArray, sensor: Mapping) -> NDArray:
    """Disparity of the left image, (h, w) [px], NaN where nothing matches; see `stereo_depth`.

    ``stereo.method`` matches blocks, as the study does, or semi-globally. Matches are validated
    back and forth between the images, and surfaces of few pixels dropped. ``stereo.subpixel``
    leaves the fraction of a pixel to the matcher, or refines it by least squares.
    """
    options, colours = StereoSpec.read(sensor["stereo"]), (left, right)
    left, right = grey(left), grey(right)
    disparity = _matched_both_ways(left, right, options, *_search_range(sensor))
    # Connected surfaces of few pixels go.
    counts = np.where(np.isfinite(disparity), disparity * SUBPIXELS, -SUBPIXELS).astype(np.int16)
    cv2.filterSpeckles(counts, -SUBPIXELS, options.speckle_size_px, SPECKLE_STEP_PX * SUBPIXELS)
    disparity = np.where(counts >= 0, disparity, np.float32(np.nan))
    if options.subpixel == "least_squares":
        disparity = _refined(left, right, disparity, options.window_px)
    if options.highlights == "drop" and colours[0].ndim == 3:
        false = _highlights(*colours, disparity, options.window_px)
        disparity = np.where(false, np.float32(np.nan), disparity)
    return disparity.astype(float)


def _focal_baseline(sensor: Mapping) -> float:
    """Disparity times depth [px m]."""
    return sensor["color"]["fx_px"] * sensor["stereo"]["baseline_m"]


def _search_range(sensor: Mapping) -> tuple[int, int]:
    """First disparity and number of disparities (a multiple of 16) for the sensor's range."""
    nearest_px, farthest_px = _focal_baseline(sensor) / np.array(sensor["range_m"])
    first = int(farthest_px)
    return first, int(np.ceil((nearest_px - first) / SEARCH_STEP)) * SEARCH_STEP


def _surroundings(wanted: NDArray, reach_px: int) -> tuple[slice, slice]:
    """Rows and columns around pixels, with those to the left that the right image shows them in."""
    rows, columns = (np.flatnonzero(wanted.any(axis=axis)) for axis in (1, 0))
    return tuple(
        slice(max(found[0] - SURROUNDINGS_PX - before, 0), found[-1] + 1 + SURROUNDINGS_PX)
        for found, before in ((rows, 0), (columns, reach_px))
    )


def _matched_both_ways(
    left: NDArray, right: NDArray, options: StereoSpec, first: int, count: int
) -> NDArray:
    """Disparity of the left image that the right image's own matches confirm [px], else NaN."""
    if options.method == "block":
        matcher = cv2.StereoBM.create(count, options.window_px)
        matcher.setTextureThreshold(TEXTURE_THRESHOLD)
    else:
        matcher = cv2.StereoSGBM.create(0, count, SEMI_GLOBAL_BLOCK_PX, *PENALTIES)
        matcher.setMode(cv2.STEREO_SGBM_MODE_SGBM_3WAY)
    matcher.setMinDisparity(first)
    matcher.setUniquenessRatio(UNIQUENESS_PERCENT[options.method])
    matcher.setDisp12MaxDiff(-1)
    there = _matched(matcher, left, right, first, first + count)
    # Seen in a mirror, the right image is the left one.
    back = _matched(matcher, right[:, ::-1], left[:, ::-1], first, first + count)[:, ::-1]
    column = np.arange(there.shape[1]) - np.round(np.nan_to_num(there)).astype(int)
    confirmed = np.take_along_axis(back, np.maximum(column, 0), axis=1)
    agree = np.abs(there - confirmed) <= options.max_left_right_px
    return np.where(agree & (column >= 0), there, np.float32(np.nan))


def _matched(
    matcher: cv2.StereoMatcher, left: NDArray, right: NDArray, first: int, margin: int
) -> NDArray:
    """Disparity of the left image [px], NaN where nothing matches."""
    # The matcher drops columns that its range can't reach.
    wide = (np.pad(image, ((0, 0), (margin, 0)), "edge") for image in (left, right))
    raw = matcher.compute(*wide)[:, margin:]
    return np.where(raw >= first * SUBPIXELS, raw / np.float32(SUBPIXELS), np.float32(np.nan))


def _refined(left: NDArray, right: NDArray, disparity: NDArray, window_px: int) -> NDArray:
    """Disparity by least squares of grey values over windows that follow one surface [px]."""
    # Matchers favour whole pixels, and windows of constant disparity blur what is slanted. So the
    # right image is warped by the plane through each window's disparities, and the rest found as by
    # Lucas and Kanade (1981), with both images' mean gradient (Benhimane and Malis 2004).
    valid = np.isfinite(disparity)
    matched = np.where(valid, disparity, 0).astype(np.float32)

    def step(start: NDArray) -> tuple[NDArray, NDArray]:
        surface = np.where(valid, local_plane(start, valid, window_px), 0)
        return surface, surface + _offset(left, right, surface, valid, window_px)

    surface, found = step(matched)
    apart = mean(np.abs(matched - surface), valid, window_px)
    # Converged after two steps.
    found = step(found)[1]
    kept = (apart < SURFACE_TOLERANCE_PX) & (np.abs(found - matched) < SURFACE_TOLERANCE_PX)
    return np.where(kept & valid, found, np.float32(np.nan))


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


def _highlights(left: NDArray, right: NDArray, disparity: NDArray, window_px: int) -> NDArray:
    """Where highlights are matched in place of the surface, (h, w) bool."""
    # They lie where the lamp's mirror image does, far behind a glossy surface: bright and pale, off
    # the disparity around them (where there is any), and of other colours beneath.
    valid = np.isfinite(disparity)
    if not valid.any():
        return valid
    matched = np.where(valid, disparity, 0).astype(np.float32)
    seeds = _colours_differ(left, right, matched, valid, window_px) & _glossy(left, window_px)
    core = cv2.erode(seeds.astype(np.uint8), np.ones((WIDTH_PX, WIDTH_PX)))
    possible = valid & _grown(core, WIDTH_PX + 2 * REACH_PX)
    around = valid & ~possible
    surface = local_plane(matched, around, PLANE * window_px)
    share = mean(around.astype(np.float32), np.ones_like(valid), PLANE * window_px)
    off = (share <= LEAST_AROUND) | (np.abs(matched - surface) > OFF_PLANE_PX)
    return _whole_surfaces(possible & off, matched, valid, window_px)


def _colours_differ(
    left: NDArray, right: NDArray, matched: NDArray, valid: NDArray, window_px: int
) -> NDArray:
    """Whether matched windows' colours differ beyond the usual and small shifts, (h, w) bool."""
    # White light adds as much to each channel: their differences show the surface alone.
    differ = np.zeros_like(valid)
    for one, other in ((0, 1), (1, 2), (0, 2)):
        here, there = (
            cv2.subtract(i[..., one], i[..., other], dtype=cv2.CV_32F) for i in (left, right)
        )
        rest = warped(there, matched) - here
        gap = np.abs(mean(rest - np.median(rest[valid]), valid, window_px))
        slope = np.sqrt(np.maximum(mean(derivative(here) ** 2, valid, window_px), 0))
        usual = FROM_MEDIAN * np.median(gap[valid])
        differ |= gap - COLOUR_SHIFT_PX * slope >= max(COLOUR_TOLERANCE, COLOUR_DEVIATIONS * usual)
    return valid & differ


def _glossy(image: NDArray, window_px: int) -> NDArray:
    """Where windows are brighter and less saturated than their surroundings, (h, w) bool."""
    brightest, span = image.max(axis=2).astype(np.float32), np.ptp(image, axis=2).astype(np.float32)
    sizes = [(side, side) for side in (window_px, SURROUNDINGS * window_px)]
    level, usual_level = (cv2.blur(grey(image).astype(np.float32), size) for size in sizes)
    colour, usual_colour = (
        cv2.blur(span, size) / (cv2.blur(brightest, size) + 1) for size in sizes
    )
    return (level > BRIGHTNESS * usual_level) & (colour < SATURATION * usual_colour)


def _whole_surfaces(found: NDArray, matched: NDArray, valid: NDArray, window_px: int) -> NDArray:
    """Highlights, with all of the surfaces of which they are a large part, (h, w) bool."""
    near, rim = np.ones((3, 3)), np.ones((2 * SURFACE_RIM_PX + 1, 2 * SURFACE_RIM_PX + 1))
    nearest = cv2.dilate(matched, near)
    farthest = cv2.erode(np.where(valid, matched, UNMATCHED_PX).astype(np.float32), near)
    smooth = valid & (nearest - farthest < SURFACE_STEP_PX)
    count, label = cv2.connectedComponents(cv2.erode(smooth.astype(np.uint8), rim))
    size = np.bincount(label.ravel(), minlength=count)
    large = np.bincount(label[found], minlength=count) > LARGEST_PART * size
    large[0] = False
    whole = _grown(large[label].astype(np.uint8), window_px + 2 * SURFACE_RIM_PX)
    return found | (valid & whole)


def _grown(mask: NDArray, side_px: int) -> NDArray:
    """Whether a square about each pixel touches a mask, (h, w) bool."""
    return cv2.dilate(mask, np.ones((side_px, side_px))) > 0


def warped(right: NDArray, disparity: NDArray) -> NDArray:
    """Right image as the left camera would see it, (h, w)."""
    height, width = right.shape
    column = np.arange(width, dtype=np.float32) - disparity
    row = np.broadcast_to(np.arange(height, dtype=np.float32)[:, None], column.shape)
    image = right.astype(np.float32)
    return cv2.remap(image, column, row.copy(), cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)


def local_plane(disparity: NDArray, valid: NDArray, window_px: int) -> NDArray:
    """Value at the centre of the plane through each window's valid pixels, (h, w) [px]."""
    one = np.ones(window_px, dtype=np.float32)
    x = np.arange(window_px, dtype=np.float32) - window_px // 2

    def averaged(image: NDArray, *weights: NDArray) -> NDArray:
        found = cv2.sepFilter2D(image, cv2.CV_32F, *weights, borderType=cv2.BORDER_CONSTANT)
        return found / np.float32(window_px**2)

    weight = valid.astype(np.float32)
    powers = ((one, one), (x, one), (one, x), (x * x, one), (x, x), (one, x * x))
    n, nx, ny, nxx, nxy, nyy = (averaged(weight, *power) for power in powers)
    d, dx, dy = (averaged(disparity * weight, *power) for power in powers[:3])
    # Cramer's rule for the constant term; what has no plane is taken out by the tolerance later.
    minors = nxx * nyy - nxy * nxy, nx * nyy - nxy * ny, nx * nxy - nxx * ny
    determinant = n * minors[0] - nx * minors[1] + ny * minors[2]
    constant = d * minors[0] - dx * minors[1] + dy * minors[2]
    return (constant / np.maximum(determinant, 1e-6)).astype(np.float32)


def mean(image: NDArray, valid: NDArray, window_px: int) -> NDArray:
    """Mean over the valid pixels of each window, (h, w); 0 where there are none."""
    size, weight = (window_px, window_px), valid.astype(np.float32)
    return cv2.blur(image * weight, size) / np.maximum(cv2.blur(weight, size), 1e-3)


def derivative(image: NDArray) -> NDArray:
    """Derivative along the rows, (h, w) [grey levels / px]."""
    return cv2.filter2D(image, cv2.CV_32F, DERIVATIVE)
