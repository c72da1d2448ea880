"""Co-rotational strain: its energy, rigid turns, small turns, and a beam that bends far."""

import numpy as np
import pytest
from palpate.solid.corotation import element_rotations, rotation_loads
from palpate.solid.mesh import element_volumes
from palpate.solid.stiffness import QUADRATURE, combined, elastic_stiffness, shape_gradients
from scipy.spatial.transform import Rotation
from solid_cases import LAM, MU, of_order, unit_box

ORDERS = pytest.mark.parametrize("order", [1, 2])
TURN = Rotation.from_rotvec([0.4, -1.9, 1.1]).as_matrix()


def bend(mesh, size):
    """A displacement that turns and strains each part otherwise."""
    x = mesh.nodes_m
    return size * np.column_stack(
        [0.5 * x[:, 2] ** 2, 0.2 * np.sin(2 * x[:, 0]), -0.6 * x[:, 0] * x[:, 2] + 0.1 * x[:, 1]]
    )


def force(mesh, rotations, u):
    """Force of a displacement at fixed rotations."""
    b1, b2 = rotation_loads(mesh, rotations)
    K = combined(*elastic_stiffness(mesh, rotations), LAM, MU)
    return (K @ u.ravel() - LAM * b1 - MU * b2).reshape(-1, 3)


def linear_force(mesh, u):
    return (combined(*elastic_stiffness(mesh), LAM, MU) @ u.ravel()).reshape(-1, 3)


@ORDERS
def test_force_is_the_slope_of_the_energy(order):
    mesh = of_order(unit_box(1), order)
    R = element_rotations(mesh, bend(mesh, 1.0))
    gradients = shape_gradients(mesh, QUADRATURE[order])
    weight = element_volumes(mesh.nodes_m, mesh.corners)[:, None] / len(QUADRATURE[order])

    def energy(u):
        F = np.eye(3) + np.einsum("eia,epib->epab", u[mesh.tetrahedra], gradients)
        H = np.einsum("epba,epbc->epac", R, F)
        e = (H + np.swapaxes(H, -1, -2)) / 2 - np.eye(3)
        trace = np.trace(e, axis1=-2, axis2=-1)
        return (weight * (LAM / 2 * trace**2 + MU * (e**2).sum(axis=(-2, -1)))).sum()

    u, step = bend(mesh, 0.8), 1e-5 * np.random.default_rng(1).normal(size=mesh.nodes_m.shape)
    slope = (energy(u + step) - energy(u - step)) / 2
    assert (force(mesh, R, u) * step).sum() == pytest.approx(slope, rel=1e-7)


@ORDERS
def test_a_rigid_turn_gives_no_force(order):
    mesh = of_order(unit_box(1), order)
    u = mesh.nodes_m @ TURN.T - mesh.nodes_m + [0.3, -0.1, 2.0]
    R = element_rotations(mesh, u)
    assert np.allclose(R, TURN, atol=1e-12)
    scale = np.abs(linear_force(mesh, u)).max()
    assert scale > 1
    assert np.abs(force(mesh, R, u)).max() < 1e-11 * scale


@ORDERS
def test_forces_turn_with_the_solid(order):
    mesh, u = (m := of_order(unit_box(1), order)), bend(m, 0.7)
    turned = (mesh.nodes_m + u) @ TURN.T - mesh.nodes_m
    R, turned_R = element_rotations(mesh, u), element_rotations(mesh, turned)
    assert np.allclose(turned_R, TURN @ R, atol=1e-10)
    f = force(mesh, R, u)
    assert np.allclose(force(mesh, turned_R, turned), f @ TURN.T, atol=1e-10 * np.abs(f).max())
    assert np.abs(f.sum(axis=0)).max() < 1e-10 * np.abs(f).max()


@ORDERS
def test_it_tends_to_linear_strain_as_the_square_of_the_displacement(order):
    mesh = of_order(unit_box(1), order)
    sizes = np.array([0.04, 0.02, 0.01])
    gaps = []
    for size in sizes:
        u = bend(mesh, size)
        gaps.append(
            np.abs(force(mesh, element_rotations(mesh, u), u) - linear_force(mesh, u)).max()
        )
    assert np.polyfit(np.log(sizes), np.log(gaps), 1)[0] == pytest.approx(2, abs=0.1)


def test_no_rotation_is_linear_strain():
    mesh = unit_box(1)
    none = np.broadcast_to(np.eye(3), (len(mesh.tetrahedra), 1, 3, 3))
    assert np.allclose(force(mesh, none, bend(mesh, 1.0)), linear_force(mesh, bend(mesh, 1.0)))
    stretched = mesh.nodes_m * [0.2, -0.1, 0.5]
    assert np.allclose(element_rotations(mesh, stretched), np.eye(3), atol=1e-12)


def test_an_element_turned_inside_out_has_a_proper_rotation():
    mesh = unit_box(1)
    u = 3 * np.random.default_rng(2).normal(size=mesh.nodes_m.shape)
    R = element_rotations(mesh, u)
    assert np.allclose(R @ np.swapaxes(R, -1, -2), np.eye(3), atol=1e-10)
    assert np.allclose(np.linalg.det(R), 1)


def test_bad_input():
    mesh = unit_box(1)
    u = np.zeros_like(mesh.nodes_m)
    with pytest.raises(ValueError, match=r"displacement_m: expected finite numbers of shape"):
        element_rotations(mesh, u[:-1])
    u[0, 0] = np.nan
    with pytest.raises(ValueError, match="displacement_m: .* 1 that are not"):
        element_rotations(mesh, u)
