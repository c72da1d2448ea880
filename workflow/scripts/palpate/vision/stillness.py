"""Whether a camera stood still between its background and a capture."""

import cv2
import numpy as np
from numpy.typing import NDArray

from palpate.vision.windows import grey

# Smaller in a small picture, and a power of two: others are padded, and shifts half a pixel off.
TILE_PX = 128
# A tile speaks when it is mostly background and its correlation has one clear peak.
MOST_FOREGROUND = 0.5
LEAST_RESPONSE = 0.25
# With less contrast, in parts of the camera's noise, a still picture is off by half a pixel.
LEAST_CONTRAST = 4.0
FEWEST_TILES = 4


def camera_shift(
    mean: NDArray, std: NDArray, image: NDArray, foreground: NDArray
) -> NDArray | None:
    """How far the background lies from where the model has it, at the ends of where that is seen.

    The tiles' shifts, by phase correlation, are those of one shift, roll and scale of the picture;
    up to half of them may be wrong.

    Parameters
    ----------
    mean, std : (h, w, c) arrays
        Expected colour of the background, and its deviation [grey levels].
    image : (h, w, 3) or (h, w) uint8 array
    foreground : (h, w) bool array
        The image's mask; tiles that it covers say nothing.

    Returns
    -------
    (4, 2) array or None
        Shifts at the corners of the region whose tiles speak [px]; None when too few have texture
        to tell.
    """
    before, noise, now = (grey(np.float32(np.squeeze(part))) for part in (mean, std, image))
    side = min(TILE_PX, 2 ** int(np.log2(min(before.shape) / 2)))
    window = cv2.createHanningWindow((side, side), cv2.CV_32F)
    centres, shifts = [], []
    for y, x in np.ndindex(before.shape[0] // side, before.shape[1] // side):
        tile = np.s_[y * side : (y + 1) * side, x * side : (x + 1) * side]
        pair = [picture[tile] - picture[tile].mean() for picture in (before, now)]
        contrast = min(map(np.std, pair)) / noise[tile].mean()
        if foreground[tile].mean() > MOST_FOREGROUND or contrast < LEAST_CONTRAST:
            continue
        shift, response = cv2.phaseCorrelate(*pair, window)
        if response >= LEAST_RESPONSE:
            centres.append([(x + 0.5) * side, (y + 0.5) * side])
            shifts.append(shift)
    if len(shifts) < FEWEST_TILES:
        return None
    places = np.array(centres)
    motion, _ = cv2.estimateAffinePartial2D(places, places + shifts, method=cv2.LMEDS)
    (left, top), (right, bottom) = places.min(axis=0), places.max(axis=0)
    corners = np.array([[left, top], [right, top], [left, bottom], [right, bottom]])
    return corners @ motion[:, :2].T + motion[:, 2] - corners
