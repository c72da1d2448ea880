"""Background subtraction with brightness and chromaticity apart (Horprasert, Section 4.2.1)."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

# A pixel that never changes still has the error of its quantisation.
QUANTISATION_STD = 1 / np.sqrt(12)
SMALLEST = 1e-6


@dataclass(frozen=True)
class BackgroundModel:
    """The four values of each background pixel, and the threshold that goes with them.

    Attributes
    ----------
    mean, std : (h, w, c) float32 arrays
        Expected colour E and its deviation S (Eq. 4.13, 4.14) [grey levels].
    brightness_rms, chromaticity_rms : (h, w) float32 arrays
        a and b of Eq. 4.17.
    threshold : float
        tau_CD of Eq. 4.19.
    """

    mean: NDArray
    std: NDArray
    brightness_rms: NDArray
    chromaticity_rms: NDArray
    threshold: float


def build_model(frames: Sequence[NDArray], *, false_positive_rate: float) -> BackgroundModel:
    """Model the background from frames without object and probe.

    The threshold is the quantile of the normalised chromaticity distortion that leaves the stated
    rate of false positives: the even frames make a model, the odd ones are held against it.

    Parameters
    ----------
    frames : sequence of (h, w, 3) or (h, w) uint8 arrays
        Read one at a time and more than once; may be lazy. Grey frames have no chromaticity: for
        them the distortion is that of brightness.
    false_positive_rate : float
        Part of background pixels that may be taken for foreground, before morphology.

    Returns
    -------
    BackgroundModel

    Raises
    ------
    ValueError
        If there are fewer than four frames, or they differ in size.
    """
    if len(frames) < 4:
        raise ValueError(f"frames: expected at least 4 background frames, found {len(frames)}")
    even = [frames[k] for k in range(0, len(frames), 2)]
    trial = _model(even, threshold=np.inf)
    distortions = [distortion(trial, frames[k])[1][::4, ::4] for k in range(1, len(frames), 2)]
    threshold = float(np.quantile(np.stack(distortions), 1 - false_positive_rate))
    return _model(frames, threshold=threshold)


def distortion(model: BackgroundModel, image: NDArray) -> tuple[NDArray, NDArray]:
    """Brightness alpha (Eq. 4.15) and normalised chromaticity distortion (Eq. 4.16, 4.18).

    Parameters
    ----------
    model : BackgroundModel
    image : (h, w, 3) or (h, w) uint8 array

    Returns
    -------
    alpha, chromaticity : (h, w) float32 arrays
    """
    pixels = _channels(image)
    if pixels.shape != model.mean.shape:
        expected, found = model.mean.shape, pixels.shape
        raise ValueError(f"image: expected the background's shape {expected}, found {found}")
    alpha, chroma = _raw_distortion(model.mean, model.std, pixels)
    if pixels.shape[2] == 1:
        return alpha, np.abs(alpha - 1) / model.brightness_rms
    return alpha, chroma / model.chromaticity_rms


def classify(
    model: BackgroundModel,
    image: NDArray,
    *,
    alpha_low: float,
    alpha_high: float,
    opening_px: int,
    closing_px: int,
    smallest_blob_px: int,
) -> NDArray:
    """Classify an image's pixels (Eq. 4.19).

    Near black the chromaticity says nothing, so a pixel darker than any shadow, or far brighter
    than the background, is foreground whatever its colour.

    Parameters
    ----------
    model : BackgroundModel
    image : (h, w, 3) or (h, w) uint8 array
    alpha_low, alpha_high : float
        Bounds of the brightness of shadows and highlights, as parts of the background's.
    opening_px, closing_px : int
        Diameters of the morphological opening and closing [px].
    smallest_blob_px : int
        Smaller blobs are dropped, and smaller holes filled [px].

    Returns
    -------
    (h, w) bool array
        True for foreground.
    """
    alpha, chroma = distortion(model, image)
    raw = (chroma > model.threshold) | (alpha < alpha_low) | (alpha > alpha_high)
    mask = cv2.morphologyEx(raw.astype(np.uint8), cv2.MORPH_OPEN, _disc(opening_px))
    mask = cv2.morphologyEx(mask, cv2.MORPH_CLOSE, _disc(closing_px))
    mask = _without_small(mask, smallest_blob_px)
    return _without_small(1 - mask, smallest_blob_px) == 0


def save_model(path: str | Path, model: BackgroundModel) -> None:
    """Write a model as NPZ."""
    with Path(path).open("wb") as stream:
        np.savez_compressed(stream, **vars(model))


def load_model(path: str | Path) -> BackgroundModel:
    """Read a model that `save_model` wrote."""
    with np.load(path, allow_pickle=False) as data:
        arrays = {name: data[name] for name in data.files if name != "threshold"}
        return BackgroundModel(**arrays, threshold=float(data["threshold"]))


def _model(frames: Sequence[NDArray], *, threshold: float) -> BackgroundModel:
    mean, std = _moments(frames)
    alpha_sum = np.zeros(mean.shape[:2])
    chroma_sum = np.zeros(mean.shape[:2])
    for frame in frames:
        alpha, chroma = _raw_distortion(mean, std, _channels(frame))
        alpha_sum += (alpha - 1) ** 2
        chroma_sum += chroma**2
    a, b = np.sqrt(alpha_sum / len(frames)), np.sqrt(chroma_sum / len(frames))
    # A few frames tell little of one pixel's spread: none counts as quieter than the typical one.
    a, b = np.maximum(a, np.median(a)), np.maximum(b, np.median(b))
    a, b = np.maximum(a, SMALLEST), np.maximum(b, SMALLEST)
    return BackgroundModel(mean, std, a.astype(np.float32), b.astype(np.float32), threshold)


def _moments(frames: Sequence[NDArray]) -> tuple[NDArray, NDArray]:
    """Mean and standard deviation in one pass (Welford), constant in memory."""
    mean = np.zeros(_channels(frames[0]).shape)
    square = np.zeros_like(mean)
    for count, frame in enumerate(frames, start=1):
        pixels = _channels(frame)
        if pixels.shape != mean.shape:
            raise ValueError(f"frame {count}: expected shape {mean.shape}, found {pixels.shape}")
        step = pixels - mean
        mean += step / count
        square += step * (pixels - mean)
    std = np.sqrt(square / len(frames))
    return mean.astype(np.float32), np.maximum(std, QUANTISATION_STD).astype(np.float32)


def _raw_distortion(mean: NDArray, std: NDArray, pixels: NDArray) -> tuple[NDArray, NDArray]:
    weight = mean / std**2
    alpha = (pixels * weight).sum(axis=2) / np.maximum((mean * weight).sum(axis=2), SMALLEST)
    chroma = np.sqrt((((pixels - alpha[..., None] * mean) / std) ** 2).sum(axis=2))
    return alpha, chroma


def _channels(image: NDArray) -> NDArray:
    pixels = image if image.ndim == 3 else image[..., None]
    return pixels.astype(np.float32)


def _disc(diameter_px: int) -> NDArray:
    return cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (diameter_px, diameter_px))


def _without_small(mask: NDArray, smallest_px: int) -> NDArray:
    _, labels, stats, _ = cv2.connectedComponentsWithStats(mask, connectivity=4)
    keep = stats[:, cv2.CC_STAT_AREA] >= smallest_px
    keep[0] = False
    return keep[labels].astype(np.uint8)
