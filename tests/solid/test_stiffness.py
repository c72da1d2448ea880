"""Elastic stiffness: patch test, scikit-fem, invariances, convergence."""

import numpy as np
import pytest
from palpate.solid.mesh import element_volumes, solid_mesh
from palpate.solid.solve import factorise
from palpate.solid.stiffness import elastic_stiffness
from skfem import Basis, ElementTetP1, ElementVector, MeshTet
from skfem.models.elasticity import linear_elasticity

LAM, MU = 80685.0, 8965.0


def box(refinements):
    mesh = MeshTet().refined(refinements)
    rng = np.random.default_rng(4)
    inner = ((mesh.p > 1e-9) & (mesh.p < 1 - 1e-9)).all(axis=0)
    points = mesh.p.copy()
    points[:, inner] += rng.uniform(-0.04, 0.04, (3, inner.sum())) / 2 ** (refinements - 1)
    return solid_mesh(points.T, mesh.t.T)


def stiffness(mesh, lam=LAM, mu=MU):
    K1, K2 = elastic_stiffness(mesh)
    return lam * K1 + mu * K2


def test_equals_scikit_fem():
    mesh = box(2)
    basis = Basis(
        MeshTet(mesh.nodes_m.T, mesh.tetrahedra.T), ElementVector(ElementTetP1()), intorder=0
    )
    reference = linear_elasticity(LAM, MU).assemble(basis)
    order = basis.nodal_dofs.T.ravel()
    gap = stiffness(mesh) - reference[order][:, order]
    assert abs(gap).max() < 1e-12 * abs(reference).max()


def test_patch():
    """A linear displacement on the boundary is reproduced inside."""
    mesh = box(2)
    gradient = np.random.default_rng(0).normal(size=(3, 3))
    exact = (mesh.nodes_m @ gradient.T).ravel()
    K = stiffness(mesh)
    boundary = (3 * mesh.surface_nodes()[:, None] + np.arange(3)).ravel()
    inner = np.setdiff1d(np.arange(exact.size), boundary)
    u = exact.copy()
    u[inner] = factorise(K[inner][:, inner])(-K[inner][:, boundary] @ exact[boundary])
    assert np.abs(u - exact).max() < 1e-12 * np.abs(exact).max()


def test_rigid_motions_cost_nothing():
    mesh = box(1)
    K = stiffness(mesh)
    spin = np.cross([0.3, -0.2, 0.9], mesh.nodes_m)
    for motion in (np.ones_like(spin), spin):
        assert np.abs(K @ motion.ravel()).max() < 1e-11 * abs(K).max()
    assert abs(K - K.T).max() < 1e-12 * abs(K).max()


def test_second_order_convergence():
    """A manufactured quadratic displacement, its body force integrated exactly enough."""
    errors = []
    for refinements in (2, 3, 4):
        mesh = box(refinements)
        x, y, _ = mesh.nodes_m.T
        exact = np.column_stack([x * x, x * y, 0 * x])
        # div sigma of that field: (3 lam + 5 mu, 0, 0)
        body = np.array([8.0, 0, 0])
        share = element_volumes(mesh.nodes_m, mesh.tetrahedra) / 4
        weight = np.bincount(mesh.tetrahedra.ravel(), np.repeat(share, 4), len(x))
        f = (-weight[:, None] * body).ravel()
        boundary = (3 * mesh.surface_nodes()[:, None] + np.arange(3)).ravel()
        inner = np.setdiff1d(np.arange(f.size), boundary)
        K, u = stiffness(mesh, 1.0, 1.0), exact.ravel().copy()
        u[inner] = factorise(K[inner][:, inner])(f[inner] - K[inner][:, boundary] @ u[boundary])
        gap = (u - exact.ravel()).reshape(-1, 3)
        errors.append(np.sqrt((weight[:, None] * gap**2).sum()))
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert orders[-1] == pytest.approx(2, abs=0.5)
