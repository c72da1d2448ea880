"""Parts of a scene: the probe, and its target, a checkerboard or OpenCV's ChArUco board."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
import trimesh
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates

from virtual_lab.parts import GRIP, METAL, SPHERE, TARGET, Finish, Part

# Linear reflectance of paper and ink; the target's margin and thickness.
WHITE, BLACK = 0.80, 0.030
MARGIN_M, THICKNESS_M = 0.016, 0.003
# Pixels to a square that are tried, so that tags and their cells are whole numbers of them.
PIXELS = range(8, 401)

# Linear reflectance and gloss of the plain parts.
STONE = Finish((0.30, 0.29, 0.28), 0.02)
STEEL = Finish((0.34, 0.35, 0.37), 0.35)
RUBBER = Finish((0.05, 0.05, 0.06), 0.06)
PAPER = Finish((0.80, 0.80, 0.80), 0.0)
# Parts of the probe along its axis from the tip's centre, upward: start, stop, radius [m].
STEM = (0.004, 0.038, 0.0035)
NANO25 = (0.038, 0.060, 0.0125)
# The target is tilted over the axis: a longer handle would pierce it.
HANDLE = (0.060, 0.186, 0.0110)
# The operator's hand is here, and so thick is the forearm behind it.
HAND_M, FOREARM_RADIUS_M = (0.0, 0.0, -0.120), 0.040
SKIN = Finish((0.45, 0.28, 0.20), 0.05)


@dataclass(frozen=True)
class Checkerboard:
    """A checkerboard whose first outer square is black.

    Attributes
    ----------
    squares : tuple of int
        Squares along x and y.
    square_m : float
    """

    squares: tuple[int, int]
    square_m: float

    def mesh(self) -> tuple[NDArray, NDArray]:
        """Vertices (n, 3) [m] and triangles of the target in its own frame (first inner corner)."""
        square, (columns, rows) = self.square_m, self.squares
        margin = square + MARGIN_M
        low = np.array([-margin, -margin, 0.0])
        last = np.array([columns - 2, rows - 2]) * square + margin
        high = np.array([*last, THICKNESS_M])
        box = trimesh.creation.box(extents=high - low)
        return box.vertices + (low + high) / 2, box.faces

    def colour(self, points_m: NDArray, footprint_m: NDArray) -> NDArray:
        """Reflectance at points of the target's frame, box-filtered over footprints, (n, 3)."""
        x, y, z = (points_m / self.square_m).T
        dark = self._dark(x + 1, y + 1, footprint_m / self.square_m)
        dark *= z < 0.5 * THICKNESS_M / self.square_m
        return np.repeat((WHITE + (BLACK - WHITE) * dark)[:, None], 3, axis=1)

    def _dark(self, x: NDArray, y: NDArray, width: NDArray) -> NDArray:
        """Black part of a width around places, all in squares from the outer corner."""
        dark = 0.5 + 0.5 * _square_wave(x, width) * _square_wave(y, width)
        return dark * (_inside(x, self.squares[0], width) * _inside(y, self.squares[1], width))


@dataclass(frozen=True)
class CharucoBoard(Checkerboard):
    """A ChArUco board.

    Attributes
    ----------
    black : (h + 1, w + 1) array
        Sums of the pixels that are black, above and left of each pixel's corner.
    pixels : int
        To a square.
    """

    black: NDArray
    pixels: int

    def _dark(self, x: NDArray, y: NDArray, width: NDArray) -> NDArray:
        half = width / 2
        low, high = (np.stack([y, x]) + sign * half for sign in (-1, 1))
        sums = [
            map_coordinates(self.black, self.pixels * np.stack(ends), order=1, mode="nearest")
            for ends in (high, (low[0], high[1]), (high[0], low[1]), low)
        ]
        return (sums[0] - sums[1] - sums[2] + sums[3]) / (2 * half * self.pixels) ** 2


def make_target(marker: Mapping) -> Checkerboard:
    """Make the target of a ``marker`` block.

    Raises
    ------
    ValueError
        If the lab has no such target, or its tags' cells and squares have no common measure.
    """
    kind = marker.get("kind", "checkerboard")
    if kind == "charuco":
        return _charuco(marker)
    if kind != "checkerboard":
        raise ValueError(f"marker.kind: expected checkerboard or charuco in the lab, found {kind}")
    columns, rows = marker["inner_corners"]
    return Checkerboard((columns + 1, rows + 1), marker["square_m"])


def _charuco(marker: Mapping) -> CharucoBoard:
    squares, share = tuple(marker["squares"]), marker["tag_m"] / marker["square_m"]
    name = getattr(cv2.aruco, f"DICT_{marker['dictionary']}")
    dictionary = cv2.aruco.getPredefinedDictionary(name)
    cells = dictionary.markerSize + 2
    fitting = (n for n in PIXELS if _whole(n * share / cells) and _whole((n - n * share) / 2))
    pixels = next(fitting, None)
    if pixels is None:
        raise ValueError(
            f"marker.tag_m: expected a simple part of square_m for the lab's board, found {share:g}"
        )
    board = cv2.aruco.CharucoBoard(squares, 1.0, share, dictionary)
    board.setLegacyPattern(bool(marker.get("white_first")))
    image = board.generateImage((squares[0] * pixels, squares[1] * pixels), marginSize=0)
    black = np.pad((image < 128).astype(float), ((1, 0), (1, 0))).cumsum(axis=0).cumsum(axis=1)
    return CharucoBoard(squares, marker["square_m"], black, pixels)


def _whole(value: float) -> bool:
    return abs(value - round(value)) < 1e-6


def _square_wave(x: NDArray, width: NDArray) -> NDArray:
    """Mean over a width of the wave that is 1 on [0, 1) and -1 on [1, 2)."""

    def integral(s: NDArray) -> NDArray:
        return 1 - np.abs(np.mod(s, 2) - 1)

    return (integral(x + width / 2) - integral(x - width / 2)) / width


def _inside(x: NDArray, size: float, width: NDArray) -> NDArray:
    return np.clip(np.minimum(x, size - x) / width + 0.5, 0, 1)


@dataclass(frozen=True)
class Probe:
    """The probe's parts, force axes with the tip's centre as origin.

    Attributes
    ----------
    parts : tuple of Part
    target : Checkerboard
    tip_from_marker : (4, 4) array
    """

    parts: tuple[Part, ...]
    target: Checkerboard
    tip_from_marker: NDArray

    def outline(self) -> NDArray:
        """Vertices of all parts, shape (n, 3) [m]."""
        return np.concatenate([part.vertices_m for part in self.parts])


def make_probe(probe: Mapping, elbow_m: Sequence[float] | None = None) -> Probe:
    """Build the probe from its file; with an elbow (3,) [m], also the operator's forearm."""
    target = make_target(probe["marker"])
    marker_from_tip = np.array(probe["marker_from_force"]) @ np.array(probe["force_from_tip"])
    tip_from_marker = np.linalg.inv(marker_from_tip)
    ball = trimesh.creation.icosphere(subdivisions=4, radius=probe["indenter"]["radius_m"])
    vertices, faces = target.mesh()
    vertices = vertices @ tip_from_marker[:3, :3].T + tip_from_marker[:3, 3]
    ends = [] if elbow_m is None else [[HAND_M, elbow_m]]
    arms = [trimesh.creation.cylinder(FOREARM_RADIUS_M, segment=pair) for pair in ends]
    parts = (
        *(Part(GRIP, arm.vertices, arm.faces, SKIN) for arm in arms),
        Part(SPHERE, ball.vertices, ball.faces, STONE),
        Part(METAL, *_cylinder(*STEM), STEEL),
        Part(METAL, *_cylinder(*NANO25), STEEL),
        Part(GRIP, *_cylinder(*HANDLE), RUBBER),
        Part(TARGET, vertices, faces, PAPER),
    )
    return Probe(parts, target, tip_from_marker)


def target_alone(target: Checkerboard) -> Probe:
    """A target without a probe: its parts in its own frame."""
    vertices, faces = target.mesh()
    return Probe((Part(TARGET, vertices, faces, PAPER),), target, np.eye(4))


def _cylinder(start: float, stop: float, radius: float) -> tuple:
    mesh = trimesh.creation.cylinder(radius=radius, height=stop - start, sections=96)
    return mesh.vertices + [0, 0, -(start + stop) / 2], mesh.faces
