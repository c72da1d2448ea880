"""Laws at finite strain and their solids: derivatives, small strain, turns."""

import numpy as np
import pytest
from palpate.solid.hyperelastic import HyperelasticSolid
from palpate.solid.laws import (
    LAWS,
    engineering_from_lame,
    lame_from_engineering,
    named_law,
    poisson_ratio,
    reduced_modulus,
    unit_lame,
)
from palpate.solid.mesh import quadratic
from palpate.solid.stiffness import combined, elastic_stiffness
from scipy.spatial.transform import Rotation

RATIOS = [0.0, 0.2, 0.45]


@pytest.fixture(params=sorted(LAWS))
def law(request):
    return named_law(request.param)


# Deformation gradients far from rest, of positive volume.
STRAINED = np.eye(3) + 0.25 * np.random.default_rng(7).uniform(-1, 1, size=(20, 3, 3))


@pytest.mark.parametrize("nu", RATIOS)
def test_stress_and_tangent_are_slopes(law, nu):
    step = 1e-6 * np.random.default_rng(8).normal(size=STRAINED.shape)
    slope = (law.energy(STRAINED + step, nu) - law.energy(STRAINED - step, nu)) / 2
    found = (law.stress(STRAINED, nu) * step).sum(axis=(1, 2))
    assert np.allclose(found, slope, rtol=1e-5, atol=1e-6 * np.abs(slope).max())
    step = 1e-6 * np.random.default_rng(9).normal(size=STRAINED.shape)
    slope = (law.stress(STRAINED + step, nu) - law.stress(STRAINED - step, nu)) / 2
    found = np.einsum("nijkl,nkl->nij", law.tangent(STRAINED, nu), step)
    assert np.linalg.norm(found - slope) < 1e-6 * np.linalg.norm(slope)


@pytest.mark.parametrize("nu", RATIOS)
def test_small_strain_is_the_linear_solid(law, nu):
    lam, mu = unit_lame(nu)
    one = np.eye(3)
    linear = lam * np.einsum("ij,kl->ijkl", one, one)
    linear += mu * (np.einsum("ik,jl->ijkl", one, one) + np.einsum("il,jk->ijkl", one, one))
    assert np.allclose(law.tangent(one, nu), linear, atol=1e-12 * (lam + mu))
    assert law.energy(one, nu) == pytest.approx(0, abs=1e-15)
    assert np.abs(law.stress(one, nu)).max() < 1e-14


def test_turning_changes_no_energy(law):
    turn = Rotation.from_rotvec([0.3, -1.2, 0.8]).as_matrix()
    assert np.allclose(law.energy(turn @ STRAINED, 0.3), law.energy(STRAINED, 0.3), rtol=1e-12)
    assert np.allclose(law.stress(turn @ STRAINED, 0.3), turn @ law.stress(STRAINED, 0.3))


def test_foam_law_at_a_ratio_of_zero_and_of_a_quarter():
    """Without a volume term of its own it is the limit; at a quarter that of 1962."""
    foam = named_law("blatz_ko")
    assert np.allclose(foam.energy(STRAINED, 0.0), foam.energy(STRAINED, 1e-7), rtol=1e-5)
    # mu/2 (I2 / I3 + 2 sqrt(I3) - 5), mu = 0.4 for a Young's modulus of 1.
    C = STRAINED.swapaxes(1, 2) @ STRAINED
    I1, I3 = np.trace(C, axis1=1, axis2=2), np.linalg.det(C)
    I2 = (I1**2 - np.trace(C @ C, axis1=1, axis2=2)) / 2
    wanted = 0.2 * (I2 / I3 + 2 * np.sqrt(I3) - 5)
    assert np.allclose(named_law("blatz_ko").energy(STRAINED, 0.25), wanted, rtol=1e-10)


def test_moduli_by_hand_and_back_and_what_is_none():
    # 24 kPa * 0.2 / (1.2 * 0.6) and 24 kPa / 2.4.
    assert lame_from_engineering(24e3, 0.2) == pytest.approx((24e3 / 3.6, 10e3))
    assert poisson_ratio(3.0, 2.0) == pytest.approx(0.3)
    assert reduced_modulus(21e3, 0.4) == pytest.approx(25e3)
    for nu in (0.0, 0.2, 0.49):
        assert engineering_from_lame(*lame_from_engineering(7e3, nu)) == pytest.approx((7e3, nu))
    with pytest.raises(ValueError, match="law: expected one of neo_hookean.*, found ogden"):
        named_law("ogden")
    with pytest.raises(ValueError, match="nu: expected from 0 to below 0.5, found 0.5"):
        unit_lame(0.5)


@pytest.fixture(scope="module")
def mesh(cube):
    return quadratic(cube)


@pytest.fixture(scope="module")
def bent(mesh):
    x = mesh.nodes_m / 0.1
    bend = np.column_stack(
        [0.15 * x[:, 2] ** 2, 0.1 * np.sin(2 * x[:, 0]), -0.1 * x[:, 2] * x[:, 1]]
    )
    return mesh.nodes_m + 0.1 * bend


@pytest.mark.parametrize("name", sorted(LAWS))
def test_forces_and_blocks_are_slopes(mesh, bent, name):
    solid = HyperelasticSolid(mesh, named_law(name), 0.3)
    step = 1e-7 * np.random.default_rng(1).normal(size=bent.shape)
    slope = (solid.energy(bent + step) - solid.energy(bent - step)) / 2
    assert (solid.forces(bent) * step).sum() == pytest.approx(slope, rel=1e-5)
    change = solid.forces(bent + step) - solid.forces(bent - step)
    K = solid.pattern.matrix(solid.blocks(bent))
    found = (K @ (2 * step).ravel()).reshape(-1, 3)
    assert np.linalg.norm(found - change) < 1e-5 * np.linalg.norm(change)


def test_at_rest_it_is_the_linear_solid_and_flat_elements_have_no_finite_energy(mesh):
    solid = HyperelasticSolid(mesh, named_law("neo_hookean"), 0.3)
    K = solid.pattern.matrix(solid.blocks(mesh.nodes_m))
    linear = combined(*elastic_stiffness(mesh), *unit_lame(0.3))
    assert abs(K - linear).max() < 1e-12 * abs(linear).max()
    solid = HyperelasticSolid(mesh, named_law("blatz_ko"), 0.3)
    assert solid.energy(mesh.nodes_m * [1, 1, 0.01]) == np.inf
    assert solid.least_volume(mesh.nodes_m * [1, 1, 0.5]) == pytest.approx(0.5)


def test_positive_part_has_no_negative_direction(mesh):
    solid = HyperelasticSolid(mesh, named_law("neo_hookean"), 0.3)
    squeezed = mesh.nodes_m * [1, 1, 0.4]
    K, positive = (
        solid.pattern.matrix(solid.blocks(squeezed, positive=part)).toarray()
        for part in (False, True)
    )
    assert np.linalg.eigvalsh(K)[0] < -1e-3 * abs(K).max()
    assert np.linalg.eigvalsh(positive)[0] > -1e-10 * abs(positive).max()
