"""Parts of a scene: the probe with its checkerboard, and what stands about on the table."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import trimesh
from numpy.typing import NDArray
from trimesh.transformations import rotation_matrix

TABLE, OBJECT, SPHERE, METAL, GRIP, TARGET, PROP = range(7)
PROBE_PARTS = (SPHERE, METAL, GRIP, TARGET)
WALL_M, FLOOR_M = 1.22, -0.72
# Linear reflectance of paper and ink; the target's margin and thickness.
WHITE, BLACK = 0.80, 0.030
MARGIN_M, THICKNESS_M = 0.016, 0.003


@dataclass(frozen=True)
class Finish:
    """How a plain surface looks.

    Attributes
    ----------
    colour : tuple of float
        Linear reflectance in red, green and blue.
    gloss, shininess : float
        Strength and exponent of the specular highlight: the larger, the sharper.
    """

    colour: tuple[float, float, float]
    gloss: float
    shininess: float = 40.0


@dataclass(frozen=True)
class Part:
    """A mesh of one kind (``TABLE`` ... ``PROP``) and finish.

    Attributes
    ----------
    kind : int
    vertices_m : (n, 3) array
    faces : (m, 3) int array
    finish : Finish
    """

    kind: int
    vertices_m: NDArray
    faces: NDArray
    finish: Finish


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


def make_target(marker: Mapping) -> Checkerboard:
    """Make the target of a ``marker`` block.

    Raises
    ------
    ValueError
        If the lab has no such target.
    """
    if (kind := marker.get("kind", "checkerboard")) != "checkerboard":
        raise ValueError(f"marker.kind: expected checkerboard in the lab, found {kind}")
    columns, rows = marker["inner_corners"]
    return Checkerboard((columns + 1, rows + 1), marker["square_m"])


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


def bench_props() -> tuple[Part, ...]:
    """Floor, wall, mug, books, pen and tape: still, well behind the object."""
    floor, wall = [[-3, -3, 0], [3, -3, 0], [3, 3, 0], [-3, 3, 0]], [[-3, 0, -1], [3, 0, -1]]
    wall += [[3, 0, 2], [-3, 0, 2]]
    create, mug = trimesh.creation, Finish((0.62, 0.60, 0.55), 0.25, 60.0)
    cup = create.annulus(r_min=0.037, r_max=0.041, height=0.095, sections=96)
    handle = create.torus(major_radius=0.026, minor_radius=0.0055)
    handle.apply_transform(rotation_matrix(np.pi / 2, [1, 0, 0]))
    bottom = create.cylinder(radius=0.038, height=0.006, sections=96)
    tape = create.annulus(r_min=0.038, r_max=0.052, height=0.025, sections=96)
    place = np.array([-0.33, 0.36, 0.0])
    return (
        _flat(floor, [0, 0, FLOOR_M], (0.20, 0.20, 0.21)),
        _flat(wall, [0, WALL_M, 0], (0.52, 0.54, 0.52)),
        _prop(cup, place + [0, 0, 0.0475], mug),
        _prop(handle, place + [0.045, 0, 0.05], mug),
        _prop(bottom, place + [0, 0, 0.003], mug),
        _box((0.21, 0.15, 0.022), (0.31, 0.34, 0.0), 24, Finish((0.10, 0.16, 0.34), 0.10)),
        _box((0.19, 0.13, 0.016), (0.315, 0.345, 0.022), 11, Finish((0.46, 0.10, 0.08), 0.12)),
        _box((0.17, 0.005, 0.004), (0.02, 0.33, 0.0), -35, Finish((0.04, 0.20, 0.10), 0.3)),
        _prop(tape, np.array([-0.08, 0.42, 0.0125]), Finish((0.55, 0.42, 0.20), 0.2)),
    )


def _flat(corners_m: list, shift_m: list, colour: tuple) -> Part:
    vertices = np.array(corners_m, dtype=float) + shift_m
    return Part(PROP, vertices, np.array([[0, 1, 2], [0, 2, 3]]), Finish(colour, 0.0))


def _box(size: tuple, place: tuple, turn_deg: float, finish: Finish) -> Part:
    box = trimesh.creation.box(extents=size)
    box.apply_transform(rotation_matrix(np.deg2rad(turn_deg), [0, 0, 1]))
    return _prop(box, np.array(place) + [0, 0, size[2] / 2], finish)


def _prop(mesh: trimesh.Trimesh, shift: NDArray, finish: Finish) -> Part:
    return Part(PROP, np.asarray(mesh.vertices) + shift, np.asarray(mesh.faces), finish)
