"""The information limit: what is told by residuals and priors alone."""

from dataclasses import replace

import numpy as np
import pytest
from bench_information import SHARINGS, errors_over_bound, made_up
from made_up_press import OPTIONS, RADIUS_M, press_of
from palpate.estimate.direct.blocks import blocks_of
from palpate.estimate.direct.budget import covariance_of
from palpate.estimate.direct.estimate import estimate_direct
from palpate.estimate.direct.indentation import Parameters, linearised, residuals
from palpate.estimate.direct.information import bound_of
from palpate.estimate.direct.options import ModelStd
from palpate.estimate.direct.prior import prior_of
from palpate.estimate.direct.quantities import LOG_E, NAMES, NU
from palpate.estimate.direct.regions import regions_of
from scipy.stats import chi2

E_AT, NU_AT = (NAMES.index(name) for name in ("youngs_modulus_pa", "poisson_ratio"))


@pytest.fixture(scope="module")
def told():
    return estimate_direct([press_of(25e3, 0.3, 1)], OPTIONS, radius_m=RADIUS_M)


def slopes_by_steps(best):
    """Derivatives of all residuals and priors by the unknowns, one step to each side."""
    (press,), (scale,) = best.indentations, best.scales
    times, prior = np.array(OPTIONS.relaxation_times_s), prior_of([press], OPTIONS)

    def all_of(vector):
        found = residuals(press, Parameters.of(vector), times_s=times)
        motion = found.motion / (scale.motion[0] * np.sqrt(scale.sharing[0]))
        return np.concatenate([found.depth, motion, prior.gaps(vector)])

    columns = []
    for k in range(len(best.vector)):
        step = np.zeros(len(best.vector))
        step[k] = 1e-6 if k in (LOG_E, NU) else 1e-7
        columns.append((all_of(best.vector + step) - all_of(best.vector - step)) / (2 * step[k]))
    return np.stack(columns, axis=1)


def test_the_bound_is_the_inverse_of_all_information(told):
    columns = slopes_by_steps(told.solution)
    size = np.linalg.norm(columns, axis=0)
    covariance = np.linalg.inv((columns / size).T @ (columns / size)) / np.outer(size, size)
    by_hand = np.sqrt(np.diag(covariance)[[LOG_E, NU]])
    assert told.bound[[E_AT, NU_AT]] == pytest.approx(by_hand, rel=0.01)


def test_what_the_table_adds_is_no_information_lost_in_the_bound(told):
    options = OPTIONS.changed(model_std=ModelStd(log_youngs_modulus=0.1, nu=0.1))
    doubted = estimate_direct([press_of(25e3, 0.3, 1)], options, radius_m=RADIUS_M)
    assert doubted.bound == pytest.approx(told.bound, rel=1e-6)
    nu = doubted.solution.parameters[0].poisson_ratio
    # E follows nu at the same E*.
    added = 0.1 * np.array([1, 2 * nu / (1 - nu**2)])
    assert doubted.budget.std[E_AT] == pytest.approx(
        np.linalg.norm([told.budget.std[E_AT], *added])
    )
    said = doubted.to_dict()["information"]["youngs_modulus_pa"]
    assert said["efficiency"] == pytest.approx(told.bound[E_AT] / doubted.budget.std[E_AT])
    assert said["efficiency"] < 0.9 * told.bound[E_AT] / told.budget.std[E_AT]


def test_outliers_cost_the_estimate_and_not_the_bound(told):
    """Thirty deviations off, each weighs about a quarter in the fit."""
    (press,), best = told.solution.indentations, told.solution
    side = np.where(press.cell_m[:, 0] > 0, 1, -1)
    outside = replace(press, moved_m=press.moved_m + 30 * press.moved_std_m * side)
    line = linearised(outside, *best.parameters, times_s=np.array(OPTIONS.relaxation_times_s))
    blocks = (blocks_of(outside, line, *best.scales),)
    far = replace(best, indentations=(outside,), blocks=blocks)
    assert bound_of(far, told.quantities, OPTIONS) == pytest.approx(told.bound, rel=1e-9)
    std = np.sqrt(np.diag(covariance_of(far, OPTIONS)))
    assert std[NU] > 1.1 * told.bound[NU_AT]


@pytest.mark.long
@pytest.mark.parametrize("sharing", SHARINGS)
def test_estimates_scatter_as_little_as_the_bound_allows(sharing):
    """Squares over the bound's within chi square's 99.9 %: a scatter of 0.56 to 1.49 times it."""
    draws = 24
    spread = (errors_over_bound(made_up(sharing), draws=draws) ** 2).sum(axis=0)
    low, high = chi2.ppf([0.0005, 0.9995], draws)
    assert ((low < spread) & (spread < high)).all()


def test_regions_add_up_and_are_those_of_the_covariance():
    """With both, the inverse is the covariance of log E and nu; of one kind there is less."""
    found = estimate_direct([press_of(25e3, 0.3, 13)], OPTIONS, radius_m=RADIUS_M)
    regions = regions_of(found.solution, found.options)
    covariance = np.linalg.inv(regions["both"])
    np.testing.assert_allclose(covariance, found.covariance[:2, :2], rtol=1e-3)
    for kind in ("force", "surface"):
        assert (np.linalg.eigvalsh(regions["both"] - regions[kind]) > 0).all()
    # What the tip's depth tells is E at each nu, not both.
    least, most = np.linalg.eigvalsh(regions["force"])
    assert 0 <= least < 1e-3 * most
    assert found.to_dict()["regions"]["both"] == regions["both"].tolist()
