"""A pixel that shows the background's colour model well, for Figure 4.11."""

from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray
from palpate.vision.background import BackgroundModel, distortion

# Its alpha E lies apart from E, no level is clipped, and its deviations are alike, so that the
# weighted projection of Eq. 4.15 looks like a perpendicular.
LARGEST_ALPHA = 0.85
LEVELS = (10, 245)
LARGEST_STD_RATIO = 1.25
# Its chromaticity is clear at so many thresholds; its distance from the rim [px].
CLEAR, RIM_PX = 3.0, 7


@dataclass(frozen=True)
class PixelColour:
    """One pixel of an image beside its background.

    Attributes
    ----------
    expected, colour : (3,) arrays
        E and I [grey levels].
    samples : (n, 3) array
        The pixel in the background's frames [grey levels].
    alpha, chromaticity : float
        Eq. 4.15 and 4.18 of the image.
    sample_alpha, sample_chromaticity : (n,) arrays
        The same of the samples.
    threshold : float
        tau_CD of Eq. 4.19.
    """

    expected: NDArray
    colour: NDArray
    samples: NDArray
    alpha: float
    chromaticity: float
    sample_alpha: NDArray
    sample_chromaticity: NDArray
    threshold: float


def choose_pixel(
    model: BackgroundModel, image: NDArray, mask: NDArray, *, alpha_low: float
) -> tuple[int, int]:
    """Choose the pixel of Figure 4.11.

    Of the foreground pixels off the mask's rim that are clearly of another chromaticity and darker
    than the background, without a level near black or white, and with deviations alike in all
    channels, the one whose colour is nearest to their median; of equals the first, row by row.

    Parameters
    ----------
    model : BackgroundModel
    image : (h, w, 3) uint8 array
    mask : (h, w) bool array
        True for foreground.
    alpha_low : float
        Brightness of the darkest shadow; darker pixels are foreground whatever their colour.

    Returns
    -------
    row, column : int

    Raises
    ------
    ValueError
        If the image has no colours, or no pixel fits.
    """
    if image.ndim != 3:
        raise ValueError(f"image: expected (h, w, 3) colours, found shape {image.shape}")
    fit = _fitting(model, image, alpha_low) & _off_rim(mask)
    if not fit.any():
        raise ValueError("mask: expected a pixel that shows the colour model, found none")
    distance = np.linalg.norm(image - np.median(image[fit], axis=0), axis=2)
    row, column = np.unravel_index(np.argmin(np.where(fit, distance, np.inf)), fit.shape)
    return int(row), int(column)


def pixel_colour(
    model: BackgroundModel, image: NDArray, samples: NDArray, pixel: tuple[int, int]
) -> PixelColour:
    """Gather what Figure 4.11 shows of one pixel.

    Parameters
    ----------
    model : BackgroundModel
    image : (h, w, 3) uint8 array
    samples : (n, 3) array
        The pixel in the background's frames [grey levels].
    pixel : tuple of int
        Row and column.

    Raises
    ------
    ValueError
        If the samples are not colours.
    """
    if samples.ndim != 2 or samples.shape[1] != 3:
        raise ValueError(f"samples: expected shape (n, 3), found {samples.shape}")
    colours = np.vstack([image[pixel], samples])[:, None]
    alpha, chroma = (v[:, 0] for v in _distortions(_repeated(model, pixel, colours), colours))
    return PixelColour(
        model.mean[pixel].astype(float),
        image[pixel].astype(float),
        samples.astype(float),
        float(alpha[0]),
        float(chroma[0]),
        alpha[1:],
        chroma[1:],
        model.threshold,
    )


def _distortions(model: BackgroundModel, image: NDArray) -> tuple[NDArray, NDArray]:
    """Brightness alpha itself (Eq. 4.15) and normalised chromaticity (Eq. 4.18), (h, w) each."""
    brightness, chroma = distortion(model, image)
    return 1 + brightness * model.brightness_rms, chroma


def _fitting(model: BackgroundModel, image: NDArray, alpha_low: float) -> NDArray:
    """Pixels whose colours show the model well, (h, w) bool."""
    alpha, chroma = _distortions(model, image)
    fit = (alpha > alpha_low) & (alpha < LARGEST_ALPHA) & (chroma > CLEAR * model.threshold)
    fit &= model.std.max(axis=2) < LARGEST_STD_RATIO * model.std.min(axis=2)
    fit &= (np.minimum(image, model.mean) > LEVELS[0]).all(axis=2)
    return fit & (np.maximum(image, model.mean) < LEVELS[1]).all(axis=2)


def _off_rim(mask: NDArray) -> NDArray:
    """Foreground whose neighbours are foreground too, (h, w) bool."""
    return cv2.erode(mask.astype(np.uint8), np.ones((RIM_PX, RIM_PX), np.uint8)).astype(bool)


def _repeated(model: BackgroundModel, pixel: tuple[int, int], colours: NDArray) -> BackgroundModel:
    """One pixel's model for each of (n, 1, 3) colours."""
    names = ("mean", "std", "brightness_rms", "chromaticity_rms")
    values = {name: getattr(model, name)[pixel][None, None] for name in names}
    return replace(model, **{name: v.repeat(len(colours), axis=0) for name, v in values.items()})
