"""Hyperelastic energy of the tracker's solid at finite strain: elements may turn by any angle."""

import numpy as np
from numpy.typing import NDArray

from palpate.solid.hyperelastic import LEAST_VOLUME
from palpate.solid.mesh import SolidMesh, at_nodes, element_volumes
from palpate.solid.stiffness import BlockPattern, shape_gradients

# Of a step that squeezes an element below the least share of its volume.
HALVINGS = 30


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
