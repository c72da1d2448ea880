"""Linear elasticity: scikit-fem, patch test, orders of convergence, NAFEMS' thick plate."""

import numpy as np
import pytest
from palpate.solid.mesh import element_volumes, quadratic, solid_mesh
from palpate.solid.solve import factorise
from palpate.solid.stiffness import combined, elastic_stiffness, shape_gradients, shape_values
from scipy.spatial import cKDTree
from skfem import Basis, ElementTetP1, ElementTetP2, ElementVector, MeshTet
from skfem.models.elasticity import linear_elasticity
from skfem.quadrature import get_quadrature_tet
from solid_cases import dofs, of_order, unit_box

LAM, MU = 1.5, 1.0
# u = A sin(k x + 0.3): -div sigma = ((lam + mu) (A k) k + mu k^2 A) sin.
AMPLITUDE, WAVE, PHASE = np.array([0.7, -0.4, 0.5]), np.array([2.1, 1.3, -1.7]), 0.3
BODY = (LAM + MU) * (AMPLITUDE @ WAVE) * WAVE + MU * (WAVE @ WAVE) * AMPLITUDE


ORDERS = pytest.mark.parametrize("order", [1, 2])


def stiffness(mesh, lam=LAM, mu=MU):
    return combined(*elastic_stiffness(mesh), lam, mu)


def quadrature(degree):
    points, weights = get_quadrature_tet(degree)
    return np.column_stack([1 - points.sum(axis=0), points.T]), 6 * weights


def at_points(mesh, degree):
    """Places (m, p, 3), their volumes (m, p) and barycentric coordinates."""
    points, weights = quadrature(degree)
    volumes = element_volumes(mesh.nodes_m, mesh.corners)[:, None] * weights
    return points @ mesh.nodes_m[mesh.corners], volumes, points


def held(mesh, exact, f):
    """Displacement that is exact on the boundary, of a force inside."""
    K, boundary = stiffness(mesh), dofs(mesh.surface_nodes())
    inner = np.setdiff1d(np.arange(exact.size), boundary)
    u = exact.copy()
    u[inner] = factorise(K[inner][:, inner])(f[inner] - K[inner][:, boundary] @ u[boundary])
    return u


def solved(mesh):
    """Displacement with exact values on the boundary and the integrated body force."""
    exact = (np.sin(mesh.nodes_m @ WAVE + PHASE)[:, None] * AMPLITUDE).ravel()
    place, volumes, points = at_points(mesh, 5)
    shares = (volumes * np.sin(place @ WAVE + PHASE)) @ shape_values(points, mesh.order)
    weight = np.bincount(mesh.tetrahedra.ravel(), shares.ravel(), len(mesh.nodes_m))
    f = (weight[:, None] * BODY).ravel()
    return held(mesh, exact, f).reshape(-1, 3)


def errors(mesh):
    """Norms of the error and of its gradient."""
    u = solved(mesh)[mesh.tetrahedra]
    place, volumes, points = at_points(mesh, 6)
    phase = place @ WAVE + PHASE
    value = shape_values(points, mesh.order) @ u
    gradient = np.einsum("epka,ekb->epba", shape_gradients(mesh, points), u)
    gap = value - np.sin(phase)[..., None] * AMPLITUDE
    slope = gradient - np.cos(phase)[..., None, None] * np.outer(AMPLITUDE, WAVE)
    return (
        np.sqrt((volumes * (gap**2).sum(axis=-1)).sum()),
        np.sqrt((volumes * (slope**2).sum(axis=(-2, -1))).sum()),
    )


@pytest.mark.parametrize(("order", "refinements"), [(1, (2, 3, 4)), (2, (1, 2, 3))])
def test_orders_of_convergence(order, refinements):
    found = np.array([errors(of_order(unit_box(k), order)) for k in refinements])
    slopes = -np.polyfit(refinements, np.log2(found), 1)[0]
    assert slopes == pytest.approx([order + 1, order], abs=0.25)


def elliptic_plate(radial, around, layers):
    """Quarter of NAFEMS' plate: inner ellipse 2 x 1, outer 3.25 x 2.75, 0.6 thick [m]."""
    s = np.linspace(0, 1, radial + 1) ** 1.4
    turn = np.linspace(0, 1, around + 1) ** 1.4 * np.pi / 2
    mesh = MeshTet.init_tensor(s, turn, np.linspace(0, 0.6, layers + 1))
    s, turn, z = mesh.p
    x = (2 + 1.25 * s) * np.cos(turn)
    y = (1 + 1.75 * s) * np.sin(turn)
    return quadratic(solid_mesh(np.column_stack([x, y, z]), mesh.t.T))


def test_nafems_thick_plate():
    """LE10: sigma_yy at D of the upper surface is -5.38 MPa under 1 MPa (NAFEMS 1990)."""
    mesh = elliptic_plate(8, 16, 4)
    E, nu = 210e9, 0.3
    lam, mu = E * nu / ((1 + nu) * (1 - 2 * nu)), E / (2 * (1 + nu))
    x, y, z = mesh.nodes_m.T
    faces = mesh.surface_faces()
    middles = mesh.nodes_m[faces[:, :3]].mean(axis=1)
    slant = np.hypot(middles[:, 0] / 3.25, middles[:, 1] / 2.75)
    outer = np.unique(faces[(slant > 0.98) & (middles[:, 2] > 1e-9) & (middles[:, 2] < 0.6 - 1e-9)])
    held = np.zeros((len(x), 3), dtype=bool)
    held[np.abs(y) < 1e-9, 1] = True
    held[np.abs(x) < 1e-9, 0] = True
    held[outer, :2] = True
    held[outer[np.abs(z[outer] - 0.3) < 1e-9], 2] = True
    top = faces[middles[:, 2] > 0.6 - 1e-9]
    a, b, c = mesh.nodes_m[top[:, :3]].transpose(1, 0, 2)
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2
    f = np.zeros_like(mesh.nodes_m)
    np.add.at(f[:, 2], top[:, 3:], -1e6 * area[:, None] / 3)
    free = np.flatnonzero(~held.ravel())
    K = stiffness(mesh, lam, mu)
    u = np.zeros(f.size)
    u[free] = factorise(K[free][:, free])(f.ravel()[free])
    corner = int(np.argmin(np.linalg.norm(mesh.nodes_m - [2, 0, 0.6], axis=1)))
    assert stress_yy(mesh, u.reshape(-1, 3), corner, lam, mu) == pytest.approx(-5.38e6, rel=0.02)


def stress_yy(mesh, u, node, lam, mu):
    """Mean over the elements that have the node as a corner."""
    elements, corner = np.nonzero(mesh.corners == node)
    gradients = shape_gradients(mesh, np.eye(4))[elements, corner]
    slope = np.einsum("eka,ekb->eba", gradients, u[mesh.tetrahedra[elements]])
    return float((lam * np.trace(slope, axis1=1, axis2=2) + 2 * mu * slope[:, 1, 1]).mean())


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
    u = held(mesh, exact, np.zeros(exact.size))
    assert np.abs(u - exact).max() < 1e-12 * np.abs(exact).max()


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


def test_matrices_of_other_patterns_are_refused():
    K1, K2 = elastic_stiffness(unit_box(1))
    message = "K2: expected the shape and the places of K1's entries, found others"
    with pytest.raises(ValueError, match=message):
        combined(K1, K2[:-3], LAM, MU)
    moved = K2.copy()
    moved.indices = moved.indices[::-1].copy()
    with pytest.raises(ValueError, match=message):
        combined(K1, moved, LAM, MU)
