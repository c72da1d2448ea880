"""Parts of a scene, and the things that stand about on the lab's table before a wall."""

from dataclasses import dataclass

import numpy as np
import trimesh
from numpy.typing import NDArray
from trimesh.transformations import rotation_matrix

TABLE, OBJECT, SPHERE, METAL, GRIP, TARGET, PROP = range(7)
PROBE_PARTS = (SPHERE, METAL, GRIP, TARGET)
WALL_M, FLOOR_M = 1.22, -0.72


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
