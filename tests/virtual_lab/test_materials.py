"""Constitutive laws and relaxation against derivatives and closed forms."""

import numpy as np
import pytest
from virtual_lab.material import LAWS, lame, relaxed_force


@pytest.mark.parametrize("name", sorted(LAWS))
def test_stress_is_the_derivative_of_energy(name):
    law = LAWS[name](25e3, 0.3)
    rng = np.random.default_rng(0)
    F = np.eye(3) + 0.2 * rng.normal(size=(3, 3))
    d = rng.normal(size=(3, 3))
    h = 1e-6
    _, P, A = law(F)
    ahead, behind = law(F + h * d), law(F - h * d)
    assert (ahead[0] - behind[0]) / (2 * h) == pytest.approx((P * d).sum(), rel=1e-6)
    assert np.allclose((ahead[1] - behind[1]) / (2 * h), np.einsum("iJkL,kL->iJ", A, d), rtol=1e-5)


@pytest.mark.parametrize("name", sorted(LAWS))
def test_small_strains_are_hookes(name):
    E, nu = 105e3, 0.45
    lam, mu = lame(E, nu)
    strain = 1e-6 * np.array([[1, 0.4, 0], [0.4, -2, 0.3], [0, 0.3, 0.5]])
    W, P, _ = LAWS[name](E, nu)(np.eye(3) + strain)
    hooke = lam * np.trace(strain) * np.eye(3) + 2 * mu * strain
    assert np.allclose(P, hooke, rtol=1e-4, atol=1e-4)
    assert LAWS[name](E, nu)(np.eye(3))[0] == pytest.approx(0, abs=1e-9)
    assert W > 0


def test_relaxation_of_a_step_and_of_a_ramp():
    time_s = np.linspace(0, 5, 5001)
    series = {"fractions": [0.2, 0.1], "times_s": [0.3, 3.0]}
    step = relaxed_force(time_s, np.ones_like(time_s), **series)
    exact = 1 - 0.2 * (1 - np.exp(-time_s / 0.3)) - 0.1 * (1 - np.exp(-time_s / 3.0))
    assert np.allclose(step, exact, atol=1e-12)
    ramp = relaxed_force(time_s, time_s, **series)
    integral = 0.7 * time_s
    for g, tau in zip(series["fractions"], series["times_s"], strict=True):
        integral = integral + g * tau * (1 - np.exp(-time_s / tau))
    assert np.allclose(ramp, integral, atol=1e-9)
