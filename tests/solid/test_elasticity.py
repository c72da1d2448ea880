"""Linear elasticity against scikit-fem, and the direct solvers of its equations."""

import numpy as np
import palpate.solid.solve as solve
import pytest
from palpate.solid.mesh import solid_mesh
from palpate.solid.solve import PardisoFactors, SuperLUFactors, factorise
from palpate.solid.stiffness import combined, elastic_stiffness
from scipy import sparse
from scipy.spatial import cKDTree
from skfem import Basis, ElementTetP1, ElementTetP2, ElementVector, MeshTet
from skfem.models.elasticity import linear_elasticity
from solid_cases import of_order

LAM, MU = 80685.0, 8965.0
MKL = pytest.mark.skipif(solve.PyPardisoSolver is None, reason="MKL is not installed")


def unit_box(refinements):
    """Unit cube with inner nodes shaken."""
    mesh = MeshTet().refined(refinements)
    rng = np.random.default_rng(4)
    inner = ((mesh.p > 1e-9) & (mesh.p < 1 - 1e-9)).all(axis=0)
    points = mesh.p.copy()
    points[:, inner] += rng.uniform(-0.04, 0.04, (3, inner.sum())) / 2 ** (refinements - 1)
    return solid_mesh(points.T, mesh.t.T)


@pytest.mark.parametrize("order", [1, 2])
def test_equals_scikit_fem(order):
    """To the last digits, so that its patch test, rigid motions and orders are ours."""
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
    gap = combined(*elastic_stiffness(mesh), LAM, MU) - reference[place][:, place]
    assert abs(gap).max() < 1e-12 * abs(reference).max()


@pytest.fixture(scope="module", params=[1, 2])
def parts(request, cube):
    mesh = of_order(cube, request.param)
    free = np.repeat(mesh.nodes_m[:, 2] > 1e-9, 3)
    return [K[free][:, free] for K in elastic_stiffness(mesh)]


@pytest.fixture(scope="module")
def right(parts):
    return np.random.default_rng(5).normal(size=(parts[0].shape[0], 3))


@MKL
def test_solvers_agree_and_solve(parts, right):
    K = combined(*parts, LAM, MU)
    ours, other = PardisoFactors(K)(right), SuperLUFactors(K)(right)
    assert np.abs(ours - other).max() < 1e-10 * np.abs(other).max()
    assert np.abs(K @ ours - right).max() < 1e-10
    assert factorise(K)(right[:, 0]).shape == (K.shape[0],)


@MKL
@pytest.mark.parametrize("solver", [PardisoFactors, SuperLUFactors])
def test_same_bytes_and_another_matrix_of_the_same_entries(parts, right, solver):
    first, second = (combined(*parts, lam, MU) for lam in (LAM, 0.2 * LAM))
    factors = solver(first)
    before = factors(right)
    again = factors.refactorise(second)(right)
    assert again.tobytes() == solver(second)(right).tobytes()
    assert factors.refactorise(first)(right).tobytes() == before.tobytes()
    assert np.abs(again - before).max() > 1e-3 * np.abs(before).max()


def test_bad_input_and_the_way_without_mkl(parts, right, monkeypatch):
    K = combined(*parts, LAM, MU)
    with pytest.raises(ValueError, match="K: expected a square matrix, found shape"):
        factorise(K[:-1])
    with pytest.raises(ValueError, match="K: expected a regular matrix, found"):
        SuperLUFactors(sparse.csr_matrix([[1.0, 1.0], [1.0, 1.0]]))
    with pytest.raises(ValueError, match="K: expected a positive definite matrix, found a pivot"):
        SuperLUFactors(sparse.csr_matrix([[1.0, 2.0], [2.0, 1.0]]))
    monkeypatch.setattr(solve, "PyPardisoSolver", None)
    assert isinstance(factorise(K), SuperLUFactors)
