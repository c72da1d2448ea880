"""Elastic stiffness of linear tetrahedra, split by the Lame parameters (Eq. 3.21-3.24)."""

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from palpate.solid.mesh import SolidMesh, element_volumes

# Eq. 3.21: C = lam C1 + mu C2, strains in the order xx, yy, zz, yz, zx, xy (Eq. 3.11).
C1 = np.zeros((6, 6))
C1[:3, :3] = 1
C2 = np.diag([2.0, 2.0, 2.0, 1.0, 1.0, 1.0])


def elastic_stiffness(mesh: SolidMesh) -> tuple[sparse.csr_matrix, sparse.csr_matrix]:
    """Assemble K1 and K2 of K = lam K1 + mu K2 (Eq. 3.24).

    Parameters
    ----------
    mesh : SolidMesh
        n nodes.

    Returns
    -------
    K1, K2 : (3n, 3n) sparse matrices
        Degree of freedom 3 * node + axis; [m], to be multiplied by Pa.
    """
    V = element_volumes(mesh.nodes_m, mesh.tetrahedra)
    B = strain_matrices(mesh)
    blocks = [np.einsum("e,eki,kl,elj->eij", V, B, C, B, optimize=True) for C in (C1, C2)]
    dofs = element_dofs(mesh)
    rows, columns = np.repeat(dofs, 12, axis=1).ravel(), np.tile(dofs, (1, 12)).ravel()
    size = 3 * len(mesh.nodes_m)
    K1, K2 = (
        sparse.csr_matrix((block.ravel(), (rows, columns)), shape=(size, size)) for block in blocks
    )
    return K1, K2


def shape_gradients(mesh: SolidMesh) -> NDArray:
    """Gradients of the four shape functions in each element, shape (m, 4, 3) [1/m]."""
    corners = mesh.nodes_m[mesh.tetrahedra]
    edges = corners[:, 1:] - corners[:, :1]
    inner = np.linalg.inv(edges).transpose(0, 2, 1)
    return np.concatenate([-inner.sum(axis=1, keepdims=True), inner], axis=1)


def strain_matrices(mesh: SolidMesh) -> NDArray:
    """Strain-displacement matrices B of Eq. 3.15, shape (m, 6, 12) [1/m]."""
    gradients = shape_gradients(mesh)
    x, y, z = (gradients[:, :, k] for k in range(3))
    B = np.zeros((len(gradients), 6, 4, 3))
    B[:, 0, :, 0], B[:, 1, :, 1], B[:, 2, :, 2] = x, y, z
    B[:, 3, :, 1], B[:, 3, :, 2] = z, y
    B[:, 4, :, 2], B[:, 4, :, 0] = x, z
    B[:, 5, :, 0], B[:, 5, :, 1] = y, x
    return B.reshape(-1, 6, 12)


def element_dofs(mesh: SolidMesh) -> NDArray:
    """Degrees of freedom of each element, shape (m, 12)."""
    return (3 * mesh.tetrahedra[:, :, None] + np.arange(3)).reshape(-1, 12)
