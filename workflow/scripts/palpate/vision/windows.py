"""Sums, means and planes over windows of a rectified pair's images."""

import cv2
import numpy as np
from numpy.typing import NDArray

# Central difference of fourth order.
DERIVATIVE = np.array([[1, -8, 0, 8, -1]], dtype=np.float32) / 12


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
    weight = valid.astype(np.float32)
    powers = ((one, one), (x, one), (one, x), (x * x, one), (x, x), (one, x * x))
    n, nx, ny, nxx, nxy, nyy = (_window_sum(weight, *power) for power in powers)
    d, dx, dy = (_window_sum(disparity * weight, *power) for power in powers[:3])
    # Cramer's rule for the constant term; what has no plane is taken out by the tolerance later.
    minors = nxx * nyy - nxy * nxy, nx * nyy - nxy * ny, nx * nxy - nxx * ny
    determinant = n * minors[0] - nx * minors[1] + ny * minors[2]
    constant = d * minors[0] - dx * minors[1] + dy * minors[2]
    return (constant / np.maximum(determinant, 1e-6)).astype(np.float32)


def _window_sum(image: NDArray, along: NDArray, down: NDArray) -> NDArray:
    """Sum over each window with separable weights, by the number of its pixels, (h, w)."""
    area = np.float32(len(along) * len(down))
    return cv2.sepFilter2D(image, cv2.CV_32F, along, down, borderType=cv2.BORDER_CONSTANT) / area


def mean(image: NDArray, valid: NDArray, window_px: int) -> NDArray:
    """Mean over the valid pixels of each window, (h, w); 0 where there are none."""
    size, weight = (window_px, window_px), valid.astype(np.float32)
    return cv2.blur(image * weight, size) / np.maximum(cv2.blur(weight, size), 1e-3)


def derivative(image: NDArray) -> NDArray:
    """Derivative along the rows, (h, w) [grey levels / px]."""
    return cv2.filter2D(image, cv2.CV_32F, DERIVATIVE)


def grey(image: NDArray) -> NDArray:
    """Grey levels of an RGB image, or those that it has, (h, w) uint8."""
    return image if image.ndim == 2 else cv2.cvtColor(image, cv2.COLOR_RGB2GRAY)
