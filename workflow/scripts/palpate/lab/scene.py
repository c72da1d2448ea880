"""What stands on the lab's table: the object, and the probe with its checkerboard."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import open3d as o3d
import trimesh
from numpy.typing import NDArray

from palpate.lab.texture import (
    FOAM_STEP_M,
    TABLE_SIZE_M,
    TABLE_STEP_M,
    draw_grid,
    foam_texture,
    look_up,
    table_texture,
)

TABLE, OBJECT, SPHERE, METAL, GRIP, BOARD = range(6)
PROBE_PARTS = (SPHERE, METAL, GRIP, BOARD)
# Linear reflectance and strength of the specular highlight of the plain parts.
PLAIN = {
    SPHERE: ((0.30, 0.29, 0.28), 0.02),
    METAL: ((0.34, 0.35, 0.37), 0.35),
    GRIP: ((0.05, 0.05, 0.06), 0.06),
}
WHITE, BLACK = 0.80, 0.030
# Parts of the probe along its axis from the tip's centre, upward: start, stop, radius [m].
STEM = (0.004, 0.038, 0.0035)
NANO25 = (0.038, 0.060, 0.0125)
# The board leans over the axis: a longer handle would pierce it.
HANDLE = (0.060, 0.186, 0.0110)
BOARD_MARGIN_M = 0.016
BOARD_THICKNESS_M = 0.003


@dataclass(frozen=True)
class Probe:
    """The probe's parts as meshes in the force frame with the tip's centre as origin.

    Attributes
    ----------
    parts : dict
        Kind of part to (vertices (n, 3) [m], triangles (m, 3)).
    tip_from_marker : (4, 4) array
    square_m : float
    squares : tuple of int
        Squares of the checkerboard along x and y.
    """

    parts: dict[int, tuple[NDArray, NDArray]]
    tip_from_marker: NDArray
    square_m: float
    squares: tuple[int, int]


@dataclass(frozen=True)
class Bench:
    """Painted surfaces that all frames of a recording share."""

    table: NDArray
    foam_top: NDArray
    foam_side: NDArray
    size_m: NDArray


def make_bench(size_m: NDArray, points_m: NDArray, rng: np.random.Generator) -> Bench:
    """Paint the table and the block, with grid lines through the sample points (Fig. 5.1)."""
    length, width, height = size_m
    top = foam_texture((length, width), rng)
    draw_grid(
        top,
        sorted({float(x) + length / 2 for x in points_m[:, 0]}),
        sorted({float(y) + width / 2 for y in points_m[:, 1]}),
    )
    side = foam_texture((length, height), rng)
    return Bench(table_texture(rng), top, side, np.asarray(size_m))


def make_probe(probe: Mapping) -> Probe:
    """Build the probe's meshes from its file."""
    radius, square = probe["indenter"]["radius_m"], probe["marker"]["square_m"]
    columns, rows = probe["marker"]["inner_corners"]
    marker_from_tip = np.array(probe["marker_from_force"]) @ np.array(probe["force_from_tip"])
    tip_from_marker = np.linalg.inv(marker_from_tip)
    ball = trimesh.creation.icosphere(subdivisions=4, radius=radius)
    parts = {
        SPHERE: (ball.vertices, ball.faces),
        METAL: _merged([_cylinder(*STEM), _cylinder(*NANO25)]),
        GRIP: _cylinder(*HANDLE),
        BOARD: _board(tip_from_marker, square, columns + 1, rows + 1),
    }
    return Probe(parts, tip_from_marker, square, (columns + 1, rows + 1))


class Scene:
    """Geometry of one moment, ready for ray casting, object frame.

    Parameters
    ----------
    surface_m : (n, 3) array, optional
        The object's surface at this moment [m]; None leaves the table bare.
    rest_m, faces : arrays
        Its undeformed vertices [m], which carry the paint, and its triangles.
    probe : Probe, optional
    tip_m, object_from_force : (3,), (3, 3) arrays
        Where the probe is.
    """

    def __init__(
        self,
        *,
        surface_m: NDArray | None = None,
        rest_m: NDArray | None = None,
        faces: NDArray | None = None,
        probe: Probe | None = None,
        tip_m: NDArray | None = None,
        object_from_force: NDArray | None = None,
    ) -> None:
        self.caster = o3d.t.geometry.RaycastingScene()
        self.kinds: list[int] = []
        half = TABLE_SIZE_M / 2
        corners = np.array([[-half, -half, 0], [half, -half, 0], [half, half, 0], [-half, half, 0]])
        self._add(TABLE, corners, np.array([[0, 1, 2], [0, 2, 3]]))
        self.rest_m, self.faces = rest_m, faces
        if surface_m is not None:
            self._add(OBJECT, surface_m, faces)
            self.normals = _vertex_normals(surface_m, faces)
        self.probe, self.tip_m = probe, tip_m
        if probe is not None:
            self.object_from_force = object_from_force
            for kind, (vertices, triangles) in probe.parts.items():
                self._add(kind, vertices @ object_from_force.T + tip_m, triangles)

    def cast(self, origins: NDArray, directions: NDArray) -> dict[str, NDArray]:
        """First hit of each ray: t, kind (-1 for none), triangle, uv and normal."""
        rays = np.concatenate(
            [np.broadcast_to(origins, directions.shape), directions], axis=1
        ).astype(np.float32)
        answer = self.caster.cast_rays(o3d.core.Tensor(rays))
        geometry = answer["geometry_ids"].numpy()
        hit = geometry < len(self.kinds)
        kinds = np.array(self.kinds)
        return {
            "t": answer["t_hit"].numpy().astype(float),
            "kind": np.where(hit, kinds[np.where(hit, geometry, 0)], -1),
            "triangle": answer["primitive_ids"].numpy().astype(np.int64),
            "uv": answer["primitive_uvs"].numpy().astype(float),
            "normal": answer["primitive_normals"].numpy().astype(float),
        }

    def blocked(self, origins: NDArray, directions: NDArray) -> NDArray:
        """Whether anything lies on each ray, shape (n,)."""
        rays = np.concatenate([origins, np.broadcast_to(directions, origins.shape)], axis=1).astype(
            np.float32
        )
        return self.caster.test_occlusions(o3d.core.Tensor(rays)).numpy()

    def _add(self, kind: int, vertices: NDArray, triangles: NDArray) -> None:
        self.caster.add_triangles(
            o3d.core.Tensor(np.ascontiguousarray(vertices, dtype=np.float32)),
            o3d.core.Tensor(np.ascontiguousarray(triangles, dtype=np.uint32)),
        )
        self.kinds.append(kind)


def barycentric(hits: dict, chosen: NDArray, faces: NDArray, values: NDArray) -> NDArray:
    """Interpolate per-vertex values (n, k) at the chosen hits of a mesh."""
    corners = faces[hits["triangle"][chosen]]
    u, v = hits["uv"][chosen].T
    weights = np.stack([1 - u - v, u, v], axis=1)
    return np.einsum("nc,nck->nk", weights, values[corners])


def table_colour(bench: Bench, points: NDArray) -> NDArray:
    """Reflectance of the table at points of it, (n, 3)."""
    place = (points[:, :2] + TABLE_SIZE_M / 2) / TABLE_STEP_M
    return look_up(bench.table, place[:, 0], place[:, 1])


def block_colour(bench: Bench, rest: NDArray) -> NDArray:
    """Reflectance of the block at undeformed points of its surface, (n, 3)."""
    length, width, height = bench.size_m
    place = (rest + [length / 2, width / 2, 0]) / FOAM_STEP_M
    colours = look_up(bench.foam_top, place[:, 0], place[:, 1])
    below = rest[:, 2] < height - 1e-6
    ends = below & (np.abs(np.abs(rest[:, 0]) - length / 2) < 1e-6)
    sides = below & ~ends
    colours[sides] = look_up(bench.foam_side, place[sides, 0], place[sides, 2])
    colours[ends] = look_up(bench.foam_side, place[ends, 1], place[ends, 2])
    return colours


def board_colour(probe: Probe, points_tip: NDArray, footprint_m: NDArray) -> NDArray:
    """Reflectance of the checkerboard, box-filtered over a ray's footprint, (n, 3).

    Parameters
    ----------
    probe : Probe
    points_tip : (n, 3) array
        Points of the board, force axes from the tip's centre [m].
    footprint_m : (n,) array
        Width that one ray stands for [m].
    """
    turn, shift = probe.tip_from_marker[:3, :3], probe.tip_from_marker[:3, 3]
    x, y, z = ((points_tip - shift) @ turn / probe.square_m).T
    width = footprint_m / probe.square_m
    # The origin corner lies one square in from the outer corner, whose square is black.
    dark = 0.5 + 0.5 * _square_wave(x + 1, width) * _square_wave(y + 1, width)
    dark *= _inside(x + 1, probe.squares[0], width) * _inside(y + 1, probe.squares[1], width)
    dark *= z < 0.5 * BOARD_THICKNESS_M / probe.square_m
    return np.repeat((WHITE + (BLACK - WHITE) * dark)[:, None], 3, axis=1)


def _square_wave(x: NDArray, width: NDArray) -> NDArray:
    """Mean over a width of the wave that is 1 on [0, 1) and -1 on [1, 2)."""

    def integral(s: NDArray) -> NDArray:
        return 1 - np.abs(np.mod(s, 2) - 1)

    return (integral(x + width / 2) - integral(x - width / 2)) / width


def _inside(x: NDArray, size: float, width: NDArray) -> NDArray:
    return np.clip(np.minimum(x, size - x) / width + 0.5, 0, 1)


def _board(tip_from_marker: NDArray, square: float, columns: int, rows: int) -> tuple:
    low = np.array([-square - BOARD_MARGIN_M, -square - BOARD_MARGIN_M, 0.0])
    high = np.array(
        [
            (columns - 1) * square + BOARD_MARGIN_M,
            (rows - 1) * square + BOARD_MARGIN_M,
            BOARD_THICKNESS_M,
        ]
    )
    box = trimesh.creation.box(extents=high - low)
    vertices = box.vertices + (low + high) / 2
    return vertices @ tip_from_marker[:3, :3].T + tip_from_marker[:3, 3], box.faces


def _cylinder(start: float, stop: float, radius: float) -> tuple:
    mesh = trimesh.creation.cylinder(radius=radius, height=stop - start, sections=96)
    return mesh.vertices + [0, 0, -(start + stop) / 2], mesh.faces


def _merged(meshes: list[tuple]) -> tuple:
    offsets = np.cumsum([0, *(len(vertices) for vertices, _ in meshes[:-1])])
    faces = [f + offset for (_, f), offset in zip(meshes, offsets, strict=True)]
    return np.concatenate([v for v, _ in meshes]), np.concatenate(faces)


def _vertex_normals(vertices: NDArray, faces: NDArray) -> NDArray:
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    areas = np.cross(b - a, c - a)
    normals = np.zeros_like(vertices)
    for k in range(3):
        np.add.at(normals, faces[:, k], areas)
    return normals / np.linalg.norm(normals, axis=1, keepdims=True)
