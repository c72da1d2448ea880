"""Highlights that a stereo pair shows at a disparity of their own."""

import cv2
import numpy as np
from numpy.typing import NDArray

from palpate.units import FROM_MEDIAN
from palpate.vision.windows import derivative, grey, local_plane, mean, warped

# Matched windows may differ in colour by this [grey levels], by what a shift explains [px], and by
# multiples of what is usual between the two cameras.
COLOUR_TOLERANCE, COLOUR_SHIFT_PX, COLOUR_DEVIATIONS = 1.0, 0.25, 3.0
# Brighter and less saturated than what surrounds it, in so many windows' width.
SURROUNDINGS, BRIGHTNESS, SATURATION = 11, 1.1, 0.9
# It counts from this width, and may reach so far beyond where it is certain.
WIDTH_PX, REACH_PX = 5, 7
# Off the plane of what is left in so many windows' width, by so much, it is no part of a surface.
PLANE, OFF_PLANE_PX = 3, 0.5
# A plane needs this part of its window.
LEAST_AROUND = 0.02
# Neighbours on one surface differ by less, and it keeps together without a rim of this width; one
# that is a highlight by this part goes as a whole.
SURFACE_STEP_PX, SURFACE_RIM_PX, LARGEST_PART = 1.0, 3, 0.3
# Beyond all disparities.
UNMATCHED_PX = 1e6


def highlights(left: NDArray, right: NDArray, disparity: NDArray, window_px: int) -> NDArray:
    """Where highlights are matched in place of the surface, (h, w) bool.

    Grey values match highlights with each other, and these lie where the lamp's mirror image
    does, far behind a glossy surface. So they are bright and pale, their disparity is not that of
    the surface around them, and the colours that lie beneath them differ (`colours_differ`). Where
    nothing is left around to compare the disparity with, the rest decides.

    Parameters
    ----------
    left, right : (h, w, 3) uint8 arrays
        Rectified pair.
    disparity : (h, w) array
        Of the left image [px]; NaN where nothing matches.
    window_px : int
        Side of the window, odd [px].
    """
    valid = np.isfinite(disparity)
    if not valid.any():
        return valid
    matched = np.where(valid, disparity, 0).astype(np.float32)
    seeds = colours_differ(left, right, matched, valid, window_px) & _glossy(left, window_px)
    core = cv2.erode(seeds.astype(np.uint8), np.ones((WIDTH_PX, WIDTH_PX)))
    side = WIDTH_PX + 2 * REACH_PX
    doubtful = valid & (cv2.dilate(core, np.ones((side, side))) > 0)
    around = valid & ~doubtful
    surface = local_plane(matched, around, PLANE * window_px)
    told = mean(around.astype(np.float32), np.ones_like(valid), PLANE * window_px) > LEAST_AROUND
    found = doubtful & (~told | (np.abs(matched - surface) > OFF_PLANE_PX))
    return _whole_surfaces(found, matched, valid, window_px)


def colours_differ(
    left: NDArray, right: NDArray, matched: NDArray, valid: NDArray, window_px: int
) -> NDArray:
    """Whether matched windows have unlike colours, (h, w) bool.

    White light adds as much to each channel, so differences of channels show the surface alone.
    What two cameras' colours usually differ by, or a shift within the precision of a match
    explains, does not count.

    Parameters
    ----------
    left, right : (h, w, 3) uint8 arrays
    matched : (h, w) float32 array
        Disparity of the left image [px].
    valid : (h, w) bool array
        Where there is one.
    window_px : int
        Side of the window, odd [px].
    """
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


def _whole_surfaces(found: NDArray, matched: NDArray, valid: NDArray, window_px: int) -> NDArray:
    """Highlights, with all of the surfaces of which they are a large part, (h, w) bool.

    Surfaces are what keeps together when their rims are taken off.
    """
    near, rim = np.ones((3, 3)), np.ones((2 * SURFACE_RIM_PX + 1, 2 * SURFACE_RIM_PX + 1))
    nearest = cv2.dilate(np.where(valid, matched, 0).astype(np.float32), near)
    farthest = cv2.erode(np.where(valid, matched, UNMATCHED_PX).astype(np.float32), near)
    smooth = valid & (nearest - farthest < SURFACE_STEP_PX)
    count, label = cv2.connectedComponents(cv2.erode(smooth.astype(np.uint8), rim))
    size = np.bincount(label.ravel(), minlength=count)
    large = np.bincount(label[found], minlength=count) > LARGEST_PART * size
    large[0] = False
    side = window_px + 2 * SURFACE_RIM_PX
    whole = cv2.dilate(large[label].astype(np.uint8), np.ones((side, side)))
    return found | (valid & (whole > 0))


def _glossy(image: NDArray, window_px: int) -> NDArray:
    """Where windows are brighter and less saturated than their surroundings, (h, w) bool."""
    brightest, span = image.max(axis=2).astype(np.float32), np.ptp(image, axis=2).astype(np.float32)
    sizes = [(side, side) for side in (window_px, SURROUNDINGS * window_px)]
    level, usual_level = (cv2.blur(grey(image).astype(np.float32), size) for size in sizes)
    colour, usual_colour = (
        cv2.blur(span, size) / (cv2.blur(brightest, size) + 1) for size in sizes
    )
    return (level > BRIGHTNESS * usual_level) & (colour < SATURATION * usual_colour)
