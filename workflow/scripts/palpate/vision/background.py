"""Background subtraction with brightness and chromaticity apart (Horprasert, Section 4.2.1)."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

# A pixel that never changes still has the error of its quantisation.
QUANTISATION_STD = 1 / np.sqrt(12)
SMALLEST = 1e-6
FEWEST_FRAMES = 4
# Pixels classified at a time: their float arrays fit into a core's second-level cache.
PIECE_PX = 8_192
# Pixels within this of a mask's edge may show both sides; so much of the foreground counts as it.
RIM_PX, MIXED = 3, 0.5
# Bins of the distortions of background pixels: a step is 0.6 %, finer than a threshold needs.
BIN_EDGES = np.concatenate([[0.0], np.geomspace(1e-3, 1e6, 3600), [np.inf]])


@dataclass(frozen=True)
class BackgroundModel:
    """The four values of each background pixel, and the thresholds that go with them.

    Attributes
    ----------
    mean, std : (h, w, c) float32 arrays
        Expected colour E and its deviation S (Eq. 4.13, 4.14) [grey levels].
    brightness_rms, chromaticity_rms : (h, w) float32 arrays
        a and b of Eq. 4.17.
    brightness_threshold, threshold : float
        Of the normalised distortions of Eq. 4.18: of brightness, and tau_CD of Eq. 4.19.
    """

    mean: NDArray
    std: NDArray
    brightness_rms: NDArray
    chromaticity_rms: NDArray
    brightness_threshold: float
    threshold: float


def build_model(frames: Sequence[NDArray], *, false_positive_rate: float) -> BackgroundModel:
    """Model the background from frames without object and probe, in memory for one frame.

    The thresholds are the quantiles of the normalised distortions that leave the stated rate of
    false positives: the even frames make a model, the odd ones are held against it.

    Parameters
    ----------
    frames : sequence of (h, w, 3) or (h, w) uint8 arrays
        Read one at a time and more than once; may be lazy.
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
    count = len(frames)
    if count < FEWEST_FRAMES:
        raise ValueError(
            f"frames: expected at least {FEWEST_FRAMES} background frames, found {count}"
        )
    trial = _statistics(frames, range(0, count, 2))
    counts = np.zeros((2, len(BIN_EDGES) - 1), dtype=np.int64)
    for k in range(1, count, 2):
        for row, values in zip(counts, distortion(trial, frames[k]), strict=True):
            row += np.histogram(np.abs(values), BIN_EDGES)[0]
    thresholds = [_quantile(row, 1 - false_positive_rate) for row in counts]
    whole = _statistics(frames, range(count))
    return BackgroundModel(
        whole.mean, whole.std, whole.brightness_rms, whole.chromaticity_rms, *thresholds
    )


def distortion(model: BackgroundModel, image: NDArray) -> tuple[NDArray, NDArray]:
    """Normalised distortions of brightness and of chromaticity (Eq. 4.15, 4.16, 4.18).

    Parameters
    ----------
    model : BackgroundModel
    image : (h, w, 3) or (h, w) uint8 array

    Returns
    -------
    brightness, chromaticity : (h, w) float32 arrays
        The chromaticity of grey images is zero.
    """
    alpha, chroma = _raw_distortion(model.mean, model.std, _pixels_like(model, image))
    return (alpha - 1) / model.brightness_rms, chroma / model.chromaticity_rms


class Classifier:
    """Tell foreground from background (Eq. 4.19), with all that images share worked out once.

    A pixel is foreground where its chromaticity differs, or where it is darker than any shadow or
    brighter than any highlight: near black the chromaticity says nothing. A background so dark
    that its noise alone passes these bounds gets wider ones. Grey images have no chromaticity;
    there a brightness that the background does not show is foreground, shadows too.

    Parameters
    ----------
    model : BackgroundModel
    alpha_low, alpha_high : float
        Bounds of the brightness of shadows and highlights, as parts of the background's.
    opening_px, closing_px : int
        Diameters of the morphological opening and closing [px].
    smallest_blob_px : int
        Smaller blobs are dropped, and smaller holes filled [px].
    """

    def __init__(
        self,
        model: BackgroundModel,
        *,
        alpha_low: float,
        alpha_high: float,
        opening_px: int,
        closing_px: int,
        smallest_blob_px: int,
    ) -> None:
        self.model, self.smallest_blob_px = model, smallest_blob_px
        self.opening, self.closing = _disc(opening_px), _disc(closing_px)
        noise = model.brightness_threshold * model.brightness_rms
        grey = model.mean.shape[2] == 1
        self._low = (1 - (noise if grey else np.maximum(1 - alpha_low, noise))).ravel()
        self._high = (1 + (noise if grey else np.maximum(alpha_high - 1, noise))).ravel()
        self._weight = _planes(_alpha_weight(model.mean, model.std))
        limit = np.maximum(model.chromaticity_rms * model.threshold, SMALLEST)
        self._mean, self._scale = _planes(model.mean), _planes(1 / (model.std * limit[..., None]))

    def __call__(self, image: NDArray) -> NDArray:
        """Classify an image's pixels and clean the mask.

        Parameters
        ----------
        image : (h, w, 3) or (h, w) uint8 array

        Returns
        -------
        (h, w) bool array
            True for foreground.

        Raises
        ------
        ValueError
            If the image's shape is not the background's.
        """
        raw = self.pixels(image).view(np.uint8)
        mask = cv2.morphologyEx(raw, cv2.MORPH_OPEN, self.opening)
        mask = cv2.morphologyEx(mask, cv2.MORPH_CLOSE, self.closing)
        mask = _without_small(mask, self.smallest_blob_px)
        mask = 1 - _without_small(1 - mask, self.smallest_blob_px)
        return self._without_mixed(mask, image)

    def _without_mixed(self, mask: NDArray, image: NDArray) -> NDArray:
        """Drop the rim's pixels that hold more of the background than of what lies before it.

        A little foreground in a pixel is enough to tell it from the background, so masks reach
        too far by about half the lens's blur. The foreground's colour is taken from the nearest
        pixel that lies deeper.
        """
        core = cv2.erode(mask, _disc(2 * RIM_PX + 1))
        rim = (mask == 1) & (core == 0)
        if not core.any():
            return mask == 1
        _, label = cv2.distanceTransformWithLabels(
            1 - core, cv2.DIST_L2, cv2.DIST_MASK_5, labelType=cv2.DIST_LABEL_PIXEL
        )
        # Labels count the core's pixels in the order of their rows.
        deeper = np.flatnonzero(core)[label[rim] - 1]
        pixels = _channels(image)
        front = pixels.reshape(-1, pixels.shape[2])[deeper].astype(np.float32)
        behind = self.model.mean[rim]
        way = front - behind
        share = ((pixels[rim] - behind) * way).sum(axis=1)
        found = mask == 1
        found[rim] = share > MIXED * (way**2).sum(axis=1)
        return found

    def pixels(self, image: NDArray) -> NDArray:
        """Foreground of each pixel by itself, (h, w) bool; in pieces that stay in the cache."""
        channels = cv2.split(_pixels_like(self.model, image))
        flat = [channel.reshape(-1) for channel in channels]
        found = np.empty(channels[0].shape, dtype=bool)
        for start in range(0, found.size, PIECE_PX):
            piece = slice(start, start + PIECE_PX)
            found.reshape(-1)[piece] = self._piece([channel[piece] for channel in flat], piece)
        return found

    def _piece(self, channels: list[NDArray], piece: slice) -> NDArray:
        colours = [channel.astype(np.float32) for channel in channels]
        alpha = sum(w[piece] * colour for w, colour in zip(self._weight, colours, strict=True))
        found = (alpha < self._low[piece]) | (alpha > self._high[piece])
        square = 0.0
        for colour, mean, scale in zip(colours, self._mean, self._scale, strict=True):
            colour -= alpha * mean[piece]
            colour *= scale[piece]
            colour *= colour
            square = colour + square
        return found | (square > 1)


def save_model(path: str | Path, model: BackgroundModel) -> None:
    """Write a model as NPZ."""
    with Path(path).open("wb") as stream:
        np.savez_compressed(stream, **vars(model))


def load_model(path: str | Path) -> BackgroundModel:
    """Read a model that `save_model` wrote."""
    with np.load(path, allow_pickle=False) as data:
        arrays = {name: data[name] for name in data.files}
    thresholds = {name: float(arrays.pop(name)) for name in ("brightness_threshold", "threshold")}
    return BackgroundModel(**arrays, **thresholds)


def _statistics(frames: Sequence[NDArray], chosen: range) -> BackgroundModel:
    """The four values of the chosen frames, without thresholds."""
    mean, std = _moments(frames[k] for k in chosen)
    alpha_sum = np.zeros(mean.shape[:2])
    chroma_sum = np.zeros(mean.shape[:2])
    for k in chosen:
        alpha, chroma = _raw_distortion(mean, std, _channels(frames[k]))
        alpha_sum += (alpha - 1) ** 2
        chroma_sum += chroma**2
    a, b = np.sqrt(alpha_sum / len(chosen)), np.sqrt(chroma_sum / len(chosen))
    # A few frames tell little of one pixel's spread: none counts as quieter than the typical one.
    a, b = np.maximum(a, np.median(a)), np.maximum(b, np.median(b))
    a, b = np.maximum(a, SMALLEST), np.maximum(b, SMALLEST)
    return BackgroundModel(mean, std, a.astype(np.float32), b.astype(np.float32), np.inf, np.inf)


def _moments(frames: Iterable[NDArray]) -> tuple[NDArray, NDArray]:
    """Mean and standard deviation in one pass (Welford), constant in memory."""
    for count, frame in enumerate(frames, start=1):
        pixels = _channels(frame)
        if count == 1:
            mean, square = np.zeros(pixels.shape), np.zeros(pixels.shape)
        if pixels.shape != mean.shape:
            raise ValueError(f"frame {count}: expected shape {mean.shape}, found {pixels.shape}")
        step = pixels - mean
        mean += step / count
        square += step * (pixels - mean)
    std = np.sqrt(square / count)
    return mean.astype(np.float32), np.maximum(std, QUANTISATION_STD).astype(np.float32)


def _raw_distortion(mean: NDArray, std: NDArray, pixels: NDArray) -> tuple[NDArray, NDArray]:
    alpha = (pixels * _alpha_weight(mean, std)).sum(axis=2)
    chroma = np.sqrt((((pixels - alpha[..., None] * mean) / std) ** 2).sum(axis=2))
    return alpha, chroma if mean.shape[2] > 1 else np.zeros_like(alpha)


def _alpha_weight(mean: NDArray, std: NDArray) -> NDArray:
    """Weights of the channels whose sum is alpha (Eq. 4.15), (h, w, c)."""
    weight = mean / std**2
    return weight / np.maximum((mean * weight).sum(axis=2, keepdims=True), SMALLEST)


def _quantile(counts: NDArray, share: float) -> float:
    """Upper edge of the bin below which a share of the counted values lies."""
    place = int(np.searchsorted(np.cumsum(counts), share * counts.sum()))
    return float(BIN_EDGES[min(place + 1, len(BIN_EDGES) - 2)])


def _pixels_like(model: BackgroundModel, image: NDArray) -> NDArray:
    pixels = _channels(image)
    if pixels.shape != model.mean.shape:
        expected, found = model.mean.shape, pixels.shape
        raise ValueError(f"image: expected the background's shape {expected}, found {found}")
    return pixels


def _channels(image: NDArray) -> NDArray:
    """Image with a last axis of channels."""
    return image if image.ndim == 3 else image[..., None]


def _planes(values: NDArray) -> NDArray:
    """From (h, w, c) to (c, h * w), so that each channel is contiguous."""
    flat = values.reshape(-1, values.shape[2]).T
    return np.ascontiguousarray(flat, dtype=np.float32)


def _disc(diameter_px: int) -> NDArray:
    return cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (diameter_px, diameter_px))


def _without_small(mask: NDArray, smallest_px: int) -> NDArray:
    _, labels, stats, _ = cv2.connectedComponentsWithStats(mask, connectivity=4)
    keep = stats[:, cv2.CC_STAT_AREA] >= smallest_px
    keep[0] = False
    return keep.astype(np.uint8)[labels]
