"""Orders of convergence on a manufactured solution, and NAFEMS' thick plate."""

import numpy as np
import pytest
from palpate.solid.mesh import element_volumes, quadratic, solid_mesh
from palpate.solid.solve import factorise
from palpate.solid.stiffness import combined, elastic_stiffness, shape_gradients, shape_values
from skfem import MeshTet
from skfem.quadrature import get_quadrature_tet
from solid_cases import dofs, of_order, unit_box

LAM, MU = 1.5, 1.0
# u = A sin(k x + 0.3): -div sigma = ((lam + mu) (A k) k + mu k^2 A) sin.
AMPLITUDE, WAVE, PHASE = np.array([0.7, -0.4, 0.5]), np.array([2.1, 1.3, -1.7]), 0.3
BODY = (LAM + MU) * (AMPLITUDE @ WAVE) * WAVE + MU * (WAVE @ WAVE) * AMPLITUDE


def quadrature(degree):
    points, weights = get_quadrature_tet(degree)
    return np.column_stack([1 - points.sum(axis=0), points.T]), 6 * weights


def at_points(mesh, degree):
    """Places (m, p, 3), their volumes (m, p) and barycentric coordinates."""
    points, weights = quadrature(degree)
    volumes = element_volumes(mesh.nodes_m, mesh.corners)[:, None] * weights
    return points @ mesh.nodes_m[mesh.corners], volumes, points


def solved(mesh):
    """Displacement with exact values on the boundary and the integrated body force."""
    exact = (np.sin(mesh.nodes_m @ WAVE + PHASE)[:, None] * AMPLITUDE).ravel()
    place, volumes, points = at_points(mesh, 5)
    shares = (volumes * np.sin(place @ WAVE + PHASE)) @ shape_values(points, mesh.order)
    weight = np.bincount(mesh.tetrahedra.ravel(), shares.ravel(), len(mesh.nodes_m))
    f = (weight[:, None] * BODY).ravel()
    boundary = dofs(mesh.surface_nodes())
    inner = np.setdiff1d(np.arange(f.size), boundary)
    K = combined(*elastic_stiffness(mesh), LAM, MU)
    u = exact.copy()
    u[inner] = factorise(K[inner][:, inner])(f[inner] - K[inner][:, boundary] @ u[boundary])
    return u.reshape(-1, 3)


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
    return quadratic(solid_mesh(np.column_stack([x, y, z]), mesh.t.T)), s, turn


def test_nafems_thick_plate():
    """LE10: sigma_yy at D of the upper surface is -5.38 MPa under 1 MPa (NAFEMS 1990)."""
    mesh, _, _ = elliptic_plate(8, 16, 4)
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
    K = combined(*elastic_stiffness(mesh), lam, mu)
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
