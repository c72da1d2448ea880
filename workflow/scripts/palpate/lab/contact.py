"""A rigid sphere pressed into a soft block: finite strain, frictionless penalty contact.

Total Lagrangian, quadratic hexahedra. The sphere goes down in steps; each is solved by Newton's
method and halved when that fails. The estimators share none of this code.
"""

import logging
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from pypardiso import PyPardisoSolver
from scipy import sparse

from palpate.lab.block_mesh import BlockMesh
from palpate.lab.material import Law

SYMMETRIC_INDEFINITE = -2
# Penalty stiffness over E / R; penetration stays below a hundredth of a millimetre.
PENALTY_FACTOR = 1500.0
NEWTON_STEPS = 25
RESIDUAL_TOLERANCE = 1e-7
SMALLEST_STEP_M = 2e-5


@dataclass(frozen=True)
class ContactStep:
    """Equilibrium at one depth.

    Attributes
    ----------
    depth_m : float
        How far the sphere's lowest point lies below the undeformed surface [m].
    displacement_m : (n, 3) array
        Nodal displacements [m].
    force_n : (3,) array
        Force of the sphere on the block [N].
    energy_j : float
        Stored elastic energy [J].
    penetration_m : float
        Largest overlap of sphere and surface [m].
    support_n : (3,) array
        Reaction of the support on the block [N].
    """

    depth_m: float
    displacement_m: NDArray
    force_n: NDArray
    energy_j: float
    penetration_m: float
    support_n: NDArray


class SphereContact:
    """Boundary value problem of a block under a rigid sphere.

    Parameters
    ----------
    mesh : BlockMesh
    law : callable
        Hyperelastic law (`palpate.lab.material`).
    point_m : (3,) array
        Point of the undeformed surface that the sphere touches first [m].
    radius_m : float
        Radius of the sphere [m].
    stiffness_pa : float
        Young's modulus, for the penalty's scale [Pa].
    fixed : (n, 3) bool array
        Displacements that are held at zero.
    """

    def __init__(
        self,
        mesh: BlockMesh,
        law: Law,
        *,
        point_m: NDArray,
        radius_m: float,
        stiffness_pa: float,
        fixed: NDArray,
    ) -> None:
        self.mesh, self.law = mesh, law
        self.point_m, self.radius_m = np.asarray(point_m, dtype=float), radius_m
        self.penalty = PENALTY_FACTOR * stiffness_pa / radius_m
        self.fixed = fixed.ravel()
        self.free = np.flatnonzero(~self.fixed)
        self.solver = PyPardisoSolver(mtype=SYMMETRIC_INDEFINITE)
        self.element_dofs = _dofs(mesh.elements)
        self.facet_dofs = _dofs(mesh.top.nodes)

    def press(self, depths_m: NDArray) -> list[ContactStep]:
        """Press the sphere to each of the increasing depths [m]."""
        u = np.zeros(self.fixed.size)
        before, depth = u, 0.0
        steps, step_before = [], None
        for wanted in depths_m:
            while depth < wanted - 1e-12:
                step = wanted - depth
                while True:
                    guess = u + (u - before) * (step / step_before) if step_before else u
                    solved = self._solve(guess, depth + step)
                    if solved is None:
                        solved = self._solve(u, depth + step)
                    if solved is not None:
                        break
                    step /= 2
                    if step < SMALLEST_STEP_M:
                        raise ValueError(f"contact: no equilibrium beyond depth {depth:.5f} m")
                before, u = u, solved
                step_before, depth = step, depth + step
            steps.append(self._describe(u, depth))
            logging.info("depth %.2f mm: %.4f N", depth * 1e3, -steps[-1].force_n[2])
        return steps

    def _solve(self, u: NDArray, depth_m: float) -> NDArray | None:
        """Newton's method from a guess; None when it fails."""
        u = u.copy()
        for _ in range(NEWTON_STEPS):
            try:
                internal, stiffness = self._elastic(u)
            except FloatingPointError:
                return None
            contact, contact_stiffness, _ = self._contact(u, depth_m)
            residual = (internal - contact)[self.free]
            scale = max(np.abs(contact).sum(), 1e-6)
            if np.abs(residual).sum() < RESIDUAL_TOLERANCE * scale:
                return u
            K = (stiffness + contact_stiffness)[self.free][:, self.free]
            step = self.solver.solve(sparse.triu(K, format="csr"), residual)
            u[self.free] -= step * min(1.0, self.radius_m / 3 / max(np.abs(step).max(), 1e-12))
        return None

    def _elastic(self, u: NDArray) -> tuple[NDArray, sparse.csr_matrix]:
        """Internal nodal forces [N] and tangent stiffness [N/m]."""
        mesh = self.mesh
        _, P, A = self.law(self._gradient(u))
        P, A = (
            P * mesh.weights_m3[..., None, None],
            A * mesh.weights_m3[..., None, None, None, None],
        )
        forces = np.einsum("eqaJ,eqiJ->eai", mesh.gradients, P, optimize=True)
        right = np.einsum("eqiJkL,eqbL->eqJibk", A, mesh.gradients, optimize=True)
        count, points = mesh.weights_m3.shape
        left = mesh.gradients.transpose(0, 2, 1, 3).reshape(count, 27, points * 3)
        blocks = left @ right.reshape(count, points * 3, 3 * 27 * 3)
        return self._gathered(forces, blocks.reshape(count, 81, 81), self.element_dofs)

    def _contact(self, u: NDArray, depth_m: float) -> tuple[NDArray, sparse.csr_matrix, float]:
        """Nodal forces of the sphere [N], their tangent (negated) [N/m], largest overlap [m]."""
        top = self.mesh.top
        positions = (self.mesh.nodes_m + u.reshape(-1, 3))[top.nodes]
        offset = top.shapes @ positions - self._centre(depth_m)
        distance = np.linalg.norm(offset, axis=-1)
        normal = offset / distance[..., None]
        overlap = np.maximum(self.radius_m - distance, 0.0)
        pressure = self.penalty * overlap * top.weights_m2
        forces = np.einsum("fqa,fqi->fai", top.shapes, pressure[..., None] * normal)
        outer = normal[..., :, None] * normal[..., None, :]
        touching = (overlap > 0) * self.penalty * top.weights_m2
        tangent = touching[..., None, None] * outer
        tangent -= (pressure / distance)[..., None, None] * (np.eye(3) - outer)
        blocks = np.einsum("fqa,fqij,fqb->faibj", top.shapes, tangent, top.shapes, optimize=True)
        size = 3 * top.nodes.shape[1]
        gathered = self._gathered(forces, blocks.reshape(-1, size, size), self.facet_dofs)
        return *gathered, float(overlap.max())

    def _describe(self, u: NDArray, depth_m: float) -> ContactStep:
        W, _, _ = self.law(self._gradient(u))
        internal, _ = self._elastic(u)
        contact, _, overlap = self._contact(u, depth_m)
        support = np.where(self.fixed, internal - contact, 0.0).reshape(-1, 3).sum(axis=0)
        return ContactStep(
            depth_m,
            u.reshape(-1, 3),
            contact.reshape(-1, 3).sum(axis=0),
            float((W * self.mesh.weights_m3).sum()),
            overlap,
            support,
        )

    def _gradient(self, u: NDArray) -> NDArray:
        """Deformation gradients at the quadrature points, (m, q, 3, 3)."""
        local = u.reshape(-1, 3)[self.mesh.elements]
        return np.einsum("eai,eqaJ->eqiJ", local, self.mesh.gradients, optimize=True) + np.eye(3)

    def _centre(self, depth_m: float) -> NDArray:
        return self.point_m + [0.0, 0.0, self.radius_m - depth_m]

    def _gathered(
        self, forces: NDArray, blocks: NDArray, dofs: NDArray
    ) -> tuple[NDArray, sparse.csr_matrix]:
        size = self.fixed.size
        total = np.bincount(dofs.ravel(), forces.reshape(len(dofs), -1).ravel(), minlength=size)
        rows = np.repeat(dofs, dofs.shape[1], axis=1).ravel()
        columns = np.tile(dofs, (1, dofs.shape[1])).ravel()
        return total, sparse.csr_matrix((blocks.ravel(), (rows, columns)), shape=(size, size))


def _dofs(nodes: NDArray) -> NDArray:
    return (3 * nodes[:, :, None] + np.arange(3)).reshape(len(nodes), -1)
