"""Instantaneous modulus of a relaxing material: times, fit, verdicts and models."""

from dataclasses import replace

import numpy as np
import pytest
from palpate.estimate.hertz.indentation import (
    Indentation,
    Record,
    hold_end,
)
from palpate.estimate.hertz.laws import contact_law, finite_strain_factor
from palpate.estimate.hertz.models import fit_held, fit_models, recommended
from palpate.estimate.hertz.options import Beliefs, Hertz
from palpate.estimate.hertz.relaxation import fit_relaxation, relaxation_times, verdict
from palpate.estimate.hertz.shape import Shape
from palpate.estimate.relaxation import relaxed_force, relaxed_share

R, TRUTH, ONSET, DEEPEST = 0.00622, 27473.0, 9, 18
TERMS = {"fractions": [0.1, 0.08], "times_s": [0.33, 2.0]}
BELIEFS = Beliefs(share=0.3, none=0.1, law_std=0.02, at_s=1.0)


def law_of(nu):
    small = contact_law("sneddon", "bonded", radius_m=R, thickness_m=0.0475, nu=nu)
    return lambda depth: small(depth) * finite_strain_factor(depth / R, nu)


LAW = law_of(0.3)
LAWS = {0.3: LAW}


def record(*, terms=TERMS, frame_std_m=5e-5, contact_m=0.0, force_std_n=0.005, seed=None):
    """Nine frames of approach, nine of loading to 7.5 mm, seven held; noisy with a seed."""
    time = np.arange(25) / 6
    depth = np.clip((time - 1.45) * 0.005, -0.01, 0.0075)
    force = TRUTH * relaxed_force(time, LAW(depth), **terms)
    if seed is not None:
        rng = np.random.default_rng(seed)
        depth = depth + rng.normal(0, frame_std_m, 25)
        force = force + rng.normal(0, force_std_n, 25)
        contact_m += rng.normal(0, 1e-4)
    return Record(time, depth + contact_m, force, DEEPEST, frame_std_m, 1e-4, force_std_n)


def fitted(ours, *, beliefs=BELIEFS, laws=LAWS):
    times = relaxation_times(ours.time_s[ONSET:])
    return fit_relaxation(ours, laws, times_s=times, beliefs=beliefs)


def until_deepest(ours):
    end = DEEPEST + 1
    cut = {name: getattr(ours, name)[:end] for name in ("time_s", "depth_m", "force_n")}
    return replace(ours, **cut)


def test_precise_samples_give_modulus_share_and_contact():
    ours = record(frame_std_m=1e-6, force_std_n=1e-4, contact_m=3e-5)
    sure = BELIEFS.changed(law_std=1e-5)
    given = {"times_s": np.array(TERMS["times_s"]), "beliefs": sure}
    fit = fit_relaxation(ours, LAWS, **given)
    assert fit.reduced_modulus_pa == pytest.approx(TRUTH, rel=0.01)
    assert fit.contact_depth_m == pytest.approx(3e-5, abs=5e-6)
    later = TRUTH * (1 - relaxed_share(1.0, **TERMS))
    assert fit.later_reduced_modulus_pa == pytest.approx(later, rel=0.01)
    elastic = TRUTH * LAW(ours.depth_m[DEEPEST] - 3e-5)
    assert fit.relaxed_share == pytest.approx(1 - ours.force_n[DEEPEST] / elastic, abs=0.01)


@pytest.mark.parametrize("terms", [TERMS, {"fractions": [], "times_s": []}])
def test_intervals_hold_the_truth_as_often_as_they_say(terms):
    """Splits and times are not the fit's own, so that intervals may hold it more often."""
    sure = BELIEFS.changed(law_std=1e-3)
    found = [fitted(record(terms=terms, seed=seed), beliefs=sure) for seed in range(40)]
    later = TRUTH * (1 - relaxed_share(1.0, **terms))
    now = [low <= TRUTH <= high for low, high in (f.reduced_modulus_interval_pa for f in found)]
    after = [
        low <= later <= high for low, high in (f.later_reduced_modulus_interval_pa for f in found)
    ]
    assert np.mean(now) >= 0.9
    assert np.mean(after) >= 0.9
    centre = np.median([f.reduced_modulus_pa for f in found])
    assert centre == pytest.approx(TRUTH, rel=0.03)
    assert np.median([f.chi_square_per_sample for f in found]) == pytest.approx(1, abs=0.35)


def test_interval_is_wide_without_a_hold():
    held = record(seed=1)
    widths = []
    for ours in (held, until_deepest(held)):
        low, high = fitted(ours).reduced_modulus_interval_pa
        assert low < TRUTH < high
        widths.append(high / low - 1)
    assert widths[1] > 1.3 * widths[0]


def test_noise_beyond_what_is_stated_widens_the_interval():
    ours = record(seed=2, frame_std_m=2e-4)
    honest, boast = fitted(ours), fitted(replace(ours, frame_std_m=2e-5))
    assert honest.chi_square_per_sample < 2 < 10 < boast.chi_square_per_sample
    assert np.ptp(boast.reduced_modulus_interval_pa) > 0.6 * np.ptp(
        honest.reduced_modulus_interval_pa
    )


def test_the_prior_decides_little_where_the_record_says_much():
    def spread(ours):
        times = relaxation_times(ours.time_s[ONSET:])
        low, high = (
            fit_relaxation(
                ours, LAWS, times_s=times, beliefs=BELIEFS.changed(share=part * BELIEFS.share)
            ).reduced_modulus_pa
            for part in (0.5, 2.0)
        )
        return high / low - 1

    assert 0 <= spread(record(seed=3)) < 0.02
    assert spread(until_deepest(record(seed=3, frame_std_m=3e-4))) > 0.03


def test_verdicts():
    relaxes, rigid = fitted(record(seed=4)), fitted(record(terms={"fractions": [], "times_s": []}))
    assert verdict(relaxes, held=True) == "relaxes"
    assert verdict(rigid, held=True) == "none seen"
    # Three to one.
    for ratio, said in (
        (2.95, "undecided"),
        (3.05, "relaxes"),
        (0.34, "undecided"),
        (0.33, "none seen"),
    ):
        assert verdict(replace(rigid, log_evidence=np.log(ratio)), held=True) == said
    assert verdict(relaxes, held=False) == "no hold"


def test_scale_of_force_and_modulus_is_free():
    """Newton or kilonewton, the same shares: E* scales with the force."""
    ours = record(seed=5)
    bigger = replace(ours, force_n=1e3 * ours.force_n, force_std_n=1e3 * ours.force_std_n)
    one, other = fitted(ours), fitted(bigger)
    assert other.reduced_modulus_pa == pytest.approx(1e3 * one.reduced_modulus_pa, rel=1e-9)
    assert other.relaxed_share == pytest.approx(one.relaxed_share, rel=1e-9)


def test_times_span_the_contact():
    times = relaxation_times(np.arange(16) / 6)
    assert len(times) == 3
    assert times[[0, -1]] == pytest.approx([1 / 3, 2.5])
    assert np.ptp(np.diff(np.log(times))) == pytest.approx(0, abs=1e-12)
    assert len(relaxation_times(np.arange(4) / 6)) == 2
    assert len(relaxation_times(np.arange(4000) / 100)) == 4


def test_hold_ends_when_the_probe_rises():
    depth = np.r_[np.linspace(-1, 8, 10), 8.02, 7.9, 8.0, 7.0, 3.0, 8.0] * 1e-3
    assert hold_end(depth, 9, frame_std_m=5e-5) == 13
    assert hold_end(depth, 9, frame_std_m=3e-4) == 14
    assert hold_end(depth[:13], 9, frame_std_m=5e-5) == 13


def held(ours):
    depth, force = ours.depth_m[: DEEPEST + 1], ours.force_n[: DEEPEST + 1]
    press = Indentation(depth, force, force, ONSET, R, 0.0475, ours.contact_std_m)
    options = Hertz(assumed_poisson_ratio=0.3, relaxation=BELIEFS)
    models = fit_models(press, options)
    base = recommended(press, models)
    row, block = fit_held(press, ours, base, options)
    return base, row, block, recommended(press, [*models, row])


def test_a_round_bases_part_of_the_depth_is_no_strain():
    """A base as round as the sphere takes half of the depth: its finite strain is the sphere's."""
    ours = record(terms={"fractions": [], "times_s": []}, frame_std_m=1e-6, force_std_n=1e-4)
    half = np.maximum(ours.depth_m, 0) / 2
    small = 4 / 3 * np.sqrt(R) * half**1.5
    ours = replace(ours, force_n=TRUTH * small * finite_strain_factor(half / R, 0.25) ** 0.5)
    depth, force = ours.depth_m[: DEEPEST + 1], ours.force_n[: DEEPEST + 1]
    shape = Shape(support="round_foot", foot_curvature_per_m=1 / R)
    press = Indentation(depth, force, force, ONSET, R, 0.0475, 1e-6, shape=shape)
    options = Hertz(relaxation=BELIEFS.changed(none=0.999, law_std=1e-4))
    base = recommended(press, fit_models(press, options))
    row, _ = fit_held(press, ours, base, options)
    # Of what Poisson's ratio is, from 0 to a half, the force determines little.
    assert row["reduced_modulus_pa"] == pytest.approx(TRUTH, rel=0.03)


def test_a_hold_recommends_the_fit_with_relaxation():
    base, row, block, best = held(record(seed=7))
    assert (base["relaxation"], row["relaxation"], best["relaxation"]) == ("none", "prony", "prony")
    assert "relaxation prony" in best["rule"]
    assert block["verdict"] == "relaxes"
    assert block["held_s"] == pytest.approx(1.0)
    assert base["reduced_modulus_pa"] < 0.95 * TRUTH
    low, high = best["reduced_modulus_interval_pa"]
    assert low < TRUTH < high


def test_no_hold_keeps_the_effective_modulus_with_a_wider_interval():
    base, row, block, best = held(until_deepest(record(seed=8)))
    assert (row["relaxation"], best["relaxation"]) == ("unheld", "unheld")
    assert block["verdict"] == "no hold"
    assert best["reduced_modulus_pa"] == base["reduced_modulus_pa"] < 0.95 * TRUTH
    assert base["reduced_modulus_interval_pa"][1] < TRUTH < best["reduced_modulus_interval_pa"][1]


@pytest.mark.parametrize(("deviations", "shallow"), [(7.7, True), (8.3, False)])
def test_a_depth_of_eight_deviations_is_enough(deviations, shallow):
    """Else the interval holds what the depth's error does to E*, which goes as its power -3/2."""
    rigid = record(terms={"fractions": [], "times_s": []}, frame_std_m=0.0075 / deviations)
    base, row, block, best = held(replace(rigid, contact_std_m=1e-5))
    assert (block["verdict"] == "too shallow") is shallow
    assert (best["relaxation"] == "shallow") is shallow
    if shallow:
        assert best["reduced_modulus_pa"] == base["reduced_modulus_pa"]
        low, high = row["reduced_modulus_interval_pa"]
        assert low < TRUTH < high and high / low > np.exp(2 * 1.9 * 1.5 / deviations)


def test_a_zero_that_only_the_force_tells_makes_no_indentation_shallow():
    """A stated deviation of 1.2 mm, which the force leaves 0.1 mm of."""
    *_, block, best = held(replace(record(seed=12), contact_std_m=1.2e-3))
    assert (block["verdict"], best["relaxation"]) == ("relaxes", "prony")
    assert block["contact_depth_std_m"] < 2e-4
    low, high = best["reduced_modulus_interval_pa"]
    assert low < TRUTH < high


def test_laws_of_other_ratios_widen_the_interval_and_are_told_apart_by_precise_samples():
    laws = {nu: law_of(nu) for nu in (0.05, 0.3, 0.45)}
    noisy, precise = record(seed=9, frame_std_m=2e-4), record(frame_std_m=1e-6, force_std_n=1e-4)
    low, high = fitted(noisy, laws=laws).reduced_modulus_interval_pa
    alone = fitted(noisy).reduced_modulus_interval_pa
    assert low < TRUTH < high
    assert high - low > 1.2 * (alone[1] - alone[0])
    sure = fitted(precise, laws=laws, beliefs=BELIEFS.changed(law_std=1e-4))
    assert sure.poisson_ratio == pytest.approx(0.3, abs=0.01)
    assert fitted(noisy, laws=laws).poisson_ratio_std > 0.1


def test_joined_equal_laws_are_one_law():
    ours = record(seed=10, frame_std_m=2e-4)
    one, both = fitted(ours), fitted(ours, laws={0.3: LAW, 0.31: LAW})
    assert both.reduced_modulus_pa == pytest.approx(one.reduced_modulus_pa, rel=1e-6)
    assert both.log_evidence == pytest.approx(one.log_evidence, abs=1e-6)
    assert both.poisson_ratio == pytest.approx(0.305)


def test_a_law_that_fits_badly_has_no_say():
    ours = record(seed=11)
    laws = {0.3: LAW, 0.4: lambda depth: R * np.maximum(depth, 0)}
    one, both = fitted(ours), fitted(ours, laws=laws)
    assert both.reduced_modulus_interval_pa == pytest.approx(
        one.reduced_modulus_interval_pa, rel=1e-6
    )
    assert both.poisson_ratio == pytest.approx(0.3, abs=1e-6)


def test_bad_input_is_named():
    ours, times = record(), np.array([0.3, 1.0])
    for name in ("frame_std_m", "contact_std_m", "force_std_n"):
        with pytest.raises(ValueError, match=f"{name}: expected above 0, found 0"):
            fit_relaxation(replace(ours, **{name: 0.0}), LAWS, times_s=times, beliefs=BELIEFS)
    air = replace(ours, depth_m=ours.depth_m - 0.007)
    with pytest.raises(ValueError, match="depth_m: expected at least 4 samples in contact"):
        fit_relaxation(replace(air, depth_m=air.depth_m - 1), LAWS, times_s=times, beliefs=BELIEFS)
    with pytest.raises(ValueError, match="time_s: expected at least 4 samples in contact, found 3"):
        relaxation_times(np.arange(3.0))
