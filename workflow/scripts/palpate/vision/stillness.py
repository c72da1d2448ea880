"""Whether a camera stood still between its background and a capture."""

import cv2
import numpy as np
from numpy.typing import NDArray

TILE_PX = 128
# A tile speaks when it is mostly background and its correlation has one clear peak.
MOST_FOREGROUND = 0.5
LEAST_RESPONSE = 0.25
# Less contrast than this is camera noise [grey levels].
LEAST_CONTRAST = 2.0
FEWEST_TILES = 4


def camera_shift(mean: NDArray, image: NDArray, foreground: NDArray) -> float | None:
    """How far the background lies from where the model has it.

    The median of the shifts of the image's tiles, by phase correlation.

    Parameters
    ----------
    mean : (h, w, c) array
        Expected colour of the background.
    image : (h, w, 3) or (h, w) uint8 array
    foreground : (h, w) bool array
        The image's mask; tiles that it covers say nothing.

    Returns
    -------
    float or None
        Shift [px]; None when too few tiles have texture to tell.
    """
    before, now = (_grey(picture) for picture in (mean, image))
    window = cv2.createHanningWindow((TILE_PX, TILE_PX), cv2.CV_32F)
    shifts = []
    for rows, columns in _tiles(before.shape):
        if foreground[rows, columns].mean() > MOST_FOREGROUND:
            continue
        pair = [_centred(picture[rows, columns]) for picture in (before, now)]
        if min(tile.std() for tile in pair) < LEAST_CONTRAST:
            continue
        shift, response = cv2.phaseCorrelate(*pair, window)
        if response >= LEAST_RESPONSE:
            shifts.append(shift)
    if len(shifts) < FEWEST_TILES:
        return None
    return float(np.linalg.norm(np.median(shifts, axis=0)))


def check_still(
    mean: NDArray, image: NDArray, foreground: NDArray, *, largest_shift_px: float, frame: int
) -> None:
    """Refuse a capture whose camera moved; see `camera_shift`.

    Raises
    ------
    ValueError
        If the background's shift exceeds the largest allowed [px].
    """
    shift_px = camera_shift(mean, image, foreground)
    if shift_px is not None and shift_px > largest_shift_px:
        raise ValueError(
            f"camera: expected where it filmed the background (within {largest_shift_px:g} px),"
            f" found it moved by {shift_px:.1f} px in frame {frame}"
        )


def _tiles(shape: tuple[int, int]) -> list[tuple[slice, slice]]:
    starts = [range(0, size - TILE_PX + 1, TILE_PX) for size in shape]
    return [(slice(y, y + TILE_PX), slice(x, x + TILE_PX)) for y in starts[0] for x in starts[1]]


def _centred(tile: NDArray) -> NDArray:
    return tile - tile.mean()


def _grey(image: NDArray) -> NDArray:
    values = image if image.ndim == 2 else image.mean(axis=2)
    return np.ascontiguousarray(values, dtype=np.float32)
