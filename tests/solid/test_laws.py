"""Hyperelastic laws: derivatives, small strain, objectivity, a simple stretch."""

import numpy as np
import pytest
from palpate.solid.laws import (
    LAWS,
    engineering_from_lame,
    lame_from_engineering,
    named_law,
    poisson_ratio,
    reduced_modulus,
    unit_lame,
)
from scipy.spatial.transform import Rotation

RATIOS = [0.0, 0.2, 0.45]


@pytest.fixture(params=sorted(LAWS))
def law(request):
    return named_law(request.param)


@pytest.fixture
def strained():
    """Deformation gradients far from rest, of positive volume."""
    return np.eye(3) + 0.25 * np.random.default_rng(7).uniform(-1, 1, size=(20, 3, 3))


@pytest.mark.parametrize("nu", RATIOS)
def test_stress_and_tangent_are_slopes(law, strained, nu):
    step = 1e-6 * np.random.default_rng(8).normal(size=strained.shape)
    slope = (law.energy(strained + step, nu) - law.energy(strained - step, nu)) / 2
    found = (law.stress(strained, nu) * step).sum(axis=(1, 2))
    assert np.allclose(found, slope, rtol=1e-5, atol=1e-6 * np.abs(slope).max())
    step = 1e-6 * np.random.default_rng(9).normal(size=strained.shape)
    slope = (law.stress(strained + step, nu) - law.stress(strained - step, nu)) / 2
    found = np.einsum("nijkl,nkl->nij", law.tangent(strained, nu), step)
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


def test_turning_changes_no_energy(law, strained):
    turn = Rotation.from_rotvec([0.3, -1.2, 0.8]).as_matrix()
    assert np.allclose(law.energy(turn @ strained, 0.3), law.energy(strained, 0.3), rtol=1e-12)
    assert np.allclose(law.stress(turn @ strained, 0.3), turn @ law.stress(strained, 0.3))


def test_foam_law_at_a_ratio_of_zero_and_of_a_quarter(strained):
    """Without a volume term of its own it is the limit; at a quarter that of 1962."""
    foam = named_law("blatz_ko")
    assert np.allclose(foam.energy(strained, 0.0), foam.energy(strained, 1e-7), rtol=1e-5)
    # mu/2 (I2 / I3 + 2 sqrt(I3) - 5), mu = 0.4 for a Young's modulus of 1.
    C = strained.swapaxes(1, 2) @ strained
    I1, I3 = np.trace(C, axis1=1, axis2=2), np.linalg.det(C)
    I2 = (I1**2 - np.trace(C @ C, axis1=1, axis2=2)) / 2
    wanted = 0.2 * (I2 / I3 + 2 * np.sqrt(I3) - 5)
    assert np.allclose(named_law("blatz_ko").energy(strained, 0.25), wanted, rtol=1e-10)


def test_bad_input():
    with pytest.raises(ValueError, match="law: expected one of neo_hookean.*, found ogden"):
        named_law("ogden")
    with pytest.raises(ValueError, match="nu: expected from 0 to below 0.5, found 0.5"):
        unit_lame(0.5)


def test_values_by_hand():
    # 24 kPa * 0.2 / (1.2 * 0.6) and 24 kPa / 2.4.
    assert lame_from_engineering(24e3, 0.2) == pytest.approx((24e3 / 3.6, 10e3))
    assert poisson_ratio(3.0, 2.0) == pytest.approx(0.3)
    assert reduced_modulus(21e3, 0.4) == pytest.approx(25e3)


@pytest.mark.parametrize("nu", [0.0, 0.2, 0.49])
def test_there_and_back(nu):
    lam, mu = lame_from_engineering(7e3, nu)
    assert engineering_from_lame(lam, mu) == pytest.approx((7e3, nu))
