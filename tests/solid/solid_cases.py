"""Meshes and numbers that the tests of the solid share."""

import numpy as np
from palpate.solid.mesh import quadratic, solid_mesh
from skfem import MeshTet

LAM, MU = 80685.0, 8965.0


def unit_box(refinements):
    """Unit cube with inner nodes shaken."""
    mesh = MeshTet().refined(refinements)
    rng = np.random.default_rng(4)
    inner = ((mesh.p > 1e-9) & (mesh.p < 1 - 1e-9)).all(axis=0)
    points = mesh.p.copy()
    points[:, inner] += rng.uniform(-0.04, 0.04, (3, inner.sum())) / 2 ** (refinements - 1)
    return solid_mesh(points.T, mesh.t.T)


def of_order(mesh, order):
    return mesh if order == 1 else quadratic(mesh)


def dofs(nodes):
    return (3 * np.asarray(nodes)[:, None] + np.arange(3)).ravel()
