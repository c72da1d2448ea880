"""Geometry of one moment of the lab, ready for ray casting, and how what rays hit looks."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from palpate.open3d_core import o3d

from virtual_lab.paint import TABLE_SIZE_M, TABLE_STEP_M, BlockPaint, SolidPaint, look_up
from virtual_lab.probe import OBJECT, SPHERE, TABLE, TARGET, Finish, Part, Probe

NO_FINISH = Finish((0.0, 0.0, 0.0), 0.0)


@dataclass(frozen=True)
class Bench:
    """What all frames of a recording share.

    Attributes
    ----------
    table : (h, w, 3) array or None
        Reflectance of the table top; None: there is no table.
    paint : BlockPaint, SolidPaint or None
        Of the object.
    props : sequence of Part
        Other things on the table.
    """

    table: NDArray | None
    paint: BlockPaint | SolidPaint | None
    props: Sequence[Part] = ()


class Scene:
    """Geometry of one moment, object frame.

    Parameters
    ----------
    bench : Bench
    surface_m : (n, 3) array, optional
        The object's surface at this moment [m]; None: no object.
    rest_m, faces : arrays
        Its undeformed vertices [m], which carry the paint, and its triangles.
    probe : Probe, optional
    tip_m, object_from_force : (3,), (3, 3) arrays
        Where the probe is.
    """

    def __init__(
        self,
        bench: Bench,
        *,
        surface_m: NDArray | None = None,
        rest_m: NDArray | None = None,
        faces: NDArray | None = None,
        probe: Probe | None = None,
        tip_m: NDArray | None = None,
        object_from_force: NDArray | None = None,
    ) -> None:
        self.bench, self.probe, self.tip_m = bench, probe, tip_m
        self.caster = o3d.t.geometry.RaycastingScene(nthreads=1)
        self.rest_m, self.faces, self.object_from_force = rest_m, faces, object_from_force
        parts = [*bench.props]
        if bench.table is not None:
            corners = TABLE_SIZE_M / 2 * np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
            parts.insert(0, Part(TABLE, corners, np.array([[0, 1, 2], [0, 2, 3]]), NO_FINISH))
        if surface_m is not None:
            parts.append(Part(OBJECT, surface_m, faces, NO_FINISH))
            self.normals = vertex_normals(surface_m, faces)
        for part in probe.parts if probe is not None else ():
            parts.append(replace(part, vertices_m=part.vertices_m @ object_from_force.T + tip_m))
        for part in parts:
            self.caster.add_triangles(
                o3d.core.Tensor(np.ascontiguousarray(part.vertices_m, dtype=np.float32)),
                o3d.core.Tensor(np.ascontiguousarray(part.faces, dtype=np.uint32)),
            )
        self.kinds, self.finishes = [p.kind for p in parts], [p.finish for p in parts]

    def cast(self, origins: NDArray, directions: NDArray) -> dict[str, NDArray]:
        """First hit of each ray: t, kind and part (-1 for none), triangle, uv and normal."""
        answer = self.caster.cast_rays(_rays(origins, directions), nthreads=1)
        part = answer["geometry_ids"].numpy().astype(np.int64)
        # A ray that hits nothing looks up the last of the kinds.
        part[part >= len(self.kinds)] = -1
        return {
            "t": answer["t_hit"].numpy().astype(float),
            "kind": np.array([*self.kinds, -1])[part],
            "part": part,
            "triangle": answer["primitive_ids"].numpy().astype(np.int64),
            "uv": answer["primitive_uvs"].numpy().astype(float),
            "normal": answer["primitive_normals"].numpy().astype(float),
        }

    def blocked(self, origins: NDArray, directions: NDArray) -> NDArray:
        """Whether anything lies on each ray, shape (n,)."""
        return self.caster.test_occlusions(_rays(origins, directions), nthreads=1).numpy()


def _rays(origins: NDArray, directions: NDArray) -> o3d.core.Tensor:
    rays = np.empty((np.broadcast(origins, directions).shape[0], 6), dtype=np.float32)
    rays[:, :3], rays[:, 3:] = origins, directions
    return o3d.core.Tensor(rays)


def dot(a: NDArray, b: NDArray) -> NDArray:
    """Scalar products of the rows of (n, 3) arrays, shape (n,)."""
    return np.einsum("ij,ij->i", a, b)


def unit(vectors: NDArray) -> NDArray:
    """Rows of an (n, 3) array at length 1; a row of zeros stays."""
    return vectors / np.maximum(np.sqrt(dot(vectors, vectors)), 1e-30)[:, None]


def vertex_normals(vertices: NDArray, faces: NDArray) -> NDArray:
    """Area-weighted unit normals of vertices, shape (n, 3)."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    areas = np.cross(b - a, c - a)
    normals = np.zeros_like(vertices)
    for k in range(3):
        np.add.at(normals, faces[:, k], areas)
    return unit(normals)


def look_at_hits(
    scene: Scene, hits: dict, points: NDArray, directions: NDArray, footprint: float
) -> tuple[NDArray, NDArray, NDArray, NDArray]:
    """Normals (n, 3), reflectances (n, 3), strength and exponent (n,) of highlights at hits.

    Parameters
    ----------
    scene : Scene
    hits : dict
        Of `Scene.cast`.
    points, directions : (n, 3) arrays
        Where the rays hit [m], and their unit directions.
    footprint : float
        Width of a ray over its length.
    """
    kind, normals = hits["kind"], hits["normal"].copy()
    colours, gloss, shininess = (
        np.array([getattr(finish, name) for finish in scene.finishes])[hits["part"]]
        for name in ("colour", "gloss", "shininess")
    )
    table = kind == TABLE
    if table.any():
        place = (points[table, :2] + TABLE_SIZE_M / 2) / TABLE_STEP_M
        colours[table] = look_up(scene.bench.table, place[:, 0], place[:, 1])
    body = kind == OBJECT
    if body.any():
        paint = scene.bench.paint
        colours[body] = paint.colour(_barycentric(hits, body, scene.faces, scene.rest_m))
        gloss[body], shininess[body] = paint.gloss, paint.shininess
        normals[body] = unit(_barycentric(hits, body, scene.faces, scene.normals))
    ball = kind == SPHERE
    if ball.any():
        normals[ball] = unit(points[ball] - scene.tip_m)
    target = kind == TARGET
    if target.any():
        local = (points[target] - scene.tip_m) @ scene.object_from_force
        transform = scene.probe.tip_from_marker
        slant = np.abs(dot(normals[target], directions[target]))
        width = hits["t"][target] * footprint / np.sqrt(np.maximum(slant, 0.1))
        local = (local - transform[:3, 3]) @ transform[:3, :3]
        colours[target] = scene.probe.target.colour(local, width)
    return normals, colours, gloss, shininess


def _barycentric(hits: dict, chosen: NDArray, faces: NDArray, values: NDArray) -> NDArray:
    """Interpolate per-vertex values (n, k) at the chosen hits of a mesh."""
    corners = faces[hits["triangle"][chosen]]
    u, v = hits["uv"][chosen].T
    weights = np.stack([1 - u - v, u, v], axis=1)
    return np.einsum("nc,nck->nk", weights, values[corners])
