"""Background subtraction with brightness and chromaticity apart (Horprasert, Section 4.2.1)."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from palpate.capture.check_capture import FEWEST_BACKGROUND_FRAMES
from palpate.npz import read_shaped, write_npz
from palpate.yaml_files import mismatch

# A pixel that never changes still has the error of its quantisation.
QUANTISATION_STD = 1 / np.sqrt(12)
SMALLEST = 1e-6
# Bins of the distortions of background pixels: a step is 0.6 %, finer than a threshold needs.
BIN_EDGES = np.concatenate([[0.0], np.geomspace(1e-3, 1e6, 3600), [np.inf]])
# Of a model's arrays.
SHAPES = dict.fromkeys(("mean", "std"), ("h", "w", "c"))
SHAPES |= dict.fromkeys(("brightness_rms", "chromaticity_rms"), ("h", "w"))
SHAPES |= dict.fromkeys(("brightness_threshold", "threshold"), ())


@dataclass(frozen=True)
class BackgroundModel:
    """The four values of each background pixel, and the thresholds that go with them."""

    # (h, w, c) float32, expected colour E and its deviation S (Eq. 4.13, 4.14) [grey levels]
    mean: NDArray
    std: NDArray
    # (h, w) float32, a and b of Eq. 4.17
    brightness_rms: NDArray
    chromaticity_rms: NDArray
    # of the normalised distortions of Eq. 4.18: of brightness, and tau_CD of Eq. 4.19
    brightness_threshold: float
    threshold: float

    def channels(self, image: NDArray) -> NDArray:
        """Image with a last axis of channels; a ValueError if its shape is not the background's."""
        pixels = _channels(image)
        if pixels.shape != self.mean.shape:
            raise mismatch("image", f"the background's shape {self.mean.shape}", pixels.shape)
        return pixels


def build_model(frames: Sequence[NDArray], *, false_positive_rate: float) -> BackgroundModel:
    """Model the background from frames without object and probe, in memory for one frame.

    The thresholds are the quantiles of the normalised distortions that leave the stated rate of
    false positives; each frame is compared with what the others say.

    Parameters
    ----------
    frames : sequence of (h, w, 3) or (h, w) uint8 arrays
        Read one at a time and more than once; may be lazy.
    false_positive_rate : float
        Part of background pixels that may be taken for foreground, before morphology.

    Raises
    ------
    ValueError
        If there are fewer than four frames, they differ in size, or are copies of one.
    """
    count = len(frames)
    if count < FEWEST_BACKGROUND_FRAMES:
        raise mismatch("frames", f"at least {FEWEST_BACKGROUND_FRAMES} background frames", count)
    mean, square = _moments(frames)
    if not square.any():
        raise ValueError("background: expected frames with a camera's noise, found copies of one")
    std = _deviation(square, count)
    sums = np.zeros((2, *mean.shape[:2]))
    for frame in frames:
        sums += _distortions(mean, std, _channels(frame)) ** 2
    # Eq. 4.17; a few frames tell little of one pixel, so none is below the typical.
    rms = np.sqrt(np.maximum(sums, 0) / count)
    typical = np.median(rms, axis=(1, 2), keepdims=True)
    rms = np.maximum(rms, np.maximum(typical, SMALLEST))
    least = np.median(rms, axis=(1, 2), keepdims=True)
    counts = np.zeros((2, len(BIN_EDGES) - 1), dtype=np.int64)
    for frame in frames:
        apart = _left_out(_channels(frame), mean, square, sums, least, count)
        for row, values in zip(counts, apart, strict=True):
            row += np.histogram(values, BIN_EDGES)[0]
    # Upper edges of the bins below which the rest of the values lies.
    shares = np.cumsum(counts, axis=1), (1 - false_positive_rate) * counts.sum(axis=1)
    places = [int(np.searchsorted(*pair)) + 1 for pair in zip(*shares, strict=True)]
    thresholds = [float(BIN_EDGES[min(place, len(BIN_EDGES) - 2)]) for place in places]
    return BackgroundModel(*(a.astype(np.float32) for a in (mean, std, *rms)), *thresholds)


def distortion(model: BackgroundModel, image: NDArray) -> tuple[NDArray, NDArray]:
    """Normalised distortions (h, w) of brightness and chromaticity (Eq. 4.15, 4.16, 4.18).

    Of an image (h, w, 3), or (h, w) of grey values whose chromaticity is zero; a `ValueError` if
    its shape is not the background's.
    """
    bright, chroma = _distortions(model.mean, model.std, model.channels(image))
    return bright / model.brightness_rms, chroma / model.chromaticity_rms


def save_model(path: str | Path, model: BackgroundModel) -> None:
    """Write a model as NPZ."""
    write_npz(path, vars(model))


def load_model(path: str | Path) -> BackgroundModel:
    """Read a model that `save_model` wrote.

    Raises
    ------
    ValueError
        If the file is damaged, or its arrays do not belong together or hold no numbers.
    """
    arrays = read_shaped(path, SHAPES, what="an NPZ file of arrays")
    for name, array in arrays.items():
        if array.dtype.kind not in "fiu" or not np.isfinite(array).all():
            raise ValueError(f"{path}: {name}: expected finite numbers, found others")
    return BackgroundModel(**{name: a if a.ndim else float(a) for name, a in arrays.items()})


def alpha_weight(mean: NDArray, std: NDArray) -> NDArray:
    """Weights of the channels whose sum is alpha (Eq. 4.15), (h, w, c)."""
    weight = mean / std**2
    return weight / np.maximum((mean * weight).sum(axis=2, keepdims=True), SMALLEST)


def _moments(frames: Sequence[NDArray]) -> tuple[NDArray, NDArray]:
    """Mean and sum of squared deviations in one pass (Welford), constant in memory."""
    mean = np.zeros(_channels(frames[0]).shape)
    square = np.zeros_like(mean)
    for count, frame in enumerate(frames, start=1):
        pixels = _channels(frame)
        if pixels.shape != mean.shape:
            raise ValueError(f"frame {count}: expected shape {mean.shape}, found {pixels.shape}")
        step = pixels - mean
        mean += step / count
        square += step * (pixels - mean)
    return mean, square


def _deviation(square: NDArray, count: int) -> NDArray:
    return np.maximum(np.sqrt(square / count), QUANTISATION_STD)


def _left_out(
    pixels: NDArray, mean: NDArray, square: NDArray, sums: NDArray, least: NDArray, count: int
) -> NDArray:
    """Normalised distortions (2, h, w) of a frame compared with the model of all others."""
    own = _distortions(mean, _deviation(square, count), pixels)
    away = pixels - mean
    others = mean - away / (count - 1)
    std = _deviation(np.maximum(square - away**2 * count / (count - 1), 0), count - 1)
    rest = np.sqrt(np.maximum(sums - own**2, 0) / (count - 1))
    return np.abs(_distortions(others, std, pixels)) / np.maximum(rest, least)


def _distortions(mean: NDArray, std: NDArray, pixels: NDArray) -> NDArray:
    """Distortions of brightness, alpha - 1, and of chromaticity, (2, h, w)."""
    alpha = (pixels * alpha_weight(mean, std)).sum(axis=2)
    chroma = np.sqrt((((pixels - alpha[..., None] * mean) / std) ** 2).sum(axis=2))
    return np.stack([alpha - 1, chroma if mean.shape[2] > 1 else np.zeros_like(alpha)])


def _channels(image: NDArray) -> NDArray:
    return image if image.ndim == 3 else image[..., None]
