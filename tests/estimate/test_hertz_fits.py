"""Fits of E* and contact: exact data, scipy's own fits, coverage, real curves, bad input."""

import numpy as np
import pandas as pd
import pytest
from palpate.estimate.hertz.fit import (
    deviation,
    effective_samples,
    fit_free_contact,
    fit_known_contact,
    freedom,
)
from palpate.estimate.hertz.laws import contact_law, parabola_force
from scipy.optimize import curve_fit
from scipy.stats import norm, t

R, TRUTH = 0.00622, 27473.0
COUNT = 60
DEPTH = np.linspace(-0.0004, 0.002, COUNT)
# Errors that change their sign each time count as independent.
ERRORS = 0.01 * (-1.0) ** np.arange(COUNT) * (1 + 0.3 * np.sin(np.arange(COUNT)))


def law_of(radius_m=R, indenter="parabola", support="half_space"):
    return contact_law(indenter, support, radius_m=radius_m, thickness_m=0.0475, nu=0.3)


def law(depth_m):
    return parabola_force(depth_m, R)


def force(contact_m=1e-4, level_n=0.0):
    return 20e3 * law(DEPTH - contact_m) + level_n + ERRORS


def correlated(rng, size, lag, std):
    """First-order process of a lag-1 autocorrelation and standard deviation."""
    noise = rng.normal(0, std, size)
    for k in range(1, size):
        noise[k] = lag * noise[k - 1] + np.sqrt(1 - lag**2) * noise[k]
    return noise


@pytest.mark.parametrize("residual", ["force", "force_two_thirds"])
def test_exact_data(residual):
    depth = np.linspace(-0.003, 0.008, 30)
    force = TRUTH * parabola_force(depth, R)
    known = fit_known_contact(depth[9:], force[9:], law_of(), depth_std_m=0.0)
    assert known.reduced_modulus_pa == pytest.approx(TRUTH, rel=1e-6)
    shifted = fit_free_contact(depth + 0.0004, force, law_of(), residual=residual)
    assert shifted.reduced_modulus_pa == pytest.approx(TRUTH, rel=1e-6)
    assert shifted.contact_depth_m == pytest.approx(0.0004, abs=1e-9)


@pytest.mark.parametrize("indenter", ["parabola", "sneddon"])
@pytest.mark.parametrize("support", ["half_space", "bonded", "not_bonded"])
def test_every_law_is_recovered(indenter, support):
    law, depth = law_of(indenter=indenter, support=support), np.linspace(-0.002, 0.008, 24)
    force = TRUTH * law(depth) + 0.05
    free = fit_free_contact(depth + 3e-4, force, law, baseline=True)
    assert free.reduced_modulus_pa == pytest.approx(TRUTH, rel=1e-6)
    assert free.baseline_n == pytest.approx(0.05, abs=1e-7)
    known = fit_known_contact(depth, force - 0.05, law, depth_std_m=0.0)
    assert known.reduced_modulus_pa == pytest.approx(TRUTH, rel=1e-12)


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
    sure = fit_known_contact(DEPTH, measured, law, depth_std_m=0.0)
    assert sure.reduced_modulus_std_pa == pytest.approx(scatter)


@pytest.mark.parametrize(("lag", "least"), [(0.0, 0.90), (0.6, 0.75)])
def test_intervals_cover_the_truth(lag, least):
    """Of 95 %; with a serial correlation of 0.6, which 24 samples hardly tell, 80 to 90 % do."""
    depth, depth_std = np.linspace(-0.002, 0.008, 24), 2e-4
    rng = np.random.default_rng(7)
    free, known, weighted = 0, 0, 0
    for _ in range(100):
        shift = rng.normal(0, depth_std)
        force = TRUTH * parabola_force(depth, R) + correlated(rng, depth.size, lag, 0.03)
        low, high = fit_free_contact(depth + shift, force, law_of()).reduced_modulus_interval_pa
        free += low < TRUTH < high
        low, high = fit_free_contact(
            depth + shift, force, law_of(), depth_std_m=depth_std
        ).reduced_modulus_interval_pa
        weighted += low < TRUTH < high
        used = depth > 0
        fit = fit_known_contact(
            depth[used] + shift, force[used], law_of(), depth_std_m=depth_std
        ).reduced_modulus_interval_pa
        known += fit[0] < TRUTH < fit[1]
    assert least <= free / 100 <= 0.99
    assert 0.90 <= known / 100 <= 1.0
    assert least <= weighted / 100 <= 1.0


def test_few_independent_samples_make_a_wide_interval():
    """Of 200 samples with a correlation of 0.9 ten are left, and Student's quantile is theirs."""
    depth, law, rng = np.linspace(1e-4, 0.008, 200), law_of(), np.random.default_rng(11)
    held = 0
    for _ in range(300):
        force = TRUTH * law(depth) + correlated(rng, depth.size, 0.9, 0.03)
        fit = fit_known_contact(depth, force, law, depth_std_m=0.0)
        low, high = fit.reduced_modulus_interval_pa
        held += low < TRUTH < high
    assert 0.92 <= held / 300 <= 0.99


def test_independent_samples_of_a_first_order_process():
    """Its lag-1 autocorrelation r leaves (1 - r)/(1 + r) of them."""
    rng = np.random.default_rng(2)
    found = effective_samples(correlated(rng, 20_000, 0.6, 1.0))
    assert found == pytest.approx(20_000 * 0.4 / 1.6, rel=0.05)
    assert effective_samples((-1.0) ** np.arange(100)) == 100
    # By hand: 1, 1, -1, -1 has a lag-1 autocorrelation of 1/4, less its bias of (1 + 1)/4.
    few = np.array([1.0, 1, -1, -1])
    assert effective_samples(few) == pytest.approx(4 * 0.25 / 1.75)
    assert freedom(few, 1) == pytest.approx(4 * 0.75)
    assert deviation(few, 1) == pytest.approx(np.sqrt(4 / (4 / 7 * 0.75)))
    # Of a record that goes one way and then the other a correlation of 0.9 or five are left.
    assert effective_samples(np.repeat([1.0, -1], 10)) == pytest.approx(20 * 0.1 / 1.9)
    assert effective_samples(np.linspace(-1, 1, 1000)) == pytest.approx(5)


def as_another_program_fits(folder, count):
    """Within 0.05 % of another program's fits; 0.004 % is found."""
    reference = pd.read_csv(folder / "reference.csv")
    assert len(reference) == count
    for row in reference.itertuples():
        curve = pd.read_csv(folder / row.file)
        position, force = curve.iloc[:, 0].to_numpy(), curve.iloc[:, 1].to_numpy()
        fit = fit_free_contact(-position, force, law_of(row.radius_m), baseline=True)
        E = fit.reduced_modulus_pa * (1 - row.poisson_ratio**2)
        assert E == pytest.approx(row.youngs_modulus_pa, rel=5e-4), row.file


def test_a_real_indentation_curve(root):
    as_another_program_fits(root / "tests/real/curves", 1)


def test_more_real_indentation_curves(more_real_data):
    as_another_program_fits(more_real_data / "hertz_afm", 6)


def test_bad_input():
    with pytest.raises(ValueError, match="samples: expected more than 2, found 2"):
        fit_free_contact(np.array([0, 1e-3]), np.array([0, 0.1]), law_of())
    with pytest.raises(ValueError, match="residual: expected one of force, force_two_thirds"):
        fit_free_contact(np.arange(5.0), np.arange(5.0), law_of(), residual="energy")
    with pytest.raises(ValueError, match="at least 2 samples in contact, found 0"):
        fit_known_contact(np.array([-1e-3, -2e-3]), np.zeros(2), law_of(), depth_std_m=0.0)
