"""What the lab's objects look like: foam with coloured marks, a shiny ball, a speckled ear."""

from collections.abc import Mapping
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates
from scipy.spatial import cKDTree

from virtual_lab.texture import (
    FOAM_STEP_M,
    MARK_COLOURS,
    cover_texture,
    draw_grid,
    foam_texture,
    look_up,
)

VOLUME_CELLS = 48


class Paint(Protocol):
    """Reflectance and highlight of an object's surface."""

    gloss: float
    shininess: float

    def colour(self, rest_m: NDArray) -> NDArray:
        """Linear reflectance at undeformed points of the surface, (n, 3)."""


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
        if len(points_m):
            draw_grid(
                self.top,
                sorted({float(x) + length / 2 for x in points_m[:, 0]}),
                sorted({float(y) + width / 2 for y in points_m[:, 1]}),
            )
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
        scale), ``dots`` (a count), ``dot_radius_m`` (least, largest), ``gloss``, ``shininess``;
        ``pitch_m`` of a mottle that repeats instead.
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
        if pitch_m := self.options.get("pitch_m"):
            return np.sqrt(2 / 3) * np.sin(2 * np.pi * rest_m / pitch_m).sum(axis=1)
        scale = self.options["mottle_m"]
        return sum(
            map_coordinates(self.volume, (rest_m / s).T, order=1, mode="grid-wrap") * weight
            for s, weight in ((scale, 0.8), (3.1 * scale, 0.6))
        )
