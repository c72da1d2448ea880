"""Foreground of an image before a modelled background (Eq. 4.19, Section 4.2.1)."""

import logging
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from palpate.capture.images import grey
from palpate.npz import Film, write_film
from palpate.units import FROM_MEDIAN
from palpate.vision.background import SMALLEST, BackgroundModel, alpha_weight
from palpate.vision.options import Background
from palpate.yaml_files import mismatch

MOST_FOREGROUND = 0.8
# Diameters of the morphological opening and closing of a mask [px].
OPENING_PX, CLOSING_PX = 3, 7
# For so many frames, of which most are off, a camera moved.
STAYS = 5
# Deviations of a median of frames that shake, and what such a one is, as multiple of a mean's.
SURE, MEDIAN_BY_MEAN = 3.0, float(np.sqrt(np.pi / 2))
# Pixels classified at a time: their float arrays fit into a core's second-level cache.
PIECE_PX = 8_192
# Pixels within this of a mask's edge may show both sides; so much of the foreground counts as it.
RIM_PX, MIXED = 3, 0.5
# Smaller in a small picture, and a power of two: others are padded, and shifts half a pixel off.
TILE_PX = 128
# A tile speaks when it is mostly background and its correlation has one clear peak.
MOST_COVERED = 0.5
LEAST_RESPONSE = 0.25
# With less contrast, in parts of the camera's noise, a still picture is off by half a pixel.
LEAST_CONTRAST = 4.0
FEWEST_TILES = 4


class Classifier:
    """Tell foreground from background (Eq. 4.19), with all that images share worked out once.

    A pixel is foreground where its chromaticity differs, or where it is darker than any shadow or
    brighter than any highlight: near black the chromaticity says nothing. A background so dark
    that its noise alone passes these bounds gets wider ones. Grey images have no chromaticity;
    there a brightness that the background does not show is foreground, shadows too.

    Parameters
    ----------
    model : BackgroundModel
    options : Background
        Bounds of the brightness of shadows and highlights, as parts of the background's; blobs
        smaller than ``smallest_blob_px`` are dropped, and smaller holes filled.
    """

    def __init__(self, model: BackgroundModel, options: Background) -> None:
        self.model, self.smallest_blob_px = model, options.smallest_blob_px
        noise = model.brightness_threshold * model.brightness_rms
        grey = model.mean.shape[2] == 1
        self._low = (1 - (noise if grey else np.maximum(1 - options.alpha_low, noise))).ravel()
        self._high = (1 + (noise if grey else np.maximum(options.alpha_high - 1, noise))).ravel()
        limit = np.maximum(model.chromaticity_rms * model.threshold, SMALLEST)
        # Grey levels have no chromaticity; what rounding leaves of it must not count.
        scale = np.zeros_like(model.std) if grey else 1 / (model.std * limit[..., None])
        # From (h, w, c) to (c, h * w), so that each channel is contiguous.
        self._weight, self._mean, self._scale = (
            np.ascontiguousarray(values.reshape(-1, values.shape[2]).T, dtype=np.float32)
            for values in (alpha_weight(model.mean, model.std), model.mean, scale)
        )

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
        mask = self.pixels(image).view(np.uint8)
        mask = cv2.morphologyEx(mask, cv2.MORPH_OPEN, _disc(OPENING_PX))
        mask = cv2.morphologyEx(mask, cv2.MORPH_CLOSE, _disc(CLOSING_PX))
        mask = _without_small(mask, self.smallest_blob_px)
        mask = 1 - _without_small(1 - mask, self.smallest_blob_px)
        return self._without_mixed(mask, image)

    def pixels(self, image: NDArray) -> NDArray:
        """Foreground of each pixel by itself, (h, w) bool; in pieces that stay in the cache."""
        channels = [channel.ravel() for channel in cv2.split(self.model.channels(image))]
        found = np.empty(channels[0].size, dtype=bool)
        for start in range(0, found.size, PIECE_PX):
            piece = slice(start, start + PIECE_PX)
            colours = [channel[piece].astype(np.float32) for channel in channels]
            alpha = sum(w[piece] * c for w, c in zip(self._weight, colours, strict=True))
            square = 0.0
            for colour, mean, scale in zip(colours, self._mean, self._scale, strict=True):
                colour -= alpha * mean[piece]
                colour *= scale[piece]
                colour *= colour
                square = colour + square
            outside = (alpha < self._low[piece]) | (alpha > self._high[piece])
            found[piece] = outside | (square > 1)
        return found.reshape(self.model.mean.shape[:2])

    def _without_mixed(self, mask: NDArray, image: NDArray) -> NDArray:
        """Drop the rim's pixels that hold more of the background than of what lies before it."""
        # A pixel with a little foreground differs from the background: masks reach too far by half
        # the lens's blur. The foreground's colour is that of the nearest pixel that lies deeper.
        found, core = mask == 1, cv2.erode(mask, _disc(2 * RIM_PX + 1))
        if not core.any():
            return found
        rim = found & (core == 0)
        _, label = cv2.distanceTransformWithLabels(
            1 - core, cv2.DIST_L2, cv2.DIST_MASK_5, labelType=cv2.DIST_LABEL_PIXEL
        )
        pixels = self.model.channels(image)
        # Labels count the core's pixels in the order of their rows.
        deeper = np.flatnonzero(core)[label[rim] - 1]
        front = pixels.reshape(-1, pixels.shape[-1])[deeper].astype(np.float32)
        behind = self.model.mean[rim]
        step = front - behind
        share = ((pixels[rim] - behind) * step).sum(axis=1)
        found[rim] = share > MIXED * (step**2).sum(axis=1)
        return found


def masks_of(
    frames: Sequence[NDArray], model: BackgroundModel, options: Background
) -> Iterator[NDArray]:
    """Foreground of each frame, (h, w) bool, one after the other.

    Parameters
    ----------
    frames : sequence of uint8 arrays
        Of the reference camera.
    model : BackgroundModel
    options : Background

    Raises
    ------
    ValueError
        If the camera moved, or the foreground of a frame can't be an object's.
    """
    classify, shifts_px = Classifier(model, options), []
    for k, image in enumerate(frames):
        mask = classify(image)
        shift_px = camera_shift(model.mean, model.std, image, mask)
        shifts_px.append(np.full((4, 2), np.nan) if shift_px is None else shift_px)
        _require_still(shifts_px, options.largest_shift_px, at_end=k == len(frames) - 1)
        full = mask.mean()
        if full > MOST_FOREGROUND:
            found = f"{full:.0%} foreground in frame {k}"
            hint = "(does the background show the same scene and light?)"
            raise mismatch("mask", "background around the object", f"{found} {hint}")
        if not full:
            raise ValueError(f"mask: expected foreground in each frame, found none in {k}")
        yield mask
    if unknown := np.isnan(shifts_px).any(axis=(1, 2)).sum():
        text = "camera: whether it stood still is not known in %d of %d frames: too little to see"
        logging.warning(text, unknown, len(frames))


def save_masks(path: str | Path, masks: Iterable[NDArray]) -> None:
    """Write masks (h, w) packed to bits as NPZ, as they come."""
    write_film(path, ({"mask": np.packbits(m, axis=-1), "shape": np.array(m.shape)} for m in masks))


def load_masks(path: str | Path) -> Film:
    """Read the masks that `save_masks` wrote, (h, w) bool each.

    Raises
    ------
    ValueError
        If the file is damaged, or holds other bits than the masks' shape asks for.
    """
    return Film(path, ("mask", "shape"), _unpacked)


def _unpacked(packed: NDArray, shape: NDArray) -> NDArray:
    whole = shape.shape == (2,) and shape.dtype.kind == "i" and packed.dtype == np.uint8
    if not whole or packed.shape != (shape[0], -(-shape[1] // 8)):
        found = f"{packed.dtype} {packed.shape} for {shape.tolist()}"
        raise ValueError(f"mask: expected the bits of (h, w), found {found}")
    return np.unpackbits(packed, axis=-1, count=shape[1]).astype(bool)


def _require_still(shifts_px: Sequence[NDArray], largest_px: float, *, at_end: bool) -> None:
    """Check the last frames' median shift: a bump stays, noise and a stand's shake do not."""
    last = np.array(shifts_px[-STAYS:])
    if np.isnan(last).all() or (len(last) < STAYS and not at_end):
        return
    moved_px = np.linalg.norm(np.nanmedian(last, axis=0), axis=1).max()
    # No less than the median of so many frames resolves: by the median step along an axis.
    steps = np.abs(np.diff(np.array(shifts_px), axis=0))
    usual = np.nanmedian(steps) if np.isfinite(steps).any() else 0.0
    median_px = MEDIAN_BY_MEAN * (usual * FROM_MEDIAN / np.sqrt(2)) / np.sqrt(len(last))
    limit_px = largest_px + SURE * median_px
    if moved_px > limit_px:
        off = np.linalg.norm(last, axis=2).max(axis=1) > limit_px
        frame = len(shifts_px) - len(last) + int(np.argmax(off))
        expected = f"where it recorded the background (within {limit_px:.2g} px)"
        raise mismatch("camera", expected, f"it moved by {moved_px:.1f} px from frame {frame} on")


def _disc(diameter_px: int) -> NDArray:
    return cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (diameter_px, diameter_px))


def _without_small(mask: NDArray, smallest_px: int) -> NDArray:
    _, labels, stats, _ = cv2.connectedComponentsWithStats(mask, connectivity=4)
    keep = stats[:, cv2.CC_STAT_AREA] >= smallest_px
    keep[0] = False
    return keep.astype(np.uint8)[labels]


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
        if foreground[tile].mean() > MOST_COVERED or contrast < LEAST_CONTRAST:
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
