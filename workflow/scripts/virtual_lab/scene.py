"""Geometry of one moment of the lab, ready for ray casting."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from palpate.open3d_core import o3d

from virtual_lab.paint import Paint
from virtual_lab.part import OBJECT, TABLE, Finish, Part
from virtual_lab.probe import Probe
from virtual_lab.texture import TABLE_SIZE_M

NO_FINISH = Finish((0.0, 0.0, 0.0), 0.0)


@dataclass(frozen=True)
class Bench:
    """What all frames of a recording share.

    Attributes
    ----------
    table : (h, w, 3) array or None
        Reflectance of the table top; None: there is no table.
    paint : Paint or None
        Of the object.
    props : sequence of Part
        Other things on the table.
    """

    table: NDArray | None
    paint: Paint | None
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
        self.kinds: list[int] = []
        self.finishes: list[Finish] = []
        if bench.table is not None:
            half = TABLE_SIZE_M / 2
            corners = np.array([[-half, -half], [half, -half], [half, half], [-half, half]])
            flat = np.column_stack([corners, np.zeros(4)])
            self._add(TABLE, flat, np.array([[0, 1, 2], [0, 2, 3]]), NO_FINISH)
        for prop in bench.props:
            self._add(prop.kind, prop.vertices_m, prop.faces, prop.finish)
        self.rest_m, self.faces = rest_m, faces
        if surface_m is not None:
            self._add(OBJECT, surface_m, faces, NO_FINISH)
            self.normals = vertex_normals(surface_m, faces)
        if probe is not None:
            self.object_from_force = object_from_force
            for part in probe.parts:
                vertices = part.vertices_m @ object_from_force.T + tip_m
                self._add(part.kind, vertices, part.faces, part.finish)

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

    def _add(self, kind: int, vertices: NDArray, triangles: NDArray, finish: Finish) -> None:
        self.caster.add_triangles(
            o3d.core.Tensor(np.ascontiguousarray(vertices, dtype=np.float32)),
            o3d.core.Tensor(np.ascontiguousarray(triangles, dtype=np.uint32)),
        )
        self.kinds.append(kind)
        self.finishes.append(finish)


def _rays(origins: NDArray, directions: NDArray) -> o3d.core.Tensor:
    rays = np.empty((np.broadcast(origins, directions).shape[0], 6), dtype=np.float32)
    rays[:, :3], rays[:, 3:] = origins, directions
    return o3d.core.Tensor(rays)


def barycentric(hits: dict, chosen: NDArray, faces: NDArray, values: NDArray) -> NDArray:
    """Interpolate per-vertex values (n, k) at the chosen hits of a mesh."""
    corners = faces[hits["triangle"][chosen]]
    u, v = hits["uv"][chosen].T
    weights = np.stack([1 - u - v, u, v], axis=1)
    return np.einsum("nc,nck->nk", weights, values[corners])


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
