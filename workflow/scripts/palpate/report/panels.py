"""What panels of figures are made of: an object's surface, a photograph, and the panel's name."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from palpate.units import MILLIMETRES

TITLE_PT, LETTER_PT = 8.5, 11


@dataclass(frozen=True)
class Surface:
    """Surface of one object before and in a frame, object frame.

    Attributes
    ----------
    rest_m, deformed_m : (n, 3) arrays
        Vertices [m].
    faces : (m, 3) int array
        Outward triangles.
    contact_m : (3,) array
        Touched point of the undeformed surface [m].
    """

    rest_m: NDArray
    deformed_m: NDArray
    faces: NDArray
    contact_m: NDArray

    def displacement_mm(self) -> NDArray:
        """Length of each vertex's displacement, shape (n,) [mm]."""
        return np.linalg.norm(self.deformed_m - self.rest_m, axis=1) * MILLIMETRES

    def volume_change(self) -> float:
        """Change of the enclosed volume as a part of the undeformed one."""
        return volume(self.deformed_m, self.faces) / volume(self.rest_m, self.faces) - 1


def photo_panel(axes: Axes, photo: NDArray | None) -> None:
    """Put a picture, (h, w) or (h, w, 3) uint8, into a panel, or the words that there is none."""
    if photo is None:
        axes.text(0.5, 0.5, "recorded as clouds:\nno picture", ha="center", va="center")
    else:
        axes.imshow(photo, cmap="gray" if photo.ndim == 2 else None, interpolation="antialiased")
    axes.set_axis_off()


def named(axes: Axes, letter: str, title: str = "") -> None:
    """Panel's letter at the upper left, its title on the same line."""
    place = {"xy": (0, 1), "xycoords": "axes fraction", "textcoords": "offset points"}
    look = {"ha": "left", "va": "bottom", "fontsize": TITLE_PT}
    axes.annotate(letter, xytext=(0, 4), weight="bold", **place, **look)
    axes.annotate(title, xytext=(LETTER_PT, 4), **place, **look)


def window(low: Sequence, high: Sequence, sizes: Sequence[int]) -> tuple[slice, slice]:
    """Rows and columns from a place to another, x and y, within a picture's width and height."""
    columns, rows = (
        slice(max(int(start), 0), min(int(end) + 1, size))
        for start, end, size in zip(low, high, sizes, strict=True)
    )
    return rows, columns


def volume(vertices: NDArray, faces: NDArray) -> float:
    """Volume that outward triangles (m, 3) over vertices (n, 3) [m] enclose [m^3]."""
    # From the middle: the parts are then as large as the whole.
    a, b, c = (vertices - vertices.mean(axis=0))[faces].swapaxes(0, 1)
    return float((a * np.cross(b, c)).sum() / 6)
