"""Painted surfaces: the table's laminate, foam with coloured marks, a cover, mottled solids."""

from collections.abc import Mapping

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates
from scipy.spatial import cKDTree

TABLE_SIZE_M = 2.4
TABLE_STEP_M = 0.0012
FOAM_STEP_M = 0.0004
VOLUME_CELLS = 48
# Reflectances, linear RGB.
TABLE_COLOUR = (0.42, 0.31, 0.21)
FOAM_COLOUR = (0.30, 0.38, 0.50)
MARK_COLOURS = ((0.55, 0.06, 0.06), (0.05, 0.30, 0.10), (0.55, 0.42, 0.04), (0.03, 0.03, 0.05))
MARKS_PER_M2 = 9000
MARK_RADIUS_M = (0.0010, 0.0030)
GRID_COLOUR = (0.02, 0.02, 0.03)


class BlockPaint:
    """Speckled foam block with grid lines through the sample points (Fig. 5.1).

    Parameters
    ----------
    size_m : (3,) array
    points_m : (k, 3) array
        Sample points; none: no lines.
    rng : numpy.random.Generator
    """

    gloss, shininess = 0.0, 1.0

    def __init__(self, size_m: NDArray, points_m: NDArray, rng: np.random.Generator) -> None:
        self.size_m = np.asarray(size_m)
        length, width, height = size_m
        self.top = foam_texture((length, width), rng)
        rows, columns = self.top.shape[:2]
        for x in sorted({float(x) + length / 2 for x in points_m[:, 0]}):
            place = round(x / FOAM_STEP_M)
            cv2.line(self.top, (place, 0), (place, rows - 1), GRID_COLOUR, 2)
        for y in sorted({float(y) + width / 2 for y in points_m[:, 1]}):
            place = round(y / FOAM_STEP_M)
            cv2.line(self.top, (0, place), (columns - 1, place), GRID_COLOUR, 2)
        self.side = foam_texture((length, height), rng)

    def colour(self, rest_m: NDArray) -> NDArray:
        """Linear reflectance at undeformed points, (n, 3)."""
        length, width, height = self.size_m
        place = (rest_m + [length / 2, width / 2, 0]) / FOAM_STEP_M
        colours = look_up(self.top, place[:, 0], place[:, 1])
        below = rest_m[:, 2] < height - 1e-6
        ends = below & (np.abs(np.abs(rest_m[:, 0]) - length / 2) < 1e-6)
        sides = below & ~ends
        colours[sides] = look_up(self.side, place[sides, 0], place[sides, 2])
        colours[ends] = look_up(self.side, place[ends, 1], place[ends, 2])
        return colours


class CoverPaint(BlockPaint):
    """Flat plastic case with a printed cover."""

    gloss, shininess = 0.05, 60.0

    def __init__(self, size_m: NDArray, rng: np.random.Generator) -> None:
        super().__init__(size_m, np.zeros((0, 3)), rng)
        self.top = cover_texture(tuple(size_m[:2]), rng)
        self.side = np.full_like(self.side, 0.45)


class SolidPaint:
    """Mottled material with dots painted on it.

    Parameters
    ----------
    options : mapping
        ``paint`` block of lab.yaml: ``colour``, ``mottle`` (relative contrast), ``mottle_m`` (its
        scale), ``dots`` (a count), ``dot_radius_m`` (least, largest), ``gloss``, ``shininess``.
    surface_m : (n, 3) array
        Vertices of the undeformed surface [m], where dots are put.
    rng : numpy.random.Generator
    """

    def __init__(self, options: Mapping, surface_m: NDArray, rng: np.random.Generator) -> None:
        self.options = options
        self.gloss, self.shininess = options["gloss"], options["shininess"]
        self.volume = rng.standard_normal((VOLUME_CELLS,) * 3).astype(np.float32)
        chosen = rng.choice(len(surface_m), size=options["dots"], replace=False)
        self.radius_m = rng.uniform(*options["dot_radius_m"], size=options["dots"])
        self.ink = np.array(MARK_COLOURS)[rng.integers(len(MARK_COLOURS), size=options["dots"])]
        self.tree = cKDTree(surface_m[chosen]) if options["dots"] else None

    def colour(self, rest_m: NDArray) -> NDArray:
        """Linear reflectance at undeformed points, (n, 3)."""
        shade = np.clip(1 + self.options["mottle"] * self._mottle(rest_m), 0.3, 1.7)
        colours = np.array(self.options["colour"]) * shade[:, None]
        if self.tree is not None:
            away, dot = self.tree.query(rest_m)
            inked = away < self.radius_m[dot]
            colours[inked] = self.ink[dot[inked]]
        return colours

    def _mottle(self, rest_m: NDArray) -> NDArray:
        """Pattern of about unit deviation at undeformed points, (n,)."""
        scale = self.options["mottle_m"]
        return sum(
            map_coordinates(self.volume, (rest_m / s).T, order=1, mode="grid-wrap") * weight
            for s, weight in ((scale, 0.8), (3.1 * scale, 0.6))
        )


def noise_field(shape: tuple[int, int], scale_px: float, rng: np.random.Generator) -> NDArray:
    """Smooth random field of unit standard deviation, shape (h, w)."""
    coarse = [max(4, int(np.ceil(size / scale_px)) + 3) for size in shape]
    field = cv2.resize(
        rng.standard_normal(coarse).astype(np.float32), shape[::-1], interpolation=cv2.INTER_CUBIC
    )
    return field / field.std()


def table_texture(rng: np.random.Generator) -> NDArray:
    """Wood-like laminate, (h, w, 3) float32 reflectance, grain along x."""
    size = int(TABLE_SIZE_M / TABLE_STEP_M)
    grain = cv2.resize(noise_field((size, size // 24), 2.0, rng), (size, size))
    pores = noise_field((size, size), 3.0, rng)
    waves = noise_field((size, size), 220.0, rng)
    shade = 1 + 0.13 * grain + 0.10 * pores + 0.08 * waves
    return _painted(np.array(TABLE_COLOUR), np.clip(shade, 0.35, 1.8))


def plain_table() -> NDArray:
    """A table top of one colour, (h, w, 3) float32 reflectance."""
    return np.full((2, 2, 3), TABLE_COLOUR, dtype=np.float32)


def foam_texture(size_m: tuple[float, float], rng: np.random.Generator) -> NDArray:
    """Open-cell foam with coloured marks, (h, w, 3) float32 reflectance, rows along y."""
    shape = _shape(size_m)
    cells = 0.55 * noise_field(shape, 2.5, rng) + 0.35 * noise_field(shape, 6.0, rng)
    shade = 1 + 0.20 * cells + 0.05 * noise_field(shape, 150.0, rng)
    image = _painted(np.array(FOAM_COLOUR), np.clip(shade, 0.3, 1.7))
    for _ in range(int(MARKS_PER_M2 * size_m[0] * size_m[1])):
        centre = (int(rng.integers(shape[1])), int(rng.integers(shape[0])))
        axes = tuple(max(1, int(r)) for r in rng.uniform(*MARK_RADIUS_M, 2) / FOAM_STEP_M)
        colour = MARK_COLOURS[rng.integers(len(MARK_COLOURS))]
        angle = float(rng.uniform(0, 180))
        cv2.ellipse(image, centre, axes, angle, 0, 360, colour, -1, cv2.LINE_AA)
    return image


def cover_texture(size_m: tuple[float, float], rng: np.random.Generator) -> NDArray:
    """Printed cover: a picture of soft colours, a title band and lines of small print."""
    shape = _shape(size_m)
    layers = [0.5 + 0.22 * noise_field(shape, 40.0, rng) for _ in range(3)]
    image = np.stack(layers, axis=-1) * (1 + 0.15 * noise_field(shape, 3.0, rng))[..., None]
    image = np.clip(image * [0.75, 0.5, 0.4], 0.02, 0.9).astype(np.float32)
    height, width = shape
    cv2.rectangle(image, (0, height - height // 5), (width, height), (0.75, 0.74, 0.70), -1)
    for line in range(4):
        row = height - height // 5 + 12 + 14 * line
        stop = int(width * rng.uniform(0.4, 0.9))
        for start in range(12, stop, 9):
            cv2.line(image, (start, row), (start + 6, row), (0.05, 0.05, 0.06), 3)
    return image


def look_up(image: NDArray, x_px: NDArray, y_px: NDArray) -> NDArray:
    """Bilinear colours at texture coordinates, shape (n, 3)."""
    count = len(x_px)
    if not count:
        return np.zeros((0, 3), dtype=np.float32)
    columns = 4096  # OpenCV's maps may not have more than 32767 rows or columns
    padded = int(np.ceil(count / columns)) * columns
    maps = (np.resize(px.astype(np.float32), padded).reshape(-1, columns) for px in (x_px, y_px))
    colours = cv2.remap(image, *maps, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REFLECT_101)
    return colours.reshape(-1, 3)[:count]


def _painted(colour: NDArray, shade: NDArray) -> NDArray:
    return (colour * shade[..., None]).astype(np.float32)


def _shape(size_m: tuple[float, float]) -> tuple[int, ...]:
    return tuple(int(np.ceil(side / FOAM_STEP_M)) + 1 for side in size_m[::-1])
