"""The forms of the lab's objects: block, ball, ear, and any closed mesh."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from virtual_lab.block import block_model, box_surface
from virtual_lab.level_set import boundary_surface, level_set_mesh
from virtual_lab.obstacle import Table
from virtual_lab.signed_distance import EAR_BOX_M, ClosedMesh, Distance, uncut_ear_distance
from virtual_lab.solid import Model
from virtual_lab.tetrahedra import interpolation, tetrahedral_solid

# The ball's surface for pictures: rings around its axis, fine at the pole that is indented.
RINGS, SECTORS, POLE_RING_M, RING_GROWTH = 150, 180, 0.0006, 1.02
# A sphere that is indented by d touches within a few times sqrt(2 R d) of its axis.
REACH_M = 0.020
EAR_SURFACE_M = 0.00105


@dataclass(frozen=True)
class Block:
    """Rectangular block of a size (3,) [m] on the table, bonded to it or not.

    All forms have a ``model`` for an indentation at a point, by the ``contact`` block of lab.yaml,
    and a closed undeformed ``surface`` of vertices (n, 3) [m] and triangles (m, 3).
    """

    size_m: tuple[float, float, float]

    def model(self, point_m: NDArray, options: Mapping) -> Model:
        """Discretise for an indentation at a point of the top face."""
        return block_model(np.array(self.size_m), point_m, options)

    def surface(self) -> tuple[NDArray, NDArray]:
        """Coarse closed surface."""
        half = np.array([self.size_m[0] / 2, self.size_m[1] / 2, 0])
        low, high = -half, half + [0, 0, self.size_m[2]]
        return box_surface([np.linspace(a, b, 9) for a, b in zip(low, high, strict=True)])


@dataclass(frozen=True)
class Ball:
    """Ball of a radius [m] that rests on the table, indented on its top."""

    radius_m: float

    def model(self, point_m: NDArray, options: Mapping) -> Model:
        """Discretise a quarter, with a real contact at the table."""
        R, edge = self.radius_m, options["element_m"]
        top, margin = np.array([0.0, 0.0, 2 * R]), 0.1 * R
        solid, mesh = tetrahedral_solid(
            self.distance,
            (np.zeros(3), np.array([R + margin, R + margin, 2 * R + margin])),
            [(0, 0.0), (1, 0.0)],
            [(top, edge), (np.zeros(3), 2 * edge)],
            spacing_m=options["spacing_m"],
            reaches={"top": (top, REACH_M), "bottom": (np.zeros(3), 0.8 * R)},
        )
        fixed = np.abs(solid.nodes_m) < 1e-9
        fixed[:, 2] = False
        rest, faces = self.surface()
        matrix = interpolation(mesh, solid, np.abs(rest))
        signs = np.where(rest < 0, -1.0, 1.0)
        table = Table(friction=options["table_friction"])
        return Model(solid, fixed, (table,), (0, 1), rest, faces, lambda u: signs * (matrix @ u))

    def distance(self, points_m: NDArray) -> NDArray:
        """Signed distance [m]."""
        return np.linalg.norm(points_m - [0, 0, self.radius_m], axis=-1) - self.radius_m

    def surface(self) -> tuple[NDArray, NDArray]:
        """Closed surface of rings around the vertical axis."""
        steps = RING_GROWTH ** np.arange(RINGS)
        angle = np.cumsum(steps * (POLE_RING_M / self.radius_m))
        angle *= (np.pi - 0.004) / angle[-1] if angle[-1] > np.pi - 0.004 else 1.0
        extra = np.arange(angle[-1], np.pi - 0.004, POLE_RING_M * steps[-1] / self.radius_m)[1:]
        return _rings(np.concatenate([angle, extra]), self.radius_m)


@dataclass(frozen=True)
class Bonded:
    """Form that the table z = 0 cuts flat and holds.

    Attributes
    ----------
    distance : callable
        Signed distance of a form that goes on below the table.
    low_m, high_m : (3,) arrays
        Corners of the box around it.
    edge_m : float
        About the edge of the triangles of its surface.
    """

    distance: Distance
    low_m: NDArray
    high_m: NDArray
    edge_m: float

    def model(self, point_m: NDArray, options: Mapping) -> Model:
        """Discretise for an indentation at a point that faces up."""
        point = np.asarray(point_m, dtype=float)
        solid, mesh = tetrahedral_solid(
            self.distance,
            self._box(2 * options["spacing_m"]),
            [(2, 0.0)],
            [(point, options["element_m"])],
            spacing_m=options["spacing_m"],
            reaches={"top": (point, REACH_M)},
        )
        fixed = np.repeat(solid.nodes_m[:, 2:] < 1e-9, 3, axis=1)
        rest, faces = self.surface()
        matrix = interpolation(mesh, solid, rest)
        return Model(solid, fixed, (), (), rest, faces, lambda u: matrix @ u)

    def surface(self) -> tuple[NDArray, NDArray]:
        """Closed surface."""
        box = self._box(2 * self.edge_m)
        return boundary_surface(*level_set_mesh(self.distance, *box, self.edge_m))

    def _box(self, margin_m: float) -> tuple[NDArray, NDArray]:
        return np.array([*self.low_m[:2] - margin_m, 0.0]), self.high_m + margin_m


def shape_of(spec: Mapping) -> Block | Ball | Bonded:
    """Form of an object of lab.yaml, from its ``shape`` block."""
    shape = spec["shape"]
    if shape["kind"] == "block":
        return Block(tuple(shape["size_m"]))
    if shape["kind"] == "ball":
        return Ball(shape["radius_m"])
    if shape["kind"] == "mesh":
        mesh = ClosedMesh(shape["file"])
        return Bonded(mesh, mesh.low_m, mesh.high_m, shape["surface_m"])
    high = np.array(EAR_BOX_M) / [2, 2, 1]
    return Bonded(uncut_ear_distance, -high, high, EAR_SURFACE_M)


def _rings(angle: NDArray, radius: float) -> tuple[NDArray, NDArray]:
    turn, count = np.arange(SECTORS) * 2 * np.pi / SECTORS, len(angle)
    around = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    heights = np.broadcast_to(np.cos(angle)[:, None, None], (count, SECTORS, 1))
    rings = np.concatenate([np.sin(angle)[:, None, None] * around, heights], axis=2).reshape(-1, 3)
    vertices = np.concatenate([[[0, 0, 1.0]], rings, [[0, 0, -1.0]]]) * radius + [0, 0, radius]
    ring = np.arange(SECTORS)
    following = (ring + 1) % SECTORS
    starts = 1 + SECTORS * np.arange(count)[:, None]
    a, b = starts[:-1] + ring, starts[:-1] + following
    c, d = a + SECTORS, b + SECTORS
    first, last = np.zeros(SECTORS, int), np.full(SECTORS, len(vertices) - 1)
    faces = [
        np.stack([a, c, b], axis=-1).reshape(-1, 3),
        np.stack([b, c, d], axis=-1).reshape(-1, 3),
        np.stack([first, 1 + ring, 1 + following], axis=1),
        np.stack([last, starts[-1] + following, starts[-1] + ring], axis=1),
    ]
    return vertices, np.concatenate(faces)
