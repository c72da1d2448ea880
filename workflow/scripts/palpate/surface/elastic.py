"""Tracker with the elastic energy of the solid as regulariser, all in the object frame."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from palpate.open3d_core import ClosestPoints
from palpate.solid.laws import lame_from_engineering
from palpate.solid.mesh import SolidMesh, at_nodes
from palpate.solid.solve import factorise
from palpate.surface.correspondences import Correspondences, pair, rest_offsets
from palpate.surface.neo_hookean import LogNeoHookean
from palpate.surface.options import ElasticTracking
from palpate.surface.template import Template

# Held nodes, and nodes that touch, against the mean diagonal of the elastic stiffness.
HOLDING, TOUCHING = 1e6, 1e3
STEPS = 40
# Deviations from which on a distance counts by its size.
HUBER = 1.5
# After so many steps points keep their places on the surface, or some change them for ever.
PAIRINGS = 8
CONVERGED_M = 3e-5
# Median of the size of a normal variable over its standard deviation.
MEDIAN_OF_NORMAL = 0.6745
SMALLEST_NOISE_M = 1e-6


@dataclass(frozen=True)
class Sphere:
    """The indenter: centre (3,) and radius [m]."""

    centre_m: NDArray
    radius_m: float

    def depths(self, points_m: NDArray) -> tuple[NDArray, NDArray]:
        """How deep points (k, 3) lie inside, (k,) [m], and unit ways out of it, (k, 3)."""
        away = points_m - self.centre_m
        distance = np.linalg.norm(away, axis=1)
        return self.radius_m - distance, away / np.maximum(distance, 1e-12)[:, None]


@dataclass(frozen=True)
class Table:
    """The plane that the object stands on: a point (3,) [m] and its unit normal (3,), upwards."""

    point_m: NDArray
    normal: NDArray

    def depths(self, points_m: NDArray) -> tuple[NDArray, NDArray]:
        """How deep points (k, 3) lie below, (k,) [m], and unit ways out of it, (k, 3)."""
        depth = -(points_m - self.point_m) @ self.normal
        return depth, np.broadcast_to(self.normal, points_m.shape)


@dataclass(frozen=True)
class Fitted:
    """One frame of the solid's n nodes.

    Attributes
    ----------
    nodes_m : (n, 3) array
        Positions [m].
    touched : tuple of two (s,) bool arrays
        Which of the s free surface nodes touch the sphere and the table.
    pairs : Correspondences or None
        The frame's points as these positions see them; None for the solid at rest.
    converged : bool
    """

    nodes_m: NDArray
    touched: tuple[NDArray, NDArray]
    pairs: Correspondences | None
    converged: bool


@dataclass(frozen=True)
class Carried:
    """Pairs of a frame's k points with the solid that carries the surface.

    Attributes
    ----------
    pairs : Correspondences
        With the distances at rest: what a point's distance would be if nothing had moved.
    triangle : (k,) int array
        Triangle of the solid's surface under each closest.
    weights : (k, 3) array
        Barycentric weights there.
    """

    pairs: Correspondences
    triangle: NDArray
    weights: NDArray


class ElasticTracker:
    """Deforms a template with the solid that carries it.

    Minimised over the positions x of the solid's nodes is weight W(x) + sum of rho(r / sigma): W
    the neo-Hookean energy for E = 1 Pa, r the distances of a frame's points along the surface's
    normals, rho Huber's function. Nodes on the support are held; sphere and table keep surface
    nodes out, without friction. Newton's method with an active set.

    Parameters
    ----------
    template : Template
        Object frame.
    solid : SolidMesh
        The object's.
    held : int array
        Nodes on the support.
    table : Table
    options : ElasticTracking

    Attributes
    ----------
    offset : (n,) array
        Distance of undeformed frames' points at each vertex of the template [m].
    at_rest_seen : list of Correspondences
        Undeformed frames, less the offset that the others of them have.
    sigma : float
        Standard deviation of the distances beyond it [m].
    """

    def __init__(
        self,
        template: Template,
        solid: SolidMesh,
        held: NDArray,
        table: Table,
        options: ElasticTracking,
    ) -> None:
        nu = options.poisson_ratio
        self.elastic = LogNeoHookean(solid, *lame_from_engineering(1.0, nu))
        self.template, self.rest, self.table, self.options = template, solid.nodes_m, table, options
        self._carrier = ClosestPoints(solid.nodes_m, solid.surface_triangles())
        _, triangle, self._weights = self._carrier(template.vertices_m)
        self._carried_by = self._carrier.faces[triangle]
        self._surface = np.setdiff1d(self._carrier.faces, held)
        rows, columns = self._carrier.faces[:, :, None], self._carrier.faces[:, None, :]
        self._pairs = self.elastic.pattern.block_of(*np.broadcast_arrays(rows, columns))
        every = np.arange(len(self.rest))
        self._diagonal = self.elastic.pattern.block_of(every, every)
        _, blocks = self.elastic.forces_and_blocks(self.rest)
        self._stiff = float(np.trace(blocks[self._diagonal], axis1=1, axis2=2).mean() / 3)
        self._held, self._holding = held, np.zeros_like(blocks)
        self._holding[self._diagonal[held]] = HOLDING * self._stiff * np.eye(3)
        self._factors = factorise(self.elastic.pattern.matrix(blocks + self._holding))
        self.offset, self.sigma = np.zeros(len(template.vertices_m)), np.inf

    def vertices(self, x: NDArray) -> NDArray:
        """Template vertices (k, 3) when the solid's nodes are at x (n, 3) [m]."""
        moved = (x - self.rest)[self._carried_by]
        return self.template.vertices_m + np.einsum("vc,vcd->vd", self._weights, moved)

    def see(self, x: NDArray, cloud: tuple[NDArray, NDArray]) -> Correspondences:
        """Pair a frame's points (m, 3) [m] and normals with the surface."""
        carried = self._carry(x, cloud)
        return replace(carried.pairs, distance_m=self._distances(carried, x))

    def _carry(self, x: NDArray, cloud: tuple[NDArray, NDArray]) -> Carried:
        vertices = self.vertices(x)
        pairs = pair(vertices, self.template, cloud, self.options).less(self.offset)
        shift = (vertices - self.template.vertices_m)[pairs.corners]
        back = np.einsum("kc,kcd,kd->k", pairs.weights, shift, pairs.normals)
        _, triangle, weights = self._carrier(pairs.rest_m)
        return Carried(replace(pairs, distance_m=pairs.distance_m + back), triangle, weights)

    def _distances(self, carried: Carried, x: NDArray) -> NDArray:
        """Distances of the pairs when the solid's nodes are at x, (k,) [m]."""
        moved = (x - self.rest)[self._carrier.faces[carried.triangle]]
        along = np.einsum("kc,kcd,kd->k", carried.weights, moved, carried.pairs.normals)
        return carried.pairs.distance_m - along

    def learn_rest(self, clouds: Sequence[tuple[NDArray, NDArray]]) -> None:
        """Take the distances in undeformed frames as the sensor's and the template's own.

        Raises
        ------
        ValueError
            If no point is near the template.
        """
        pairs_by_frame = [self._carry(self.rest, cloud).pairs for cloud in clouds]
        self.offset, others = rest_offsets(self.template, pairs_by_frame)
        self.at_rest_seen = [
            pairs.less(own) for pairs, own in zip(pairs_by_frame, others, strict=True)
        ]
        left = np.concatenate([pairs.distance_m for pairs in self.at_rest_seen])
        if not len(left):
            raise ValueError("cloud: expected points near the template at rest, found none")
        spread = float(np.median(np.abs(left))) / MEDIAN_OF_NORMAL
        self.sigma = max(spread, SMALLEST_NOISE_M)

    def at_rest(self) -> Fitted:
        """The undeformed solid."""
        nothing = np.zeros(len(self._surface), dtype=bool)
        return Fitted(self.rest, (nothing, nothing), None, True)

    def fit(
        self, start: Fitted, cloud: tuple[NDArray, NDArray], sphere: Sphere, weight: float
    ) -> Fitted:
        """Minimise for one frame.

        Parameters
        ----------
        start : Fitted
            What touched before touches until it is pulled: a sphere that draws back a little must
            not let go of all at once.
        cloud : (points (m, 3) [m], normals (m, 3))
        sphere : Sphere
        weight : float
            Of the elastic energy [1/J].
        """
        x, touched, converged = start.nodes_m, start.touched, False
        for k in range(STEPS):
            if k < PAIRINGS:
                carried = self._carry(x, cloud)
            before, obstacles = touched, list(zip((sphere, self.table), touched, strict=True))
            step, touched = self._step(x, carried, obstacles, weight)
            part = self.elastic.allowed_part(x, step)
            x = x + part * step
            same = all(map(np.array_equal, before, touched))
            converged = bool(np.abs(step).max() < CONVERGED_M) and (same or k == 0)
            if converged:
                break
        return Fitted(x, touched, self.see(x, cloud), converged)

    def costs(self, pairs: Correspondences, place_m: NDArray, reach_m: float) -> NDArray:
        """Huber's function of each point within a reach of a place [m], shape (k,)."""
        near = np.linalg.norm(pairs.rest_m - place_m, axis=1) < reach_m
        size, k = np.abs(pairs.distance_m[near]) / self.sigma, HUBER
        return np.where(size < k, 0.5 * size**2, k * (size - 0.5 * k))

    def _step(self, x: NDArray, carried: Carried, obstacles: list, weight: float) -> tuple:
        """Newton step, and which surface nodes then touch each obstacle."""
        # All is divided by the weight, so that the elastic part keeps its size.
        forces, blocks = self._outer(x, carried, weight)
        depths = [obstacle.depths(x[self._surface]) for obstacle, _ in obstacles]
        active = []
        for (depth, n), (_, touched) in zip(depths, obstacles, strict=True):
            now = touched | (depth > 0)
            nodes, strength = self._surface[now], TOUCHING * self._stiff
            forces[nodes] -= strength * depth[now, None] * n[now]
            blocks[self._diagonal[nodes]] += strength * n[now, :, None] * n[now, None, :]
            active.append(now)
        step = self._solve(x, forces, blocks)
        # A node leaves when it is pulled: by the sphere's curvature alone it may lie outside.
        moved = step[self._surface]
        left = [depth - np.einsum("kd,kd->k", n, moved) for depth, n in depths]
        return step, tuple(now & (rest > 0) for now, rest in zip(active, left, strict=True))

    def _solve(self, x: NDArray, forces: NDArray, blocks: NDArray) -> NDArray:
        """Step against all forces; where the elastic part is not positive, without that part."""
        pull, elastic = self.elastic.forces_and_blocks(x)
        right = -(forces + pull).ravel()
        try:
            step = self._factors.refactorise(self.elastic.pattern.matrix(blocks + elastic))(right)
            downhill = step @ right > 0
        except ValueError:
            downhill = False
        if not downhill and right.any():
            _, elastic = self.elastic.forces_and_blocks(x, positive=True)
            step = self._factors.refactorise(self.elastic.pattern.matrix(blocks + elastic))(right)
        return step.reshape(-1, 3)

    def _outer(self, x: NDArray, carried: Carried, weight: float) -> tuple[NDArray, NDArray]:
        """Gradient and second derivative of what the support and the points ask for."""
        forces, blocks = np.zeros_like(x), self._holding.copy()
        forces[self._held] = HOLDING * self._stiff * (x - self.rest)[self._held]
        triangle, w, n = carried.triangle, carried.weights, carried.pairs.normals
        distance = self._distances(carried, x)
        size = np.maximum(np.abs(distance), SMALLEST_NOISE_M)
        strength = np.minimum(1, HUBER * self.sigma / size)
        strength /= weight * self.sigma**2
        outer = (n[:, :, None] * n[:, None, :]).reshape(-1, 9)
        for i in range(3):
            pull = (strength * w[:, i] * distance)[:, None] * n
            forces -= at_nodes(self._carrier.faces[triangle, i], pull, len(x))
            for j in range(3):
                part = (strength * w[:, i] * w[:, j])[:, None] * outer
                sums = at_nodes(triangle, part, len(self._pairs)).reshape(-1, 3, 3)
                np.add.at(blocks, self._pairs[:, i, j], sums)
        return forces, blocks
