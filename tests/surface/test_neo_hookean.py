"""The hyperelastic energy: derivatives, rotations, small strain, uniform stretch."""

import numpy as np
import pytest
from palpate.solid.mesh import quadratic, solid_mesh
from palpate.solid.stiffness import combined, elastic_stiffness
from palpate.surface.neo_hookean import LogNeoHookean
from scipy.spatial.transform import Rotation
from skfem import MeshTet

LAM, MU = 900.0, 400.0


@pytest.fixture(scope="module")
def cube():
    mesh = MeshTet().refined(2)
    return solid_mesh(0.1 * mesh.p.T, mesh.t.T)


@pytest.fixture(scope="module")
def elastic(cube):
    return LogNeoHookean(cube, LAM, MU)


@pytest.fixture(scope="module")
def bent(cube):
    """Node positions far from rest."""
    x = cube.nodes_m / 0.1
    bend = [0.2 * x[:, 2] ** 2, 0.1 * np.sin(2 * x[:, 0]), -0.15 * x[:, 2] * x[:, 1]]
    return cube.nodes_m + 0.1 * np.column_stack(bend)


def test_forces_and_blocks_are_slopes_of_the_energy(elastic, bent):
    step = 1e-6 * np.random.default_rng(1).normal(size=bent.shape)
    forces, blocks = elastic.forces_and_blocks(bent)
    slope = (elastic.energy(bent + step) - elastic.energy(bent - step)) / 2
    assert (forces * step).sum() == pytest.approx(slope, rel=1e-6)
    assert np.abs(forces.sum(axis=0)).max() < 1e-9 * np.abs(forces).max()
    step /= 10
    before, after = (elastic.forces_and_blocks(bent + sign * step)[0] for sign in (-1, 1))
    found = (elastic.pattern.matrix(blocks) @ (2 * step).ravel()).reshape(-1, 3)
    assert np.linalg.norm(found - (after - before)) < 1e-6 * np.linalg.norm(after - before)


def test_turning_changes_nothing(elastic, bent):
    turn = Rotation.from_rotvec([0.4, -1.9, 1.1]).as_matrix()
    assert elastic.energy(bent @ turn.T) == pytest.approx(elastic.energy(bent), rel=1e-12)
    forces, _ = elastic.forces_and_blocks(bent)
    turned, _ = elastic.forces_and_blocks(bent @ turn.T)
    assert np.allclose(turned, forces @ turn.T, atol=1e-12 * np.abs(forces).max())
    assert elastic.energy(elastic.mesh.nodes_m @ turn.T) == pytest.approx(0, abs=1e-15)


def test_at_rest_it_is_the_linear_solid(elastic, cube):
    forces, blocks = elastic.forces_and_blocks(cube.nodes_m)
    linear = combined(*elastic_stiffness(cube), LAM, MU)
    assert abs(elastic.pattern.matrix(blocks) - linear).max() < 1e-12 * abs(linear).max()
    assert np.abs(forces).max() < 1e-12 * abs(linear).max()


def test_uniform_stretch(elastic, cube):
    stretch = np.diag([1.3, 0.9, 1.1])
    J, first = np.linalg.det(stretch), (np.diag(stretch) ** 2).sum()
    density = MU / 2 * (first - 3 - 2 * np.log(J)) + LAM / 2 * np.log(J) ** 2
    found = elastic.energy(cube.nodes_m @ stretch)
    assert found == pytest.approx(density * cube.volume_m3, rel=1e-12)


def test_under_strong_compression_the_positive_part_stays_positive(elastic, cube):
    squeezed = cube.nodes_m @ np.diag([1.0, 1.0, 0.2])
    _, blocks = elastic.forces_and_blocks(squeezed)
    assert np.linalg.eigvalsh(elastic.pattern.matrix(blocks).toarray()).min() < -1e-3 * MU * 0.1
    _, blocks = elastic.forces_and_blocks(squeezed, positive=True)
    assert np.linalg.eigvalsh(elastic.pattern.matrix(blocks).toarray()).min() > -1e-12 * MU


def test_steps_that_would_turn_an_element_inside_are_cut(elastic, cube):
    flat = np.zeros_like(cube.nodes_m)
    flat[:, 2] = -1.5 * cube.nodes_m[:, 2]
    part = elastic.allowed_part(cube.nodes_m, flat)
    assert part == 0.5
    assert elastic.energy(cube.nodes_m + flat) == np.inf
    assert np.isfinite(elastic.energy(cube.nodes_m + part * flat))


def test_ten_node_elements_are_refused(cube):
    with pytest.raises(ValueError, match="mesh: expected four-node elements, found ten-node ones"):
        LogNeoHookean(quadratic(cube), LAM, MU)
