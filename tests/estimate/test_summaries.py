"""What a mixture, a profile or a correlogram comes to, by hand or by counting every pair."""

from types import SimpleNamespace

import numpy as np
import pytest
from palpate.estimate.direct.motion_noise import LAG_M, correlogram
from palpate.estimate.hertz.mixture import Mixture
from palpate.estimate.hertz.options import Beliefs
from palpate.estimate.hertz.range import HertzRange
from palpate.estimate.hertz.record import Record, forces_along, held_record
from palpate.estimate.hertz.relaxation import _moments, _quantile, _summary, verdict
from palpate.estimate.minimise.least_squares import _rooted
from palpate.estimate.minimise.profile import _best_modulus, _interval, _with_minimum
from palpate.estimate.minimise.scatter import correlation_length, error_clusters, rounding_of
from palpate.solid.laws import engineering_from_lame
from scipy.stats import norm

RECORD = Record(np.arange(6.0), np.arange(6) * 1e-3 - 1e-3, np.arange(6.0), 4, 1e-4, 1e-4, 0.01)


def mixture():
    return Mixture(
        law=np.array([0, 0, 1]),
        amplitudes=np.array([[0.0, 0.0], [0.2, 0.1], [0.0, 0.4]]),
        log_likelihood=np.array([0.0, 1.0, 2.0]),
        weights=np.array([0.5, 0.3, 0.2]),
        found=np.array([[20e3, 1e-4, 0.01, 0], [24e3, 2e-4, 0.02, 0], [30e3, 4e-4, 0.05, 0]]),
        covariance=np.stack([np.diag([1e6, 1e-10, 0, 0])] * 2 + [np.diag([4e6, 4e-10, 0, 0])]),
        chi_square=np.array([8.0, 6.0, 9.0]),
        taken=np.array([0.0, 0.2, 0.3]),
        residual_n=np.array([[0.01] * 6, [0.02] * 6, [0.0] * 6]),
    )


def test_moments_and_quantiles_of_a_mixture():
    weights, means = np.array([0.25, 0.75]), np.array([1.0, 5.0])
    mean, std = _moments(weights, means, np.array([1.0, 4.0]))
    assert (mean, std) == pytest.approx((4.0, np.sqrt(0.25 * (1 + 9) + 0.75 * (4 + 1))))
    stds = np.array([0.5, 2.0])
    for level in (0.025, 0.5, 0.975):
        found = _quantile(weights, means, stds, level)
        assert weights @ norm.cdf(found, means, stds) == pytest.approx(level)


def test_a_fit_in_numbers():
    of, beliefs = mixture(), Beliefs(law_std=0.03, at_s=1.0)
    found = _summary(RECORD, of, np.array([0.1, 0.4]), np.array([0.5, 2.0]), beliefs)
    # The law's own scale beside each point's deviation.
    std = np.hypot([1e3, 1e3, 2e3], 0.03 * of.found[:, 0])
    medians = [found.reduced_modulus_pa, *found.reduced_modulus_interval_pa]
    for value, level in zip(medians, (0.5, 0.025, 0.975), strict=True):
        assert of.weights @ norm.cdf(value, of.found[:, 0], std) == pytest.approx(level)
    left = 1 - of.amplitudes @ (1 - np.exp(-1 / np.array([0.5, 2.0])))
    medians = [found.later_reduced_modulus_pa, *found.later_reduced_modulus_interval_pa]
    for value, level in zip(medians, (0.5, 0.025, 0.975), strict=True):
        chance = of.weights @ norm.cdf(value, of.found[:, 0] * left, std * left)
        assert chance == pytest.approx(level)
    mean = of.weights @ of.found[:, 0]
    variance = of.weights @ (std**2 + (of.found[:, 0] - mean) ** 2)
    assert found.reduced_modulus_std_pa == pytest.approx(np.sqrt(variance))
    assert (found.relaxed_share, found.relaxed_share_interval) == (0.0, (0.0, 0.3))
    assert found.fractions == pytest.approx((0.06, 0.03 + 0.08))
    assert found.poisson_ratio == pytest.approx(0.8 * 0.1 + 0.2 * 0.4)
    assert found.poisson_ratio_std == pytest.approx(0.3 * np.sqrt(0.8 * 0.2))
    assert found.contact_depth_m == pytest.approx(1.9e-4)
    spread = of.weights @ (of.found[:, 1] - 1.9e-4) ** 2 + 0.8 * 1e-10 + 0.2 * 4e-10
    assert found.contact_depth_std_m == pytest.approx(np.sqrt(spread))
    assert found.law_growth == pytest.approx(0.021)
    assert found.chi_square_per_sample == pytest.approx(6 / 4)
    assert found.rms_n == pytest.approx(0.011)
    assert (found.later_s, found.times_s) == (1.0, (0.5, 2.0))


@pytest.mark.parametrize(
    ("evidence", "held", "word"),
    [(9.0, False, "no hold"), (1.0, True, "undecided"), (-1.0, True, "undecided")]
    + [(1.2, True, "relaxes"), (-1.2, True, "none seen")],
)
def test_evidence_of_three_to_one(evidence, held, word):
    assert verdict(SimpleNamespace(log_evidence=evidence), held=held) == word


def test_correlation_of_every_pair():
    rng = np.random.default_rng(4)
    places = rng.uniform(0, 0.02, (40, 3)) * [1, 1, 0]
    noise = rng.normal(size=(7, 40))
    noise[:, 3] = np.nan
    noise[2, 10:20] = np.nan
    distance, found = correlogram(places, noise)
    sums, counts, ways, pairs = np.zeros((4, len(distance)))
    for a in range(40):
        for b in range(a):
            way = np.linalg.norm(places[a] - places[b])
            step = int(way / LAG_M)
            product = noise[:, a] * noise[:, b]
            sums[step] += np.nansum(product)
            counts[step] += np.isfinite(product).sum()
            ways[step] += way
            pairs[step] += 1
    some = counts > 0
    assert np.array_equal(np.isfinite(found), some) and np.array_equal(np.isfinite(distance), some)
    assert found[some] == pytest.approx((sums[some] / counts[some]) / np.nanmean(noise**2))
    assert distance[some] == pytest.approx(ways[some] / pairs[some])


def test_directions_that_agree_up_to_a_distance():
    """Along a line, gaps of one direction for 9 mm and of another beyond: the end of a bin."""
    x = np.arange(0, 0.03, 0.0003)
    points = np.column_stack([x, 0 * x, 0 * x])
    gaps = np.where((x // 0.009 % 2 == 0)[:, None], [1.0, 0, 0], [0, 0, 2.0])
    found = correlation_length(points, gaps, bin_m=0.001)
    cosines = [
        np.mean([(gaps[i] @ gaps[j]) > 0 for i in range(100) for j in range(i) if near(x, i, j, k)])
        for k in range(30)
    ]
    first = next(k for k, cosine in enumerate(cosines) if cosine < 0.1)
    assert found == pytest.approx(0.001 * first)
    assert 0.004 < found < 0.012
    assert correlation_length(points, gaps * (-1.0) ** np.arange(100)[:, None], bin_m=0.001) == 0


def near(x, i, j, k):
    return int((x[i] - x[j]) / 0.001) == k


def test_cells_of_a_grid():
    nodes = np.array([[0.0, 0, 0], [0.9, 0, 0], [1.1, 0, 0], [0.1, 1.5, 0], [1.9, 0.5, 0.5]])
    found = error_clusters(nodes, size_m=1.0)
    assert found[0] == found[1] and found[2] == found[4]
    assert len(np.unique(found)) == 3
    assert rounding_of(np.array([[3.0, 0, 4], [0, 1, 0]])) == pytest.approx(0.003)


def parabola(lam, mu):
    """An error that is least at E = 20 kPa and nu = 0.3, with the two entwined."""
    E, nu = engineering_from_lame(lam, mu)
    return 1e-3 + (np.log(E / 20e3) - (nu - 0.3)) ** 2 + 4 * (nu - 0.3) ** 2


def test_the_best_modulus_for_a_ratio():
    for nu in (0.1, 0.3, 0.45):
        E, error = _best_modulus(parabola, nu, (1e3, 1e6))
        assert pytest.approx(20e3 * np.exp(nu - 0.3), rel=1e-5) == E
        assert error == pytest.approx(1e-3 + 4 * (nu - 0.3) ** 2)
    assert _best_modulus(parabola, 0.3, (1e3, 1e4))[0] == pytest.approx(1e4, rel=1e-3)


def test_the_interval_ends_where_the_error_has_risen_so_far():
    def profile(nu):
        return 20e3, 1e-3 + 4 * (nu - 0.3) ** 2

    nus = np.linspace(0, 0.48, 9)
    grid, found = _with_minimum(nus, [profile(nu) for nu in nus], profile)
    assert len(grid) == 9 and len(found) == 9
    off = np.array([0.0, 0.1, 0.27, 0.36, 0.48])
    grid, found = _with_minimum(off, [profile(nu) for nu in off], profile)
    assert np.diff(grid).min() > 0 and grid[3] == pytest.approx(0.3, abs=1e-5)
    assert [error for _, error in found] == pytest.approx([profile(nu)[1] for nu in grid])
    errors = [error for _, error in found]
    assert _interval(grid, errors, profile, 0.01) == pytest.approx((0.25, 0.35))
    assert _interval(grid, errors, profile, 0.09) == pytest.approx((0.15, 0.45))
    assert _interval(grid, errors, profile, 0.2) == (pytest.approx(0.3 - 0.05**0.5), 0.48)
    assert _interval(grid, errors, profile, 0.5) == (0.0, 0.48)


def test_gaps_over_the_root_of_their_length():
    """Their square is the rounded length; derivatives by differences along a line."""
    rng = np.random.default_rng(6)
    gap, slope = rng.normal(size=(5, 3)), rng.normal(size=(5, 3, 2))
    found, turned = _rooted(gap, slope, 0.2)
    length = np.sqrt((gap**2).sum(axis=1) + 0.2**2)
    assert (found**2).sum(axis=1) == pytest.approx((gap**2).sum(axis=1) / length)
    for k, step in enumerate(1e-6 * np.eye(2)):
        ends = [_rooted(gap + sign * slope @ step, slope, 0.2)[0] for sign in (1, -1)]
        assert turned[..., k] == pytest.approx((ends[0] - ends[1]) / 2e-6, abs=1e-7)


def test_a_record_and_its_hold():
    """At rest to the third sample, loaded to the seventh, held to the tenth, then let go."""
    depth = np.array([-3, -2, -1, -0.5, 0.5, 1, 2, 2.02, 1.98, 2.01, 1.2, 0]) * 1e-3
    along = np.array([0.6, 0, -0.8])
    force = np.outer(np.maximum(depth, 0) * 500, along)
    force[:3] = np.diag([0.01, 0.02, 0.03])
    force[6:10] += np.outer([1, -1, 1, -1], [0.08, 0, 0.06])
    given = {"frame_std_m": 2e-5}
    found = forces_along(depth, force, HertzRange(4, 6), **given)
    assert found == pytest.approx(force @ along)
    record = held_record(
        np.arange(12.0), depth, force, HertzRange(4, 6), contact_std_m=1e-4, **given
    )
    assert record.deepest == 6 and record.time_s.tolist() == [*range(10)]
    assert np.array_equal(record.depth_m, depth[:10]) and record.force_n == pytest.approx(
        found[:10]
    )
    # Each component of the rest about its own mean, over two degrees of freedom.
    variance = np.mean([(2 / 3) * c**2 / 2 for c in (0.01, 0.02, 0.03)])
    assert record.force_std_n == pytest.approx(np.sqrt(variance))
    assert (record.frame_std_m, record.contact_std_m) == (2e-5, 1e-4)
    early = held_record(
        np.arange(12.0), depth, force, HertzRange(3, 6), contact_std_m=1e-4, **given
    )
    assert early is None
