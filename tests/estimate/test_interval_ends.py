"""Ends of the moduli's intervals, by hand and by draws: E is E* (1 - nu^2) at each nu."""

from types import SimpleNamespace

import numpy as np
import pytest
from palpate.estimate.direct.options import Fit
from palpate.estimate.direct.quantities import (
    BULK,
    NAMES,
    SHEAR,
    Profile,
    intervals,
    over_star,
    over_star_by_nu,
)
from scipy.stats import t

# At the quantile itself nu has its ends.
E_STAR, NORMAL = 30e3, t.ppf(0.975, 1e9)


def intervals_of(nu, stds, *, options=None, frames=50, correlation=0.0, table_std=0.0):
    """Intervals where log E*, nu and a share that relaxes within a second have these deviations.

    `table_std` is an error of nu beside them.
    """
    is_nu, later = np.array([(one == "poisson_ratio", one.endswith("1s_pa")) for one in NAMES]).T
    slopes = np.stack([1.0 - is_nu, np.where(is_nu, 1, over_star_by_nu(nu)), -1.0 * later], axis=1)
    log = np.log(E_STAR) + over_star(nu)
    values = np.where(is_nu, nu, log)
    covariance = np.diag(np.square(stds))
    covariance[[0, 1], [1, 0]] = correlation * stds[0] * stds[1]
    std = np.sqrt(np.einsum("qi,ij,qj->q", slopes, covariance, slopes))
    std = np.hypot(std, table_std * np.abs(slopes[:, 1]))
    best = SimpleNamespace(
        converged=True,
        options=options or Fit(),
        covariance=covariance,
        parameters=[SimpleNamespace(youngs_modulus_pa=E_STAR * (1 - nu**2), offset_m=0.0)],
        indentations=[SimpleNamespace(frames=np.arange(frames), zero_std_m=1e-3)],
    )
    quantities = SimpleNamespace(values=values, slopes=slopes)
    budget = SimpleNamespace(freedom=np.full(7, 1e9), std=std)

    def at(ratios):
        z = (ratios - nu) / stds[1]
        moved = (correlation * stds[0] * z)[:, None] + (over_star(ratios).T - over_star(nu))
        return log + moved, z**2, np.zeros_like(moved)

    few, bounds = frames < 5 and not best.options.poisson_ratio, best.options.poisson_ratio_bounds
    half = NORMAL * stds[1]
    profile = Profile(np.array(bounds) if few else np.clip([nu - half, nu + half], *bounds), at)
    return intervals(best, quantities, budget, profile)


def test_e_follows_nu_and_what_is_independent_adds_in_squares():
    """E changes with nu at the same reduced modulus."""
    found = intervals_of(0.4, [0.0, 0.03, 0.0])
    nu, E = found["poisson_ratio"], found["youngs_modulus_pa"]
    ends = 0.4 + np.array([-1, 1]) * NORMAL * 0.03
    assert (nu.low, nu.high) == pytest.approx(ends)
    assert (E.high, E.low) == pytest.approx(E_STAR * (1 - ends**2))
    star = found["reduced_modulus_pa"]
    assert (star.low, star.value, star.high) == pytest.approx((E_STAR,) * 3)
    found = intervals_of(0.3, [0.04, 0.02, 0.03])
    ends = 0.3 + np.array([1, -1]) * NORMAL * 0.02
    with_nu = np.log((1 - ends**2) / (1 - 0.3**2))
    # To first order: E is not straight in nu.
    for name, half in (
        ("reduced_modulus_pa", np.full(2, NORMAL * 0.04)),
        ("youngs_modulus_pa", np.hypot(NORMAL * 0.04, with_nu)),
        ("youngs_modulus_1s_pa", np.hypot(NORMAL * 0.05, with_nu)),
    ):
        low, value, high = found[name].low, found[name].value, found[name].high
        assert np.log([value / low, high / value]) == pytest.approx(half, rel=0.01)


def test_intervals_end_at_the_range_of_nu_and_few_frames_leave_all_of_it():
    found = intervals_of(0.47, [0.0, 0.1, 0.0])
    low, E = 0.47 - NORMAL * 0.1, found["youngs_modulus_pa"]
    assert found["poisson_ratio"].high == 0.4999
    assert (E.low, E.high) == pytest.approx((E_STAR * (1 - 0.4999**2), E_STAR * (1 - low**2)))
    found = intervals_of(0.3, [0.01, 0.01, 0.0], frames=4)
    nu, E = found["poisson_ratio"], found["youngs_modulus_pa"]
    assert (nu.low, nu.high) == (0.0, 0.4999)
    assert E.low < E_STAR * (1 - 0.4999**2) and E.high > E_STAR
    shear, bulk = found[SHEAR], found[BULK]
    assert nu.verdict == shear.verdict == bulk.verdict == "not identified"
    assert bulk.high is None and shear.high > E_STAR / 2 and shear.low < E_STAR * 0.5001 / 2


def test_a_ratio_that_was_given_keeps_its_deviation_and_g_and_k_follow_it():
    """Not the table's error of nu, which what is known of nu leaves out."""
    options = Fit(poisson_ratio=0.35, poisson_ratio_std=0.02)
    for std, middle, half in ((0.019, 0.35, 0.02), (0.01, 0.34, 0.01)):
        nu = intervals_of(0.34, [0.0, std, 0.0], options=options)["poisson_ratio"]
        expected = 0.34, middle - NORMAL * half, middle + NORMAL * half
        assert (nu.value, nu.low, nu.high) == pytest.approx(expected)
    options = Fit(poisson_ratio=0.47, poisson_ratio_std=0.002)
    found = intervals_of(0.47, [0.001, 0.002, 0.0], options=options, table_std=0.01)
    ends = 0.47 + np.array([-1, 1]) * NORMAL * 0.002
    assert (found["poisson_ratio"].low, found["poisson_ratio"].high) == pytest.approx(ends)
    high = E_STAR * (1 - ends[1] ** 2) / (3 * (1 - 2 * ends[1]))
    assert found[BULK].high == pytest.approx(high, rel=0.01)
    assert found[SHEAR].low == pytest.approx(E_STAR * (1 - ends[1]) / 2, rel=0.01)


@pytest.mark.parametrize("correlation", [-0.9, 0.0, 0.9])
def test_shear_modulus_has_the_budgets_deviation_with_the_tables_error_of_nu(correlation):
    """The table moves nu at the same E*, whatever the fit moves along nu."""
    found = intervals_of(0.25, [0.02, 0.02, 0.0], correlation=correlation, table_std=0.08)[SHEAR]
    by_nu = over_star_by_nu(0.25)[NAMES.index(SHEAR)]
    fitted = 0.02**2 * (1 + by_nu**2 + 2 * correlation * by_nu)
    half = NORMAL * np.hypot(np.sqrt(fitted), 0.08 * by_nu)
    assert np.log(found.high / found.low) / 2 == pytest.approx(half, rel=0.05)


@pytest.mark.parametrize("correlation", [-0.8, 0.0, 0.6])
@pytest.mark.parametrize(("nu", "std"), [(0.3, 0.01), (0.3, 0.07), (0.42, 0.03), (0.15, 0.05)])
def test_shear_and_bulk_modulus_are_those_of_draws(nu, std, correlation):
    """Of log E* and nu that go together, so that log E and nu do: narrow and wide."""
    found = intervals_of(nu, [0.05, std, 0.0], correlation=correlation)
    cross, rng = correlation * 0.05 * std, np.random.default_rng(5)
    mean, covariance = [np.log(E_STAR), nu], [[0.05**2, cross], [cross, std**2]]
    log_star, ratio = rng.multivariate_normal(mean, covariance, size=400_000).T
    E = np.exp(log_star) * (1 - ratio**2)
    # What is beyond 1/2 cannot be squeezed at all.
    bulk = np.where(ratio < 0.5, E / (3 * (1 - 2 * ratio)), np.inf)
    for modulus, drawn in ((found[SHEAR], E / (2 * (1 + ratio))), (found[BULK], bulk)):
        low, middle, high = np.percentile(drawn, [2.5, 50, 97.5])
        assert modulus.value == pytest.approx(middle, rel=0.01)
        half = np.log([middle / modulus.low, modulus.high / middle])
        assert half == pytest.approx(np.log([middle / low, high / middle]), rel=0.05, abs=0.01)


def test_a_ratio_at_one_half_that_is_not_determined_leaves_g_and_k_finite():
    """K grows with nu without end there: what a linear part makes of an error is no interval."""
    found = intervals_of(0.4999, [0.05, 2.9, 0.0], table_std=0.03)
    shear, bulk = found[SHEAR], found[BULK]
    assert 0.2 * E_STAR < shear.low < shear.value < shear.high < 0.6 * E_STAR
    assert 0.2 * E_STAR < bulk.low < bulk.value and bulk.high is None


@pytest.mark.parametrize("end", [0.45, 0.4999])
def test_a_ratio_that_may_lie_at_its_range_s_end_leaves_the_bulk_modulus_open(end):
    """An end that a person chose says as little of K as 1/2 does."""
    options = Fit(poisson_ratio_bounds=(0.0, end))
    found = intervals_of(0.4, [0.02, 0.06, 0.0], options=options)
    assert found["poisson_ratio"].high == end
    assert found[BULK].high is None and found[BULK].verdict == "bounded"
    assert 0 < found[BULK].low < found[BULK].value
    # The ratio's end is G's.
    star = 1 - NORMAL * 0.02
    assert E_STAR * (1 - end) / 2 * star < found[SHEAR].low < E_STAR * (1 - end) / 2
    inside = intervals_of(0.3, [0.02, 0.02, 0.0], options=options)[BULK]
    assert inside.high > inside.value and inside.verdict == "identified"
