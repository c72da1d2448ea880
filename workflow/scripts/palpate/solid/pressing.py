"""Equilibrium of a hyperelastic solid that a rigid sphere presses, on a support."""

import logging
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from palpate.solid.hyperelastic import HyperelasticSolid
from palpate.solid.obstacle import (
    SurfacePoints,
    Touch,
    plane_touch,
    sphere_touch,
    touch_blocks,
    touch_energy,
    touch_forces,
)
from palpate.solid.solve import factorise

# Newton's steps end when none moves a node farther; what is left is a square of it.
SMALLEST_STEP_M = 4e-6
STEPS = 40
# Old factors are kept while each step is at most this part of the one before.
SHRINKING = 0.3
NEAR_M = 5e-5
# From steps of this size on the sphere is moved on by what its skin gives.
SETTLED_M = 2e-4
HALVINGS = 12
# Part of the slope that a step's gain in energy must reach.
ARMIJO = 1e-4


@dataclass(frozen=True)
class State:
    """Equilibrium at one place of the sphere.

    Attributes
    ----------
    x_m : (n, 3) array
        Node positions [m].
    force_m2 : (3,) array
        Of the sphere on the solid, over Young's modulus [m^2].
    given_m : float
        What the sphere's skin gave of the depth [m].
    steps : int
        Newton's steps that it took.
    """

    x_m: NDArray
    force_m2: NDArray
    given_m: float
    steps: int


class PressedSolid:
    """A solid, what holds it, and a frictionless rigid sphere that presses it.

    Parameters
    ----------
    solid : HyperelasticSolid
    free : (n, 3) bool array
        Directions in which nodes may move.
    reach : SurfacePoints
        Of the surface that the sphere may touch.
    touch_m, direction : (3,) arrays
        Where the sphere's tip touches first [m], and its way, of length 1.
    radius_m : float
        Of the sphere [m].
    penalty_per_m : float
        Pressure per penetration over Young's modulus [1/m].
    table : Table, optional
        That the solid stands on without being bonded to it.
    """

    def __init__(
        self,
        solid: HyperelasticSolid,
        free: NDArray,
        reach: SurfacePoints,
        *,
        touch_m: NDArray,
        direction: NDArray,
        radius_m: float,
        penalty_per_m: float,
        table: "Table | None" = None,
    ) -> None:
        self.solid, self.free, self.reach, self.table = solid, free, reach, table
        self.touch_m, self.direction = touch_m, direction
        self.radius_m, self.penalty_per_m = radius_m, penalty_per_m
        self._chosen = np.flatnonzero(free.ravel())
        count = len(solid.columns)
        places = sparse.bsr_matrix(
            (np.arange(9 * count).reshape(-1, 3, 3), solid.columns, solid.starts)
        )
        free_places = places.tocsr()[self._chosen][:, self._chosen].sorted_indices()
        self._take, self._pattern = free_places.data, (free_places.indices, free_places.indptr)
        self._pairs = _pairs(solid, reach)
        self._table_pairs = _pairs(solid, table.surface) if table else None
        self._factors = None

    def equilibrium(self, start_m: NDArray, depth_m: float, *, given_m: float = 0.0) -> State:
        """Find the equilibrium at a depth, from node positions near it.

        The sphere's skin gives way; it goes deeper by what that takes of the depth.

        Parameters
        ----------
        start_m : (n, 3) array
            [m].
        depth_m : float
            Way of the sphere since the first touch [m].
        given_m : float, optional
            Guess of what the skin takes [m].

        Raises
        ------
        ValueError
            If it isn't found in as many steps as are tried.
        """
        x, given, largest = start_m, given_m, np.inf
        for step in range(1, STEPS + 1):
            centre = self.centre_m(depth_m + given)
            forces, before = self._forces(x, centre), largest
            # Near the end the last factors serve as long as they bring the steps down.
            move = self._solved(forces) if before < NEAR_M else None
            if move is None or np.abs(move).max() > SHRINKING * before:
                self._refactorise(x, centre)
                move = self._solved(forces)
            part = self._allowed(x, centre, move, forces)
            x = x + part * move
            largest = np.abs(part * move).max()
            if part == 1.0 and largest < SMALLEST_STEP_M:
                return State(x, self.sphere_force(x, centre), given, step)
            if part == 1.0 and largest < SETTLED_M:
                given = self._given(x, centre)
        raise ValueError(
            f"equilibrium: expected steps below {SMALLEST_STEP_M:g} m after {STEPS},"
            f" found {largest:.2g} m"
        )

    def centre_m(self, depth_m: float) -> NDArray:
        """Centre of the sphere that would be at a depth if nothing gave way [m]."""
        return self.touch_m + (depth_m - self.radius_m) * self.direction

    def _given(self, x: NDArray, centre_m: NDArray) -> float:
        """Depth that the sphere's skin takes, to the first order of its compliance [m].

        At a given force the skin's complementary energy Q adds dQ/dF to the depth; in Hertz's
        contact Q grows with the force's power 4/3.
        """
        touch = self._touch(x, centre_m)
        weights = self.reach.areas_m2[touch.points] * touch.depth_m
        along = float(weights @ (touch.normals @ self.direction))
        return 2 / 3 * float(weights @ touch.depth_m) / along if along > 0 else 0.0

    def sphere_force(self, x: NDArray, centre_m: NDArray) -> NDArray:
        """Force of the sphere on the solid over Young's modulus, (3,) [m^2]."""
        return -self._sphere_forces(x, centre_m).sum(axis=0)

    def _touch(self, x: NDArray, centre_m: NDArray) -> Touch:
        return sphere_touch(self.reach.places(x), centre_m, self.radius_m)

    def _sphere_forces(self, x: NDArray, centre_m: NDArray) -> NDArray:
        return touch_forces(self._touch(x, centre_m), self.reach, self.penalty_per_m, len(x))

    def _energy(self, x: NDArray, centre_m: NDArray) -> float:
        energy = self.solid.energy(x)
        energy += touch_energy(self._touch(x, centre_m), self.reach, self.penalty_per_m)
        return energy + (self.table.energy(x) if self.table else 0.0)

    def _forces(self, x: NDArray, centre_m: NDArray) -> NDArray:
        forces = self.solid.forces(x) + self._sphere_forces(x, centre_m)
        return forces + (self.table.forces(x) if self.table else 0.0)

    def _refactorise(self, x: NDArray, centre_m: NDArray) -> None:
        for positive in (False, True):
            matrix = self._matrix(x, centre_m, positive=positive)
            try:
                if self._factors is None:
                    self._factors = factorise(matrix)
                else:
                    self._factors.refactorise(matrix)
                return
            except ValueError:
                if positive:
                    raise

    def _solved(self, forces: NDArray) -> NDArray:
        move = np.zeros(forces.size)
        move[self._chosen] = self._factors(-forces.ravel()[self._chosen])
        return move.reshape(forces.shape)

    def _matrix(self, x: NDArray, centre_m: NDArray, *, positive: bool) -> sparse.csr_matrix:
        blocks = self.solid.blocks(x, positive=positive)
        faces, extra = touch_blocks(
            self._touch(x, centre_m), self.reach, self.penalty_per_m, positive=positive
        )
        _add(blocks, self._pairs[faces], extra)
        if self.table:
            faces, extra = self.table.blocks(x)
            _add(blocks, self._table_pairs[faces], extra)
        size = len(self._chosen)
        return sparse.csr_matrix((blocks.ravel()[self._take], *self._pattern), shape=(size, size))

    def _allowed(self, x: NDArray, centre_m: NDArray, move: NDArray, forces: NDArray) -> float:
        """Part of a step that lowers the energy enough."""
        if np.abs(move).max() < NEAR_M:
            return 1.0
        before, slope, part = self._energy(x, centre_m), float((forces * move).sum()), 1.0
        for _ in range(HALVINGS):
            gain = self._energy(x + part * move, centre_m) - before
            if gain <= ARMIJO * part * slope:
                return part
            part /= 2
        logging.debug("no part of a step lowers the energy")
        return part


@dataclass
class Table:
    """A plane that points of the surface stand on; where they touched, they stick.

    Attributes
    ----------
    surface : SurfacePoints
        That may touch.
    point_m, normal : (3,) arrays
        Of the plane; the normal has length 1.
    penalty_per_m : float
        Pressure per penetration over Young's modulus, and shear per sliding [1/m].
    anchors_m : (f, q, 3) array
        Where the points touched first; NaN where they have not yet [m].
    """

    surface: SurfacePoints
    point_m: NDArray
    normal: NDArray
    penalty_per_m: float
    anchors_m: NDArray

    def energy(self, x: NDArray) -> float:
        """Energy over Young's modulus [m^3]."""
        touch, slid, stiff = self._state(x)
        sliding = 0.5 * (stiff * self.surface.areas_m2[touch.points]) @ (slid**2).sum(axis=1)
        return touch_energy(touch, self.surface, self.penalty_per_m) + float(sliding)

    def forces(self, x: NDArray) -> NDArray:
        """Gradient of the energy, shape (n, 3) [m^2]."""
        touch, slid, stiff = self._state(x)
        faces, inside = touch.points
        shear = (stiff * self.surface.areas_m2[touch.points])[:, None] * slid
        pull = self.surface.shapes[inside][:, :, None] * shear[:, None, :]
        nodes = self.surface.faces[faces].ravel()
        sides = [np.bincount(nodes, pull[..., a].ravel(), len(x)) for a in range(3)]
        return touch_forces(touch, self.surface, self.penalty_per_m, len(x)) + np.stack(sides, 1)

    def blocks(self, x: NDArray) -> tuple[NDArray, NDArray]:
        """Faces in touch and their second derivatives, as `touch_blocks` gives them."""
        touch, _, stiff = self._state(x)
        return touch_blocks(touch, self.surface, self.penalty_per_m, stick_per_m=stiff)

    def settle(self, x: NDArray) -> None:
        """Let the points that touch by now stick where they are; free those that left."""
        touch, _, _ = self._state(x)
        anchors = np.full_like(self.anchors_m, np.nan)
        places = self.surface.places(x)[touch.points]
        old = self.anchors_m[touch.points]
        anchors[touch.points] = np.where(np.isnan(old), places, old)
        self.anchors_m = anchors

    def _state(self, x: NDArray) -> tuple[Touch, NDArray, NDArray]:
        """Touch, how far its points slid from where they stuck (k, 3), stiffness against it."""
        places = self.surface.places(x)
        touch = plane_touch(places, self.point_m, self.normal)
        slid = places[touch.points] - self.anchors_m[touch.points]
        sticks = ~np.isnan(slid[:, 0])
        slid = np.where(sticks[:, None], slid, 0.0)
        slid = slid - (slid @ self.normal)[:, None] * self.normal
        return touch, slid, np.where(sticks, self.penalty_per_m, 0.0)


def _pairs(solid: HyperelasticSolid, surface: SurfacePoints) -> NDArray:
    """Places of the blocks of all pairs of a face's nodes, shape (f, k, k)."""
    rows = np.repeat(surface.faces[:, :, None], surface.faces.shape[1], axis=2)
    return solid.block_of(rows, rows.swapaxes(1, 2))


def _add(blocks: NDArray, places: NDArray, extra: NDArray) -> None:
    np.add.at(blocks, places.ravel(), extra.reshape(-1, 3, 3))
