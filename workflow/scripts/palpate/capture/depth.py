"""What the numbers of a depth image say."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from palpate.units import MILLIMETRES

# Counts of a stated size, 0 where there is none; and a Kinect's.
MILLIMETRE, COUNTS, DISPARITY = "millimetre", "counts", "kinect_disparity"


def count_m(spec: Mapping) -> float:
    """What one count of a depth image is [m], by the ``depth`` block of the sensor's file."""
    return spec["count_m"] if spec["encoding"] == COUNTS else 1 / MILLIMETRES


def depth_of(counts: NDArray, spec: Mapping) -> NDArray:
    """Depths of an image; of a Kinect from normalised disparity (Eq. 4.1-4.3).

    Parameters
    ----------
    counts : (...) uint16 array
        As the image has them.
    spec : mapping
        ``depth`` block of the sensor's file.

    Returns
    -------
    (...) array
        Depth along the camera's axis [m]; NaN where there is no reading.
    """
    if spec["encoding"] != DISPARITY:
        return np.where(counts > 0, counts / (1 / count_m(spec)), np.nan)
    disparity = spec["disparity_scale"] * counts.astype(float) + spec["disparity_offset_px"]
    known = (counts != spec["no_reading"]) & (disparity > 0)
    return np.where(
        known, spec["fx_px"] * spec["baseline_m"] / np.where(known, disparity, 1), np.nan
    )
