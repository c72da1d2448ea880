"""Fits of E* and contact: exact data, scipy's own fits, coverage, real curves."""

import numpy as np
import pandas as pd
import pytest
from palpate.estimate.hertz.fit import (
    fit_free_contact,
    fit_known_contact,
)
from palpate.estimate.hertz.laws import contact_law, parabola_force
from scipy.optimize import curve_fit
from scipy.stats import t

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
    powers = fit_free_contact(depth + 4e-4, force - 0.05, law, residual="force_two_thirds")
    assert powers.reduced_modulus_pa == pytest.approx(TRUTH, rel=1e-6)
    assert powers.contact_depth_m == pytest.approx(4e-4, abs=1e-9)


WEIGHTS = np.linspace(0.5, 2, COUNT)
# Contact at 0 within its stated deviation; powers of a force that is off.
GIVEN = {
    "as it is": {},
    "baseline": {"baseline": True},
    "weights": {"weights": WEIGHTS},
    "powers": {"residual": "force_two_thirds"},
    "contact": {"depth_std_m": 2e-5},
}


@pytest.mark.parametrize("case", GIVEN)
def test_free_contact_is_least_squares_with_its_covariance(case):
    given, power = GIVEN[case], 2 / 3 if case == "powers" else 1
    measured = force(level_n=0.05 * (case in ("baseline", "powers")))
    plain = case in ("as it is", "baseline")

    def model(_, log_E, contact, level=0.0):
        found = (np.exp(log_E) * law(DEPTH - 1e-4 * contact) + level) ** power
        return np.append(found, [1e-4 * contact] * (case == "contact"))

    wanted, sigma = measured**power, 1 / np.sqrt(given.get("weights", np.ones(COUNT)))
    if case == "contact":
        scatter = np.sqrt(COUNT / (COUNT - 2)) * fit_free_contact(DEPTH, measured, law).rms_n
        wanted, sigma = np.append(wanted, 0.0), np.append(sigma * scatter, 2e-5)
    start = [np.log(2e4), 1.0, *[0.05] * (case == "baseline")]
    fine = {"xtol": 1e-14, "ftol": 1e-14} if plain else {}
    best, covariance = curve_fit(model, DEPTH, wanted, p0=start, sigma=sigma, **fine)
    E, contact, level = np.exp(best[0]), 1e-4 * best[1], best[2] if case == "baseline" else 0.0
    found = fit_free_contact(DEPTH, measured, law, **given)
    exact = plain or case == "weights"
    assert found.reduced_modulus_pa == pytest.approx(E, rel=1e-5 if exact else 1e-4)
    assert found.contact_depth_m == pytest.approx(contact, rel=1e-5 if plain else 1e-3, abs=0.0)
    if plain or case == "powers":
        left = np.sqrt(np.mean((measured - E * law(DEPTH - contact) - level) ** 2))
        assert found.rms_n == pytest.approx(left, rel=1e-5 if plain else 1e-3)
    if exact:
        std = np.sqrt(np.diag(covariance))
        assert found.reduced_modulus_std_pa == pytest.approx(E * std[0], rel=2e-3)
    if plain:
        assert found.contact_depth_std_m == pytest.approx(1e-4 * std[1], rel=2e-3)
        width = t.ppf(0.975, COUNT - len(best)) * std[0]
        ends = E * np.exp(-width), E * np.exp(width)
        assert found.reduced_modulus_interval_pa == pytest.approx(ends, rel=1e-4)
        assert found.baseline_n == pytest.approx(level, abs=1e-7)
        assert found.effective_samples == pytest.approx(COUNT)


def covered(fits):
    """Share of intervals that hold the truth."""
    ends = np.array([fit.reduced_modulus_interval_pa for fit in fits])
    return np.mean((ends[:, 0] < TRUTH) & (TRUTH < ends[:, 1]))


@pytest.mark.parametrize(("lag", "least"), [(0.0, 0.90), (0.6, 0.75)])
def test_intervals_cover_the_truth(lag, least):
    """Of 95 %; with a serial correlation of 0.6, which 24 samples hardly tell, 80 to 90 % do."""
    depth, depth_std = np.linspace(-0.002, 0.008, 24), 2e-4
    rng, law, used = np.random.default_rng(7), law_of(), depth > 0
    free, known, weighted = [], [], []
    for _ in range(100):
        moved = depth + rng.normal(0, depth_std)
        force = TRUTH * law(depth) + correlated(rng, depth.size, lag, 0.03)
        free.append(fit_free_contact(moved, force, law))
        weighted.append(fit_free_contact(moved, force, law, depth_std_m=depth_std))
        known.append(fit_known_contact(moved[used], force[used], law, depth_std_m=depth_std))
    assert least <= covered(free) <= 0.99
    assert covered(known) >= 0.90
    assert covered(weighted) >= least


def test_few_independent_samples_make_a_wide_interval():
    """Of 200 samples with a correlation of 0.9 ten are left, and Student's quantile is theirs."""
    depth, law, rng = np.linspace(1e-4, 0.008, 200), law_of(), np.random.default_rng(11)
    forces = (TRUTH * law(depth) + correlated(rng, 200, 0.9, 0.03) for _ in range(300))
    fits = [fit_known_contact(depth, force, law, depth_std_m=0.0) for force in forces]
    assert 0.92 <= covered(fits) <= 0.99


def test_more_real_indentation_curves(more_real_data):
    """Within 0.05 % of another program's fits; 0.004 % is found."""
    reference = pd.read_csv(more_real_data / "hertz_afm/reference.csv")
    assert len(reference) == 6
    for row in reference.itertuples():
        curve = pd.read_csv(more_real_data / "hertz_afm" / row.file)
        position, force = curve.iloc[:, 0].to_numpy(), curve.iloc[:, 1].to_numpy()
        fit = fit_free_contact(-position, force, law_of(row.radius_m), baseline=True)
        E = fit.reduced_modulus_pa * (1 - row.poisson_ratio**2)
        assert E == pytest.approx(row.youngs_modulus_pa, rel=5e-4), row.file
