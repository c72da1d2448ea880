"""Small pictures of an indentation: whether the camera saw the object, the probe and the dent."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from matplotlib import colormaps
from numpy.typing import NDArray

from palpate.report.panels import window
from palpate.units import MILLIMETRES
from palpate.vision.camera import PinholeCamera

WIDTH_PX, QUALITY = 640, 82
# Around object and probe, as a part of their picture's size; the board is so far from the tip.
ROOM, BOARD_M = 0.3, 0.15
OUTLINE, TIP, THICK_PX = (255, 176, 0), (230, 30, 60), 2
AXIS_M, DOT_PX = 0.03, 3
MAP = "cividis"
FOUND = "yellow: outline of the foreground; red: tip and axis of the probe as found"
MEASURED = "measured points of the object, dark near and light far"


@dataclass(frozen=True)
class Frames:
    """What was made of a capture's frames.

    Pictures of the reference camera, grey or RGB; masks (h, w), bool; places of the probe's tip
    (f, 3), camera frame [m], and its axes (f, 3); clouds, camera frame; and forces (f,) [N].
    """

    photos: Sequence[NDArray]
    masks: Sequence[NDArray]
    tips_m: NDArray
    axes: NDArray
    clouds: Sequence
    camera: PinholeCamera
    force_n: NDArray


@dataclass(frozen=True)
class Glimpse:
    """A picture with its caption, and what pictures of its kind show."""

    jpeg: bytes
    caption: str
    shows: str


def glimpses(frames: Frames, deepest: int, name: str) -> Iterator[Glimpse]:
    """Pictures at maximum depth, at about half the force, and of the first frame."""
    middle = int(np.argmin(np.abs(frames.force_n[: deepest + 1] - frames.force_n[deepest] / 2)))
    around = _around(frames, deepest)
    said = {deepest: "maximum depth", middle: "half the force", 0: "first frame"}
    heads = {
        k: f"{name}, {when} (frame {k + 1} of {len(frames.force_n)}), {frames.force_n[k]:.2f} N"
        for k, when in said.items()
    }
    for k, head in heads.items():
        yield Glimpse(_jpeg(_outlined(frames, k), around), head, FOUND)
    for k, head in heads.items():
        count = len(frames.clouds[k].points_m)
        yield Glimpse(_jpeg(_cloud(frames, k), around), f"{head}, {count} points", MEASURED)


def _outlined(frames: Frames, frame: int) -> NDArray:
    """Photograph with the mask's outline and the probe's tip and axis."""
    image = _rgb(frames.photos[frame])
    mask = frames.masks[frame].astype(np.uint8)
    lines, _ = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    cv2.drawContours(image, lines, -1, OUTLINE, THICK_PX // 2 or 1)
    tip = frames.tips_m[frame]
    ends = frames.camera.project([tip, tip - AXIS_M * frames.axes[frame]])
    if np.isfinite(ends).all():
        at, back = (tuple(int(v) for v in np.rint(end)) for end in ends)
        cv2.line(image, at, back, TIP, 1, cv2.LINE_AA)
        cv2.circle(image, at, 2 * THICK_PX, TIP, 1, cv2.LINE_AA)
    return image


def _cloud(frames: Frames, frame: int) -> NDArray:
    """Dimmed photograph with the cloud's points, coloured by their distance."""
    image = _rgb(frames.photos[frame]) // 3
    points = np.asarray(frames.clouds[frame].points_m, dtype=float)
    if not len(points):
        return image
    z = points[:, 2] * MILLIMETRES
    low, high = np.percentile(z, [2, 98])
    part = np.clip((z - low) / max(high - low, 1e-9), 0, 1)
    colours = (255 * colormaps[MAP](part)[:, :3]).astype(int)
    places = np.rint(frames.camera.project(points)).astype(int)
    for place, colour in zip(places.tolist(), colours.tolist(), strict=True):
        cv2.circle(image, place, DOT_PX // 2, colour, -1)
    return image


def _around(frames: Frames, frame: int) -> tuple[slice, slice]:
    """Rows and columns around the measured points, tip and board, with room about them."""
    tip, axis = frames.tips_m[frame], frames.axes[frame]
    points = np.vstack([frames.clouds[frame].points_m, tip, tip - BOARD_M * axis])
    places = frames.camera.project(points[np.isfinite(points).all(axis=1)])
    low, high = places.min(axis=0), places.max(axis=0)
    more = ROOM * (high - low).max()
    return window(low - more, high + more, (frames.camera.width_px, frames.camera.height_px))


def _rgb(photo: NDArray) -> NDArray:
    image = np.ascontiguousarray(photo)
    return cv2.cvtColor(image, cv2.COLOR_GRAY2RGB) if image.ndim == 2 else image.copy()


def _jpeg(image: NDArray, around: tuple[slice, slice]) -> bytes:
    """Window of an RGB picture, as wide as all are."""
    part = image[around]
    height = max(1, round(part.shape[0] * WIDTH_PX / part.shape[1]))
    larger = cv2.resize(part, (WIDTH_PX, height), interpolation=cv2.INTER_CUBIC)
    bgr = cv2.cvtColor(larger, cv2.COLOR_RGB2BGR)
    return cv2.imencode(".jpg", bgr, [cv2.IMWRITE_JPEG_QUALITY, QUALITY])[1].tobytes()
