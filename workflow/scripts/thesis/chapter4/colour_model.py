"""Figure 4.11: the colour model of the background subtraction, from a real pixel."""

from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from numpy.typing import NDArray
from palpate.capture.images import Stream
from palpate.report.style import (
    ARROW,
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    PAGE_IN,
    SMALL,
    beside,
    entitle,
    label_provenance,
)
from palpate.vision.background import load_model
from palpate.vision.foreground import load_masks
from palpate.vision.options import Background

from thesis.chapter4.colour_pixel import PixelColour, choose_pixel, pixel_colour

WHITE_LEVEL = 255
# Half a side of the zoom [px].
ZOOM_PX = 12
# The chromaticity line rises on the paper so steeply, and the view may turn about it so far.
RISE_DEG, TURNS_DEG = 40.0, np.arange(-50, 51, 2)
TICKS = (100, 200)
EXPECTED, PROJECTED, COLOUR = r"$\mathbf{E}_i$", r"$\alpha_i\mathbf{E}_i$", r"$\mathbf{I}_i$"


def make_figure_4_11(inputs: Any, params: Any) -> Figure:
    """The figure, of a pixel of the capture's middle frame."""
    (capture,) = params.captures
    shades = Background.read(params.options)
    bounds = shades.alpha_low, shades.alpha_high
    model, frames = load_model(inputs.model), Stream(inputs.capture, params.sensor)
    middle = len(frames) // 2
    image, mask = frames[middle], load_masks(inputs.mask)[middle]
    pixel = choose_pixel(model, image, mask, alpha_low=bounds[0])
    samples = np.stack([frame[pixel] for frame in Stream(inputs.background, params.sensor)])
    shown = pixel_colour(model, image, samples, pixel)
    provenance = capture["provenance"]
    return figure_4_11(shown, image, pixel, alpha_bounds=bounds, provenance=provenance)


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
    _colour_space_panel(figure.add_axes((0.33, 0.05, 0.38, 0.86)), shown)
    _class_panel(figure.add_axes((0.78, 0.17, 0.21, 0.74)), shown, alpha_bounds)
    label_provenance(figure, {provenance})
    return figure


def _photo_panel(axes: Axes, image: NDArray, pixel: tuple[int, int]) -> None:
    axes.imshow(image, interpolation="antialiased")
    corner = (pixel[1] - ZOOM_PX - 0.5, pixel[0] - ZOOM_PX - 0.5)
    side = 2 * ZOOM_PX + 1
    axes.add_patch(Rectangle(corner, side, side, fill=False, ec="white", lw=2.0))
    axes.add_patch(Rectangle(corner, side, side, fill=False, ec=BLACK, lw=1.0))
    axes.set_axis_off()
    entitle(axes, "Image", "a")


def _zoom_panel(axes: Axes, image: NDArray, pixel: tuple[int, int]) -> None:
    row, column = pixel
    axes.imshow(image, interpolation="none")
    axes.set_xlim(column - ZOOM_PX - 0.5, column + ZOOM_PX + 0.5)
    axes.set_ylim(row + ZOOM_PX + 0.5, row - ZOOM_PX - 0.5)
    axes.add_patch(Rectangle((column - 0.5, row - 0.5), 1, 1, fill=False, ec="white", lw=1.0))
    axes.annotate(
        "pixel $i$",
        (column, row - 0.5),
        (0, 14),
        textcoords="offset points",
        ha="center",
        color="white",
        fontsize=7.5,
        arrowprops={"arrowstyle": "-", "color": "white", "lw": 0.8},
    )
    axes.set(xticks=[], yticks=[])
    axes.spines[:].set_visible(True)


def _swatch_panel(axes: Axes, shown: PixelColour) -> None:
    axes.set(xlim=(0, 1), ylim=(3, 0))
    colours = (shown.expected, shown.alpha * shown.expected, shown.colour)
    for k, (colour, name) in enumerate(zip(colours, (EXPECTED, PROJECTED, COLOUR), strict=True)):
        axes.add_patch(Rectangle((0.02, k + 0.08), 0.3, 0.84, fc=colour / WHITE_LEVEL, ec="none"))
        axes.text(0.38, k + 0.32, name, va="center")
        levels = ", ".join(f"{level:.0f}" for level in colour)
        axes.text(0.38, k + 0.74, levels, va="center", fontsize=6.5)
    axes.set_axis_off()


def _colour_space_panel(axes: Axes, shown: PixelColour) -> None:
    view = _colour_view(shown.expected, shown.colour)
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_axis_off()
    entitle(axes, "RGB space (grey levels)", "b")
    _draw_axes(axes, view)
    _draw_distortion(axes, shown, view)
    _samples_inset(axes, shown, view)


def _draw_axes(axes: Axes, view: NDArray) -> None:
    """Axes of the colour space with ticks."""
    for direction, name in zip(view, "RGB", strict=True):
        axes.annotate("", WHITE_LEVEL * direction, (0, 0), arrowprops=ARROW)
        beside(axes, WHITE_LEVEL * direction, name, direction, 6, weight="bold")
        for level in TICKS:
            axes.plot(*(level * direction), ".", ms=3, color=BLACK)
            aside = np.array([direction[1], -direction[0]]) * (1 if direction[1] < 0.6 else -1)
            beside(axes, level * direction, str(level), aside, 7, fontsize=SMALL)


def _draw_distortion(axes: Axes, shown: PixelColour, view: NDArray) -> None:
    """E, the chromaticity line, I, alpha E and CD."""
    colours = (shown.expected, shown.alpha * shown.expected, shown.colour)
    E, foot, pixel = (colour @ view for colour in colours)
    axes.plot(*np.transpose([(0, 0), 1.2 * E]), color=BLACK)
    axes.plot(*np.transpose([foot, pixel]), color=ORANGE, lw=1.8)
    for place, colour in zip((E, foot, pixel), colours, strict=True):
        _dot(axes, place, colour)
    down = np.array([np.sin(np.radians(RISE_DEG)), -np.cos(np.radians(RISE_DEG))])
    beside(axes, E, EXPECTED, down, 8)
    beside(axes, foot, PROJECTED, down, 8)
    beside(axes, pixel, COLOUR, pixel - foot, 9)
    beside(axes, (foot + pixel) / 2, "$CD_i$", -E, 11, color=ORANGE)
    axes.text(0, 0, "O ", ha="right", va="top")
    axes.text(
        *(0.42 * E),
        "\nchromaticity line",
        rotation=RISE_DEG,
        rotation_mode="anchor",
        ha="center",
        va="center",
        fontsize=SMALL,
    )


def _samples_inset(axes: Axes, shown: PixelColour, view: NDArray) -> None:
    """Magnify the background's frames around E."""
    E, samples = shown.expected @ view, shown.samples @ view
    reach = 1.5 * max(1.0, np.abs(samples - E).max())
    inset = axes.inset_axes((0.75, 0.17, 0.25, 0.3), aspect="equal", xticks=[], yticks=[])
    inset.set(xlim=E[0] + np.array([-reach, reach]), ylim=E[1] + np.array([-reach, reach]))
    inset.plot(*np.transpose([0.9 * E, 1.1 * E]), color=BLACK, lw=1.0)
    _dot(inset, E, shown.expected)
    inset.plot(*samples.T, "o", ms=3, color=BLUE, mec="white", mew=0.3)
    inset.spines[:].set(visible=True, color=GREY)
    inset.set_xlabel(f"{len(samples)} background frames", fontsize=SMALL, color=BLUE, labelpad=2)
    bar = E + np.array([0.9 * reach - 1, -0.86 * reach])
    inset.plot([bar[0], bar[0] + 1], [bar[1]] * 2, color=BLACK, lw=1.5, solid_capstyle="butt")
    beside(inset, bar, "1 level", (-1, 0), 4, fontsize=SMALL - 0.5)
    axes.indicate_inset_zoom(inset, edgecolor=GREY, lw=0.6, alpha=1)


def _dot(axes: Axes, place: NDArray, colour: NDArray) -> None:
    """Mark a place in a pixel's own colour [grey levels]."""
    axes.plot(*place, "o", ms=6, mfc=colour / WHITE_LEVEL, mec=BLACK, mew=0.8)


def _colour_view(E: NDArray, colour: NDArray) -> NDArray:
    """Directions of the paper's right and up in RGB space, as columns (3, 2).

    The chromaticity line keeps its length; of the turns about it the one is taken that sets it
    and the axes R, G, B farthest apart on the paper.
    """
    along = E / np.linalg.norm(E)
    out = colour - (colour @ along) * along
    out /= np.linalg.norm(out)
    views = [_turned(along, out, turn) for turn in np.radians(TURNS_DEG)]
    return max(views, key=lambda view: _smallest_angle(np.vstack([view, along @ view])))


def _turned(along: NDArray, out: NDArray, turn: float) -> NDArray:
    rise = np.radians(RISE_DEG)
    across = np.cos(turn) * out + np.sin(turn) * np.cross(along, out)
    right = np.cos(rise) * along - np.sin(rise) * across
    return np.column_stack([right, np.sin(rise) * along + np.cos(rise) * across])


def _smallest_angle(directions: NDArray) -> float:
    angles = np.sort(np.arctan2(directions[:, 1], directions[:, 0]))
    return float(np.diff(angles, append=angles[0] + 2 * np.pi).min())


def _class_panel(axes: Axes, shown: PixelColour, bounds: tuple[float, float]) -> None:
    low, high = bounds
    axes.add_patch(Rectangle((low, 0), high - low, shown.threshold, fc=GREEN, ec="none", alpha=0.2))
    axes.text(high, shown.threshold, r"$\tau_{CD}$ ", color=GREEN, ha="right", va="bottom")
    axes.plot(shown.sample_alpha, shown.sample_chromaticity, ".", ms=3, color=BLUE)
    place = np.array([shown.alpha, shown.chromaticity])
    _dot(axes, place, shown.colour)
    beside(axes, place, f"{COLOUR} ({place[0]:.2f}, {place[1]:.1f})", (0, -1), 11)
    axes.text((low + high) / 2, 0.6 * shown.threshold, "background", ha="center", va="center")
    axes.text((low + high) / 2, 0.5 * shown.chromaticity, "foreground", ha="center")
    axes.set(xlim=(0, high + 0.1), ylim=(0, 1.1 * shown.chromaticity))
    axes.set_xlabel(r"Brightness distortion $\alpha_i$")
    axes.set_ylabel(r"Chromaticity distortion $CD_i/b_i$")
    entitle(axes, "Classification", "c")
