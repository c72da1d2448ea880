"""Things that stand about on the lab's table, and the wall behind it."""

import numpy as np
import trimesh
from numpy.typing import NDArray

from virtual_lab.part import PROP, Finish, Part

WALL_M, FLOOR_M = 1.22, -0.72


def bench_props() -> tuple[Part, ...]:
    """Mug, books, tape, pen, floor and wall: still, well behind the object."""
    return (
        _flat(
            [[-3, -3, 0], [3, -3, 0], [3, 3, 0], [-3, 3, 0]], [0, 0, FLOOR_M], (0.20, 0.20, 0.21)
        ),
        _flat([[-3, 0, -1], [3, 0, -1], [3, 0, 2], [-3, 0, 2]], [0, WALL_M, 0], (0.52, 0.54, 0.52)),
        *_mug(np.array([-0.33, 0.36, 0.0])),
        _box((0.21, 0.15, 0.022), (0.31, 0.34, 0.0), 24, Finish((0.10, 0.16, 0.34), 0.10)),
        _box((0.19, 0.13, 0.016), (0.315, 0.345, 0.022), 11, Finish((0.46, 0.10, 0.08), 0.12)),
        _box((0.17, 0.005, 0.004), (0.02, 0.33, 0.0), -35, Finish((0.04, 0.20, 0.10), 0.3)),
        _tape(np.array([-0.08, 0.42, 0.0])),
    )


def _flat(corners_m: list, shift_m: list, colour: tuple) -> Part:
    vertices = np.array(corners_m, dtype=float) + shift_m
    return Part(PROP, vertices, np.array([[0, 1, 2], [0, 2, 3]]), Finish(colour, 0.0))


def _mug(place: NDArray) -> tuple[Part, ...]:
    cup = trimesh.creation.annulus(r_min=0.037, r_max=0.041, height=0.095, sections=96)
    handle = trimesh.creation.torus(major_radius=0.026, minor_radius=0.0055)
    handle.apply_transform(trimesh.transformations.rotation_matrix(np.pi / 2, [1, 0, 0]))
    finish = Finish((0.62, 0.60, 0.55), 0.25, 60.0)
    floor = trimesh.creation.cylinder(radius=0.038, height=0.006, sections=96)
    return (
        _part(cup, place + [0, 0, 0.0475], finish),
        _part(handle, place + [0.045, 0, 0.05], finish),
        _part(floor, place + [0, 0, 0.003], finish),
    )


def _tape(place: NDArray) -> Part:
    ring = trimesh.creation.annulus(r_min=0.038, r_max=0.052, height=0.025, sections=96)
    return _part(ring, place + [0, 0, 0.0125], Finish((0.55, 0.42, 0.20), 0.2))


def _box(size: tuple, place: tuple, turn_deg: float, finish: Finish) -> Part:
    box = trimesh.creation.box(extents=size)
    box.apply_transform(trimesh.transformations.rotation_matrix(np.deg2rad(turn_deg), [0, 0, 1]))
    return _part(box, np.array(place) + [0, 0, size[2] / 2], finish)


def _part(mesh: trimesh.Trimesh, shift: NDArray, finish: Finish) -> Part:
    return Part(PROP, np.asarray(mesh.vertices) + shift, np.asarray(mesh.faces), finish)
