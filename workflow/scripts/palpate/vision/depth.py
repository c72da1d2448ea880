"""Depth images of each kind of sensor [m]."""

from collections.abc import Mapping

import cv2
import numpy as np
from numpy.typing import NDArray

MILLIMETRES = 1000.0
# StereoBM counts disparity in sixteenths of a pixel, its speckle range too.
SUBPIXELS = 16
SPECKLE_STEP = 2 * SUBPIXELS
BLOCK = 16
TEXTURE_THRESHOLD = 10
UNIQUENESS_PERCENT = 5


def kinect_depth(counts: NDArray, spec: Mapping) -> NDArray:
    """Depth from normalised disparity (Eq. 4.1-4.3).

    Parameters
    ----------
    counts : (h, w) uint16 array
        Normalised disparity d'.
    spec : mapping
        ``depth`` block of the sensor's file.

    Returns
    -------
    (h, w) array
        Depth along the infrared camera's axis [m]; NaN where there is no reading.
    """
    disparity = spec["disparity_scale"] * counts.astype(float) + spec["disparity_offset_px"]
    valid = (counts != spec["no_reading"]) & (disparity > 0)
    depth_m = np.full(counts.shape, np.nan)
    depth_m[valid] = spec["fx_px"] * spec["baseline_m"] / disparity[valid]
    return depth_m


def millimetre_depth(millimetres: NDArray) -> NDArray:
    """Depth from millimetres, (h, w) [m]; NaN where the image holds 0."""
    return np.where(millimetres > 0, millimetres / MILLIMETRES, np.nan)


def stereo_depth(left: NDArray, right: NDArray, sensor: Mapping) -> NDArray:
    """Depth of the left image of a rectified pair by block matching (Section 4.1.2).

    Matches are validated back and forth between the images, and surfaces of few pixels dropped.

    Parameters
    ----------
    left, right : (h, w, 3) or (h, w) uint8 arrays
    sensor : mapping
        The sensor's file.

    Returns
    -------
    (h, w) array
        Depth along the camera's axis [m]; NaN where nothing matches.
    """
    disparity = stereo_disparity(left, right, sensor)
    product = sensor["color"]["fx_px"] * sensor["stereo"]["baseline_m"]
    return product / disparity


def stereo_disparity(left: NDArray, right: NDArray, sensor: Mapping) -> NDArray:
    """Disparity of the left image [px], NaN where nothing matches; see `stereo_depth`."""
    first, count = _search_range(sensor)
    options = sensor["stereo"]
    matcher = cv2.StereoBM.create(count, options["window_px"])
    matcher.setMinDisparity(first)
    matcher.setTextureThreshold(TEXTURE_THRESHOLD)
    matcher.setUniquenessRatio(UNIQUENESS_PERCENT)
    matcher.setDisp12MaxDiff(int(np.ceil(options["max_left_right_px"])))
    matcher.setSpeckleWindowSize(options["speckle_size_px"])
    matcher.setSpeckleRange(SPECKLE_STEP)
    # The matcher drops columns that its range can't reach; a margin keeps them.
    margin = [
        cv2.copyMakeBorder(_grey(image), 0, 0, first + count, 0, cv2.BORDER_REPLICATE)
        for image in (left, right)
    ]
    raw = matcher.compute(*margin)[:, first + count :]
    return np.where(raw >= first * SUBPIXELS, raw / SUBPIXELS, np.nan)


def _search_range(sensor: Mapping) -> tuple[int, int]:
    """First disparity and number of disparities (a multiple of 16) for the sensor's range."""
    nearest_m, farthest_m = sensor["range_m"]
    product = sensor["color"]["fx_px"] * sensor["stereo"]["baseline_m"]
    first = int(product / farthest_m)
    return first, int(np.ceil((product / nearest_m - first) / BLOCK)) * BLOCK


def _grey(image: NDArray) -> NDArray:
    return image if image.ndim == 2 else cv2.cvtColor(image, cv2.COLOR_RGB2GRAY)
