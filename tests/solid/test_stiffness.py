"""Elastic stiffness of both orders: scikit-fem, patch test, invariances."""

import numpy as np
import pytest
from palpate.solid.mesh import SolidMesh
from palpate.solid.solve import factorise
from palpate.solid.stiffness import combined, elastic_stiffness, shape_values
from scipy.spatial import cKDTree
from skfem import Basis, ElementTetP1, ElementTetP2, ElementVector, MeshTet
from skfem.models.elasticity import linear_elasticity
from solid_cases import LAM, MU, dofs, of_order, unit_box

ORDERS = pytest.mark.parametrize("order", [1, 2])


def stiffness(mesh, lam=LAM, mu=MU):
    return combined(*elastic_stiffness(mesh), lam, mu)


@ORDERS
def test_equals_scikit_fem(order):
    linear = unit_box(2)
    mesh = of_order(linear, order)
    element = ElementVector(ElementTetP1() if order == 1 else ElementTetP2())
    points, corners = map(np.ascontiguousarray, (linear.nodes_m.T, linear.tetrahedra.T))
    basis = Basis(MeshTet(points, corners), element, intorder=2 * (order - 1))
    reference = linear_elasticity(LAM, MU).assemble(basis)
    axis = np.empty(basis.N, dtype=int)
    for group in (basis.nodal_dofs, basis.edge_dofs):
        axis[group] = np.arange(len(group))[:, None]
    _, node = cKDTree(mesh.nodes_m).query(basis.doflocs.T)
    place = np.argsort(3 * node + axis)
    gap = stiffness(mesh) - reference[place][:, place]
    assert abs(gap).max() < 1e-12 * abs(reference).max()


@ORDERS
def test_patch(order):
    """A linear displacement on the boundary is reproduced inside."""
    mesh = of_order(unit_box(2), order)
    gradient = np.random.default_rng(0).normal(size=(3, 3))
    exact = (mesh.nodes_m @ gradient.T).ravel()
    K = stiffness(mesh)
    boundary = dofs(mesh.surface_nodes())
    inner = np.setdiff1d(np.arange(exact.size), boundary)
    u = exact.copy()
    u[inner] = factorise(K[inner][:, inner])(-K[inner][:, boundary] @ exact[boundary])
    assert np.abs(u - exact).max() < 1e-12 * np.abs(exact).max()


@ORDERS
def test_energy_of_uniform_strain(order):
    """u K u = V (lam (tr e)^2 + 2 mu e:e) for a linear displacement (Eq. 3.10, 3.21)."""
    mesh = of_order(unit_box(1), order)
    gradient = np.random.default_rng(1).normal(size=(3, 3))
    strain = (gradient + gradient.T) / 2
    u = (mesh.nodes_m @ gradient.T).ravel()
    expected = LAM * np.trace(strain) ** 2 + 2 * MU * (strain**2).sum()
    assert u @ stiffness(mesh) @ u == pytest.approx(expected, rel=1e-12)


@ORDERS
def test_rigid_motions_cost_nothing(order):
    mesh = of_order(unit_box(1), order)
    K = stiffness(mesh)
    spin = np.cross([0.3, -0.2, 0.9], mesh.nodes_m)
    for motion in (np.ones_like(spin), spin):
        assert np.abs(K @ motion.ravel()).max() < 1e-11 * abs(K).max()
    assert abs(K - K.T).max() < 1e-12 * abs(K).max()
    # Just the six rigid motions: a missing quadrature point would add others.
    values = np.linalg.eigvalsh(K.toarray())
    assert np.count_nonzero(values < 1e-9 * values[-1]) == 6


@ORDERS
def test_numbers_of_nodes_do_not_matter(order):
    mesh = of_order(unit_box(1), order)
    place = np.random.default_rng(2).permutation(len(mesh.nodes_m))
    nodes = np.empty_like(mesh.nodes_m)
    nodes[place] = mesh.nodes_m
    other = stiffness(SolidMesh(nodes, place[mesh.tetrahedra]))
    moved = dofs(place)
    assert abs(other[moved][:, moved] - stiffness(mesh)).max() < 1e-12 * abs(other).max()


@ORDERS
def test_both_parts_have_the_same_entries(order):
    K1, K2 = elastic_stiffness(of_order(unit_box(1), order))
    assert np.array_equal(K1.indices, K2.indices) and np.array_equal(K1.indptr, K2.indptr)
    K = combined(K1, K2, 3.0, 0.5)
    assert abs(K - (3.0 * K1 + 0.5 * K2)).max() < 1e-15
    assert np.array_equal(K.indices, K1.indices)


@ORDERS
def test_shape_functions_share_one_and_are_one_at_their_node(order):
    corners = np.eye(4)
    middles = [
        (corners[i] + corners[j]) / 2 for i, j in [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)]
    ]
    nodes = corners if order == 1 else np.concatenate([corners, middles])
    assert np.allclose(shape_values(nodes, order), np.eye(len(nodes)), atol=1e-15)


def test_matrices_of_other_patterns_are_refused():
    K1, K2 = elastic_stiffness(unit_box(1))
    message = "K2: expected the shape and the places of K1's entries, found others"
    with pytest.raises(ValueError, match=message):
        combined(K1, K2[:-3], LAM, MU)
    moved = K2.copy()
    moved.indices = moved.indices[::-1].copy()
    with pytest.raises(ValueError, match=message):
        combined(K1, moved, LAM, MU)
