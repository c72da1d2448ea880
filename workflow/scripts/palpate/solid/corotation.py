"""Strain measured after a given rotation of each part of the solid (co-rotational strain).

With rotations R that are kept fixed the strain is ``e = sym(R' grad x) - 1``: linear in the
displacement as Eq. 3.4, but zero for a solid that turns as R does, which Eq. 3.4 is not.
"""

import numpy as np
from numpy.typing import NDArray

from palpate.solid.mesh import SolidMesh, at_nodes
from palpate.solid.stiffness import QUADRATURE, point_volumes, shape_gradients


def element_rotations(mesh: SolidMesh, displacement_m: NDArray) -> NDArray:
    """Rotations of the polar decomposition F = R U at the points of each element.

    Parameters
    ----------
    mesh : SolidMesh
        n nodes, m elements of either order, with p points each.
    displacement_m : (n, 3) array
        Displacement of all nodes [m].

    Returns
    -------
    (m, p, 3, 3) array
        Proper rotations, also where an element is turned inside out.

    Raises
    ------
    ValueError
        If the displacement isn't one of finite numbers for every node.
    """
    u = np.asarray(displacement_m, dtype=float)
    if u.shape != mesh.nodes_m.shape or not np.isfinite(u).all():
        raise ValueError(
            f"displacement_m: expected finite numbers of shape {mesh.nodes_m.shape},"
            f" found shape {u.shape} with {np.count_nonzero(~np.isfinite(u))} that are not"
        )
    gradients = shape_gradients(mesh, QUADRATURE[mesh.order])
    F = np.eye(3) + np.einsum("eia,epib->epab", u[mesh.tetrahedra], gradients)
    left, _, right = np.linalg.svd(F)
    left[..., 2] *= np.sign(np.linalg.det(left @ right))[..., None]
    return left @ right


def rotation_loads(mesh: SolidMesh, rotations: NDArray) -> tuple[NDArray, NDArray]:
    """Loads of the rotations, for K_R u = f + lam b1 + mu b2.

    They are the forces that hold the undeformed solid as if it had not turned:
    ``S = sym(R) - 1`` is its strain, and ``b1 = -int tr(S) R grad N``, ``b2 = -2 int R S grad N``.

    Parameters
    ----------
    mesh : SolidMesh
        n nodes, m elements.
    rotations : (m, p, 3, 3) array
        As `element_rotations` gives them.

    Returns
    -------
    b1, b2 : (3n,) arrays
        Degree of freedom 3 * node + axis; [m^2], to be multiplied by Pa.
    """
    points, size = QUADRATURE[mesh.order], len(mesh.nodes_m)
    gradients = shape_gradients(mesh, points)
    weight = point_volumes(mesh, points)[:, :, None, None]
    S = (rotations + rotations.mT) / 2 - np.eye(3)
    volumetric = np.trace(S, axis1=-2, axis2=-1)[..., None, None] * rotations
    return tuple(
        -at_nodes(mesh.tetrahedra, (weight * gradients @ stress.mT).sum(axis=1), size).ravel()
        for stress in (volumetric, 2 * rotations @ S)
    )
