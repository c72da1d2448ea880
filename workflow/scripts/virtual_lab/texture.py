"""Painted surfaces of the lab: laminate of the table, speckled foam with coloured marks."""

import cv2
import numpy as np
from numpy.typing import NDArray

TABLE_SIZE_M = 2.4
TABLE_STEP_M = 0.0012
FOAM_STEP_M = 0.0004
# Reflectances, linear RGB.
TABLE_COLOUR = (0.42, 0.31, 0.21)
FOAM_COLOUR = (0.30, 0.38, 0.50)
MARK_COLOURS = ((0.55, 0.06, 0.06), (0.05, 0.30, 0.10), (0.55, 0.42, 0.04), (0.03, 0.03, 0.05))
MARKS_PER_M2 = 9000
MARK_RADIUS_M = (0.0010, 0.0030)
GRID_COLOUR = (0.02, 0.02, 0.03)


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
    shape = tuple(int(np.ceil(side / FOAM_STEP_M)) + 1 for side in size_m[::-1])
    cells = 0.55 * noise_field(shape, 2.5, rng) + 0.35 * noise_field(shape, 6.0, rng)
    shade = 1 + 0.20 * cells + 0.05 * noise_field(shape, 150.0, rng)
    image = _painted(np.array(FOAM_COLOUR), np.clip(shade, 0.3, 1.7))
    for _ in range(int(MARKS_PER_M2 * size_m[0] * size_m[1])):
        _paint_mark(image, rng)
    return image


def cover_texture(size_m: tuple[float, float], rng: np.random.Generator) -> NDArray:
    """Printed cover: a picture of soft colours, a title band and lines of small print."""
    shape = tuple(int(np.ceil(side / FOAM_STEP_M)) + 1 for side in size_m[::-1])
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


def draw_grid(image: NDArray, columns_m: list[float], rows_m: list[float]) -> None:
    """Draw thin lines across a foam texture at distances from its first corner [m]."""
    height, width = image.shape[:2]
    for x in columns_m:
        place = round(x / FOAM_STEP_M)
        cv2.line(image, (place, 0), (place, height - 1), GRID_COLOUR, 2)
    for y in rows_m:
        place = round(y / FOAM_STEP_M)
        cv2.line(image, (0, place), (width - 1, place), GRID_COLOUR, 2)


def look_up(image: NDArray, x_px: NDArray, y_px: NDArray) -> NDArray:
    """Bilinear colours at texture coordinates, shape (n, 3)."""
    count = len(x_px)
    if not count:
        return np.zeros((0, 3), dtype=np.float32)
    columns = 4096  # OpenCV's maps may not have more than 32767 rows or columns
    padded = int(np.ceil(count / columns)) * columns
    maps = [
        np.resize(values.astype(np.float32), padded).reshape(-1, columns) for values in (x_px, y_px)
    ]
    colours = cv2.remap(image, *maps, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REFLECT_101)
    return colours.reshape(-1, 3)[:count]


def _painted(colour: NDArray, shade: NDArray) -> NDArray:
    return (colour * shade[..., None]).astype(np.float32)


def _paint_mark(image: NDArray, rng: np.random.Generator) -> None:
    height, width = image.shape[:2]
    centre = (int(rng.integers(width)), int(rng.integers(height)))
    radii = rng.uniform(*MARK_RADIUS_M, 2) / FOAM_STEP_M
    axes = (max(1, int(radii[0])), max(1, int(radii[1])))
    colour = MARK_COLOURS[rng.integers(len(MARK_COLOURS))]
    cv2.ellipse(image, centre, axes, float(rng.uniform(0, 180)), 0, 360, colour, -1, cv2.LINE_AA)
