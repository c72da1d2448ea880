"""The grid of relaxing shares: each point's least squares, weights and evidence, worked out."""

import numpy as np
import pytest
from palpate.estimate.hertz.indentation import Record
from palpate.estimate.hertz.laws import parabola_force
from palpate.estimate.hertz.mixture import (
    _columns,
    _force_std,
    _relaxed,
    _weights,
    freedom,
    joined,
    settled,
)
from palpate.estimate.hertz.options import Beliefs
from palpate.estimate.hertz.relaxation_prior import amplitude_grid
from palpate.estimate.relaxation import relaxed_force
from scipy.stats import multivariate_normal

R, TIMES_S = 0.006, np.array([0.3, 2.0])
BELIEFS = Beliefs(share=0.3, none=0.1, law_std=0.05)


def law(depth_m):
    return parabola_force(depth_m, R)


@pytest.fixture(scope="module")
def record():
    rng = np.random.default_rng(3)
    time = np.arange(14) / 5
    depth = np.clip(time * 0.003 - 0.0012, -0.002, 0.004)
    force = 20e3 * relaxed_force(time, law(depth), fractions=[0.15, 0.1], times_s=TIMES_S)
    return Record(time, depth, force + rng.normal(0, 0.003, 14), 9, 3e-5, 2e-4, 0.004)


def test_columns_are_slopes_of_the_elastic_force(record):
    found = _columns(record, law, 1e-4, 20e3)
    depth = record.depth_m - 1e-4
    assert found[:, 0] == pytest.approx(law(depth))
    assert found[:, 1] == pytest.approx(
        -20e3 * 1.5 * law(depth) / np.where(depth, depth, 1), rel=1e-3
    )
    # The law grows by half of its error from the middle of the press to its end.
    part = np.clip(depth / depth.max(), 0, 1) - 0.5
    assert found[:, 2] == pytest.approx(20e3 * law(depth) * part)


def test_a_frames_own_depth_moves_its_force(record):
    found = _force_std(record, law, 1e-4, 20e3)
    depth = record.depth_m - 1e-4
    rise = np.where(depth > 1e-4, 20e3 * 1.5 * law(depth) / np.where(depth, depth, 1) * 3e-5, 0)
    deep = depth > 3e-4
    assert found[deep] == pytest.approx(np.hypot(0.004, rise)[deep], rel=1e-3)
    assert found[depth < -1e-4] == pytest.approx(0.004)


def test_every_column_relaxes(record):
    columns = _columns(record, law, 0.0, 20e3)
    grid = np.array([[0.0, 0.0], [0.2, 0.1]])
    found = _relaxed(record.time_s, columns, TIMES_S, grid)
    assert found[0] == pytest.approx(columns)
    expected = relaxed_force(record.time_s, columns, fractions=grid[1], times_s=TIMES_S)
    assert found[1] == pytest.approx(expected)


def test_each_point_is_the_least_squares_of_force_and_what_is_known(record):
    """At the settled contact, with scipy's density of the record as its likelihood."""
    mixture = settled(record, law, TIMES_S, BELIEFS)
    mean = mixture.weights @ mixture.found
    assert mixture.weights.sum() == pytest.approx(1)
    columns = _columns(record, law, mean[1], mean[0])
    std = _force_std(record, law, mean[1], mean[0])
    known = np.array([2e-4, 0.05, 0.004])
    chances = []
    for k in (0, len(mixture.amplitudes) // 2):
        shares = mixture.amplitudes[k]
        design = relaxed_force(record.time_s, columns, fractions=shares, times_s=TIMES_S)
        design = np.column_stack([design, np.ones(14)])
        rows = np.vstack([design / std[:, None], np.diag(1 / np.r_[1, known])[1:]])
        wanted = np.r_[record.force_n / std, -mean[1] / known[0], 0, 0]
        best = np.linalg.lstsq(rows, wanted, rcond=None)[0]
        assert mixture.found[k] == pytest.approx(best + [0, mean[1], 0, 0], rel=1e-3, abs=1e-6)
        left = record.force_n - design @ best
        assert mixture.residual_n[k] == pytest.approx(left, abs=1e-5)
        chi = ((wanted - rows @ best) ** 2).sum()
        assert mixture.chi_square[k] == pytest.approx(chi, rel=1e-3)
        excess = max(mixture.chi_square.min() / 12, 1.0)
        expected = np.linalg.inv(rows.T @ rows) * excess
        assert mixture.covariance[k] == pytest.approx(expected, rel=0.01)
        gone = 1 - design[9, 0] / columns[9, 0]
        assert mixture.taken[k] == pytest.approx(gone, abs=1e-4)
        spread = design[:, 1:] * known
        density = multivariate_normal.logpdf(
            record.force_n,
            design[:, 0] * best[0] - design[:, 1] * mean[1],
            np.diag(std**2) + spread @ spread.T,
        )
        # All of the modulus's values are as likely.
        evidence = density + 0.5 * np.log(expected[0, 0])
        chances.append(evidence - mixture.log_likelihood[k])
    assert freedom(record) == 12 and excess == 1
    assert chances[0] == pytest.approx(chances[1], abs=0.02)


def test_weights_of_none_and_of_what_relaxes():
    amplitudes = np.array([[0.0, 0], [0.1, 0], [0.1, 0.2], [0, 0.3]])
    found = _weights(np.array([0.0, 0, np.log(2), 0]), amplitudes, BELIEFS)
    # A tenth for none, the rest evenly, one of them twice as likely.
    parts = np.array([0.1, 0.3, 0.6, 0.3])
    assert found == pytest.approx(parts / parts.sum())


def test_evidence_for_relaxation(record):
    mixture = settled(record, law, TIMES_S, BELIEFS)
    none = ~mixture.amplitudes.any(axis=1)
    chance = np.exp(mixture.log_likelihood - mixture.log_likelihood.max())
    expected = np.log(chance[~none].mean() / chance[none].mean())
    assert mixture.log_evidence == pytest.approx(expected)
    assert none.sum() == 1 and len(none) == 1 + len(amplitude_grid(2, scale=0.3))


def test_laws_beside_each_other_are_weighed_by_what_they_leave(record):
    def other(depth_m):
        return law(depth_m) * (1 + 400 * np.maximum(depth_m, 0))

    parts = [settled(record, one, TIMES_S, BELIEFS) for one in (law, other)]
    both = joined(record, parts, BELIEFS)
    assert len(both.weights) == sum(len(part.weights) for part in parts)
    assert np.array_equal(np.unique(both.law), [0, 1])
    first, second = (both.weights[both.law == k].sum() for k in (0, 1))
    assert first + second == pytest.approx(1) and first > second
    # The scatter is that of the law that fits best.
    best = min(max(part.chi_square.min() / 12, 1.0) for part in parts)
    for k, part in enumerate(parts):
        own = max(part.chi_square.min() / 12, 1.0)
        assert both.covariance[both.law == k] == pytest.approx(part.covariance * best / own)
