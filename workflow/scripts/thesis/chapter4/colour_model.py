"""Figure 4.11: the colour model of the background subtraction, from a real pixel."""

from dataclasses import dataclass, replace
from typing import Any

import cv2
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from numpy.typing import NDArray
from palpate.capture.images import Stream
from palpate.report.panels import named, photo_panel
from palpate.report.style import BLACK, BLUE, GREEN, GREY, ORANGE, PAGE_IN
from palpate.vision.background import BackgroundModel, distortion, load_model
from palpate.vision.foreground import load_masks
from palpate.vision.options import Background

from thesis.diagrams import TEXT_PT, Sketch, blank, labelled, write
from thesis.panels import scale_bar
from thesis.views import View

WHITE_LEVEL, TICKS = 255, (100, 200)
# Half a side of the zoom [px].
ZOOM_PX = 12
# R to the right, B up; colours of a background lie near the grey diagonal, apart from all axes.
SIDE = View(-70, 35)
EXPECTED, PROJECTED, COLOUR = r"$\mathbf{E}_i$", r"$\alpha_i\mathbf{E}_i$", r"$\mathbf{I}_i$"
# Its alpha E lies apart from E, no level is clipped, and its deviations are alike.
LARGEST_ALPHA = 0.85
LEVELS = (10, 245)
LARGEST_STD_RATIO = 1.25
# Its chromaticity is clear at so many thresholds; its distance from the rim [px].
CLEAR, RIM_PX = 3.0, 7


@dataclass(frozen=True)
class PixelColour:
    """One pixel of an image beside its background, colours in grey levels.

    ``expected`` and ``colour`` (3,) are E and I, ``samples`` (n, 3) the pixel in the background's
    frames, ``alpha`` and ``chromaticity`` Eq. 4.15 and 4.18 of I and of the samples (n,), and
    ``threshold`` tau_CD of Eq. 4.19.
    """

    expected: NDArray
    colour: NDArray
    samples: NDArray
    alpha: float
    chromaticity: float
    sample_alpha: NDArray
    sample_chromaticity: NDArray
    threshold: float


def _choose_pixel(
    model: BackgroundModel, image: NDArray, mask: NDArray, *, alpha_low: float
) -> tuple[int, int]:
    """Row and column of Figure 4.11's pixel: typical of those darker and of other colour."""
    fit = _fitting(model, image, alpha_low) & _off_rim(mask)
    if not fit.any():
        raise ValueError("mask: expected a pixel that shows the colour model, found none")
    distance = np.linalg.norm(image - np.median(image[fit], axis=0), axis=2)
    row, column = np.unravel_index(np.argmin(np.where(fit, distance, np.inf)), fit.shape)
    return int(row), int(column)


def _pixel_colour(
    model: BackgroundModel, image: NDArray, samples: NDArray, pixel: tuple[int, int]
) -> PixelColour:
    """What the figure shows of a pixel, whose ``samples`` (n, 3) are the background's frames."""
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


def figure_4_11(inputs: Any, params: Any) -> Figure:
    """Colour model of the background subtraction, a pixel of the middle frame (Fig. 4.11)."""
    shades = Background.read(params.options)
    bounds = shades.alpha_low, shades.alpha_high
    model, frames = load_model(inputs.model), Stream(inputs.capture, params.sensor)
    middle = len(frames) // 2
    image, mask = frames[middle], load_masks(inputs.mask)[middle]
    pixel = _choose_pixel(model, image, mask, alpha_low=bounds[0])
    samples = np.stack([frame[pixel] for frame in Stream(inputs.background, params.sensor)])
    shown = _pixel_colour(model, image, samples, pixel)
    figure = plt.figure(figsize=(PAGE_IN, 3.1))
    photo = figure.add_axes((0.015, 0.45, 0.27, 0.47))
    zoom = figure.add_axes((0.015, 0.07, 0.13, 0.33))
    for axes, colour in ((photo, BLACK), (zoom, "white")):
        photo_panel(axes, image)
        side = 2 * ZOOM_PX + 1 if axes is photo else 1
        corner = pixel[1] - side / 2, pixel[0] - side / 2
        axes.add_patch(Rectangle(corner, side, side, fill=False, ec="white", lw=2.0))
        axes.add_patch(Rectangle(corner, side, side, fill=False, ec=colour, lw=1.0))
    named(photo, "a", "Image")
    reach = np.array([-ZOOM_PX - 0.5, ZOOM_PX + 0.5])
    zoom.set(xlim=pixel[1] + reach, ylim=pixel[0] - reach)
    write(zoom, (pixel[1], pixel[0] - 0.5), "pixel $i$", (0, 1), 8)
    _swatches(figure.add_axes((0.155, 0.07, 0.13, 0.33)), shown)
    space = blank(figure, (0.32, 0.05, 0.38, 0.87), "RGB space (grey levels)", "b")
    _colour_space(Sketch(space, SIDE), shown)
    _classes(figure.add_axes((0.775, 0.17, 0.215, 0.75)), shown, bounds)
    return labelled(figure, params)


def _swatches(axes: Axes, shown: PixelColour) -> None:
    axes.set(xlim=(0, 1), ylim=(3, 0))
    colours = (shown.expected, shown.alpha * shown.expected, shown.colour)
    for k, (colour, name) in enumerate(zip(colours, (EXPECTED, PROJECTED, COLOUR), strict=True)):
        axes.add_patch(Rectangle((0.02, k + 0.08), 0.28, 0.84, fc=colour / WHITE_LEVEL, ec="none"))
        levels = ", ".join(f"{level:.0f}" for level in colour)
        axes.text(0.36, k + 0.5, f"{name}\n{levels}", va="center", fontsize=TEXT_PT)
    axes.set_axis_off()


def _colour_space(sketch: Sketch, shown: PixelColour) -> None:
    """Axes, E, the chromaticity line, I, alpha E and CD."""
    # A sketch's unit is a thousandth of its places'.
    unit = 1e-3
    names = [rf"$\mathbf{{{name}}}$" for name in "RGB"]
    sketch.triad(np.eye(4), WHITE_LEVEL * unit, names=names, colours=[BLACK] * 3)
    for axis, side in zip(np.eye(3), ((0, -1), (-1, 0.6), (-1, 0)), strict=True):
        for level in TICKS:
            sketch.dot(level * unit * axis, ms=1.8)
            sketch.name(level * unit * axis, str(level), side, 7)
    colours = (shown.expected, shown.alpha * shown.expected, shown.colour)
    E, base, pixel = (unit * colour for colour in colours)
    sketch.line(np.zeros(3), 1.25 * E, lw=1.3)
    sketch.line(base, pixel, color=ORANGE, lw=1.8)
    for place, colour in zip((E, base, pixel), colours, strict=True):
        sketch.dot(place, ms=6, mfc=colour / WHITE_LEVEL, mec=BLACK, mew=0.8)
    along = sketch.flat(E)
    down = np.array([along[1], -along[0]])
    for place, text, side in ((E, EXPECTED, down), (base, PROJECTED, down), (pixel, COLOUR, -down)):
        sketch.name(place, text, side, 9)
    sketch.name((base + pixel) / 2, "$CD_i$", -along, 12, color=ORANGE)
    look = {"rotation": np.rad2deg(np.arctan2(*along[::-1])), "rotation_mode": "anchor"}
    sketch.name(0.2 * E, "chromaticity line", down, 7, **look)
    sketch.name(np.zeros(3), "O", (-1, -1), 6)
    _samples_inset(sketch, shown, E)


def _samples_inset(sketch: Sketch, shown: PixelColour, E: NDArray) -> None:
    """Magnify the background's frames around E."""
    middle, samples = sketch.flat(E), sketch.flat(shown.samples * 1e-3)
    reach = 1.5 * max(1.0, np.abs(samples - middle).max())
    inset = sketch.axes.inset_axes((0.76, 0.2, 0.24, 0.28), aspect="equal", xticks=[], yticks=[])
    near = np.array([-reach, reach])
    inset.set(xlim=middle[0] + near, ylim=middle[1] + near)
    close = Sketch(inset, sketch.view)
    close.line(0.9 * E, 1.1 * E)
    close.dot(E, ms=6, mfc=shown.expected / WHITE_LEVEL, mec=BLACK, mew=0.8)
    inset.plot(*samples.T, "o", ms=3, color=BLUE, mec="white", mew=0.3, zorder=6)
    inset.spines[:].set(visible=True, color=GREY)
    words = f"{len(samples)} background\nframes"
    inset.set_xlabel(words, fontsize=TEXT_PT, color=BLUE, labelpad=2)
    scale_bar(inset, 1, "1 level", loc="lower right")
    sketch.axes.indicate_inset_zoom(inset, edgecolor=GREY, lw=0.6, alpha=1)


def _classes(axes: Axes, shown: PixelColour, bounds: tuple[float, float]) -> None:
    low, high = bounds
    axes.add_patch(Rectangle((low, 0), high - low, shown.threshold, fc=GREEN, ec="none", alpha=0.2))
    axes.text(high, shown.threshold, r"$\tau_{CD}$ ", color=GREEN, ha="right", va="bottom")
    axes.plot(shown.sample_alpha, shown.sample_chromaticity, ".", ms=3, color=BLUE)
    place = shown.alpha, shown.chromaticity
    look = {"ms": 6, "mfc": shown.colour / WHITE_LEVEL, "mec": BLACK, "mew": 0.8}
    axes.plot(*place, "o", **look)
    write(axes, place, f"{COLOUR} ({place[0]:.2f}, {place[1]:.1f})", (0, -1), 11)
    write(axes, ((low + high) / 2, 0.6 * shown.threshold), "background", (0, 1), 0.1)
    write(axes, ((low + high) / 2, 0.5 * shown.chromaticity), "foreground", (0, 1), 0.1)
    axes.set(xlim=(0, high + 0.1), ylim=(0, 1.1 * shown.chromaticity))
    axes.set_xlabel(r"Brightness distortion $\alpha_i$")
    axes.set_ylabel(r"Chromaticity distortion $CD_i/b_i$")
    named(axes, "c", "Classification")
