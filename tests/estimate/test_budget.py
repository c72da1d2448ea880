"""Each term of the uncertainty budget alone, against its first order by hand."""

from dataclasses import replace

import numpy as np
import pytest
from budget_by_hand import (
    APART,
    BESIDE,
    CAPTURE,
    DEPTH_M,
    FIELDS,
    FORCE_N,
    JUDGED,
    MEASURED,
    NO_SLIDING,
    NOISES,
    NOTHING,
    NU,
    SLOPES,
    TERMS,
    TRUTH,
    as_options_say,
    by_hand,
    by_place,
    covariance_by_hand,
    stacked,
)
from made_up_indentation import EXACT_TABLE, RADIUS_M, SIX_ERRORS
from palpate.estimate.direct import quantities
from palpate.estimate.direct.budget import budget_of
from palpate.estimate.direct.deviations import Scales, with_depth_errors
from palpate.estimate.direct.fit import Solution, held_at
from palpate.estimate.direct.indentation import OWN
from palpate.estimate.direct.options import BASE_SOURCE, TIP_SOURCE, UNSTATED, ProbeUncertainty
from palpate.report.budget_bars import SOURCES
from scipy.integrate import quad
from scipy.stats import chi2, halfnorm, t


def with_term(field, std):
    """A capture and options with noise and this term alone."""
    options, capture = NOTHING.changed(**BESIDE.get(field, {})), CAPTURE
    for name in ("rig", "model_std"):
        if hasattr(block := getattr(options, name), field):
            options = options.changed(**{name: block.changed(**{field: std})})
    if hasattr(options, field):
        options = options.changed(**{field: std})
    elif hasattr(capture, field):
        capture = replace(capture, **{field: np.zeros_like(getattr(capture, field)) + std})
    return options, as_options_say(capture, options)


def estimate(options, *captures, known=UNSTATED):
    """What the estimate says of captures at the truth, without a fit."""
    captures = tuple(with_depth_errors(one, TRUTH, options, likeliest=False) for one in captures)
    shared, own = np.split(TRUTH.vector, [-OWN])
    vector, scales = np.r_[shared, np.tile(own, len(captures))], (Scales(),) * len(captures)
    best = Solution(captures, options, vector, scales)
    moduli = quantities.quantities_of(best, radius_m=RADIUS_M)
    budget = budget_of(best, moduli, known, radius_m=RADIUS_M)
    # Of captures that are apart the truth is not where the cost is least.
    profile = quantities.Profile.of(held_at(best, NU), moduli, budget)
    return budget, quantities.intervals(best, moduli, budget, profile)


def budget(options, *captures, known=UNSTATED):
    return estimate(options, *captures, known=known)[0]


def line(budget, name):
    (found,) = (one for one in budget.sources if one.name == name)
    return found


# Errors that each capture has anew; of all others a further capture says next to nothing.
ANEW = {"force_zero_std_n", "force_drift_std_n", "depth_pattern_std_m", "shift_std_m", *MEASURED}


@pytest.mark.parametrize("field", sorted(FIELDS))
def test_a_term_alone_is_what_its_first_order_says(field):
    """And of two captures, which have the support and the camera's place in common.

    A new field has no case, and fails.
    """
    source, std, does = TERMS[field]
    alone = budget(*with_term(field, std))
    options, capture = with_term(field, std / 100)
    hardly, both = (budget(options, *[capture] * count) for count in (1, 2))
    assert alone.std[JUDGED] == pytest.approx(by_hand(**does(std)), rel=0.02)
    assert hardly.std[JUDGED] == pytest.approx(by_hand(**does(std / 100)), rel=0.02)
    assert (alone.std[JUDGED] > 1.1 * hardly.std[JUDGED]).any()
    assert line(alone, source).std > 0
    one, two = (line(found, source).contributions for found in (hardly, both))
    fewer, largest = np.sqrt(2) if field in ANEW else 1, int(np.argmax(one))
    assert two[largest] == pytest.approx(one[largest] / fewer, rel=0.08)


@pytest.mark.parametrize("count", [2, 6])
@pytest.mark.parametrize(("source", "errors"), [(TIP_SOURCE, np.eye(3)), (BASE_SOURCE, SIX_ERRORS)])
def test_tip_and_base_are_one_for_all_captures(source, errors, count):
    """Their error does not fall with their number, and what is left of the contact's place does."""
    root = {source: np.diag([0.0, 1e-6, 1e-6]) @ errors}
    capture = replace(CAPTURE, place_std_m=1e-6, shared_roots_m=root)
    one, all_of = budget(NOTHING, capture), budget(NOTHING, *[capture] * count)
    for name, fewer in ((source, 1), ("place of the contact", np.sqrt(count))):
        parts = [line(found, name).contributions[JUDGED] for found in (one, all_of)]
        at = int(np.argmax(parts[0]))
        assert parts[1][at] == pytest.approx(parts[0][at] / fewer, rel=0.08)
        assert line(all_of, name).std == pytest.approx(1e-6)


def test_the_base_adds_what_an_error_of_the_depth_and_of_the_place_add():
    """Of one capture; each of six errors moves both."""
    std_m = np.array([2e-4, 3e-3, 3e-3])
    base = {BASE_SOURCE: np.diag(std_m) @ SIX_ERRORS}
    found = budget(NOTHING, replace(CAPTURE, shared_roots_m=base))
    changes = [stacked(1.0, 0.0), *map(by_place, np.eye(2))]
    expected = by_hand(learnt=changes, known=np.diag([0, 0, *std_m**-2]))
    assert found.std[JUDGED] == pytest.approx(expected, rel=0.02)
    assert (expected > 1.1 * budget(NOTHING, CAPTURE).std[JUDGED]).any()


def test_the_report_explains_every_source():
    """Those that the other tests find in a budget, and no more."""
    shared_or_apart = {TIP_SOURCE, BASE_SOURCE, APART}
    assert {source for source, *_ in TERMS.values()} | shared_or_apart == set(SOURCES)


@pytest.mark.parametrize(
    "field", ["offset_std_m", "clock_std_s", "camera_clock_std_s", "shift_std_m", "place_std_m"]
)
def test_what_each_capture_has_for_itself_scatters_between_them(field):
    source, std, _ = TERMS[field]
    options, capture = with_term(field, 0.03 * std)
    assert APART not in {one.name for one in budget(options, capture).sources}
    found, without = budget(options, *[capture] * 3), budget(NOTHING, *[CAPTURE] * 3)
    noises = sum(line(without, name).contributions ** 2 for name in NOISES)
    factor = line(without, APART).contributions ** 2 / noises
    assert factor == pytest.approx(likely_excess(0.0, 2), rel=0.05)
    own = sum(line(found, name).contributions ** 2 for name in (source, *NOISES))
    assert line(found, APART).contributions ** 2 == pytest.approx(factor * own, rel=0.005)


def likely_excess(scatter, freedom):
    """Mean of tau^2: a half-normal prior of 0.5, and variances that scatter like chi squared."""

    def weight(tau):
        spread = 1 + tau**2
        likely = chi2.pdf(freedom * scatter / spread, freedom) / spread if scatter else 1.0
        return halfnorm.pdf(tau, scale=0.5) * (likely if scatter else spread ** (-freedom / 2))

    whole, _ = quad(weight, 0, 10, points=[0.5, 2])
    return quad(lambda tau: tau**2 * weight(tau), 0, 10, points=[0.5, 2])[0] / whole


def test_an_interval_is_student_s_quantile_of_what_the_budget_holds():
    """Each part of the data that errs by itself is a degree of freedom, as far as it counts."""
    budget, moduli = estimate(NOTHING, CAPTURE)
    covariance, design = covariance_by_hand()
    parts = (SLOPES @ covariance @ design.T) ** 2
    of_depths, of_motions = np.split(parts, [len(DEPTH_M)], axis=1)
    patches = np.broadcast_to(CAPTURE.cluster, CAPTURE.moved_m.shape).ravel()
    of_patches = np.stack([of_motions[:, patches == k].sum(1) for k in np.unique(patches)], axis=1)
    fourth = 0.0
    for shares in (of_depths, of_patches):
        count = np.maximum(shares.sum(axis=1) ** 2 / (shares**2).sum(axis=1), 4)
        fourth = fourth + shares.sum(axis=1) ** 2 / (count - 1)
    freedom = parts.sum(axis=1) ** 2 / fourth
    assert budget.freedom[JUDGED] == pytest.approx(freedom, rel=0.01)
    half = t.ppf(0.975, freedom) * np.sqrt(parts.sum(axis=1))
    star, nu = (moduli[name] for name in ("reduced_modulus_pa", "poisson_ratio"))
    ends = np.log([star.value / star.low, star.high / star.value])
    assert ends == pytest.approx(half[0], rel=0.01)
    assert [nu.value - nu.low, nu.high - nu.value] == pytest.approx([half[2]] * 2, rel=0.01)


def test_what_is_stated_of_a_probe_counts():
    found = budget(NOTHING, CAPTURE, known=ProbeUncertainty(compliance_std_m_n=2e-4))
    assert found.std[JUDGED] == pytest.approx(by_hand(2e-4 * stacked(FORCE_N, 0.0)), rel=0.02)
    rows = np.diag([1e-8, 1e-8, 4e-8]).tolist()
    said = ProbeUncertainty.of({"tip_covariance_m2": rows, "compliance_std_m_n": 1e-6})
    assert np.array_equal(said.tip_covariance_m2, rows) and said.compliance_std_m_n == 1e-6
    assert ProbeUncertainty.of({}) == UNSTATED


def test_base_friction():
    """None of a bonded or small base; of another uniform between sliding and sticking.

    A twelfth of the squared difference of log forces.
    """
    for softer in (NO_SLIDING, None, NO_SLIDING - 0.2 * CAPTURE.table.poisson_ratios[:, None]):
        std = 0.08 if softer is None or not softer.any() else 1e-6
        options = NOTHING.changed(model_std=EXACT_TABLE.changed(nu_loose=std))
        capture = replace(CAPTURE, table=replace(CAPTURE.table, softer=softer))
        found = budget(options, capture)
        names = {one.name for one in found.sources}
        assert (TERMS["nu_loose"][0] in names) == (softer is not None)
    contributions = line(found, TERMS["nu_loose"][0]).contributions
    assert contributions == pytest.approx(0.2 * NU / np.sqrt(12) * quantities.LOG_MODULI, abs=1e-4)


@pytest.mark.parametrize("count", [2, 3, 6])
def test_captures_that_are_apart(count):
    """Forces of other scales: E* is their mean, and knows it by their scatter.

    With as many degrees of freedom as captures less one (JCGM 100:2008, Eq. G.2b).
    """
    errors = np.linspace(-0.05, 0.05, count)
    apart = [replace(CAPTURE, force_n=CAPTURE.force_n * (1 + e)) for e in errors]
    for captures, variance in (([CAPTURE] * count, 0.0), (apart, errors.var(ddof=1) / count)):
        found, moduli = estimate(NOTHING, *captures)
        stated = sum(line(found, noise).contributions[0] ** 2 for noise in NOISES)
        expected = stated * likely_excess(variance / stated, count - 1)
        part = line(found, APART)
        assert part.contributions[0] ** 2 == pytest.approx(expected, rel=0.05)
        assert part.freedom == count - 1
    others = sum(one.contributions**4 / one.freedom for one in found.sources if one is not part)
    freedom = found.std**4 / (others + part.contributions**4 / (count - 1))
    star, modulus = quantities.NAMES.index("reduced_modulus_pa"), moduli["reduced_modulus_pa"]
    half = t.ppf(0.975, freedom[star]) * found.std[star]
    ends = np.log([modulus.value / modulus.low, modulus.high / modulus.value])
    assert ends == pytest.approx([half] * 2, rel=0.01)
    # Without them noise alone would have degrees of freedom.
    assert half > 1.03 * t.ppf(0.975, found.std[star] ** 4 / others[star]) * found.std[star]
