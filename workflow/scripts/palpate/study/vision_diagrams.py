"""Diagrams of Section 4.2 from real data: the colour model and the chain of transforms."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import cv2
import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Ellipse, Polygon, Rectangle
from matplotlib.patheffects import Normal, Stroke
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
LARGEST_STD_RATIO = 1.25
# Its chromaticity is clear at so many thresholds; its distance from the rim, half a zoom's side.
CLEAR, RIM_PX, ZOOM_PX = 3.0, 7, 12
# The chromaticity line rises on the paper so steeply, and the view may turn about it so far.
RISE_DEG, TURNS_DEG = 40.0, np.arange(-50, 51, 2)
SMALL = 6.5
TICKS = (100, 200)
AXIS_ARROW = {"arrowstyle": "-|>", "color": BLACK, "lw": 0.8, "shrinkA": 0, "shrinkB": 0}
# Figure 4.12: where the reader stands, and sizes of what the files don't give [m]; the sensor's
# are of ATI's data sheet of the Nano25, handle and stem are sketched.
SIDE_DEG, ABOVE_DEG = 50.0, 34.0
CAMERA_M, FRAME_M = 0.060, 0.035
NANO25_RADIUS_M, NANO25_LENGTH_M = 0.0125, 0.0216
HANDLE_RADIUS_M, HANDLE_M, STEM_RADIUS_M = 0.011, 0.120, 0.0035
MILLIMETRES = 1e3
POINTS_PER_INCH, LETTER_DEPTH_PT = 72, 1.8
CHAIN_ARROW = AXIS_ARROW | {"lw": 1.6, "arrowstyle": "-|>,head_width=0.25,head_length=0.5"}
HALO = Stroke(linewidth=3.2, foreground="white")
CHAIN_ARROW |= {"path_effects": [HALO, Normal()]}
CHESSBOARD, SENSOR, TIP = (
    rf"$\mathbf{{T}}_{{\mathrm{{{name}}}}}$" for name in ("Chessboard", "Sensor", "Tip")
)
EXPECTED, PROJECTED, COLOUR = r"$\mathbf{E}_i$", r"$\alpha_i\mathbf{E}_i$", r"$\mathbf{I}_i$"


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


def _photo_panel(axes: Axes, image: NDArray, pixel: tuple[int, int]) -> None:
    axes.imshow(image, interpolation="antialiased")
    corner = (pixel[1] - ZOOM_PX - 0.5, pixel[0] - ZOOM_PX - 0.5)
    side = 2 * ZOOM_PX + 1
    axes.add_patch(Rectangle(corner, side, side, fill=False, ec="white", lw=2.0))
    axes.add_patch(Rectangle(corner, side, side, fill=False, ec=BLACK, lw=1.0))
    axes.set_axis_off()
    _entitle(axes, "Image", "a")


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
    _entitle(axes, "RGB space (grey levels)", "b")
    _draw_axes(axes, view)
    _draw_distortion(axes, shown, view)
    _samples_inset(axes, shown, view)


def _draw_axes(axes: Axes, view: NDArray) -> None:
    """Axes of the colour space with ticks."""
    for direction, name in zip(view, "RGB", strict=True):
        axes.annotate("", WHITE_LEVEL * direction, (0, 0), arrowprops=AXIS_ARROW)
        _beside(axes, WHITE_LEVEL * direction, name, direction, 6, weight="bold")
        for level in TICKS:
            axes.plot(*(level * direction), ".", ms=3, color=BLACK)
            aside = np.array([direction[1], -direction[0]]) * (1 if direction[1] < 0.6 else -1)
            _beside(axes, level * direction, str(level), aside, 7, fontsize=SMALL)


def _draw_distortion(axes: Axes, shown: PixelColour, view: NDArray) -> None:
    """E, the chromaticity line, I, alpha E and CD."""
    colours = (shown.expected, shown.alpha * shown.expected, shown.colour)
    E, foot, pixel = (colour @ view for colour in colours)
    axes.plot(*np.transpose([(0, 0), 1.2 * E]), color=BLACK)
    axes.plot(*np.transpose([foot, pixel]), color=ORANGE, lw=1.8)
    for place, colour in zip((E, foot, pixel), colours, strict=True):
        _dot(axes, place, colour)
    down = np.array([np.sin(np.radians(RISE_DEG)), -np.cos(np.radians(RISE_DEG))])
    _beside(axes, E, EXPECTED, down, 8)
    _beside(axes, foot, PROJECTED, down, 8)
    _beside(axes, pixel, COLOUR, pixel - foot, 9)
    _beside(axes, (foot + pixel) / 2, "$CD_i$", -E, 11, color=ORANGE)
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
    _beside(inset, bar, "1 level", (-1, 0), 4, fontsize=SMALL - 0.5)
    axes.indicate_inset_zoom(inset, edgecolor=GREY, lw=0.6, alpha=1)


def _dot(axes: Axes, place: NDArray, colour: NDArray) -> None:
    """Mark a place in a pixel's own colour [grey levels]."""
    axes.plot(*place, "o", ms=6, mfc=colour / WHITE_LEVEL, mec=BLACK, mew=0.8)


def _beside(
    axes: Axes, place: NDArray, text: str, direction: NDArray, points: float, **look
) -> None:
    """Write a text some points away from a place; it grows away from it."""
    offset = points * np.asarray(direction) / np.linalg.norm(direction)
    across = "left" if offset[0] > 3 else "right" if offset[0] < -3 else "center"
    axes.annotate(text, place, offset, textcoords="offset points", ha=across, va="center", **look)


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
    _beside(axes, place, f"{COLOUR} ({place[0]:.2f}, {place[1]:.1f})", (0, -1), 11)
    axes.text((low + high) / 2, 0.6 * shown.threshold, "background", ha="center", va="center")
    axes.text((low + high) / 2, 0.5 * shown.chromaticity, "foreground", ha="center")
    axes.set(xlim=(0, high + 0.1), ylim=(0, 1.1 * shown.chromaticity))
    axes.set_xlabel(r"Brightness distortion $\alpha_i$")
    axes.set_ylabel(r"Chromaticity distortion $CD_i/b_i$")
    _entitle(axes, "Classification", "c")


def chain(pose: pd.DataFrame, probe: Mapping) -> dict[str, NDArray]:
    """Frames of Eq. 4.20 in the camera's, in the first frame that shows the marker.

    Parameters
    ----------
    pose : DataFrame
        probe_pose.csv.
    probe : mapping
        The probe's file.

    Returns
    -------
    dict
        ``camera``, ``marker``, ``force`` and ``tip``, each a (4, 4) transform to the camera [m].

    Raises
    ------
    ValueError
        If the marker is in no frame.
    """
    seen = np.flatnonzero(pose["detected"] == 1)
    if not len(seen):
        raise ValueError(f"pose: expected a frame with the marker, found none of {len(pose)}")
    marker = marker_transforms(pose)[seen[0]]
    force = marker @ np.array(probe["marker_from_force"])
    tip = force @ np.array(probe["force_from_tip"])
    return {"camera": np.eye(4), "marker": marker, "force": force, "tip": tip}


def figure_4_12(pose: pd.DataFrame, probe: Mapping, camera: Mapping, *, provenance: str) -> Figure:
    """Chain of transforms from the probe's tip to the camera, to scale (Fig. 4.12).

    Parameters
    ----------
    pose : DataFrame
        probe_pose.csv.
    probe : mapping
        The probe's file.
    camera : mapping
        ``color`` block of the sensor's file, for the field of view.
    provenance : str
    """
    frames = chain(pose, probe)
    figure = plt.figure(figsize=(PAGE_IN, 3.6))
    _chain_panel(figure.add_axes((0.03, 0.04, 0.53, 0.88)), frames, probe, camera)
    _probe_panel(figure.add_axes((0.6, 0.04, 0.39, 0.88)), frames, probe)
    label_provenance(figure, {provenance})
    return figure


def _chain_panel(
    axes: Axes, frames: Mapping[str, NDArray], probe: Mapping, camera: Mapping
) -> None:
    """Everything, from the camera to the tip."""
    view = _side_view(frames)
    _blank(axes, "From camera to tip", "a")
    _draw_camera(axes, camera, view)
    _draw_probe(axes, frames, probe, view)
    places = _origins(frames, view)
    _arrow(axes, places["camera"], places["tip"], lw=1.0, linestyle=(0, (4, 2)), color=BLACK)
    _arrow(axes, places["camera"], places["marker"])
    for name in ("camera", "marker", "tip"):
        _draw_frame(axes, frames[name], view)
    _name_transform(axes, frames, view, ("camera", "marker"), CHESSBOARD, (0, 12))
    _name_transform(axes, frames, view, ("camera", "tip"), f"{CHESSBOARD}{SENSOR}{TIP}", (6, -6))
    _beside(axes, places["camera"], "camera", (0.16, 1), 21, weight="bold")
    _scale_bar(axes, places["tip"] + [0.1, 0], 0.100)
    axes.autoscale_view()


def _probe_panel(axes: Axes, frames: Mapping[str, NDArray], probe: Mapping) -> None:
    """The probe from nearby."""
    view = _side_view(frames)
    _blank(axes, "Probe", "b")
    _draw_probe(axes, frames, probe, view)
    places = _origins(frames, view)
    _arrow(axes, places["marker"], places["force"], connectionstyle="arc3,rad=-0.25")
    _arrow(axes, places["force"], places["tip"], connectionstyle="arc3,rad=0.6")
    for name in ("marker", "force", "tip"):
        _draw_frame(axes, frames[name], view)
    _name_transform(axes, frames, view, ("marker", "force"), SENSOR, (-30, -28))
    _name_transform(axes, frames, view, ("force", "tip"), TIP, (-26, -1))
    for name, words in (("force", "force sensor"), ("tip", "tip")):
        _beside(axes, places[name], words, (1, 0), 44, weight="bold")
    _beside(axes, places["marker"], "marker", (-0.4, 1), 32, weight="bold")
    radius = probe["indenter"]["radius_m"] * MILLIMETRES
    _beside(axes, places["tip"], f"radius {radius:.2f} mm", (1, -0.22), 45, fontsize=SMALL)
    _scale_bar(axes, places["tip"] + [0.055, 0.031], 0.050)
    axes.autoscale_view()


def _scale_bar(axes: Axes, place: NDArray, length_m: float) -> None:
    """Scale of the parallel projection; the arrows are foreshortened and have their lengths."""
    axes.plot(place[0] + np.array([0, length_m]), [place[1]] * 2, color=BLACK, lw=2)
    middle = place + [length_m / 2, 0]
    text = f"{length_m * MILLIMETRES:.0f} mm, parallel to the page"
    _beside(axes, middle, text, (0, -1), 8, fontsize=SMALL)


def _name_transform(
    axes: Axes,
    frames: Mapping[str, NDArray],
    view: NDArray,
    ends: tuple[str, str],
    symbol: str,
    offset: tuple[float, float],
) -> None:
    """Write a transform's symbol, what it takes where, and its length beside its middle."""
    first, second = (frames[name][:3, 3] for name in ends)
    length = np.linalg.norm(second - first) * MILLIMETRES
    text = f"{symbol}\n{ends[0]} from {ends[1]}\n{length:.0f} mm"
    axes.annotate(
        text,
        (first + second) @ view / 2,
        offset,
        textcoords="offset points",
        fontsize=7.5,
        ha="center" if offset[0] == 0 else "left" if offset[0] > 0 else "right",
        va="bottom" if offset[1] > 0 else "top",
    )


def _blank(axes: Axes, title: str, letter: str) -> None:
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_axis_off()
    _entitle(axes, title, letter)


def _entitle(axes: Axes, title: str, letter: str) -> None:
    """Title on the line of the panel's letter, which stands by the axes' height."""
    height_in = axes.get_position().height * axes.figure.get_figheight()
    axes.set_title(title, pad=0.04 * height_in * POINTS_PER_INCH + LETTER_DEPTH_PT)
    panel_letter(axes, letter)


def _origins(frames: Mapping[str, NDArray], view: NDArray) -> dict[str, NDArray]:
    return {name: transform[:3, 3] @ view for name, transform in frames.items()}


def _arrow(axes: Axes, start: NDArray, stop: NDArray, **look) -> None:
    axes.annotate("", stop, start, arrowprops=CHAIN_ARROW | look)


def _side_view(frames: Mapping[str, NDArray]) -> NDArray:
    """Directions of the paper's right and up in the camera frame, as columns (3, 2).

    The probe stands upright and the camera is to its right; the reader stands beside the camera.
    """
    turn, tilt = np.radians([SIDE_DEG, ABOVE_DEG])
    up = -frames["tip"][:3, 2]
    ahead = frames["tip"][:3, 3] - (frames["tip"][:3, 3] @ up) * up
    ahead /= np.linalg.norm(ahead)
    look = np.sin(turn) * ahead + np.cos(turn) * np.cross(ahead, up)
    return np.column_stack([np.cross(look, up), np.cos(tilt) * up + np.sin(tilt) * look])


def _draw_camera(axes: Axes, camera: Mapping, view: NDArray) -> None:
    """Pyramid of the camera's field of view."""
    size = np.array([camera["width_px"], camera["height_px"]])
    focal = np.array([camera["fx_px"], camera["fy_px"]])
    centre = np.array([camera["cx_px"], camera["cy_px"]])
    corners = (np.array([[0, 0], [1, 0], [1, 1], [0, 1]]) * size - centre) / focal
    corners = CAMERA_M * np.column_stack([corners, np.ones(4)])
    for k in range(4):
        side = np.array([np.zeros(3), corners[k], corners[k - 1]])
        axes.add_patch(Polygon(side @ view, fc=GREY, alpha=0.18, ec=BLACK, lw=0.6))


def _draw_board(axes: Axes, transform: NDArray, marker: Mapping, view: NDArray) -> None:
    """Squares of the checkerboard; the outer one beside the origin is black."""
    columns, rows = np.array(marker["inner_corners"]) + 1
    for row, column in np.ndindex(rows, columns):
        x, y = np.array([column - 1, row - 1]) * marker["square_m"]
        corners = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]) * marker["square_m"]
        colour = "white" if (row + column) % 2 else "#555555"
        places = _moved(transform, corners + [x, y, 0])
        axes.add_patch(Polygon(places @ view, fc=colour, ec=GREY, lw=0.3))


def _draw_probe(axes: Axes, frames: Mapping[str, NDArray], probe: Mapping, view: NDArray) -> None:
    """Sphere at its radius, stem and sensor."""
    centre = frames["tip"][:3, 3] @ view
    along = [[0, 0, -HANDLE_M], [0, 0, 0], [0, 0, NANO25_LENGTH_M]]
    grip, top, face = _moved(frames["force"], np.array(along)) @ view
    axes.add_patch(Circle(centre, probe["indenter"]["radius_m"], fc="#B0B0B0", ec=BLACK, lw=0.7))
    _tube(axes, face, centre + [0, STEM_RADIUS_M], STEM_RADIUS_M, "#DDDDDD")
    _tube(axes, top, face, NANO25_RADIUS_M, "#EEEEEE")
    _tube(axes, grip, top, HANDLE_RADIUS_M, "#CFCFCF")
    _draw_board(axes, frames["marker"], probe["marker"], view)


def _tube(axes: Axes, top: NDArray, foot: NDArray, radius_m: float, colour: str) -> None:
    """Cylinder about the paper's vertical, seen from above."""
    look = {"fc": colour, "ec": BLACK, "lw": 0.6}
    size = 2 * radius_m * np.array([1, np.sin(np.radians(ABOVE_DEG))])
    aside = np.array([radius_m, 0])
    axes.add_patch(Ellipse(foot, *size, **look))
    axes.add_patch(Polygon([top - aside, foot - aside, foot + aside, top + aside], fc=colour))
    for side in (aside, -aside):
        axes.plot(*np.transpose([top + side, foot + side]), color=BLACK, lw=0.6, zorder=1)
    axes.add_patch(Ellipse(top, *size, **look))


def _draw_frame(axes: Axes, transform: NDArray, view: NDArray) -> None:
    """Axes of a frame."""
    origin = transform[:3, 3] @ view
    for k, (name, colour) in enumerate(zip("xyz", (ORANGE, GREEN, BLUE), strict=True)):
        end = (transform[:3, 3] + FRAME_M * transform[:3, k]) @ view
        axes.annotate("", end, origin, arrowprops=AXIS_ARROW | {"color": colour, "lw": 1.2})
        axes.update_datalim([end])
        look = {"color": colour, "fontsize": SMALL, "path_effects": [HALO, Normal()]}
        _beside(axes, end, f"${name}$", end - origin, 4, **look)


def _moved(transform: NDArray, points_m: NDArray) -> NDArray:
    return points_m @ transform[:3, :3].T + transform[:3, 3]
