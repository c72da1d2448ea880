"""Direct estimate on presses whose moduli are known."""

from dataclasses import replace
from types import SimpleNamespace

import matplotlib.pyplot as plt
import numpy as np
import pytest
from made_up_press import (
    NO_RIG,
    OPTIONS,
    RADIUS_M,
    SHARE_TIMES_S,
    SHARES,
    STANDING,
    START,
    model_of,
    press_of,
    sliding,
)
from palpate import direct
from palpate.estimate.direct import fit
from palpate.estimate.direct.blocks import Scales, blocks_of
from palpate.estimate.direct.budget import covariance_of
from palpate.estimate.direct.deviations import (
    LEAST_NOISE,
    robust_weights,
    variance_parts,
    with_depth_errors,
    with_pattern,
)
from palpate.estimate.direct.estimate import estimate_direct
from palpate.estimate.direct.fit import fit_direct
from palpate.estimate.direct.indentation import (
    Parameters,
    linearised,
    residuals,
)
from palpate.estimate.direct.options import Fit, ModelStd
from palpate.estimate.direct.quantities import NAMES
from palpate.estimate.direct.regions import regions_of
from palpate.estimate.direct.result import youngs_after
from palpate.estimate.direct.rig import rig_errors
from palpate.estimate.direct.support_motion import rocking_axes, support_axes_of
from palpate.estimate.relaxation import relaxed_share
from palpate.solid.support import Support


def test_exact_data_give_the_moduli_back():
    indentation = press_of(25e3, 0.3, 1, noise=0.0)
    options = OPTIONS.changed(fraction_std=10.0, fraction_step_std=10.0)
    found = fit_direct([indentation], options, START).parameters[0]
    assert found.youngs_modulus_pa == pytest.approx(25e3, rel=2e-3)
    assert found.poisson_ratio == pytest.approx(0.3, abs=1e-3)
    assert found.fractions == pytest.approx([0.08, 0.05], abs=5e-3)


def test_derivatives_are_those_of_the_residuals():
    indentation = press_of(25e3, 0.3, 1, support=STANDING)
    axis = np.arange(len(indentation.cell_m)) % 3
    table = sliding(indentation.cell_m)
    by_place = table.motion_by_place[:2]
    table = replace(table, motion_by_place=np.concatenate([by_place, by_place * (axis > 0)]))
    indentation = replace(indentation, table=table, axis=axis)
    support_motion = np.array([2e-5, 3e-4, -1e-4])
    of = Parameters(
        *(24e3, 0.28, 0.2, -0.3, 0.01, np.array([0.05, 0.03]), 1e-4, 2e-3),
        shift_m=np.array([1e-5, -2e-5, 3e-5]),
        place_m=np.array([2e-4, -3e-4]),
        picture_m=np.array([-1e-4, 4e-4]),
        support_motion=support_motion,
        foot=0.4,
    )
    times = np.array(OPTIONS.relaxation_times_s)
    line = linearised(indentation, of, times_s=times)
    steps = [1e-5] * 8 + [1e-7, 1e-4] + [1e-7] * 3 + [1e-6] * 4 + [1e-7, 1e-5, 1e-5]
    assert len(steps) == len(of.vector)
    for k, step in enumerate(steps):
        ends = []
        for sign in (-1, 1):
            vector = of.vector
            vector[k] += sign * step
            ends.append(residuals(indentation, Parameters.of(vector), times_s=times))
        for name in ("depth", "motion"):
            slope = (getattr(ends[1], name) - getattr(ends[0], name)) / (2 * step)
            found = getattr(line, f"{name}_slope")[:, k]
            assert np.abs(found - slope).max() <= 1e-4 * np.abs(slope).max() + 1e-5


def test_a_clock_that_was_set_wrong_before_is_set_right():
    """The force's clock was moved by 25 ms: what is known of it is that the clocks agree."""
    late = press_of(25e3, 0.3, 1, noise=0.2, shares=(0.0, 0.0), late_s=0.025)
    told = replace(late, clock_expected_s=0.025)
    known = OPTIONS.changed(force_law_std=1e-3, motion_law_std=1e-3)
    right, wrong = (fit_direct([one], known, START).parameters[0] for one in (told, late))
    assert right.clock_s == pytest.approx(0.025, abs=0.005)
    assert right.youngs_modulus_pa == pytest.approx(25e3, rel=0.02)
    # Taken for known before, it is drawn back to what the simpler contact said.
    assert wrong.clock_s < right.clock_s


def test_what_settles_is_no_modulus():
    indentation = press_of(25e3, 0.3, 1, noise=0.2, support=STANDING)
    support_motion = np.array([6e-5, 5e-4, -3e-4])
    samples = indentation.moved_m + indentation.load[:, None] * (
        indentation.support_axes.samples_m @ support_motion
    )
    sunk = replace(
        indentation,
        moved_m=samples,
        depth_m=indentation.depth_m + indentation.load * support_motion[0],
    )
    bonded = replace(sunk, support_axes=replace(sunk.support_axes, std=np.zeros(3)))
    free, held = (fit_direct([one], OPTIONS, START).parameters[0] for one in (sunk, bonded))
    assert free.support_motion == pytest.approx(support_motion, rel=0.25)
    assert np.abs(held.support_motion).max() < 1e-9
    assert abs(free.poisson_ratio - 0.3) < 0.02 < abs(held.poisson_ratio - 0.3)


def test_what_stands_sinks_along_its_support_and_rocks_about_its_foot():
    samples = np.array([[0.0, 0.0, 0.1], [0.03, 0.0, 0.05], [0.0, 0.04, 0.02]])
    normals = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 0.6, 0.8]])
    ground = Support(np.zeros(3), np.array([0, 0, 2.0]), 1e-3, "resting")
    options = Fit(sinking_std_m=1e-5, rocking_std_rad=2e-4)
    top, down = np.array([0.0, 0, 0.1]), np.array([0.0, 0, -1])
    given = {"support": ground, "options": options}
    found = support_axes_of(samples, normals, contact_m=top, direction=down, **given)
    assert found.samples_m[:, 0] == pytest.approx([-1, 0, -0.8])
    assert found.tip_m == pytest.approx([1, 0, 0])
    # Turned by a small angle about each axis, samples move across it as far as they are high.
    for k, axis in enumerate(rocking_axes(np.array([0.0, 0, 1]))):
        turned = np.cross(axis, samples)
        assert found.samples_m[:, 1 + k] == pytest.approx((turned * normals).sum(axis=1))
    assert found.std == pytest.approx([1e-5, 2e-4, 2e-4])
    # Pressed from the side it does not sink along the press, and rocks by its height.
    side = np.array([0.03, 0.0, 0.05])
    found = support_axes_of(
        samples, normals, contact_m=side, direction=np.array([-1.0, 0, 0]), **given
    )
    assert found.tip_m[0] == pytest.approx(0)
    assert np.linalg.norm(found.tip_m[1:]) == pytest.approx(0.05)
    bonded = replace(ground, contact="bonded")
    found = support_axes_of(
        samples, normals, support=bonded, contact_m=top, direction=down, options=options
    )
    assert not found.std.any()


def test_shares_of_neighbouring_times_hold_together():
    indentation = press_of(25e3, 0.3, 2, shares=(0.15, 0.0))
    loose, tight = (
        fit_direct([indentation], OPTIONS.changed(fraction_step_std=std), START)
        .parameters[0]
        .fractions
        for std in (1.0, 1e-4)
    )
    assert np.ptp(loose) > 0.05
    assert np.ptp(tight) < 1e-3


def test_parts_of_a_variance_are_found_and_outliers_hardly_change_them():
    rng = np.random.default_rng(8)
    parts = np.column_stack([rng.uniform(1, 4, 20000), rng.uniform(0, 5, 20000)])
    gaps = rng.standard_t(4, 20000) * np.sqrt(parts @ [0.5, 0.2])
    assert variance_parts(gaps, parts) == pytest.approx([0.5, 0.2], rel=0.1)
    gaps[:200] *= 30
    assert variance_parts(gaps, parts) == pytest.approx([0.5, 0.2], rel=0.2)
    assert variance_parts(gaps * 1e-6, parts)[0] == LEAST_NOISE


def test_blocks_are_the_sums_of_their_cells():
    indentation = press_of(25e3, 0.3, 1)
    line = linearised(indentation, START, times_s=np.array(OPTIONS.relaxation_times_s))
    blocks = blocks_of(indentation, line, Scales((2.0, 1.0), (3.0, 1.0)))
    gaps, slope = line.residuals.motion, line.motion_slope
    weight = robust_weights(gaps, 2.0) / 12
    cluster = np.broadcast_to(indentation.cluster, indentation.seen.shape)[indentation.seen]
    for number in (0, 5):
        here = cluster == number
        whole = slope[here].T @ (weight[here, None] * slope[here])
        assert blocks.motion_matrix[number] == pytest.approx(whole)
        assert blocks.motion_slope[number] == pytest.approx(slope[here].T @ (weight * gaps)[here])


@pytest.mark.parametrize("indentation", [{"kept": 1}, {"deepest_m": 4e-4, "least_m": 5e-5}])
def test_one_frame_or_a_small_depth_does_not_tell_nu(indentation):
    indentation = press_of(25e3, 0.3, 1, **indentation)
    found = estimate_direct([indentation], OPTIONS, radius_m=RADIUS_M).moduli["poisson_ratio"]
    assert found.verdict == "not identified"
    assert (found.low, found.high) == pytest.approx((0.0, 0.4999))


def test_captures_together_know_more_than_one():
    stds = []
    for count in (1, 5):
        chosen = [press_of(60e3, 0.4, seed) for seed in range(count)]
        best = fit_direct(chosen, OPTIONS, START)
        stds.append(np.sqrt(np.diag(covariance_of(best, OPTIONS))[:2]))
    # What relaxes, and so E, is held by a prior that captures share; nu by each capture's own.
    assert stds[1][0] < stds[0][0]
    assert stds[1][1] < 0.7 * stds[0][1]
    assert best.parameters[0].poisson_ratio == pytest.approx(0.4, abs=4 * stds[1][1])


@pytest.mark.long
@pytest.mark.parametrize("laws", [(0.6, 0.6), (-0.4, 0.8)])
def test_a_solid_of_another_law(laws):
    """Force and motion each have a law of their own, and E is that of small strain."""
    presses = [press_of(25e3, 0.3, seed, laws=laws, noise=0.3) for seed in range(4)]
    found = estimate_direct(presses, OPTIONS, radius_m=RADIUS_M)
    p = found.solution.parameters[0]
    assert [p.force_law, p.motion_law] == pytest.approx(laws, abs=0.25)
    E = found.moduli["youngs_modulus_pa"]
    assert E.low < 25e3 < E.high
    # A law that is taken for known is wrong, and sure of it.
    options = OPTIONS.changed(force_law_std=1e-3, motion_law_std=1e-3)
    sure = estimate_direct(presses, options, radius_m=RADIUS_M).moduli["youngs_modulus_pa"]
    assert not sure.low < 25e3 < sure.high


@pytest.mark.long
def test_the_effective_modulus_is_that_of_the_force_at_its_depth_and_time():
    presses = [press_of(25e3, 0.3, seed, laws=(0.6, 0.6), noise=0.3) for seed in range(4)]
    found = estimate_direct(presses, OPTIONS, radius_m=RADIUS_M)
    depth = np.array([found.quantities.depth_m])
    table = presses[0].table
    harder = float((table.force(depth, 0.3, 0.6) / table.force(depth, 0.3, 0.0))[0])
    told = found.moduli["effective_reduced_modulus_pa"]
    left = 1 - relaxed_share(1.0, fractions=SHARES, times_s=np.array(SHARE_TIMES_S))
    assert told.value == pytest.approx(25e3 / (1 - 0.3**2) * harder * left, rel=0.02)
    # One noisy indentation determines it better than E* at small strain.
    one = estimate_direct([press_of(25e3, 0.3, 1)], OPTIONS, radius_m=RADIUS_M).budget.std
    std = dict(zip(NAMES, one, strict=True))
    assert std["effective_reduced_modulus_pa"] < 0.8 * std["reduced_modulus_pa"]


@pytest.mark.long
def test_a_ratio_that_is_known_beforehand_narrows_e():
    press = press_of(25e3, 0.3, 1, motion_std_m=4e-4)
    free = estimate_direct([press], OPTIONS, radius_m=RADIUS_M)
    options = OPTIONS.changed(poisson_ratio=0.3, poisson_ratio_std=0.002)
    known = estimate_direct([press], options, radius_m=RADIUS_M)
    E, nu = (known.moduli[name] for name in ("youngs_modulus_pa", "poisson_ratio"))
    assert E.low < 25e3 < E.high
    wider = free.moduli["youngs_modulus_pa"]
    assert E.high / E.low < wider.high / wider.low
    assert nu.verdict == "assumed"
    assert (nu.low, nu.high) == pytest.approx((0.3 - 0.00392, 0.3 + 0.00392), abs=1e-4)
    # What is held beforehand gives way to what the press tells well.
    wide = OPTIONS.changed(poisson_ratio=0.4, poisson_ratio_std=0.3)
    clear = press_of(25e3, 0.3, 1)
    free = estimate_direct([clear], OPTIONS, radius_m=RADIUS_M)
    told = estimate_direct([clear], wide, radius_m=RADIUS_M).moduli["poisson_ratio"]
    assert told.verdict != "assumed"
    assert abs(told.value - free.moduli["poisson_ratio"].value) < 0.02


def test_an_estimate_can_be_looked_at():
    presses = [press_of(25e3, 0.3, k) for k in (1, 2)]
    found = estimate_direct(presses, OPTIONS, radius_m=RADIUS_M)
    assert repr(found).startswith("DirectEstimate of 2 captures (95 % intervals)\n")
    assert f"youngs_modulus: {found.moduli['youngs_modulus_pa']}" in repr(found)
    for one, press in zip(found.captures(), presses, strict=True):
        assert np.array_equal(one.force_n, press.force_n[press.frames])
        moved = one.tip_depth_m[press.frames] - press.tip_depth_m[press.frames]
        assert one.depth_m - press.depth_m == pytest.approx(moved) and (moved != 0).all()
        assert np.std(one.fitted_depth_m - one.depth_m) < 2 * np.median(press.depth_std_m)
        left = one.moved_m - one.fitted_moved_m
        assert np.array_equal(np.isnan(left), ~press.seen)
        assert np.nanstd(left) < 1.5 * np.median(press.moved_std_m[press.seen])
        # The middle half of normal residuals is within 0.67 deviations.
        expected = one.moved_expected_std_m
        assert np.nanmedian(np.abs(left) / expected) == pytest.approx(0.67, abs=0.05)
        assert np.array_equal(np.isnan(expected), ~press.seen)
        assert one.depth_expected_std_m.shape == one.depth_m.shape
    axes = plt.figure().add_subplot()
    found.plot(axes)
    assert [len(line.get_xdata()) for line in axes.lines] == [len(presses[0].frames)] * 4


def test_the_budget_is_the_covariance():
    """Contributions add up in squares to what the normal equations say of the moduli."""
    best = estimate_direct([press_of(25e3, 0.3, 1)], OPTIONS, radius_m=RADIUS_M)
    onto = best.quantities.slopes @ best.covariance
    whole = np.sqrt(np.diag(onto @ best.quantities.slopes.T))
    # Noise that scatters by more than was stated adds to it.
    assert (best.budget.std >= whole * (1 - 1e-3)).all()
    assert (best.budget.std <= whole * 1.5).all()
    rows = best.budget.rows()
    parts = np.array([row["contribution_log_effective_reduced_modulus"] for row in rows])
    assert (np.diff(parts) <= 0).all()
    assert np.sqrt((parts**2).sum()) == pytest.approx(best.budget.std[0])
    for row in rows:
        product = row["sensitivity_poisson_ratio"] * row["standard_uncertainty"]
        assert product == pytest.approx(row["contribution_poisson_ratio"])


@pytest.mark.parametrize(("name", "std"), [("force_drift_std_n", 0.02), ("board_scale_std", 0.02)])
def test_a_rig_s_error_moves_the_moduli_as_the_budget_says(name, std):
    """Against the fit of what such an error makes of a press."""
    options = OPTIONS.changed(rig=NO_RIG.changed(**{name: std}))
    press = press_of(25e3, 0.3, 1, noise=0.3)
    found = estimate_direct([press], options, radius_m=RADIUS_M)
    (error,) = (e for e in rig_errors(options.rig, radius_m=RADIUS_M) if e.std)
    (line,) = (s for s in found.budget.sources if s.name == error.source)
    scales = found.solution.scales
    start = found.solution.parameters[0]
    spoilt = [error.changed(one, std) for one in found.solution.indentations]
    moved = fit_direct(spoilt, options, start, scales=scales).parameters[0]
    change = np.log(moved.youngs_modulus_pa / start.youngs_modulus_pa)
    assert abs(change) > 1e-4
    assert line.contributions[NAMES.index("youngs_modulus_pa")] == pytest.approx(
        abs(change), rel=0.15
    )


@pytest.mark.parametrize("kept", [1, 3, None])
def test_e_holds_what_belongs_to_both_ends_of_nu(kept):
    """E is E* (1 - nu^2) at each nu that is left open, wherever nu itself was found."""
    found = estimate_direct([press_of(25e3, 0.3, 13, kept=kept)], OPTIONS, radius_m=RADIUS_M)
    nu, star = found.moduli["poisson_ratio"], found.moduli["reduced_modulus_pa"]
    E = found.moduli["youngs_modulus_pa"]
    for one in (star, E):
        assert one.low < one.value < one.high
    slopes = dict(zip(NAMES, found.quantities.slopes, strict=True))
    by_nu = slopes["reduced_modulus_pa"] @ found.covariance @ slopes["poisson_ratio"]
    by_nu /= found.covariance[1, 1]
    for end in (nu.low, nu.high):
        follows = star.value * np.exp(by_nu * (end - nu.value)) * (1 - end**2)
        assert 0.99 * E.low < follows < 1.01 * E.high


def test_what_the_table_adds_is_no_information_lost_in_the_bound():
    press = press_of(25e3, 0.3, 1)
    known = estimate_direct([press], OPTIONS, radius_m=RADIUS_M)
    options = OPTIONS.changed(model_std=ModelStd(log_youngs_modulus=0.1, nu=0.1))
    found = estimate_direct([press], options, radius_m=RADIUS_M)
    assert found.bound == pytest.approx(known.bound, rel=1e-6)
    assert (known.bound <= known.budget.std * (1 + 1e-3)).all()
    nu, at = found.solution.parameters[0].poisson_ratio, NAMES.index("youngs_modulus_pa")
    # E follows nu at the same E*.
    added = 0.1 * np.array([1, 2 * nu / (1 - nu**2)])
    assert found.budget.std[at] == pytest.approx(np.linalg.norm([known.budget.std[at], *added]))
    said = found.to_dict()["information"]["youngs_modulus_pa"]
    assert said["efficiency"] == pytest.approx(known.bound[at] / found.budget.std[at])


def test_regions_add_up_and_are_those_of_the_covariance():
    """With both, the inverse is the covariance of log E and nu; of one kind there is less."""
    found = estimate_direct([press_of(25e3, 0.3, 13)], OPTIONS, radius_m=RADIUS_M)
    regions = regions_of(found.solution, found.options)
    covariance = np.linalg.inv(regions["both"])
    np.testing.assert_allclose(covariance, found.covariance[:2, :2], rtol=1e-3)
    for kind in ("force", "surface"):
        assert (np.linalg.eigvalsh(regions["both"] - regions[kind]) > 0).all()
    # Indentation depths determine E at each nu, not both.
    least, most = np.linalg.eigvalsh(regions["force"])
    assert 0 <= least < 1e-3 * most
    assert found.to_dict()["regions"]["both"] == regions["both"].tolist()


def test_e_after_a_second_is_that_of_the_moduli():
    found = estimate_direct([press_of(25e3, 0.3, 13)], OPTIONS, radius_m=RADIUS_M)
    again, told = youngs_after(found, 1.0), found.moduli["youngs_modulus_1s_pa"]
    assert again.value == pytest.approx(told.value)
    for end, other in ((again.low, told.low), (again.high, told.high)):
        assert np.log(end / again.value) == pytest.approx(np.log(other / told.value), rel=0.05)
    late = youngs_after(found, 10.0)
    assert late.value < again.value < found.moduli["youngs_modulus_pa"].value
    assert found.to_dict()["youngs_modulus_10s_pa"]["value"] == late.value


@pytest.mark.long
@pytest.mark.parametrize("foot", [0.1, 0.9])
def test_how_freely_a_foot_slides_is_found(foot):
    """A table whose foot sticks takes what sliding adds for another Poisson's ratio."""
    cell = press_of(25e3, 0.35, 1).cell_m
    model = sliding(cell)
    press = press_of(25e3, 0.35, 1, noise=0.3, foot=foot, solid=(cell, model, model))
    found = estimate_direct([press], OPTIONS, radius_m=RADIUS_M)
    p, nu = found.solution.parameters[0], found.moduli["poisson_ratio"]
    assert nu.low < 0.35 < nu.high and p.poisson_ratio == pytest.approx(0.35, abs=0.02)
    assert p.foot == pytest.approx(foot, abs=0.15)
    assert found.to_dict()["foot"] == p.foot
    sticks = estimate_direct(
        [replace(press, table=model_of(cell))], OPTIONS, radius_m=RADIUS_M
    ).solution.parameters[0]
    assert sticks.foot == pytest.approx(0, abs=1e-9)
    assert (abs(sticks.poisson_ratio - 0.35) > 0.05) == (foot > 0.5)


def test_poisson_s_ratio_ends_with_the_table():
    press = press_of(25e3, 0.45, 1)
    table = press.table
    short = replace(
        table,
        poisson_ratios=table.poisson_ratios[:3],
        force_per_modulus_m2=table.force_per_modulus_m2[:3],
        stiffening=table.stiffening[:3],
        motion_m=table.motion_m[:3],
        motion_change_m=table.motion_change_m[:3],
        yielding=table.yielding[:3],
        motion_by_foot=table.motion_by_foot[:3],
        motion_by_place=table.motion_by_place[:, :3],
    )
    found = estimate_direct([replace(press, table=short)], OPTIONS, radius_m=RADIUS_M)
    assert found.moduli["poisson_ratio"].high == 0.35
    with pytest.raises(ValueError, match="poisson_ratio_bounds: expected low below high within"):
        estimate_direct(
            [press], OPTIONS.changed(poisson_ratio_bounds=(0.4, 0.1)), radius_m=RADIUS_M
        )


def test_a_capture_counts_once(tmp_path):
    one = SimpleNamespace(capture=SimpleNamespace(folder=tmp_path / "08"))
    with pytest.raises(ValueError, match="measured: expected each capture once, found 08 again"):
        direct.estimate([one, one], [])


@pytest.mark.parametrize("beside_m", [(0.001, 0.0), (-0.0005, 0.0008)])
def test_a_contact_beside_where_it_was_seen_is_found(beside_m):
    """A millimetre moves the nearest samples by 7 %, to one side up and to the other down."""
    press = press_of(25e3, 0.3, 3, beside_m=beside_m)
    found = estimate_direct([press], OPTIONS, radius_m=RADIUS_M)
    place = found.solution.parameters[0].place_m
    assert place == pytest.approx(beside_m, abs=1e-4)
    truth = {"youngs_modulus_pa": 25e3, "poisson_ratio": 0.3}
    assert all(found.moduli[name].low < at < found.moduli[name].high for name, at in truth.items())


@pytest.mark.long
def test_a_faster_camera_knows_no_more_of_what_hangs_on_the_place():
    """Five times the frames with a wavy error of the depth: no narrower than the error allows."""
    found = []
    for rate_hz, frames in ((6, 24), (30, 120)):
        press = press_of(25e3, 0.3, 1, rate_hz=rate_hz, frames=frames, wavy_m=1.5e-4)
        found.append(estimate_direct([press], OPTIONS, radius_m=RADIUS_M))
    for one in found:
        star = one.moduli["reduced_modulus_pa"]
        assert star.low < 25e3 / (1 - 0.3**2) < star.high
    noise = [next(s for s in one.budget.sources if s.name == "noise of the depth") for one in found]
    star = [source.contributions[NAMES.index("reduced_modulus_pa")] for source in noise]
    assert star[1] > 0.7 * star[0]


def test_a_fit_that_did_not_converge_says_so(monkeypatch):
    monkeypatch.setattr(fit, "SMALLEST_STEP", np.full(4, 1e-22))
    monkeypatch.setattr(fit, "ITERATIONS", 8)
    assert not fit_direct([press_of(25e3, 0.3, 1)], OPTIONS, START).converged


def test_a_press_that_begins_far_from_the_surface_is_told():
    """A diameter for a radius of 6 mm: every depth is 6 mm too much."""
    press = press_of(25e3, 0.3, 1)
    press = replace(press, depth_m=press.depth_m + 0.006, offset_std_m=1e-3)
    found = estimate_direct([press], OPTIONS, radius_m=RADIUS_M)
    (line,) = found.doubts
    assert line.startswith(
        "the force begins 6.2 mm below the surface, 6.2 deviations off (radius_m"
    )
    assert {one.verdict for one in found.moduli.values()} == {"not judged"}


def test_patches_are_as_large_as_asked():
    press = press_of(25e3, 0.3, 1)
    times = np.array(OPTIONS.relaxation_times_s)
    counts = [
        int(with_pattern(replace(press, patch_m=size), START, times_s=times).cluster.max()) + 1
        for size in (0.02, 0.04, 0.08)
    ]
    assert counts[0] >= counts[1] > counts[2]


@pytest.mark.parametrize("times", [1, 3, 10])
def test_deviations_that_are_found_are_those_of_the_errors(times):
    """Of depths and motions, that scatter as is stated or by more."""
    press = press_of(25e3, 0.3, 5)
    rng, more = np.random.default_rng(5), np.sqrt(times**2 - 1)
    spoilt = replace(
        press,
        depth_m=press.depth_m + more * rng.normal(0, press.tip_std_m, len(press.depth_m)),
        moved_m=press.moved_m + more * rng.normal(0, press.noise_std_m),
    )
    best = fit_direct([spoilt], OPTIONS, START)
    (found,), (scale,) = best.indentations, best.scales
    stated = with_depth_errors(press, best.parameters[0], OPTIONS, likeliest=False).depth_std_m
    assert 0.65 < np.median(found.depth_std_m / np.hypot(stated, more * press.tip_std_m)) < 1.5
    motion = np.median(found.moved_std_m) * scale.motion[0] * np.sqrt(scale.sharing[0])
    assert motion == pytest.approx(times * press.noise_std_m[0, 0], rel=0.05)


def test_depths_that_scatter_far_beyond_what_is_stated_are_told():
    """1.6 mm of noise where each frame says 0.08 mm."""
    press = press_of(25e3, 0.3, 1)
    noise = np.random.default_rng(1).normal(0, 20 * press.tip_std_m, len(press.frames))
    found = estimate_direct(
        [replace(press, depth_m=press.depth_m + noise)], OPTIONS, radius_m=RADIUS_M
    )
    assert "depths scatter by" in found.doubts[0]
    E = found.moduli["youngs_modulus_pa"]
    assert E.low < 25e3 < E.high


def test_a_contact_that_was_seen_beside_its_table_is_expected_there():
    press = press_of(25e3, 0.3, 3, beside_m=(0.0015, 0.0), motion_std_m=1e-3)
    seen = replace(press, place_expected_m=np.array([0.0015, 0.0]))
    found = [
        estimate_direct([one], OPTIONS, radius_m=RADIUS_M).solution.parameters[0].place_m[0]
        for one in (press, seen)
    ]
    assert found[1] == pytest.approx(0.0015, abs=2e-4)
    assert found[0] < 0.0012
