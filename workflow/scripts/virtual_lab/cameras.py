"""The lab's colour cameras: from linear radiance to the images that they record."""

from collections.abc import Mapping

import cv2
import numpy as np
from numpy.typing import NDArray
from palpate.capture.images import mosaic_rggb

GAMMA = 2.2
FULL_SCALE = 255.0
LUMA = (0.299, 0.587, 0.114)


def color_image(
    radiance: NDArray, encoding: str, options: Mapping, rng: np.random.Generator
) -> NDArray:
    """Record a linear picture: lens blur, exposure, gamma, mosaic, noise, eight bits.

    Parameters
    ----------
    radiance : (h, w, 3) array
        Linear radiance; 1 is full scale at unit exposure.
    encoding : str
        ``bayer_rggb8``, ``rgb8`` or ``mono8``.
    options : mapping
        ``camera_noise`` block of lab.yaml: the variance of a sample [grey levels^2] is
        ``read_variance + shot_variance * level``.
    rng : numpy.random.Generator

    Returns
    -------
    uint8 array
        (h, w) mosaic or grey image, or (h, w, 3).
    """
    return Exposure(radiance, encoding, options).shot(rng)


def shaken(radiance: NDArray, shift_px: NDArray) -> NDArray:
    """A picture (h, w, 3) moved by a part of a pixel along x and y, (2,) [px]."""
    if not shift_px.any():
        return radiance
    move = np.column_stack([np.eye(2), shift_px])
    size = radiance.shape[1::-1]
    return cv2.warpAffine(
        radiance, move, size, flags=cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE
    )


class Exposure:
    """A still picture, ready to be taken many times with fresh noise; see `color_image`."""

    def __init__(self, radiance: NDArray, encoding: str, options: Mapping) -> None:
        self.options = options
        blurred = cv2.GaussianBlur(radiance.astype(np.float32), (0, 0), options["blur_px"])
        # Gamma first: a flicker of the light is then a factor.
        levels = np.maximum(blurred, 0) ** (1 / GAMMA) * FULL_SCALE
        if encoding == "bayer_rggb8":
            levels = mosaic_rggb(levels)
        elif encoding == "mono8":
            levels = levels @ np.array(LUMA, dtype=np.float32)
        self.levels = np.ascontiguousarray(levels, dtype=np.float32)

    def shot(self, rng: np.random.Generator) -> NDArray:
        """One image with its own flicker and noise, uint8."""
        options = self.options
        flicker = (1 + options["flicker"] * rng.standard_normal()) ** (1 / GAMMA)
        levels = np.clip(self.levels * np.float32(flicker), 0, FULL_SCALE)
        std = np.sqrt(options["read_variance"] + options["shot_variance"] * levels)
        noisy = levels + std * rng.standard_normal(levels.shape, dtype=np.float32)
        return np.clip(np.round(noisy), 0, FULL_SCALE).astype(np.uint8)
