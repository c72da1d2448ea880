"""The forms of the lab's objects: block, ball, ear, and any closed mesh."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from virtual_lab.block import block_model, box_surface
from virtual_lab.closed_mesh import ClosedMesh
from virtual_lab.ear import EAR_BOX_M, ear_distance, uncut_ear_distance
from virtual_lab.level_set import Distance, boundary_surface, level_set_mesh, slope
from virtual_lab.model import Model
from virtual_lab.obstacle import Table
from virtual_lab.tetrahedra import interpolation, tetrahedral_solid

ON_SURFACE_M = 5e-4
# The ball's surface for pictures: rings around its axis, fine at the pole that is pressed.
RINGS, SECTORS, POLE_RING_M, RING_GROWTH = 150, 180, 0.0006, 1.02
# A sphere that sinks in by d touches within a few times sqrt(2 R d) of its axis.
REACH_M = 0.020
EAR_SURFACE_M = 0.00105


class Shape(Protocol):
    """What the lab asks of a form."""

    def model(self, point_m: NDArray, options: Mapping) -> Model:
        """Discretise for a press at a point."""

    def surface(self) -> tuple[NDArray, NDArray]:
        """Closed undeformed surface: vertices (n, 3) [m] and triangles (m, 3)."""


@dataclass(frozen=True)
class Block:
    """Rectangular block on the table, bonded to it or loose.

    Attributes
    ----------
    size_m : (3,) tuple
    """

    size_m: tuple[float, float, float]

    def model(self, point_m: NDArray, options: Mapping) -> Model:
        """Discretise for a press at a point of the top face."""
        return block_model(np.array(self.size_m), point_m, options)

    def surface(self) -> tuple[NDArray, NDArray]:
        """Coarse closed surface."""
        half = np.array([self.size_m[0] / 2, self.size_m[1] / 2, 0])
        low, high = -half, half + [0, 0, self.size_m[2]]
        return box_surface([np.linspace(a, b, 9) for a, b in zip(low, high, strict=True)])


@dataclass(frozen=True)
class Ball:
    """Ball that rests on the table, pressed on its top.

    Attributes
    ----------
    radius_m : float
    """

    radius_m: float

    def model(self, point_m: NDArray, options: Mapping) -> Model:
        """Discretise a quarter, with a real contact at the table."""
        R = self.radius_m
        top = np.array([0.0, 0.0, 2 * R])
        if np.linalg.norm(np.asarray(point_m) - top) > ON_SURFACE_M:
            raise ValueError(f"point: expected the ball's top {top.tolist()} m, found {point_m}")
        if not 0 < options["deepest_m"] < R:
            raise ValueError(f"deepest_m: expected 0 < depth < {R} m, found {options['deepest_m']}")
        planes = [(0, 0.0), (1, 0.0)]
        edge, margin = options["element_m"], 0.1 * R
        solid, mesh = tetrahedral_solid(
            self.distance,
            (np.zeros(3), np.array([R + margin, R + margin, 2 * R + margin])),
            planes,
            [(top, edge), (np.zeros(3), 2 * edge)],
            spacing_m=options["spacing_m"],
            reaches={"top": (top, REACH_M), "bottom": (np.zeros(3), 0.8 * R)},
        )
        fixed = np.abs(solid.nodes_m) < 1e-9
        fixed[:, 2] = False
        rest, faces = self.surface()
        matrix = interpolation(mesh, solid, np.abs(rest))
        signs = np.where(rest < 0, -1.0, 1.0)

        def sample(displacement_m: NDArray) -> NDArray:
            return signs * (matrix @ displacement_m)

        table = Table(friction=options["table_friction"])
        return Model(solid, fixed, (table,), (0, 1), rest, faces, sample)

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
class Ear:
    """Silicone ear on a flat base that is bonded to the table."""

    def model(self, point_m: NDArray, options: Mapping) -> Model:
        """Discretise for a press at a point that faces up."""
        point = np.asarray(point_m, dtype=float)
        _check_point(point, ear_distance, options["deepest_m"])
        high = np.array(EAR_BOX_M) / [2, 2, 1] + 2 * options["spacing_m"]
        box = high * [-1, -1, 0], high
        return _bonded(uncut_ear_distance, box, point, options, self.surface())

    def surface(self) -> tuple[NDArray, NDArray]:
        """Closed surface of about 20,000 vertices."""
        high = np.array(EAR_BOX_M) / [2, 2, 1] + 2 * EAR_SURFACE_M
        return boundary_surface(
            *level_set_mesh(uncut_ear_distance, high * [-1, -1, 0], high, EAR_SURFACE_M)
        )


@dataclass(frozen=True)
class Drawn:
    """Object whose form a closed mesh gives; the table cuts it flat and holds it.

    Attributes
    ----------
    file : str
        Of the mesh, object frame [m].
    surface_m : float
        About the edge of the surface's triangles.
    """

    file: str
    surface_m: float

    def model(self, point_m: NDArray, options: Mapping) -> Model:
        """Discretise for a press at a point that faces up."""
        point, distance = np.asarray(point_m, dtype=float), ClosedMesh(self.file)
        _check_point(point, distance, options["deepest_m"])
        box = _above_table(distance, 2 * options["spacing_m"])
        return _bonded(distance, box, point, options, self.surface())

    def surface(self) -> tuple[NDArray, NDArray]:
        """Closed surface."""
        distance = ClosedMesh(self.file)
        box = _above_table(distance, 2 * self.surface_m)
        return boundary_surface(*level_set_mesh(distance, *box, self.surface_m))


def shape_of(spec: Mapping) -> Shape:
    """Form of an object of lab.yaml, from its ``shape`` block."""
    shape = spec["shape"]
    if shape["kind"] == "block":
        return Block(tuple(shape["size_m"]))
    if shape["kind"] == "ball":
        return Ball(shape["radius_m"])
    if shape["kind"] == "mesh":
        return Drawn(shape["file"], shape["surface_m"])
    return Ear()


def _above_table(mesh: ClosedMesh, margin_m: float) -> tuple[NDArray, NDArray]:
    """Corners of the box around a mesh above the table."""
    return np.array([*mesh.low_m[:2] - margin_m, 0.0]), mesh.high_m + margin_m


def _bonded(
    distance: Distance,
    box_m: tuple[NDArray, NDArray],
    point: NDArray,
    options: Mapping,
    surface: tuple[NDArray, NDArray],
) -> Model:
    """Discretise a form that the table z = 0 cuts and holds."""
    solid, mesh = tetrahedral_solid(
        distance,
        box_m,
        [(2, 0.0)],
        [(point, options["element_m"])],
        spacing_m=options["spacing_m"],
        reaches={"top": (point, REACH_M)},
    )
    fixed = np.repeat(solid.nodes_m[:, 2:] < 1e-9, 3, axis=1)
    rest, faces = surface
    matrix = interpolation(mesh, solid, rest)
    return Model(solid, fixed, (), (), rest, faces, lambda u: matrix @ u)


def _check_point(point: NDArray, distance: object, deepest_m: float) -> None:
    found = point.tolist()
    if abs(float(distance(point[None])[0])) > ON_SURFACE_M:
        raise ValueError(f"point: expected on the object's surface, found {found} m")
    if slope(point[None], distance)[0, 2] < np.cos(np.deg2rad(30)):
        raise ValueError(f"point: expected where the object faces up, found {found} m")
    if not 0 < deepest_m < point[2]:
        raise ValueError(f"deepest_m: expected 0 < depth < {point[2]:.4f} m, found {deepest_m}")


def _rings(angle: NDArray, radius: float) -> tuple[NDArray, NDArray]:
    turn = np.arange(SECTORS) * 2 * np.pi / SECTORS
    around = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    rings = np.concatenate(
        [
            np.sin(angle)[:, None, None] * around,
            np.broadcast_to(np.cos(angle)[:, None, None], (len(angle), SECTORS, 1)),
        ],
        axis=2,
    ).reshape(-1, 3)
    vertices = np.concatenate([[[0, 0, 1.0]], rings, [[0, 0, -1.0]]]) * radius + [0, 0, radius]
    k, j = np.meshgrid(np.arange(len(angle) - 1), np.arange(SECTORS), indexing="ij")
    a, b = 1 + k * SECTORS + j, 1 + k * SECTORS + (j + 1) % SECTORS
    c, d = a + SECTORS, b + SECTORS
    last, ring = len(vertices) - 1, np.arange(SECTORS)
    following = (ring + 1) % SECTORS
    start = 1 + (len(angle) - 1) * SECTORS
    faces = [
        np.stack([a, c, b], axis=-1).reshape(-1, 3),
        np.stack([b, c, d], axis=-1).reshape(-1, 3),
        np.stack([np.zeros(SECTORS, int), 1 + ring, 1 + following], axis=1),
        np.stack([np.full(SECTORS, last), start + following, start + ring], axis=1),
    ]
    return vertices, np.concatenate(faces)
