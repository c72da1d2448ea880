"""What the offset of two clocks is found with: a relaxing contact, held to a fine quadrature."""

import numpy as np
import pytest
from palpate.vision.clock import (
    BASELINE_STD_N,
    CURVATURE_STD_PER_M,
    SHARED,
    _between,
    _Press,
    _telling,
)

FRAMES_S, SPEED_M_S = np.arange(0, 3.01, 0.1), 0.002


def relaxed(time_s, elastic, share, times_s):
    """Force of Maxwell elements, each with a part of the share, by small steps."""
    force = (1 - share) * elastic
    for tau in times_s:
        held = np.zeros(len(time_s))
        for k in range(1, len(time_s)):
            step = time_s[k] - time_s[k - 1]
            middle = np.exp(-step / (2 * tau))
            held[k] = held[k - 1] * middle**2 + (elastic[k] - elastic[k - 1]) * middle
        force = force + share / len(times_s) * held
    return force


def press():
    time = np.arange(0, 3.001, 0.01)
    depth = SPEED_M_S * FRAMES_S - 0.001
    return _Press(time, np.zeros(len(time)), 0.01, FRAMES_S, depth, np.full(len(depth), 1e-4))


def force_of(of, parameters):
    return of._force(parameters[:SHARED], parameters[SHARED:])


def test_force_of_a_relaxing_contact():
    """Offset 20 ms, contact at half a millimetre, 0.6 of the curvature's deviation, 0.15 + 0.3."""
    time = np.arange(0, 3.0001, 0.001)
    x = np.maximum(SPEED_M_S * np.clip(time - 0.02, 0, 3) - 0.001 - 0.0005, 0)
    elastic = 4e4 * x**1.5 * (1 + 0.6 * CURVATURE_STD_PER_M * x)
    expected = relaxed(time, elastic, 0.15 + 2 * 0.15, (0.3, 3.0)) + 0.4 * BASELINE_STD_N
    parameters = np.r_[2.0, np.log(4e4), 0.5, 0.6, 2.0, 0.4, np.zeros(len(FRAMES_S))]
    found = force_of(press(), parameters)
    assert found == pytest.approx(expected[::10], abs=1e-3 * expected.max())


def test_each_frames_depth_is_an_unknown():
    of = press()
    parameters = np.r_[0, np.log(4e4), 0.5, 0, -1.0, 0, np.zeros(len(FRAMES_S))]
    deeper = parameters.copy()
    deeper[6:] = 2.0
    # All of them deeper by two deviations of 0.1 mm: as a contact that much higher.
    higher = parameters.copy()
    higher[2] = 0.3
    assert force_of(of, deeper) == pytest.approx(force_of(of, higher))


def test_residuals_are_in_deviations():
    of = press()
    parameters = np.r_[1.5, np.log(4e4), 0.5, 0.6, -0.2, 0.4, np.arange(len(FRAMES_S)) / 10]
    found = of.residual(parameters, 0.01)
    assert found[: len(of.time_s)] == pytest.approx(force_of(of, parameters) * of.weights)
    assert found[len(of.time_s)] == pytest.approx(1.5)
    assert found[len(of.time_s) + 1 :] == pytest.approx(parameters[3:])
    # Samples farther than 30 ms from all frames, which come every 100 ms, count nothing.
    away = np.abs(of.time_s[:, None] - FRAMES_S).min(axis=1)
    clear = np.abs(away - 0.03) > 1e-6
    assert np.array_equal(of.weights[clear] > 0, (away < 0.03)[clear])


def test_a_start_goes_through_the_deepest():
    of = press()
    of.force_n[-1] = 2.0
    start = of.start(0.001)
    # From 1 mm to 5 mm.
    assert np.exp(start[1]) * 0.004**1.5 == pytest.approx(2.0)
    assert start[2] == pytest.approx(1.0)
    assert not np.delete(start, [1, 2]).any() and len(start) == 6 + len(FRAMES_S)


def test_frames_that_tell():
    few = np.ones(120)
    assert np.array_equal(_telling(few), np.arange(120))
    # A press of 30 in 600: with a dozen frames beside it.
    late = np.zeros(600)
    late[400:430] = 1.0
    assert np.array_equal(_telling(late), np.arange(388, 442))
    # A long hold: its rise, and as much beside it.
    held = np.zeros(600)
    held[200:] = np.linspace(1, 0.5, 400)
    held[190:201] = np.linspace(0.2, 1.1, 11)
    assert np.array_equal(_telling(held), np.arange(178, 213))
    slow = np.zeros(600)
    slow[100:500] = np.linspace(0.2, 1.0, 400)
    chosen = _telling(slow)
    assert len(chosen) <= 120 and np.ptp(np.diff(chosen)) == 0
    assert chosen[0] == 88 and chosen[-1] > 499


def test_samples_between_the_first_and_the_last_frame():
    time = np.arange(10.0)
    found = _between(time, 2 * time, np.array([1.5, 4.0, 7.5]))
    assert found[0].tolist() == [2, 3, 4, 5, 6, 7]
    assert found[1].tolist() == [4, 6, 8, 10, 12, 14]
    # Of fifty thousand, means of three.
    time = np.arange(50_003) / 1e4
    means = _between(time, time**2, np.array([-1.0, 9.0]))
    assert len(means[0]) == 16_667
    assert means[0][:2] == pytest.approx([1e-4, 4e-4])
    assert means[1][0] == pytest.approx((0 + 1 + 4) / 3 * 1e-8)
