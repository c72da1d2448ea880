"""Deviations of depths, priors and scatter of residuals, held to densities worked out in full."""

from dataclasses import replace

import numpy as np
import pytest
from made_up_press import NO_RIG, STANDING, START, press_of
from palpate.estimate.direct.deviations import (
    NOISES,
    PATTERNS,
    _likeliest,
    robust_scale,
    robust_weights,
    with_depth_errors,
)
from palpate.estimate.direct.indentation import OWN, SHARED, depth_noise
from palpate.estimate.direct.options import Fit
from palpate.estimate.direct.prior import parameter_bounds, prior_of, scaled_inverse
from palpate.estimate.hertz.scatter import deviation, effective_samples, freedom
from scipy.stats import multivariate_normal

OPTIONS = Fit(
    relaxation_times_s=(0.3, 1.0, 3.0),
    force_law_std=0.4,
    motion_law_std=0.8,
    gain_std=0.02,
    fraction_std=0.1,
    fraction_step_std=0.05,
    rig=NO_RIG,
)


@pytest.mark.parametrize("seed", range(3))
def test_the_likeliest_multiples_are_those_of_the_whole_density(seed):
    rng = np.random.default_rng(seed)
    place = np.linspace(0, 4, 18)
    alike = 0.5 * np.exp(-(np.subtract.outer(place, place) ** 2) / 2)
    spread = np.column_stack([np.ones(18), place]) * [3.0, 0.7]
    covariance = np.diag(np.full(18, 2.0**2)) + 4.0**2 * alike + spread @ spread.T
    gap = rng.multivariate_normal(np.zeros(18), covariance)
    chances = [
        [
            multivariate_normal.logpdf(
                gap, cov=noise**2 * np.eye(18) + pattern**2 * alike + spread @ spread.T
            )
            for pattern in PATTERNS
        ]
        for noise in NOISES
    ]
    i, j = np.unravel_index(np.argmax(chances), np.shape(chances))
    assert _likeliest(gap, spread, alike) == (NOISES[i], PATTERNS[j])


def test_depths_of_the_same_place_and_time_err_together():
    press, options = press_of(25e3, 0.3, 1), OPTIONS.changed(relaxation_times_s=(0.3, 3.0))
    found = with_depth_errors(press, START, options, likeliest=False)
    covariance = found.depth_root_m @ found.depth_root_m.T
    noise = depth_noise(press, START, times_s=np.array(options.relaxation_times_s))
    assert np.diag(covariance) == pytest.approx(noise**2 + press.pattern_std_m**2)
    time, way = press.time_s[press.frames], press.depth_m
    i, j = 3, 5
    apart = ((way[i] - way[j]) / 0.002) ** 2 / 2 + abs(time[i] - time[j]) / 2.0
    assert covariance[i, j] == pytest.approx(press.pattern_std_m**2 * np.exp(-apart))
    likeliest = with_depth_errors(press, START, options, likeliest=True)
    larger = likeliest.depth_root_m @ likeliest.depth_root_m.T
    assert (np.diag(larger) >= np.diag(covariance) * (1 - 1e-9)).all()


def test_soft_absolute_values():
    assert robust_weights(np.array([0.0, 16.0, -24.0]), 2.0) == pytest.approx(
        [1, 0.5**0.5, 1 / np.sqrt(1 + 1.5**2)]
    )
    rng = np.random.default_rng(1)
    assert robust_scale(rng.normal(0, 3, 4001)) == pytest.approx(3, rel=0.05)
    assert robust_scale(np.array([])) == 1.0 and robust_scale(np.zeros(3)) == 1e-9


# Further equations, which are no errors of single unknowns.
KNOWN = ("relaxing shares of neighbouring times", "Poisson's ratio")


def test_priors_are_those_of_the_errors():
    """Covariance of the unknowns beforehand; the captures' own come last."""
    pressed = replace(
        press_of(25e3, 0.3, 1, support=STANDING),
        clock_expected_s=0.02,
        place_expected_m=np.array([1e-3, 0.0]),
        tip_root_m=np.diag([3e-4, 2e-4, 1e-4]),
    )
    turned = replace(pressed, tip_axes=np.eye(3)[[0, 2, 1]])
    prior = prior_of([pressed, turned], OPTIONS.changed(poisson_ratio=0.3))
    size, own = SHARED + 3 + 2 * OWN, SHARED + 3
    assert prior.rows.shape[1] == size
    information = prior.information + np.diag(np.r_[1.0, np.zeros(size - 1)])
    covariance, std = np.linalg.inv(information), OPTIONS.poisson_ratio_std
    assert covariance[1, 1] == pytest.approx(std**2)
    assert covariance[2, 2] == pytest.approx(OPTIONS.force_law_std**2, rel=1e-5)
    assert covariance[4, 4] == pytest.approx(OPTIONS.gain_std**2, rel=1e-5)
    first, second = own + np.arange(OWN), own + OWN + np.arange(OWN)
    # Depth's zeros and places: of each capture, and of the tip, which is one for both.
    zeros = np.r_[first[0], first[5:7], second[0], second[5:7]]
    tip = np.concatenate([np.diag([3e-4, 2e-4, 1e-4]), turned.tip_axes @ pressed.tip_root_m])
    alone = np.tile([pressed.offset_std_m, 5e-4, 5e-4], 2)
    expected = np.diag(alone**2) + tip @ tip.T
    assert covariance[np.ix_(zeros, zeros)] == pytest.approx(expected, rel=1e-4, abs=1e-12)
    # Clocks are each capture's, the picture's place and the base one for both.
    for at, alike in ((1, 0), (7, 1), (8, 1), (9, 1), (10, 1)):
        part = covariance[np.ix_([first[at], second[at]], [first[at], second[at]])]
        assert part / part[0, 0] == pytest.approx(np.array([[1, alike], [alike, 1]]), abs=1e-5)
    mean = np.linalg.solve(information, prior.rows.T @ prior.values)
    assert mean[[first[1], first[5], second[6]]] == pytest.approx([0.02, 1e-3, 0.0], abs=1e-9)
    assert mean[1] == pytest.approx(0.3)
    found = {one.name: one for one in prior.errors}
    assert found["rocking"].unit == "rad" and found["sinking"].unit == "m"
    assert found["tip of the probe"].std == pytest.approx(3e-4)
    # Errors of all sources, and nothing else, make the covariance of what has no data.
    moves = np.concatenate([one.response for one in prior.errors if one.name not in KNOWN])
    assert np.diag(moves.T @ moves)[2:5] == pytest.approx(np.diag(prior.information)[2:5])


def test_ranges_of_the_unknowns():
    low, high = parameter_bounds(2, OPTIONS)
    assert len(low) == SHARED + 3 + 2 * OWN == len(high)
    assert np.exp([low[0], high[0]]) == pytest.approx(OPTIONS.youngs_modulus_bounds_pa)
    assert (low[1], high[1]) == OPTIONS.poisson_ratio_bounds
    shares = slice(SHARED, SHARED + 3)
    assert not low[shares].any() and high[shares] == pytest.approx(np.full(3, 0.95 / 3))
    assert (low[SHARED - 1], high[SHARED - 1]) == (0, 1)
    others = np.r_[2 : SHARED - 1, SHARED + 3 : len(low)]
    assert (low[others] == -np.inf).all() and (high[others] == np.inf).all()


def test_covariance_of_unknowns_of_many_orders():
    root = np.diag([1e-6, 1.0, 1e5]) @ np.array([[1.0, 0, 0], [0.5, 2, 0], [0.1, -0.7, 3]])
    covariance = root @ root.T
    assert scaled_inverse(np.linalg.inv(covariance)) == pytest.approx(covariance, rel=1e-6)


def test_independent_samples_of_a_first_order_process():
    """Its lag-1 autocorrelation r leaves (1 - r)/(1 + r) of them."""
    rng, values = np.random.default_rng(2), np.zeros(20_000)
    for k in range(1, len(values)):
        values[k] = 0.6 * values[k - 1] + rng.normal()
    assert effective_samples(values) == pytest.approx(20_000 * 0.4 / 1.6, rel=0.05)
    assert effective_samples(rng.normal(size=20_000)) == pytest.approx(20_000, rel=0.05)
    assert effective_samples((-1.0) ** np.arange(100)) == 100
    # By hand: 1, 1, -1, -1 has a lag-1 autocorrelation of 1/4, less its bias of (1 + 1)/4.
    few = np.array([1.0, 1, -1, -1])
    assert effective_samples(few) == pytest.approx(4 * 0.25 / 1.75)
    # Of a steady drift five are left.
    assert effective_samples(np.linspace(-1, 1, 1000)) == pytest.approx(5)


def test_freedom_and_deviation_of_few_samples():
    few = np.array([1.0, 1, -1, -1])
    assert freedom(few, 1) == pytest.approx(4 * 0.75)
    assert deviation(few, 1) == pytest.approx(np.sqrt(4 / (4 / 7 * 0.75)))
    drift = np.linspace(-1, 1, 1000)
    assert freedom(drift, 2) == pytest.approx(5 * 0.998)
