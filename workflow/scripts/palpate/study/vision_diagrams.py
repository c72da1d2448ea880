"""Diagrams of Section 4.2 from real data: the colour model and the chain of transforms."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import cv2
import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon, Rectangle
from numpy.typing import NDArray

from palpate.study.style import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    PAGE_IN,
    label_provenance,
    panel_letter,
)
from palpate.vision.background import BackgroundModel, distortion
from palpate.vision.probe import marker_transforms

WHITE_LEVEL = 255
# A pixel that shows the model well: its alpha E lies apart from E, no level is clipped, and its
# deviations are alike, so that the weighted projection of Eq. 4.15 looks like a perpendicular.
LARGEST_ALPHA = 0.85
LEVELS = (10, 245)
LARGEST_STD_RATIO = 1.6
RIM_PX = 7
ZOOM_PX = 15
# The chromaticity line rises on the paper; the view turns about it, or G would hide behind it.
RISE_DEG, TURN_DEG = 42.0, 32.0


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

    Of the foreground pixels off the mask's rim that are darker than the background, without a
    level near black or white, and with deviations alike in all channels, the one whose colour
    lies farthest from the chromaticity line; of equals the first, row by row.

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
    alpha, chroma = _distortions(model, image)
    distance = np.linalg.norm(image - alpha[..., None] * model.mean, axis=2)
    rim = np.ones((RIM_PX, RIM_PX), np.uint8)
    fit = cv2.erode(mask.astype(np.uint8), rim).astype(bool) & (chroma > model.threshold)
    fit &= (alpha > alpha_low) & (alpha < LARGEST_ALPHA)
    fit &= model.std.max(axis=2) < LARGEST_STD_RATIO * model.std.min(axis=2)
    fit &= (np.minimum(image, model.mean) > LEVELS[0]).all(axis=2)
    fit &= (np.maximum(image, model.mean) < LEVELS[1]).all(axis=2)
    if not fit.any():
        raise ValueError("mask: expected a pixel that shows the colour model, found none")
    row, column = np.unravel_index(np.argmax(np.where(fit, distance, -1)), fit.shape)
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


def figure_4_11(
    shown: PixelColour,
    image: NDArray,
    pixel: tuple[int, int],
    *,
    alpha_bounds: tuple[float, float],
    provenance: str,
) -> Figure:
    """Colour model of the background subtraction for one captured pixel (Fig. 4.11).

    Parameters
    ----------
    shown : PixelColour
    image : (h, w, 3) uint8 array
        The frame that the pixel is of.
    pixel : tuple of int
        Row and column.
    alpha_bounds : tuple of float
        Darkest shadow and brightest highlight that count as background.
    provenance : str
    """
    figure = plt.figure(figsize=(PAGE_IN, 3.0))
    _photo_panel(figure.add_axes((0.025, 0.42, 0.27, 0.49)), image, pixel)
    _zoom_panel(figure.add_axes((0.025, 0.06, 0.135, 0.32)), image, pixel)
    _swatch_panel(figure.add_axes((0.165, 0.06, 0.13, 0.32)), shown)
    space = figure.add_axes((0.315, 0.05, 0.38, 0.86))
    _colour_space_panel(space, shown)
    _class_panel(figure.add_axes((0.775, 0.17, 0.215, 0.74)), shown, alpha_bounds)
    label_provenance(figure, {provenance})
    return figure


def _distortions(model: BackgroundModel, image: NDArray) -> tuple[NDArray, NDArray]:
    """Brightness alpha itself (Eq. 4.15) and normalised chromaticity (Eq. 4.18), (h, w) each."""
    brightness, chroma = distortion(model, image)
    return 1 + brightness * model.brightness_rms, chroma


def _repeated(model: BackgroundModel, pixel: tuple[int, int], colours: NDArray) -> BackgroundModel:
    """One pixel's model for each of (n, 1, 3) colours."""
    names = ("mean", "std", "brightness_rms", "chromaticity_rms")
    values = {name: getattr(model, name)[pixel][None, None] for name in names}
    return replace(model, **{name: v.repeat(len(colours), axis=0) for name, v in values.items()})


def _photo_panel(axes: Axes, image: NDArray, pixel: tuple[int, int]) -> None:
    axes.imshow(image, interpolation="antialiased")
    corner = (pixel[1] - ZOOM_PX - 0.5, pixel[0] - ZOOM_PX - 0.5)
    side = 2 * ZOOM_PX + 1
    axes.add_patch(Rectangle(corner, side, side, fill=False, ec="white", lw=2.0))
    axes.add_patch(Rectangle(corner, side, side, fill=False, ec=BLACK, lw=1.0))
    axes.set_title("Image")
    axes.set_axis_off()
    panel_letter(axes, "a")


def _zoom_panel(axes: Axes, image: NDArray, pixel: tuple[int, int]) -> None:
    row, column = pixel
    axes.imshow(image, interpolation="none")
    axes.set_xlim(column - ZOOM_PX - 0.5, column + ZOOM_PX + 0.5)
    axes.set_ylim(row + ZOOM_PX + 0.5, row - ZOOM_PX - 0.5)
    axes.add_patch(Rectangle((column - 0.5, row - 0.5), 1, 1, fill=False, ec="white", lw=1.0))
    axes.annotate(
        "pixel $i$", (column, row - 0.5), (0, 14), textcoords="offset points", ha="center",
        color="white", fontsize=7.5, arrowprops={"arrowstyle": "-", "color": "white", "lw": 0.8},
    )
    axes.set(xticks=[], yticks=[])
    axes.spines[:].set_visible(True)


def _swatch_panel(axes: Axes, shown: PixelColour) -> None:
    axes.set(xlim=(0, 1), ylim=(3, 0))
    colours = (shown.expected, shown.alpha * shown.expected, shown.colour)
    names = (r"$\mathbf{E}_i$", r"$\alpha_i\mathbf{E}_i$", r"$\mathbf{I}_i$")
    for k, (colour, name) in enumerate(zip(colours, names, strict=True)):
        axes.add_patch(Rectangle((0.02, k + 0.08), 0.3, 0.84, fc=colour / WHITE_LEVEL, ec="none"))
        axes.text(0.38, k + 0.32, name, va="center")
        levels = ", ".join(f"{level:.0f}" for level in colour)
        axes.text(0.38, k + 0.74, levels, va="center", fontsize=6.5)
    axes.set_axis_off()


def _colour_space_panel(axes: Axes, shown: PixelColour) -> None:
    view = _colour_view(shown.expected, shown.colour)
    _cube(axes, view)
    axes.set_aspect("equal")
    axes.set_axis_off()
    axes.set_title("RGB space (grey levels)")
    E, I, foot = (p @ view for p in (shown.expected, shown.colour, shown.alpha * shown.expected))
    top = 1.18 * E
    axes.plot([0, top[0]], [0, top[1]], color=BLACK, lw=1.0)
    axes.plot(*np.transpose([foot, I]), color=ORANGE, lw=1.6)
    for p, c in ((E, shown.expected), (foot, shown.alpha * shown.expected), (I, shown.colour)):
        axes.plot(*p, "o", ms=7, mfc=c / WHITE_LEVEL, mec=BLACK, mew=0.8)
    panel_letter(axes, "b")


def _cube(axes, view):
    corners = np.array([[i, j, k] for i in (0, 1) for j in (0, 1) for k in (0, 1)]) * WHITE_LEVEL
    for a in corners:
        for b in corners:
            if np.sum(a != b) == 1 and a.sum() < b.sum():
                axes.plot(*np.transpose([a @ view, b @ view]), color=GREY, lw=0.5)
    for k, n in enumerate("RGB"):
        p = view[k] * WHITE_LEVEL
        axes.annotate("", p * 1.12, (0, 0), arrowprops={"arrowstyle": "-|>", "color": BLACK, "lw": 0.8, "shrinkA": 0, "shrinkB": 0})
        axes.text(*(p * 1.18), n, ha="center", va="center")


def _colour_view(E: NDArray, I: NDArray) -> NDArray:
    """Directions of the paper's right and up in RGB space, as columns (3, 2)."""
    along = E / np.linalg.norm(E)
    out = I - (I @ along) * along
    out /= np.linalg.norm(out)
    turn, rise = np.radians([TURN_DEG, RISE_DEG])
    across = np.cos(turn) * out + np.sin(turn) * np.cross(along, out)
    right = np.cos(rise) * along - np.sin(rise) * across
    return np.column_stack([right, np.sin(rise) * along + np.cos(rise) * across])


def _class_panel(axes: Axes, shown: PixelColour, bounds: tuple[float, float]) -> None:
    low, high = bounds
    axes.add_patch(Rectangle((low, 0), high - low, shown.threshold, fc=GREEN, alpha=0.2))
    axes.plot(shown.sample_alpha, shown.sample_chromaticity, ".", ms=3, color=BLUE)
    axes.plot(shown.alpha, shown.chromaticity, "o", color=ORANGE)
    axes.set(xlim=(0, 1.6), ylim=(0, None))
    axes.set_xlabel(r"Brightness distortion $\alpha_i$")
    axes.set_ylabel(r"Chromaticity distortion $\widehat{CD}_i$")
    panel_letter(axes, "c")
