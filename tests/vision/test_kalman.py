"""The study's filter to the letter, and the smoother that does not lag."""

import numpy as np
import pytest
from palpate.vision.kalman import smooth_tip, study_filter


def smoothed(time_s, values, std, acceleration_m_s2):
    """One coordinate, with deviations that hold all of the measurements' errors."""
    tips, stds = (np.column_stack([column] * 3) for column in (values, std))
    return smooth_tip(time_s, tips, stds, acceleration_std_m_s2=acceleration_m_s2)[:, 1]


def test_study_filter_by_hand():
    # P0 = 0 gives gain 0, then P = 1 gives 1/11, then P = 10/11 + 1 gives 21/131.
    found = study_filter(np.array([[1.0], [2.0], [2.0], [3.0]])).ravel()
    second = 1 + 1 / 11
    assert found == pytest.approx([1, 1, second, second + 21 / 131 * (3 - second)])


def test_study_filter_lags_and_smoother_does_not():
    time_s = np.arange(60) / 6
    ramp = np.clip(time_s - 2, 0, 4) * 0.002
    lag = np.abs(study_filter(ramp[:, None])[:, 0] - ramp)[20:34].max()
    frame = 0.002 / 6
    assert 2.4 * frame < lag < 3.0 * frame
    found = smoothed(time_s, ramp, np.full(60, 3e-4), 0.05)
    assert np.abs(found - ramp).max() < 0.25 * frame


def test_smoother_reduces_noise_and_bridges_gaps():
    rng, time_s, std = np.random.default_rng(5), np.arange(80) / 6, np.full(80, 3e-4)
    for speed in (0.002, 0.0):
        path = speed * time_s
        noisy = path + rng.normal(0, std)
        noisy[30:33] = np.nan
        found = smoothed(time_s, noisy, std, 0.005)
        assert (found - path).std() < 0.6 * 3e-4
        assert np.abs(found[30:33] - path[30:33]).max() < 6e-4


def test_smoother_is_the_likeliest_path():
    """Of all starts and accelerations, each constant between two frames, by least squares."""
    rng = np.random.default_rng(2)
    time_s, acceleration = np.cumsum(rng.uniform(0.1, 0.3, 9)), 0.4
    std, values = rng.uniform(0.01, 0.03, 9), rng.normal(0, 0.05, 9)
    values[[0, 4]] = np.nan
    # Place and speed over start, speed and eight accelerations.
    place, speed = np.zeros((2, 9, 10))
    place[0, 0] = speed[0, 1] = 1
    for k, step in enumerate(np.diff(time_s)):
        place[k + 1] = place[k] + step * speed[k]
        speed[k + 1] = speed[k]
        place[k + 1, 2 + k], speed[k + 1, 2 + k] = step**2 / 2, step
    seen = np.isfinite(values)
    scale = np.r_[1, 1, np.full(8, acceleration)]
    rows = np.concatenate([place[seen] / std[seen, None], np.diag(1 / scale)])
    wanted = np.r_[values[seen] / std[seen], values[1], np.zeros(9)]
    likeliest = place @ np.linalg.lstsq(rows, wanted, rcond=None)[0]
    assert smoothed(time_s, values, std, acceleration) == pytest.approx(likeliest, abs=1e-9)


def test_frames_that_are_known_better_count_more():
    time_s, std = np.arange(40) / 6, np.full(40, 5e-4)
    std[::4] = 1e-5
    noisy = np.random.default_rng(1).normal(0, std)
    assert np.abs(smoothed(time_s, noisy, std, 0.005)).max() < 1e-4
