"""Hertz fits: exact data, noise, real indentation curves, and what is refused."""

import numpy as np
import pandas as pd
import pytest
from palpate.estimate.hertz import (
    check_contact,
    fit_free_contact,
    fit_study,
    force_onset,
    hertz_force,
    hertz_range,
)

R = 0.00622


def test_exact_data():
    depth = np.linspace(-0.003, 0.008, 30)
    force = hertz_force(depth, 27473.0, R)
    assert fit_study(depth[9:], force[9:], R).reduced_modulus_pa == pytest.approx(27473, rel=1e-6)
    shifted = fit_free_contact(depth + 0.0004, force, R)
    assert shifted.reduced_modulus_pa == pytest.approx(27473, rel=1e-6)
    assert shifted.contact_depth_m == pytest.approx(0.0004, abs=1e-9)


def test_interval_covers_the_truth_as_often_as_it_says():
    depth = np.linspace(-0.002, 0.008, 24)
    rng = np.random.default_rng(7)
    covered = 0
    for _ in range(200):
        force = hertz_force(depth - 0.0003, 27473.0, R) + rng.normal(0, 0.03, depth.size)
        low, high = fit_free_contact(depth, force, R).reduced_modulus_interval_pa
        covered += low < 27473 < high
    assert 180 <= covered <= 198


def test_real_indentation_curves(real_data):
    folder = real_data / "hertz_afm"
    reference = pd.read_csv(folder / "reference.csv")
    for row in reference.itertuples():
        curve = pd.read_csv(folder / row.file)
        position, force = curve.iloc[:, 0].to_numpy(), curve.iloc[:, 1].to_numpy()
        fit = fit_free_contact(-position, force, row.radius_m, baseline=True)
        E = fit.reduced_modulus_pa * (1 - row.poisson_ratio**2)
        assert E == pytest.approx(row.youngs_modulus_pa, rel=1e-3), row.file


def test_range_is_from_onset_to_peak():
    force = np.array([0.01, 0.03, 0.02, 0.2, 0.6, 1.2, 1.1, 1.0])
    chosen = hertz_range(force, onset_force_n=0.1)
    assert (chosen.start, chosen.stop) == (3, 5)


def test_bad_input():
    with pytest.raises(ValueError, match="force: expected above 0.1 N, found at most 0.05 N"):
        force_onset(np.array([0.0, 0.05]), onset_force_n=0.1)
    with pytest.raises(ValueError, match="expected samples before contact"):
        force_onset(np.array([0.5, 0.9]), onset_force_n=0.1)
    with pytest.raises(ValueError, match="samples: expected more than 2, found 2"):
        fit_free_contact(np.array([0, 1e-3]), np.array([0, 0.1]), R)
    with pytest.raises(ValueError, match="at least 2 samples in contact, found 0"):
        fit_study(np.array([-1e-3, -2e-3]), np.array([0.0, 0.0]), R)


@pytest.mark.parametrize(("depth_mm", "place"), [(7.0, "below"), (-9.0, "above")])
def test_a_press_that_begins_far_from_the_surface(depth_mm, place):
    depth = np.array([-0.02, depth_mm * 1e-3, depth_mm * 1e-3 + 0.001])
    with pytest.raises(ValueError, match=f"found it {abs(depth_mm)} mm {place} in frame 1"):
        check_contact(depth, 1)
    check_contact(depth - depth[1] + 0.001, 1)
