"""Energy, forces and tangent of solids at finite strain: elements may turn by any angle."""

import numpy as np
from numpy.typing import NDArray

from palpate.solid.laws import Law
from palpate.solid.mesh import SolidMesh, at_nodes, element_volumes
from palpate.solid.stiffness import QUADRATURE, BlockPattern, point_volumes, shape_gradients

# Elements whose tangents are made at once: what a processor's cache holds.
PART = 256
# No quadrature point may be squeezed below this share of its volume by a step.
LEAST_VOLUME = 0.02
# A step may not squeeze an element below this share of its volume.
LEAST_VOLUME = 0.02
HALVINGS = 30


class HyperelasticSolid:
    """A solid of Young's modulus 1 whose law and Poisson's ratio may change.

    Parameters
    ----------
    mesh : SolidMesh
        n nodes, m elements of either order.
    law : Law
    nu : float
        Poisson's ratio.
    """

    def __init__(self, mesh: SolidMesh, law: Law, nu: float) -> None:
        self.mesh, self.law, self.nu = mesh, law, nu
        points = QUADRATURE[mesh.order]
        self._gradients = shape_gradients(mesh, points)
        self._weights = point_volumes(mesh, points)
        m, q, k, _ = self._gradients.shape
        weighted = self._weights[..., None, None] * self._gradients
        self._weighted = weighted.transpose(0, 2, 1, 3).reshape(m, k, 3 * q)
        self.pattern = BlockPattern(mesh.tetrahedra, len(mesh.nodes_m))

    def least_volume(self, x: NDArray) -> float:
        """Least ratio of volumes, after to before, at node positions x (n, 3) [m]."""
        return float(np.linalg.det(self._deformation(x)).min())

    def energy(self, x: NDArray) -> float:
        """Energy over Young's modulus [m^3]; infinite where an element is nearly flat."""
        F = self._deformation(x)
        if np.linalg.det(F).min() <= LEAST_VOLUME:
            return np.inf
        return float((self._weights * self.law.energy(F, self.nu)).sum())

    def forces(self, x: NDArray) -> NDArray:
        """Gradient of the energy, shape (n, 3) [m^2]."""
        P = self.law.stress(self._deformation(x), self.nu).swapaxes(2, 3)
        pull = np.matmul(self._weighted, P.reshape(len(P), -1, 3))
        return at_nodes(self.mesh.tetrahedra, pull, len(x))

    def blocks(self, x: NDArray, *, positive: bool = False) -> NDArray:
        """Second derivative of the energy as blocks of the pattern, (k, 3, 3) [m].

        Parameters
        ----------
        x : (n, 3) array
            Node positions [m].
        positive : bool, optional
            Leave out what makes the second derivative negative at a quadrature point.
        """
        F = self._deformation(x)
        m, q, k, _ = self._gradients.shape
        whole = np.empty((m, k, 9 * k))
        for start in range(0, m, PART):
            part = slice(start, start + PART)
            A = self.law.tangent(F[part], self.nu)
            if positive:
                A = _positive_part(A)
            # From (q, a, J, b, L) to (q, J, L, a, b); with j for L: rows (q, J), columns (j, a, b).
            A = A.transpose(0, 1, 3, 5, 2, 4).reshape(-1, q, 3, 3, 9)
            right = np.matmul(self._gradients[part, :, None], A).reshape(-1, 3 * q, 9 * k)
            np.matmul(self._weighted[part], right, out=whole[part])
        return self.pattern.sums(whole)

    def _deformation(self, x: NDArray) -> NDArray:
        """Deformation gradient (Eq. 3.4) at the quadrature points, shape (m, q, 3, 3)."""
        corners = x[self.mesh.tetrahedra].swapaxes(1, 2)
        return np.matmul(corners[:, None], self._gradients)


def _positive_part(A: NDArray) -> NDArray:
    flat = A.reshape(*A.shape[:-4], 9, 9)
    values, vectors = np.linalg.eigh(flat)
    kept = vectors * np.maximum(values, 0)[..., None, :]
    return np.matmul(kept, vectors.swapaxes(-1, -2)).reshape(A.shape)


class LogNeoHookean:
    """Compressible neo-Hookean solid of four-node elements.

    The energy density is mu/2 (tr F'F - 3 - 2 ln J) + lam/2 (ln J)^2 [1]_; for small strain it is
    the linear solid's.

    Parameters
    ----------
    mesh : SolidMesh
        n nodes, m elements of four nodes.
    lam, mu : float
        Lame parameters at small strain [Pa].

    Raises
    ------
    ValueError
        If the mesh has ten-node elements.

    References
    ----------
    .. [1] J. Bonet and R. D. Wood, Nonlinear continuum mechanics for finite element analysis,
       2nd ed., Section 6.4.3 (2008).
    """

    def __init__(self, mesh: SolidMesh, lam: float, mu: float) -> None:
        if mesh.order != 1:
            raise ValueError("mesh: expected four-node elements, found ten-node ones")
        self.mesh, self.lam, self.mu = mesh, lam, mu
        self.gradients = shape_gradients(mesh, np.full((1, 4), 0.25))[:, 0]
        self.volume = element_volumes(mesh.nodes_m, mesh.tetrahedra)
        self.pattern = BlockPattern(mesh.tetrahedra, len(mesh.nodes_m))
        inner = np.einsum("eia,eja->eij", self.gradients, self.gradients)
        self._inner = (mu * self.volume)[:, None, None, None, None] * (
            inner[..., None, None] * np.eye(3)
        )

    def energy(self, x: NDArray) -> float:
        """Energy at node positions x (n, 3) [m], in J; infinite if an element is turned inside."""
        F = self._deformation(x)
        J = np.linalg.det(F)
        if J.min() <= 0:
            return np.inf
        density = 0.5 * self.mu * ((F**2).sum(axis=(1, 2)) - 3 - 2 * np.log(J))
        return float(self.volume @ (density + 0.5 * self.lam * np.log(J) ** 2))

    def forces_and_blocks(self, x: NDArray, *, positive: bool = False) -> tuple[NDArray, NDArray]:
        """Gradient and second derivative of the energy at node positions x (n, 3) [m].

        Parameters
        ----------
        x : (n, 3) array
        positive : bool, optional
            Leave out the part that makes the second derivative negative under strong compression.

        Returns
        -------
        forces : (n, 3) array
            [N].
        blocks : (k, 3, 3) array
            Blocks of the stiffness, of the pattern [N/m].
        """
        F, corners = self._deformation(x), self.mesh.tetrahedra
        log_J = np.log(np.linalg.det(F))
        h = np.einsum("eba,eib->eia", np.linalg.inv(F), self.gradients)
        pull = self.mu * (np.einsum("eab,eib->eia", F, self.gradients) - h)
        pull = self.volume[:, None, None] * (pull + (self.lam * log_J)[:, None, None] * h)
        forces = at_nodes(corners, pull, len(x))
        H = np.einsum("eia,ejb->eijab", h, h)
        blocks = self._inner + (self.lam * self.volume)[:, None, None, None, None] * H
        if not positive:
            turning = (self.mu - self.lam * log_J) * self.volume
            blocks += turning[:, None, None, None, None] * np.swapaxes(H, 3, 4)
        return forces, self.pattern.sums(blocks)

    def allowed_part(self, x: NDArray, step: NDArray) -> float:
        """Largest of 1, 1/2, 1/4 ... of a step (n, 3) [m] that squeezes no element too far."""
        part = 1.0
        for _ in range(HALVINGS):
            if np.linalg.det(self._deformation(x + part * step)).min() > LEAST_VOLUME:
                return part
            part /= 2
        return part

    def _deformation(self, x: NDArray) -> NDArray:
        """Deformation gradient F of each element (Eq. 3.4), shape (m, 3, 3)."""
        return np.einsum("eia,eib->eab", x[self.mesh.tetrahedra], self.gradients)
