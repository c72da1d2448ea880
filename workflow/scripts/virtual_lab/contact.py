"""A soft solid between rigid obstacles: finite strain, penalty contact, Coulomb friction.

Total Lagrangian with quadratic elements. The sphere advances in load steps; each is solved by
Newton's method and halved when that fails. The estimators share none of this code.
"""

import logging
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from virtual_lab.material import Law
from virtual_lab.obstacle import Sphere, Table
from virtual_lab.solid import SolidMesh
from virtual_lab.tangent import TangentSolver

# Penalty stiffness over E / R; penetration stays below a hundredth of a millimetre or two.
PENALTY_FACTOR = 1500.0
STICKING_FACTOR = 0.1
# Of a solution: Newton's steps, and parts of them.
TRIALS = 40
# Part of a step below which it is taken whatever it does.
SMALLEST_SHARE = 0.2
RESIDUAL_TOLERANCE = 1e-7
# Relative residual below which the tangent takes in the turning of the normals.
SETTLED = 0.1
SMALLEST_STEP_M = 2e-5
# Elements whose matrices are made at once: what a processor's cache holds.
PART = 32
Obstacle = Sphere | Table


@dataclass(frozen=True)
class ContactStep:
    """Equilibrium at one depth.

    Attributes
    ----------
    depth_m : float
        How far the sphere went since it first touched [m].
    displacement_m : (n, 3) array
        Nodal displacements [m].
    forces_n : (k, 3) array
        Force of each obstacle on the object [N].
    energy_j : float
        Stored elastic energy [J].
    penetration_m : float
        Largest overlap of object and obstacles [m].
    support_n : (3,) array
        Reaction of the fixed nodes on the object [N].
    """

    depth_m: float
    displacement_m: NDArray
    forces_n: NDArray
    energy_j: float
    penetration_m: float
    support_n: NDArray


@dataclass
class Grip:
    """What friction remembers of the last equilibrium, at an obstacle's quadrature points.

    Attributes
    ----------
    offset_m : (f, q, 3) array
        Position relative to the obstacle [m].
    traction_pa : (f, q, 3) array
    """

    offset_m: NDArray
    traction_pa: NDArray


class ContactProblem:
    """Boundary value problem of a solid that a sphere indents.

    Parameters
    ----------
    mesh : SolidMesh
    law : callable
        Hyperelastic law (`virtual_lab.material`).
    obstacles : sequence of Sphere and Table
        The sphere first.
    stiffness_pa : float
        Young's modulus, for the penalty's scale [Pa].
    fixed : (n, 3) bool array
        Displacements that are zero.
    grade : (m, q) array, optional
        How much stiffer than the law's the solid is at its quadrature points; 1 if not given.
    """

    def __init__(
        self,
        mesh: SolidMesh,
        law: Law,
        obstacles: Sequence[Obstacle],
        *,
        stiffness_pa: float,
        fixed: NDArray,
        grade: NDArray | float = 1.0,
    ) -> None:
        self.mesh, self.law, self.obstacles = mesh, law, tuple(obstacles)
        self.grade = np.broadcast_to(grade, mesh.weights_m3.shape)
        self.penalty = PENALTY_FACTOR * stiffness_pa / obstacles[0].radius_m
        self.largest_move_m = obstacles[0].radius_m / 3
        self.fixed = fixed.ravel()
        self.free = np.flatnonzero(~self.fixed)
        slips = any(obstacle.friction for obstacle in obstacles)
        self.tangent = TangentSolver(mesh.elements, self.fixed, symmetric=not slips)
        count, points, nodes, _ = mesh.gradients.shape
        weighted = mesh.gradients * (self.grade * mesh.weights_m3)[..., None, None]
        self.weighted = weighted.transpose(0, 2, 1, 3).reshape(count, nodes, points * 3)
        self.parts = [slice(k, k + PART) for k in range(0, count, PART)]
        self.iterations = 0

    def indent(self, depths_m: NDArray) -> list[ContactStep]:
        """Solve for each of the increasing indentation depths [m].

        Raises
        ------
        ValueError
            If no equilibrium is found beyond a depth.
        """
        u = np.zeros(self.fixed.size)
        before, depth, step_before = u, 0.0, None
        grips = self._grips(u, 0.0, [None] * len(self.obstacles))
        steps = []
        for wanted in depths_m:
            while depth < wanted - 1e-12:
                step = wanted - depth
                while True:
                    guess = u + (u - before) * (step / step_before) if step_before else u
                    solved = self._solve(guess, depth + step, grips)
                    if solved is not None:
                        break
                    step /= 2
                    if step < SMALLEST_STEP_M:
                        raise ValueError(f"contact: no equilibrium beyond depth {depth:.5f} m")
                before, u = u, solved
                step_before, depth = step, depth + step
                grips = self._grips(u, depth, grips)
            steps.append(self._describe(u, depth, grips))
            found = steps[-1].forces_n[0] @ self.obstacles[0].direction
            logging.info("depth %.2f mm: %.4f N (%d)", depth * 1e3, found, self.iterations)
        return steps

    def _solve(self, u: NDArray, depth_m: float, grips: list) -> NDArray | None:
        """Newton's method from a guess; None when it fails."""
        last, before, share = np.inf, u, 1.0
        step = np.zeros(len(self.free))
        for _ in range(TRIALS):
            u = before.copy()
            u[self.free] -= share * step
            try:
                internal, blocks = self._elastic(u)
            except FloatingPointError:
                if not step.any() or share < SMALLEST_SHARE:
                    return None
                share /= 2
                continue
            touches = self._touches(u, depth_m, grips, turning=last < SETTLED)
            contact, patches = sum(touch[0] for touch in touches), [touch[1] for touch in touches]
            residual = (internal - contact)[self.free]
            scale = max(np.abs(contact).sum(), 1e-6)
            error = np.abs(residual).sum() / scale
            if error < RESIDUAL_TOLERANCE:
                return u
            # Near the end, what slips and sticks in turn is solved by parts of a step.
            if last < min(error, SETTLED) and share > SMALLEST_SHARE:
                share /= 2
                continue
            last, before, share = error, u, 1.0
            step = self.tangent.solve([(np.arange(len(blocks)), blocks), *patches], residual)
            step *= min(1.0, self.largest_move_m / max(np.abs(step).max(), 1e-12))
            self.iterations += 1
        return None

    def _elastic(self, u: NDArray) -> tuple[NDArray, NDArray]:
        """Internal nodal forces [N] and tangents of the elements (m, a, 3, 3, a) [N/m]."""
        count, points, nodes, _ = self.mesh.gradients.shape
        forces = np.empty((count, nodes, 3))
        blocks = np.empty((count, nodes, 3, 3, nodes))
        for part in self.parts:
            _, P, A = self.law(self._gradient(u, part))
            size, left = len(P), self.weighted[part]
            forces[part] = left @ P.swapaxes(2, 3).reshape(size, points * 3, 3)
            A = A.swapaxes(2, 3).reshape(size, points, 27, 3)
            right = A @ self.mesh.gradients[part].swapaxes(2, 3)
            np.matmul(
                left,
                right.reshape(size, points * 3, 9 * nodes),
                out=blocks[part].reshape(size, nodes, 9 * nodes),
            )
        return self.tangent.gathered(forces), blocks

    def _touches(
        self, u: NDArray, depth_m: float, grips: list, *, turning: bool = True
    ) -> list[tuple]:
        """What `_touch` gives of each obstacle.

        The turning of the normals is part of the tangent, but a guess's overlap means a
        pressure far beyond the object's, and with it the matrix loses its definiteness.
        """
        pairs = zip(self.obstacles, grips, strict=True)
        return [self._touch(obstacle, grip, u, depth_m, turning) for obstacle, grip in pairs]

    def _touch(
        self, obstacle: Obstacle, grip: Grip | None, u: NDArray, depth_m: float, turning: bool
    ) -> tuple[NDArray, tuple, NDArray, float]:
        """Nodal forces [N], negated tangents with their elements, tractions, overlap [m]."""
        patch, positions = self._positions(obstacle, u)
        gap, normal, curvature = obstacle.gap(positions, depth_m)
        penalty = self.penalty * obstacle.penalty
        pressure = penalty * np.maximum(-gap, 0.0)
        outer = normal[..., :, None] * normal[..., None, :]
        across = np.eye(3) - outer
        # A flat bottom at rest just touches: nothing else supports it before it is indented.
        stiffness = ((gap <= 0) * penalty)[..., None, None] * outer
        if turning:
            stiffness = stiffness - (pressure * curvature)[..., None, None] * across
        traction = np.zeros_like(positions)
        if grip is not None and obstacle.friction:
            moved = positions - obstacle.place(depth_m) - grip.offset_m
            traction, tangent = self._friction(obstacle, grip, normal, pressure, moved)
            stiffness = stiffness + tangent
        load = (pressure[..., None] * normal + traction) * patch.weights_m2[..., None]
        stiffness = stiffness * patch.weights_m2[..., None, None]
        forces = np.einsum("fqa,fqi->fai", patch.shapes, load)
        blocks = np.einsum(
            "fqa,fqij,fqb->faijb", patch.shapes, stiffness, patch.shapes, optimize=True
        )
        gathered = self.tangent.gathered(forces, patch.elements)
        return gathered, (patch.elements, blocks), traction, float(max(-gap.min(), 0))

    def _friction(
        self, obstacle: Obstacle, grip: Grip, normal: NDArray, pressure: NDArray, moved: NDArray
    ) -> tuple[NDArray, NDArray]:
        """Tangential tractions [Pa] and their tangent (negated), at fixed normals."""
        penalty = self.penalty * obstacle.penalty
        sticking = STICKING_FACTOR * penalty
        across = np.eye(3) - normal[..., :, None] * normal[..., None, :]
        trial = np.einsum("...ij,...j->...i", across, grip.traction_pa - sticking * moved)
        size, limit = np.linalg.norm(trial, axis=-1), obstacle.friction * pressure
        share = np.minimum(1.0, limit / np.maximum(size, 1e-12))
        along = trial / np.maximum(size, 1e-12)[..., None]
        slips = (share < 1)[..., None, None]
        tangent = across - slips * along[..., :, None] * along[..., None, :]
        tangent = sticking * share[..., None, None] * tangent
        # What slips resists the more, the larger the pressure.
        pressed = slips & (pressure > 0)[..., None, None]
        by_pressure = pressed * along[..., :, None] * normal[..., None, :]
        return share[..., None] * trial, tangent + obstacle.friction * penalty * by_pressure

    def _grips(self, u: NDArray, depth_m: float, grips: list) -> list[Grip | None]:
        """What friction remembers of an equilibrium."""
        found: list[Grip | None] = []
        for obstacle, touch in zip(self.obstacles, self._touches(u, depth_m, grips), strict=True):
            offset = self._positions(obstacle, u)[1] - obstacle.place(depth_m)
            found.append(Grip(offset, touch[2]) if obstacle.friction else None)
        return found

    def _positions(self, obstacle: Obstacle, u: NDArray) -> tuple:
        patch = self.mesh.patches[obstacle.patch]
        nodes = self.mesh.elements[patch.elements]
        return patch, patch.shapes @ (self.mesh.nodes_m + u.reshape(-1, 3))[nodes]

    def _describe(self, u: NDArray, depth_m: float, grips: list) -> ContactStep:
        W, _, _ = self.law(self._gradient(u))
        internal, _ = self._elastic(u)
        touches = self._touches(u, depth_m, grips)
        contact = sum(touch[0] for touch in touches)
        support = np.where(self.fixed, internal - contact, 0.0).reshape(-1, 3).sum(axis=0)
        return ContactStep(
            depth_m,
            u.reshape(-1, 3),
            np.array([touch[0].reshape(-1, 3).sum(axis=0) for touch in touches]),
            float((W * self.grade * self.mesh.weights_m3).sum()),
            max(touch[3] for touch in touches),
            support,
        )

    def _gradient(self, u: NDArray, part: slice = slice(None)) -> NDArray:
        """Deformation gradients at the quadrature points, (m, q, 3, 3)."""
        local = u.reshape(-1, 3)[self.mesh.elements[part]]
        return local[:, None].swapaxes(2, 3) @ self.mesh.gradients[part] + np.eye(3)
