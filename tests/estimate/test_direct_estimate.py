"""Moduli, intervals and information of made-up indentations."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from made_up_indentation import (
    EXACT_TABLE,
    OPTIONS,
    RADIUS_M,
    indentation_of,
    made_up_table,
    random_cells,
)
from palpate import direct
from palpate.estimate.direct.estimate import estimate_direct
from palpate.estimate.direct.quantities import NAMES
from palpate.estimate.direct.result import regions_of


def estimate(*captures, options=OPTIONS):
    return estimate_direct(captures, options, radius_m=RADIUS_M)


@pytest.fixture(scope="module")
def found():
    return estimate(indentation_of(25e3, 0.3, 13))


def test_a_small_depth_does_not_determine_nu():
    small = indentation_of(25e3, 0.3, 1, maximum_depth_m=4e-4, least_m=5e-5)
    nu = estimate(small).moduli["poisson_ratio"]
    assert nu.verdict == "not identified"
    assert (nu.low, nu.high) == pytest.approx((0.0, 0.4999))


def test_what_was_measured_and_what_was_fitted(found):
    (one,), capture = found.captures(), indentation_of(25e3, 0.3, 13)
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
    capture = indentation_of(25e3, 0.3, 13)
    model = EXACT_TABLE.changed(log_youngs_modulus=0.1, nu=0.1)
    other = estimate(capture, options=OPTIONS.changed(model_std=model))
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
        estimate(indentation_of(25e3, 0.3, 1), options=options)


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
        options = OPTIONS.changed(poisson_ratio_bounds=bounds)
        return estimate_direct([capture], options, radius_m=RADIUS_M).moduli

    free, held = moduli(0.0, 0.49), [moduli(nu, nu + 1e-6) for nu in (0.0, 0.12, 0.24, 0.36, 0.48)]
    assert free["poisson_ratio"].verdict == "not identified"
    for name in ("effective_reduced_modulus_pa", "youngs_modulus_pa", "reduced_modulus_pa"):
        each = np.array([(one[name].low, one[name].value, one[name].high) for one in held])
        assert 0.98 * each[:, 0].min() <= free[name].low <= 1.01 * each[:, 1].min()
        assert 0.99 * each[:, 1].max() <= free[name].high <= 1.02 * each[:, 2].max()
