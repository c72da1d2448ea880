"""The joint fit of made-up indentations: moduli, intervals and information."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from made_up_indentation import (
    EXACT_TABLE,
    OPTIONS,
    RADIUS_M,
    START,
    UNBONDED,
    indentation_of,
    made_up_table,
    random_cells,
)
from palpate import direct
from palpate.estimate.direct.deviations import ROBUST, sharing_of, with_depth_errors
from palpate.estimate.direct.estimate import estimate_direct
from palpate.estimate.direct.fit import fit_direct
from palpate.estimate.direct.indentation import OWN, Parameters, residuals
from palpate.estimate.direct.prior import prior_of
from palpate.estimate.direct.quantities import NAMES
from palpate.estimate.direct.result import regions_of

TIMES_S = np.array(OPTIONS.relaxation_times_s)
# Material-law parameters that are known to be those of the neo-Hookean solid.
NEO_HOOKEAN = OPTIONS.changed(force_law_std=1e-3, motion_law_std=1e-3)


def fitted(*captures, options=OPTIONS):
    return fit_direct(captures, options, START).parameters[0]


@pytest.mark.parametrize("scale", [1.0, 7.0])
def test_exact_data_give_the_moduli_back(scale):
    """Where all forces are larger, so is E and nothing else."""
    capture = indentation_of(25e3, 0.3, 1, noise=0.0)
    capture = replace(
        capture, force_n=scale * capture.force_n, force_std_n=scale * capture.force_std_n
    )
    found = fitted(capture, options=OPTIONS.changed(fraction_std=10.0, fraction_step_std=10.0))
    assert found.youngs_modulus_pa == pytest.approx(scale * 25e3, rel=2e-3)
    assert found.poisson_ratio == pytest.approx(0.3, abs=1e-3)
    assert found.fractions == pytest.approx([0.08, 0.05], abs=5e-3)


def cost_by_hand(best, vector):
    """Minus twice the log density of residuals, with robust displacements, and the prior's."""
    shared, *own = np.split(vector, OWN * np.arange(-len(best.indentations), 0))
    total = (prior_of(best.indentations, OPTIONS).gaps(vector) ** 2).sum()
    for one, scale, mine in zip(best.indentations, best.scales, own, strict=True):
        gaps = residuals(one, Parameters(np.append(shared, mine), TIMES_S))
        soft = np.sqrt(1 + (gaps.motion / (ROBUST * scale.motion)) ** 2) - 1
        total += (gaps.depth**2).sum() + 2 * ROBUST**2 * soft.sum() / scale.sharing
    return total


def test_the_fit_is_the_minimum_of_the_cost():
    best = fit_direct(
        [indentation_of(25e3, 0.3, seed, support=UNBONDED) for seed in (1, 2)], OPTIONS, START
    )
    least = cost_by_hand(best, best.vector)
    assert best.cost_at(best.vector, best.scales) == pytest.approx(least)
    deviations = best.std
    for k in range(len(deviations)):
        step = 0.2 * deviations[k] * np.eye(len(deviations))[k]
        ends = [cost_by_hand(best, best.vector + sign * step) - least for sign in (-1, 1)]
        assert min(ends) > 0 and ends[0] == pytest.approx(ends[1], rel=0.2)


def test_a_known_clock_offset_is_found():
    """The force's clock was moved by 25 ms: what is known of it is that the clocks agree."""
    late = indentation_of(25e3, 0.3, 1, noise=0.2, amplitudes=(0.0, 0.0), delay_s=0.025)
    expected = replace(late, clock_expected_s=0.025)
    right, wrong = (fitted(one, options=NEO_HOOKEAN) for one in (expected, late))
    assert right.clock_s == pytest.approx(0.025, abs=0.005)
    assert right.youngs_modulus_pa == pytest.approx(25e3, rel=0.02)
    assert wrong.clock_s < right.clock_s


@pytest.mark.parametrize("times", [1, 3, 10])
def test_deviations_that_are_found_are_those_of_the_errors(times):
    """Of depths and displacements, that scatter as is stated or by more."""
    capture = indentation_of(25e3, 0.3, 5)
    rng, more = np.random.default_rng(5), np.sqrt(times**2 - 1)
    noisy = replace(
        capture,
        depth_m=capture.depth_m + more * rng.normal(0, capture.tip_std_m, len(capture.depth_m)),
        moved_m=capture.moved_m + more * rng.normal(0, capture.noise_std_m),
    )
    best = fit_direct([noisy], OPTIONS, START)
    (found,), (scale,) = best.indentations, best.scales
    stated = with_depth_errors(capture, best.parameters[0], OPTIONS, likeliest=False).depth_std_m
    expected = np.hypot(stated, more * capture.tip_std_m)
    assert 0.65 < np.median(found.depth_std_m / expected) < 1.5
    # Depths that err by themselves are not taken for such as err together.
    together = np.sqrt(np.diag(found.depth_root_m @ found.depth_root_m.T, 1))
    assert np.median(together / expected[1:]) < 0.5
    motion = np.median(found.moved_std_m) * scale.motion * np.sqrt(scale.sharing)
    assert motion == pytest.approx(times * capture.noise_std_m[0, 0], rel=0.05)


def test_displacements_that_err_by_how_far_they_move():
    """With a variance in proportion, and one in a hundred thirty times as far off."""
    capture, rng = indentation_of(25e3, 0.3, 5), np.random.default_rng(5)
    more = 1e-5 * np.abs(capture.moved_m)
    error = rng.normal(0, np.sqrt(more)) * np.where(rng.random(more.shape) < 0.01, 30, 1)
    best = fit_direct([replace(capture, moved_m=capture.moved_m + error)], OPTIONS, START)
    found = best.indentations[0].moved_std_m * best.scales[0].motion
    expected = np.sqrt(capture.noise_std_m**2 + more)
    for here in (more > np.quantile(more, 0.9), more < np.quantile(more, 0.1)):
        assert np.median(found[here] / expected[here]) == pytest.approx(1, abs=0.15)


@pytest.mark.parametrize(
    ("patch", "frame", "both"),
    [(0, 0, 0), (0.2, 0, 0), (0, 0.2, 0), (0.2, 0.2, 0), (0, 0, 0.7), (0.2, 0.2, 0.7)],
)
def test_displacements_of_a_patch_or_a_frame_that_err_together(patch, frame, both):
    """A patch has two motions in each frame: 1 + their number times the variance they share."""
    rng, frames, patches = np.random.default_rng(3), 60, 120
    shape, cluster = (frames, 2 * patches), np.repeat(np.arange(patches), 2)
    common = rng.normal(0, patch, patches)[cluster] + rng.normal(0, frame, (frames, 1))
    common = common + rng.normal(0, both, (frames, patches))[:, cluster]
    gaps = rng.normal(0, np.sqrt(1 - both**2), shape) + common
    capture = SimpleNamespace(seen=np.ones(shape, dtype=bool), cluster=cluster)
    slope = np.column_stack([np.ones(gaps.size), np.zeros(gaps.size), rng.normal(size=gaps.size)])
    line = SimpleNamespace(motion=gaps.ravel(), motion_slope=slope)
    expected = 1 + both**2 + 120 * patch**2 + 240 * frame**2
    assert sharing_of(capture, line, 1.0) == pytest.approx(expected, rel=0.25)


def test_a_contact_that_was_seen_beside_its_table_is_expected_there():
    capture = indentation_of(25e3, 0.3, 3, beside_m=(0.0015, 0.0), motion_std_m=1e-3)
    seen = replace(capture, place_expected_m=np.array([0.0015, 0.0]))
    found = [fitted(one).place_m[0] for one in (capture, seen)]
    assert found[1] == pytest.approx(0.0015, abs=2e-4)
    assert found[0] < 0.0012


def estimate(*captures, options=OPTIONS):
    return estimate_direct(captures, options, radius_m=RADIUS_M)


MEASURED = indentation_of(25e3, 0.3, 13)


@pytest.fixture(scope="module")
def found():
    return estimate(MEASURED)


def test_a_small_depth_does_not_determine_nu():
    small = indentation_of(25e3, 0.3, 1, maximum_depth_m=4e-4, least_m=5e-5)
    nu = estimate(small).moduli["poisson_ratio"]
    assert nu.verdict == "not identified"
    assert (nu.low, nu.high) == pytest.approx((0.0, 0.4999))


def test_what_was_measured_and_what_was_fitted(found):
    (one,), capture = found.captures(), MEASURED
    assert np.array_equal(one.force_n, capture.force_n[capture.frames])
    moved = one.tip_depth_m[capture.frames] - capture.tip_depth_m[capture.frames]
    assert one.depth_m - capture.depth_m == pytest.approx(moved) and (moved != 0).all()
    assert np.std(one.fitted_depth_m - one.depth_m) < 2 * np.median(capture.depth_std_m)
    left, expected = one.moved_m - one.fitted_moved_m, one.moved_expected_std_m
    assert np.array_equal(np.isnan(left), ~capture.seen)
    assert np.array_equal(np.isnan(expected), ~capture.seen)
    # The middle half of normal residuals is within 0.67 deviations.
    assert np.nanmedian(np.abs(left) / expected) == pytest.approx(0.67, abs=0.05)


def test_the_budget_is_the_covariance(found):
    """Contributions add up in squares to what the normal equations say of the moduli."""
    slopes, budget = found.quantities.slopes, found.budget
    whole = np.sqrt(np.diag(slopes @ found.solution.covariance @ slopes.T))
    # Noise that scatters by more than was stated adds to it.
    assert (budget.std >= whole * (1 - 1e-3)).all() and (budget.std <= whole * 1.5).all()
    rows = pd.DataFrame(budget.rows())
    parts = rows["contribution_log_effective_reduced_modulus"]
    assert parts.is_monotonic_decreasing
    assert np.linalg.norm(parts) == pytest.approx(budget.std[0])
    product = rows["sensitivity_poisson_ratio"] * rows["standard_uncertainty"]
    assert product.to_numpy() == pytest.approx(rows["contribution_poisson_ratio"].to_numpy())


def test_what_the_table_adds_is_no_information_lost_in_the_bound(found):
    model = EXACT_TABLE.changed(log_youngs_modulus=0.1, nu=0.1)
    other = estimate(MEASURED, options=OPTIONS.changed(model_std=model))
    assert other.bound == pytest.approx(found.bound, rel=1e-6)
    assert (found.bound <= found.budget.std * (1 + 1e-3)).all()
    nu, at = other.solution.parameters[0].poisson_ratio, NAMES.index("youngs_modulus_pa")
    # E follows nu at the same E*.
    added = 0.1 * np.array([1, 2 * nu / (1 - nu**2)])
    assert other.budget.std[at] == pytest.approx(np.linalg.norm([found.budget.std[at], *added]))
    said = other.to_dict()["information"]["youngs_modulus_pa"]
    assert said["efficiency"] == pytest.approx(found.bound[at] / other.budget.std[at])


def test_regions_add_up_and_are_those_of_the_covariance(found):
    """With both, the inverse is the covariance of log E and nu; of one kind there is less."""
    regions = regions_of(found.solution)
    covariance = np.linalg.inv(regions["both"])
    np.testing.assert_allclose(covariance, found.solution.covariance[:2, :2], rtol=1e-3)
    for kind in ("force", "surface"):
        assert (np.linalg.eigvalsh(regions["both"] - regions[kind]) > 0).all()
    # Indentation depths determine E at each nu, not both.
    least, most = np.linalg.eigvalsh(regions["force"])
    assert 0 <= least < 1e-3 * most


def test_poisson_s_ratio_ends_with_the_table():
    capture = indentation_of(25e3, 0.45, 1)
    by_ratio = "poisson_ratios force_per_modulus_m2 stiffening motion_m motion_change_m"
    short = {name: getattr(capture.table, name)[:3] for name in by_ratio.split()}
    short["motion_by_place"] = capture.table.motion_by_place[:, :3]
    found = estimate(replace(capture, table=replace(capture.table, **short)))
    assert found.moduli["poisson_ratio"].high == 0.35


def test_a_force_that_begins_far_from_the_surface_is_not_judged():
    """A diameter for a radius of 6 mm: every depth is 6 mm too much."""
    capture = indentation_of(25e3, 0.3, 1)
    found = estimate(replace(capture, depth_m=capture.depth_m + 0.006, offset_std_m=1e-3))
    assert len(found.warnings) == 1
    assert {one.verdict for one in found.moduli.values()} == {"not judged"}


def test_bad_input(tmp_path):
    one = SimpleNamespace(capture=SimpleNamespace(folder=tmp_path / "08"))
    with pytest.raises(ValueError, match="measured: expected each capture once, found 08 again"):
        direct.estimate([one, one], [])
    with pytest.raises(ValueError, match="indentations: expected one or more, found none"):
        estimate()
    options = OPTIONS.changed(poisson_ratio_bounds=(0.4, 0.1))
    with pytest.raises(ValueError, match="poisson_ratio_bounds: expected low below high"):
        estimate(MEASURED, options=options)


def test_intervals_follow_the_fits_at_each_nu_where_none_is_excluded():
    """They hold the moduli of fits with nu held, and reach no farther than the intervals of these.

    E* is not straight in nu, as on thin or unbonded objects.
    """
    cell = random_cells(np.random.default_rng(3))
    table = made_up_table(cell)
    bent = 1 - 0.8 * table.poisson_ratios[:, None] ** 2
    table = replace(table, force_per_modulus_m2=bent * table.force_per_modulus_m2)
    capture = indentation_of(25e3, 0.4, 3, solid=(cell, table, table), motion_std_m=5e-3)

    def moduli(*bounds):
        return estimate(capture, options=OPTIONS.changed(poisson_ratio_bounds=bounds)).moduli

    free, held = moduli(0.0, 0.49), [moduli(nu, nu + 1e-6) for nu in (0.0, 0.12, 0.24, 0.36, 0.48)]
    assert free["poisson_ratio"].verdict == "not identified"
    for name in ("effective_reduced_modulus_pa", "youngs_modulus_pa", "reduced_modulus_pa"):
        each = np.array([(one[name].low, one[name].value, one[name].high) for one in held])
        assert 0.98 * each[:, 0].min() <= free[name].low <= 1.01 * each[:, 1].min()
        assert 0.99 * each[:, 1].max() <= free[name].high <= 1.02 * each[:, 2].max()
