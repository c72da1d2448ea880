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
    sphere_touch,
    touch_blocks,
    touch_energy,
    touch_forces,
)
from palpate.solid.resting import Table
from palpate.solid.solve import factorise

# Newton's steps end when none moves a node farther; what is left is a square of it.
SMALLEST_STEP_M = 4e-6
# Of the depth, where that is less.
SMALLEST_PART = 0.004
STEPS = 40
# Old factors are kept while each step is at most this part of the one before.
SHRINKING = 0.3
NEAR_M = 5e-5
# From steps of this size on the sphere is moved on by what its skin gives.
SETTLED_M = 2e-4
# The skin's energy grows with this power of the force; known from two forces that differ enough.
HERTZ_POWER, POWERS, MORE = 4 / 3, (1.0, 3.0), 1.02
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
    skin_m3 : float
        Complementary energy of the skin over Young's modulus [m^3].
    steps : int
        Newton's steps that it took.
    """

    x_m: NDArray
    force_m2: NDArray
    given_m: float
    skin_m3: float
    steps: int

    @staticmethod
    def at_rest(nodes_m: NDArray) -> "State":
        """Before the sphere touches."""
        return State(nodes_m, np.zeros(3), 0.0, 0.0, 0)


class IndentedSolid:
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
        table: Table | None = None,
    ) -> None:
        self.solid, self.free, self.reach, self.table = solid, free, reach, table
        self.touch_m, self.direction = touch_m, direction
        self.radius_m = radius_m
        self._chosen = np.flatnonzero(free.ravel())
        places = solid.pattern.places()
        free_places = places[self._chosen][:, self._chosen].sorted_indices()
        self._take, self._pattern = free_places.data, (free_places.indices, free_places.indptr)
        self._pairs = _pairs(solid, reach)
        self._table_pairs = _pairs(solid, table.surface) if table else None
        self._factors = None

    def equilibrium(self, start_m: NDArray, depth_m: float, *, last: State) -> State:
        """Find the equilibrium at a depth, from node positions near it.

        The sphere's skin gives way; it goes deeper by what that takes of the depth.

        Parameters
        ----------
        start_m : (n, 3) array
            [m].
        depth_m : float
            Way of the sphere since the first touch [m].
        last : State
            At a lesser depth.

        Raises
        ------
        ValueError
            If it isn't found in as many steps as are tried.
        """
        x, given, largest = start_m, last.given_m, np.inf
        smallest = min(SMALLEST_STEP_M, SMALLEST_PART * depth_m)
        if self.table:
            self.table.settle(last.x_m if last.steps else x)
        for step in range(1, STEPS + 1):
            centre = self.centre_m(depth_m + given)
            forces, before = self._forces(x, centre), largest
            # Near the end the last factors serve as long as they bring the steps down.
            move = self._solved(forces) if before < NEAR_M else None
            if move is None or np.abs(move).max() > SHRINKING * before:
                self._refactorise(x, centre)
                move = self._solved(forces)
            # Small steps that don't shrink go to and fro between two sets of touching points.
            free = np.abs(move).max() < min(NEAR_M, max(before / 2, smallest))
            part = 1.0 if free else self._allowed(x, centre, move, forces)
            x = x + part * move
            largest = np.abs(part * move).max()
            if part == 1.0 and largest < smallest:
                return State(x, self.sphere_force(x, centre), given, self._skin(x, centre), step)
            if part == 1.0 and largest < SETTLED_M:
                given = self._given(x, centre, last)
        raise ValueError(
            f"equilibrium: expected steps below {smallest:g} m after {STEPS}, found {largest:.2g} m"
        )

    def centre_m(self, depth_m: float) -> NDArray:
        """Centre of the sphere that would be at a depth if nothing gave way [m]."""
        return self.touch_m + (depth_m - self.radius_m) * self.direction

    def _given(self, x: NDArray, centre_m: NDArray, last: State) -> float:
        """Depth that the sphere's skin takes, to the first order of its compliance [m].

        At a given force F the skin's complementary energy Q adds dQ/dF to the depth; Q grows with
        a power of F, in Hertz's contact with 4/3.
        """
        force = float(self.sphere_force(x, centre_m) @ self.direction)
        before = float(last.force_m2 @ self.direction)
        energy, power = self._skin(x, centre_m), HERTZ_POWER
        if force <= 0:
            return 0.0
        if before > 0 and force > MORE * before:
            power = np.log(energy / last.skin_m3) / np.log(force / before)
        return float(np.clip(power, *POWERS)) * energy / force

    def _skin(self, x: NDArray, centre_m: NDArray) -> float:
        """Complementary energy of the sphere's skin over Young's modulus [m^3]."""
        return touch_energy(self._touch(x, centre_m), self.reach)

    def sphere_force(self, x: NDArray, centre_m: NDArray) -> NDArray:
        """Force of the sphere on the solid over Young's modulus, (3,) [m^2]."""
        return -self._sphere_forces(x, centre_m).sum(axis=0)

    def _touch(self, x: NDArray, centre_m: NDArray) -> Touch:
        return sphere_touch(self.reach.places(x), centre_m, self.radius_m)

    def _sphere_forces(self, x: NDArray, centre_m: NDArray) -> NDArray:
        return touch_forces(self._touch(x, centre_m), self.reach, len(x))

    def _energy(self, x: NDArray, centre_m: NDArray) -> float:
        energy = self.solid.energy(x)
        energy += touch_energy(self._touch(x, centre_m), self.reach)
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
        faces, extra = touch_blocks(self._touch(x, centre_m), self.reach, positive=positive)
        _add(blocks, self._pairs[faces], extra)
        if self.table:
            faces, extra = self.table.blocks(x)
            _add(blocks, self._table_pairs[faces], extra)
            pinned = self.table.pinned
            blocks[self.solid.pattern.block_of(pinned, pinned)] += self.table.pins_m
        size = len(self._chosen)
        return sparse.csr_matrix((blocks.ravel()[self._take], *self._pattern), shape=(size, size))

    def _allowed(self, x: NDArray, centre_m: NDArray, move: NDArray, forces: NDArray) -> float:
        """Part of a step that lowers the energy enough."""
        before, slope, part = self._energy(x, centre_m), float((forces * move).sum()), 1.0
        for _ in range(HALVINGS):
            gain = self._energy(x + part * move, centre_m) - before
            if gain <= ARMIJO * part * slope:
                return part
            part /= 2
        logging.debug("no part of a step lowers the energy")
        return part


def _pairs(solid: HyperelasticSolid, surface: SurfacePoints) -> NDArray:
    """Places of the blocks of all pairs of a face's nodes, shape (f, k, k)."""
    rows = np.repeat(surface.faces[:, :, None], surface.faces.shape[1], axis=2)
    return solid.pattern.block_of(rows, rows.swapaxes(1, 2))


def _add(blocks: NDArray, places: NDArray, extra: NDArray) -> None:
    np.add.at(blocks, places.ravel(), extra.reshape(-1, 3, 3))
