"""Fits of E* and contact to samples whose errors alternate: those of scipy's, worked out apart."""

import numpy as np
import pytest
from palpate.estimate.hertz.fit import (
    fit_free_contact,
    fit_known_contact,
    fit_study,
    hertz_force,
)
from palpate.estimate.hertz.laws import parabola_force
from scipy.optimize import curve_fit
from scipy.stats import norm, t

RADIUS_M, COUNT = 0.006, 60
DEPTH = np.linspace(-0.0004, 0.002, COUNT)
# Errors that change their sign each time count as independent.
ERRORS = 0.01 * (-1.0) ** np.arange(COUNT) * (1 + 0.3 * np.sin(np.arange(COUNT)))


def law(depth_m):
    return parabola_force(depth_m, RADIUS_M)


def force(contact_m=1e-4, level_n=0.0):
    return 20e3 * law(DEPTH - contact_m) + level_n + ERRORS


@pytest.mark.parametrize("baseline", [False, True])
def test_free_contact_is_least_squares_with_its_covariance(baseline):
    measured = force(level_n=0.05 * baseline)

    def model(depth, log_E, contact, level=0.0):
        return np.exp(log_E) * law(depth - 1e-4 * contact) + level

    start = [np.log(2e4), 1.0, *[0.05] * baseline]
    best, covariance = curve_fit(model, DEPTH, measured, p0=start, xtol=1e-14, ftol=1e-14)
    std = np.sqrt(np.diag(covariance))
    found = fit_free_contact(DEPTH, measured, law, baseline=baseline)
    E = np.exp(best[0])
    assert found.reduced_modulus_pa == pytest.approx(E, rel=1e-5)
    assert found.reduced_modulus_std_pa == pytest.approx(E * std[0], rel=2e-3)
    assert found.contact_depth_m == pytest.approx(1e-4 * best[1], abs=1e-9)
    assert found.contact_depth_std_m == pytest.approx(1e-4 * std[1], rel=2e-3)
    correlation = covariance[0, 1] / std[0] / std[1]
    assert found.contact_correlation == pytest.approx(correlation, abs=1e-3)
    width = t.ppf(0.975, COUNT - len(best)) * std[0]
    ends = E * np.exp(-width), E * np.exp(width)
    assert found.reduced_modulus_interval_pa == pytest.approx(ends, rel=1e-4)
    assert found.baseline_n == pytest.approx(best[2] if baseline else 0, abs=1e-7)
    left = measured - model(DEPTH, *best)
    assert found.rms_n == pytest.approx(np.sqrt(np.mean(left**2)), rel=1e-5)
    assert found.effective_samples == pytest.approx(COUNT)


def test_powers_of_the_force_are_compared():
    measured = force() + 0.05
    found = fit_free_contact(DEPTH, measured, law, residual="force_two_thirds")

    def model(depth, log_E, contact):
        return (np.exp(log_E) * law(depth - 1e-4 * contact)) ** (2 / 3)

    best, _ = curve_fit(model, DEPTH, measured ** (2 / 3), p0=[np.log(2e4), 1.0])
    assert found.reduced_modulus_pa == pytest.approx(np.exp(best[0]), rel=1e-4)
    left = measured - np.exp(best[0]) * law(DEPTH - 1e-4 * best[1])
    assert found.rms_n == pytest.approx(np.sqrt(np.mean(left**2)), rel=1e-3)


def test_weights_and_what_is_known_of_the_contact():
    measured, weights = force(), np.linspace(0.5, 2, COUNT)
    found = fit_free_contact(DEPTH, measured, law, weights=weights)

    def model(depth, log_E, contact):
        return np.exp(log_E) * law(depth - 1e-4 * contact)

    sigma = 1 / np.sqrt(weights)
    best, covariance = curve_fit(model, DEPTH, measured, p0=[np.log(2e4), 1.0], sigma=sigma)
    assert found.reduced_modulus_pa == pytest.approx(np.exp(best[0]), rel=1e-5)
    std = found.reduced_modulus_std_pa / found.reduced_modulus_pa
    assert std == pytest.approx(np.sqrt(covariance[0, 0]), rel=2e-3)
    # Contact at 0 within its stated deviation, in the residuals' own.
    free = fit_free_contact(DEPTH, measured, law)
    scatter = np.sqrt(COUNT / (COUNT - 2)) * free.rms_n
    held = fit_free_contact(DEPTH, measured, law, depth_std_m=2e-5)

    def both(depth, log_E, contact):
        return np.r_[model(DEPTH, log_E, contact), 1e-4 * contact]

    known = np.r_[np.full(COUNT, scatter), 2e-5]
    best, _ = curve_fit(both, DEPTH, np.r_[measured, 0.0], p0=[np.log(2e4), 1.0], sigma=known)
    assert held.reduced_modulus_pa == pytest.approx(np.exp(best[0]), rel=1e-4)
    assert 0 < held.contact_depth_m == pytest.approx(1e-4 * best[1], rel=1e-3)


def test_known_contact_by_hand():
    measured = force(contact_m=0.0)
    unit = law(DEPTH)
    E = unit @ measured / (unit @ unit)
    left = measured - E * unit
    scatter = np.sqrt(left @ left / (COUNT - 1) / (unit @ unit))
    # A depth that is off by 0.1 mm, by differences a tenth as large.
    moved = [
        law(DEPTH + sign * 1e-5) @ measured / np.sum(law(DEPTH + sign * 1e-5) ** 2)
        for sign in (1, -1)
    ]
    of_depth = (moved[0] - moved[1]) / 2e-5 * 1e-4
    found = fit_known_contact(DEPTH, measured, law, depth_std_m=1e-4)
    assert found.reduced_modulus_pa == pytest.approx(E)
    assert found.reduced_modulus_std_pa == pytest.approx(np.hypot(scatter, of_depth), rel=5e-3)
    width = np.hypot(t.ppf(0.975, COUNT - 1) * scatter, norm.ppf(0.975) * of_depth) / E
    ends = E * np.exp(-width), E * np.exp(width)
    assert found.reduced_modulus_interval_pa == pytest.approx(ends, rel=5e-3)
    assert found.rms_n == pytest.approx(np.sqrt(np.mean(left**2)))
    study = fit_study(DEPTH, measured, RADIUS_M)
    assert study.reduced_modulus_pa == pytest.approx(E) and study.rms_n == pytest.approx(
        found.rms_n
    )
    sure = fit_known_contact(DEPTH, measured, law, depth_std_m=0.0)
    assert sure.reduced_modulus_std_pa == pytest.approx(scatter)


def test_hertzs_force():
    found = hertz_force(np.array([-0.001, 0.0015]), 20e3, RADIUS_M)
    assert found == pytest.approx([0, 4 / 3 * 20e3 * np.sqrt(0.006) * 0.0015**1.5])
