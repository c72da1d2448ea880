"""Hertz fits: exact data, noise, real indentation curves, and what is refused."""

import numpy as np
import pandas as pd
import pytest
from palpate.estimate.hertz.fit import (
    effective_samples,
    fit_free_contact,
    fit_known_contact,
    fit_study,
    hertz_force,
)
from palpate.estimate.hertz.laws import contact_law

R, TRUTH = 0.00622, 27473.0


def law_of(radius_m=R, indenter="parabola", support="half_space"):
    return contact_law(indenter, support, radius_m=radius_m, thickness_m=0.0475, nu=0.3)


def correlated(rng, size, lag, std):
    """First-order process of a lag-1 autocorrelation and standard deviation."""
    noise = rng.normal(0, std, size)
    for k in range(1, size):
        noise[k] = lag * noise[k - 1] + np.sqrt(1 - lag**2) * noise[k]
    return noise


@pytest.mark.parametrize("residual", ["force", "force_two_thirds"])
def test_exact_data(residual):
    depth = np.linspace(-0.003, 0.008, 30)
    force = hertz_force(depth, TRUTH, R)
    assert fit_study(depth[9:], force[9:], R).reduced_modulus_pa == pytest.approx(TRUTH, rel=1e-6)
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


def test_known_contact_is_the_studys_fit():
    depth = np.linspace(0.001, 0.008, 12)
    force = hertz_force(depth, TRUTH, R) + np.random.default_rng(3).normal(0, 0.05, 12)
    known = fit_known_contact(depth, force, law_of(), depth_std_m=1e-4)
    study = fit_study(depth, force, R)
    assert known.reduced_modulus_pa == pytest.approx(study.reduced_modulus_pa, rel=1e-6)
    assert known.rms_n == pytest.approx(study.rms_n, rel=1e-9)


@pytest.mark.parametrize(("lag", "least"), [(0.0, 0.90), (0.6, 0.75)])
def test_intervals_cover_the_truth(lag, least):
    """Of 95 %; with a serial correlation of 0.6, which 24 samples hardly tell, 80 to 90 % do."""
    depth, depth_std = np.linspace(-0.002, 0.008, 24), 2e-4
    rng = np.random.default_rng(7)
    free, known, weighted = 0, 0, 0
    for _ in range(100):
        shift = rng.normal(0, depth_std)
        force = hertz_force(depth, TRUTH, R) + correlated(rng, depth.size, lag, 0.03)
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


def test_correlated_residuals_count_less():
    rng = np.random.default_rng(2)
    assert effective_samples(rng.normal(size=4000)) == pytest.approx(4000, rel=0.1)
    found = effective_samples(correlated(rng, 4000, 0.6, 1.0))
    assert found == pytest.approx(4000 * 0.4 / 1.6, rel=0.15)


def test_modulus_and_contact_point_go_together():
    depth = np.linspace(-0.002, 0.008, 24)
    force = hertz_force(depth, TRUTH, R) + np.random.default_rng(1).normal(0, 0.02, 24)
    fit = fit_free_contact(depth, force, law_of())
    assert 0.8 < fit.contact_correlation < 0.99


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
    for fit in (
        lambda depth, force: fit_study(depth, force, R),
        lambda depth, force: fit_known_contact(depth, force, law_of(), depth_std_m=0.0),
    ):
        with pytest.raises(ValueError, match="at least 2 samples in contact, found 0"):
            fit(np.array([-1e-3, -2e-3]), np.array([0.0, 0.0]))
