"""The simulated foam block of Section 3.3.2: linear tetrahedra, one loaded triangle."""

from pathlib import Path

import meshio
import numpy as np
from numpy.typing import NDArray
from skfem import Basis, ElementTetP1, ElementVector, MeshTet, condense, solve
from skfem.models.elasticity import linear_elasticity

ON_PLANE_M = 1e-9


def load_block(
    mesh_file: str | Path, *, lambda_pa: float, mu_pa: float, traction_pa: float, steps: int
) -> dict[str, NDArray]:
    """Solve a block on its support under a traction on a triangle of its top, in equal steps.

    The triangle is the one nearest to the middle of the top face; its load is shared evenly by
    its three nodes, as linear elements have it.

    Parameters
    ----------
    mesh_file : path
        Linear tetrahedra of a block that stands on z = 0.
    lambda_pa, mu_pa : float
        Lame parameters.
    traction_pa : float
        Traction along the top's outward normal at the last step.
    steps : int

    Returns
    -------
    dict
        ``nodes_m`` (n, 3), ``tetrahedra`` (m, 4), ``triangle`` (3,), ``force_n`` (k, n, 3) nodal
        loads, ``displacement_m`` (k, n, 3).
    """
    data = meshio.read(mesh_file)
    nodes, tetrahedra = np.asarray(data.points, dtype=float), data.cells_dict["tetra"]
    mesh = MeshTet(np.ascontiguousarray(nodes.T), np.ascontiguousarray(tetrahedra.T))
    basis = Basis(mesh, ElementVector(ElementTetP1()), intorder=0)
    K = linear_elasticity(lambda_pa, mu_pa).assemble(basis)
    triangle = _top_triangle(mesh)
    a, b, c = nodes[triangle]
    area = np.linalg.norm(np.cross(b - a, c - a)) / 2
    f = np.zeros_like(nodes)
    f[triangle, 2] = traction_pa * area / 3
    held = basis.get_dofs(mesh.facets_satisfying(lambda x: np.abs(x[2]) < ON_PLANE_M)).all()
    u = solve(*condense(K, f.ravel(), D=held)).reshape(-1, 3)
    share = (np.arange(steps) + 1)[:, None, None] / steps
    return {
        "nodes_m": nodes,
        "tetrahedra": tetrahedra,
        "triangle": triangle,
        "force_n": share * f,
        "displacement_m": share * u,
    }


def _top_triangle(mesh: MeshTet) -> NDArray:
    top = mesh.p[2].max()
    facets = mesh.facets_satisfying(lambda x: np.abs(x[2] - top) < ON_PLANE_M)
    middle = mesh.p[:2][:, mesh.facets[:, facets]].mean(axis=1)
    return mesh.facets[:, facets[np.argmin(np.linalg.norm(middle, axis=0))]]
