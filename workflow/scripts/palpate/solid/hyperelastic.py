"""Energy, forces and tangent of a solid of a hyperelastic law at finite strain."""

import numpy as np
from numpy.typing import NDArray

from palpate.solid.laws import Law
from palpate.solid.mesh import SolidMesh, at_nodes
from palpate.solid.stiffness import QUADRATURE, BlockPattern, point_volumes, shape_gradients

# Elements whose tangents are made at once: what a processor's cache holds.
PART = 256
# No quadrature point may be squeezed below this share of its volume by a step.
LEAST_VOLUME = 0.02


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
