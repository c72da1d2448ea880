"""Where a checkerboard's pixels lie on the board, and how bright a blurred board is there.

The derivatives leave out that a pixel's size on the board changes as the board moves: it is small.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.special import erf

from palpate.vision.camera import PinholeCamera


def place_derivatives(
    u: NDArray, v: NDArray, w: NDArray, inverse: NDArray, pose: NDArray, square_m: float
) -> tuple[NDArray, NDArray]:
    """Derivatives of u and v by rotation vector and shift of the board, (n, 6) each."""
    x, y, z = pose[:3, :2] @ (np.stack([u, v]) * w * square_m)
    dw = [
        np.stack([z * b - y * c, x * c - z * a, y * a - x * b, -w * a, -w * b, -w * c])
        for a, b, c in inverse
    ]
    return tuple(((dw[k] - place * dw[2]) / w).T for k, place in ((0, u), (1, v)))


def pixel_sizes(
    u: NDArray, v: NDArray, w: NDArray, inverse: NDArray, camera: PinholeCamera
) -> tuple[NDArray, NDArray]:
    """Squares per pixel across the edges of constant u and of constant v, (n,) each."""
    sizes = []
    for k, place in ((0, u), (1, v)):
        across, down = (
            (inverse[k, axis] - place * inverse[2, axis]) / w * (1 / focal)
            for axis, focal in ((0, camera.fx_px), (1, camera.fy_px))
        )
        sizes.append(np.sqrt(across**2 + down**2))
    return tuple(sizes)


def square_wave(place: NDArray, lines: int, blur: NDArray) -> tuple[NDArray, NDArray, NDArray]:
    """Blurred square wave that starts at +1, its derivatives by place and by blur."""
    wave, slope, spread = np.ones_like(place), np.zeros_like(place), np.zeros_like(place)
    for line in range(lines):
        sign = -1 if line % 2 == 0 else 1
        z = (place - line) / blur
        bell = np.exp(-(z**2) / 2) * np.sqrt(2 / np.pi) / blur
        wave += sign * (1 + erf(z / np.sqrt(2)))
        slope += sign * bell
        spread -= sign * bell * z
    return wave, slope, spread
