"""The study's filter to the letter, and the smoother that does not lag."""

import numpy as np
import pytest
from palpate.vision.kalman import filter_tip, smooth, study_filter

OPTIONS = {"measurement_std_m": 3e-4, "acceleration_std_m_s2": 0.05}


def test_study_filter_by_hand():
    # P0 = 0 gives gain 0, then P = 1 gives 1/11, then P = 10/11 + 1 gives 21/131.
    found = study_filter(np.array([[1.0], [2.0], [2.0], [3.0]])).ravel()
    second = 1 + 1 / 11
    assert found == pytest.approx([1, 1, second, second + 21 / 131 * (3 - second)])


def test_study_filter_lags_and_smoother_does_not():
    time_s = np.arange(60) / 6
    ramp = np.clip(time_s - 2, 0, 4)[:, None] * 0.002
    lag = np.abs(study_filter(ramp) - ramp)[20:34].max()
    frame = 0.002 / 6
    assert 2.4 * frame < lag < 3.0 * frame
    assert np.abs(smooth(time_s, ramp, **OPTIONS) - ramp).max() < 0.25 * frame


def test_smoother_reduces_noise_and_bridges_gaps():
    rng = np.random.default_rng(5)
    time_s = np.arange(80) / 6
    path = np.column_stack([0.002 * time_s, 0.01 + 0 * time_s, 0 * time_s])
    noisy = path + rng.normal(0, 3e-4, path.shape)
    noisy[30:33] = np.nan
    found = smooth(time_s, noisy, measurement_std_m=3e-4, acceleration_std_m_s2=0.005)
    assert (found - path).std() < 0.6 * 3e-4
    assert np.abs(found[30:33] - path[30:33]).max() < 6e-4


def test_unknown_method_is_refused():
    with pytest.raises(ValueError, match="method: expected study, smoother or none"):
        filter_tip(np.arange(3.0), np.zeros((3, 3)), method="best", **OPTIONS)
