"""Direct estimate on presses whose moduli are known."""

from dataclasses import replace

import numpy as np
import pytest
from floor import floor
from palpate.estimate.direct.blocks import Scales, blocks_of
from palpate.estimate.direct.deviations import LEAST_NOISE, robust_weights, variance_parts
from palpate.estimate.direct.estimate import estimate_direct, law_evidence, laws_to_try
from palpate.estimate.direct.fit import fit_direct, prior_of
from palpate.estimate.direct.indentation import (
    OWN,
    DirectIndentation,
    Parameters,
    linearised,
    residuals,
)
from palpate.estimate.direct.interval import (
    bootstrap,
    effective_clusters,
    intervals,
    profile_over_nu,
)
from palpate.estimate.direct.options import Fit, ModelStd
from palpate.estimate.direct.relaxation import relaxed_force
from palpate.estimate.direct.support_motion import rocking_axes, support_axes_of
from palpate.estimate.direct.table import SampleTable
from palpate.solid.support import Support

RADIUS_M = 0.006
OPTIONS = Fit(
    relaxation_times_s=(0.3, 3.0),
    fraction_std=0.1,
    fraction_step_std=0.1,
    force_std=0.0,
    model_std=ModelStd(log_youngs_modulus=0.0, nu=0.0),
    draws=200,
    profile_poisson_ratios=(0.0, 0.2, 0.35, 0.49),
)
START = Parameters(1e4, 0.2, 0.0, np.zeros(2), 0.0, 0.0, 0.0, np.zeros(3))
STANDING = floor(1e-3, height_m=-0.05, contact="resting")


def model_of(cell_m, law="made_up", stiffening=0.0):
    """Force like Hertz's; a surface that sinks less far off, and rises with nu."""
    nus, depth = np.array([0.0, 0.2, 0.35, 0.45, 0.49]), np.linspace(0, 0.009, 13)
    force = 4 / 3 * np.sqrt(RADIUS_M) * depth**1.5 * (1 + stiffening * depth / 0.009)
    r = np.linalg.norm(cell_m, axis=1)
    motion = [-depth[:, None] * RADIUS_M / r * (1 - (0.5 + 2 * nu**2) * (r / 0.1)) for nu in nus]
    return SampleTable(law, nus, depth, force / (1 - nus[:, None] ** 2), np.array(motion))


def support_axes(cell_m, support):
    return support_axes_of(
        cell_m,
        np.tile([0.0, 0, 1], (len(cell_m), 1)),
        support=support,
        contact_m=np.zeros(3),
        direction=np.array([0.0, 0, -1]),
        options=Fit(sinking_std_m=1e-4, rocking_std_rad=1e-3),
    )


def press_of(
    E,
    nu,
    seed,
    *,
    noise=1.0,
    shares=(0.08, 0.05),
    frames=24,
    deepest_m=0.007,
    start_s=1.0,
    least_m=5e-4,
    kept=None,
    support=None,
    late_s=0.0,
):
    """A capture of 24 frames: rest, press, hold."""
    rng = np.random.default_rng(seed)
    cell = np.column_stack([rng.uniform(-0.08, 0.08, (400, 2)), np.zeros(400)])
    cell = cell[np.linalg.norm(cell, axis=1) > 0.015]
    model = model_of(cell)
    time = np.arange(frames) / 6
    depth = deepest_m * np.clip((time - start_s) / 1.8, 0, 1)
    elastic = E * model.force(depth, nu)
    force = relaxed_force(time, elastic, fractions=shares, times_s=[0.3, 3.0])
    if late_s:
        fine = np.arange(0, time[-1] + 0.1, 0.005)
        way = deepest_m * np.clip((fine - start_s) / 1.8, 0, 1)
        whole = E * model.force(way, nu)
        whole = relaxed_force(fine, whole, fractions=shares, times_s=[0.3, 3.0])
        force = np.interp(time + late_s, fine, whole)
    force = force + noise * rng.normal(0, 0.003 * force.max(), frames)
    used = np.flatnonzero(depth > least_m)[:kept]
    motion, _ = model.motion(depth[used], nu)
    motion = motion + noise * rng.normal(0, 5e-5, motion.shape)
    offset = noise * rng.normal(0, 1e-4)
    measured = depth[used] + offset + noise * rng.normal(0, 8e-5, len(used))
    cluster = np.unique((cell[:, :2] // 0.02).astype(int), axis=0, return_inverse=True)[1].ravel()
    return DirectIndentation(
        time_s=time,
        force_n=force,
        frames=used,
        frames_beyond=0,
        depth_m=measured,
        speed_m_s=np.gradient(depth, time)[used],
        depth_std_m=8e-5,
        offset_std_m=1e-4,
        clock_expected_s=0.0,
        clock_std_s=0.01,
        force_std_n=0.003 * force.max(),
        contact_m=np.zeros(3),
        cell_m=cell,
        normal=np.tile([0.0, 0, 1], (len(cell), 1)),
        moved_m=motion,
        noise_std_m=np.full(motion.shape, 5e-5),
        moved_std_m=np.full(motion.shape, 5e-5),
        shift_std_m=2e-5,
        patch_m=0.02,
        cluster=cluster,
        support_axes=support_axes(cell, support or replace(STANDING, contact="bonded")),
        models={"made_up": model},
    )


def test_exact_data_give_the_moduli_back():
    indentation = press_of(25e3, 0.3, 1, noise=0.0)
    options = replace(OPTIONS, fraction_std=10.0, fraction_step_std=10.0)
    found = fit_direct([indentation], "made_up", options, START).parameters[0]
    assert found.youngs_modulus_pa == pytest.approx(25e3, rel=2e-3)
    assert found.poisson_ratio == pytest.approx(0.3, abs=1e-3)
    assert found.fractions == pytest.approx([0.08, 0.05], abs=5e-3)


def test_derivatives_are_those_of_the_residuals():
    indentation = press_of(25e3, 0.3, 1, support=STANDING)
    support_motion = np.array([2e-5, 3e-4, -1e-4])
    of = Parameters(24e3, 0.28, 0.01, np.array([0.05, 0.03]), 1e-4, 2e-3, 1e-5, support_motion)
    times = np.array(OPTIONS.relaxation_times_s)
    # Deviations of the depth depend on the parameters a little, which is left out.
    indentation = replace(indentation, force_std_n=1e-9)
    line = linearised(indentation, "made_up", of, times_s=times)
    steps = [1e-5] * 5 + [1e-7, 1e-4, 1e-7] + [1e-7, 1e-5, 1e-5]
    assert len(steps) == len(of.vector)
    for k, step in enumerate(steps):
        ends = []
        for sign in (-1, 1):
            vector = of.vector
            vector[k] += sign * step
            ends.append(residuals(indentation, "made_up", Parameters.of(vector), times_s=times))
        for name in ("depth", "motion"):
            slope = (getattr(ends[1], name) - getattr(ends[0], name)) / (2 * step)
            found = getattr(line, f"{name}_slope")[:, k]
            assert np.abs(found - slope).max() <= 2e-3 * np.abs(slope).max() + 1e-5


def test_a_clock_that_was_set_wrong_before_is_set_right():
    """The force's clock was moved by 25 ms: what is known of it is that the clocks agree."""
    late = press_of(25e3, 0.3, 1, noise=0.2, shares=(0.0, 0.0), late_s=0.025)
    told = replace(late, clock_expected_s=0.025)
    right, wrong = (
        fit_direct([one], "made_up", OPTIONS, START).parameters[0] for one in (told, late)
    )
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
    free, held = (
        fit_direct([one], "made_up", OPTIONS, START).parameters[0] for one in (sunk, bonded)
    )
    assert free.support_motion == pytest.approx(support_motion, rel=0.25)
    assert np.abs(held.support_motion).max() < 1e-9
    assert abs(free.poisson_ratio - 0.3) < 0.02 < abs(held.poisson_ratio - 0.3)


def test_captures_on_one_foot_know_no_more_of_it_than_one():
    options = replace(OPTIONS, gain_std=1e-3)
    moved = []
    for count in (1, 4):
        indentations = [press_of(60e3, 0.4, 3, support=STANDING) for _ in range(count)]
        prior = prior_of(indentations, options)
        # What all sink by in common, at the cost of one deviation.
        common = np.zeros(prior.rows.shape[1])
        shared = len(common) - OWN * count
        common[[shared + OWN * k + 3 for k in range(count)]] = 1e-4
        expected = prior.gaps(np.zeros(len(common)))
        moved.append(((prior.gaps(common) - expected) ** 2).sum())
    assert moved == pytest.approx([1, 1])


def test_settling_does_not_make_the_modulus_drift_over_the_depth():
    support_motion, indentation = (
        np.array([1e-4, 0.0, 0.0]),
        press_of(25e3, 0.3, 1, noise=0.0, support=STANDING),
    )
    samples = indentation.moved_m + indentation.load[:, None] * (
        indentation.support_axes.samples_m @ support_motion
    )
    sunk = replace(
        indentation,
        moved_m=samples,
        depth_m=indentation.depth_m + indentation.load * support_motion[0],
    )
    best = fit_direct([sunk], "made_up", OPTIONS, START)
    evidence = law_evidence(best, OPTIONS, RADIUS_M)
    assert abs(evidence.modulus_slope) * evidence.depth_spread < 2e-3


def test_patches_that_tell_nu_do_not_hang_on_motions_that_do_not_happen():
    best = fit_direct([press_of(25e3, 0.3, 1)], "made_up", OPTIONS, START)
    wide = effective_clusters(best, OPTIONS)
    block = best.blocks[0]
    other = replace(best, blocks=(replace(block, motion_matrix=block.motion_matrix * (1 + 1e-13)),))
    assert effective_clusters(other, OPTIONS) == pytest.approx(wide, rel=1e-6)
    kept = slice(0, -3)
    information = prior_of(best.indentations, OPTIONS).information[kept, kept]
    information += block.motion_matrix.sum(axis=0)[kept, kept]
    information += block.depth_matrix.sum(axis=0)[kept, kept]
    along = np.linalg.inv(information)[1]
    shares = np.einsum("i,bij,j->b", along, block.motion_matrix[:, kept, kept], along)
    assert wide == pytest.approx(shares.sum() ** 2 / (shares**2).sum(), rel=1e-4)


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
        fit_direct([indentation], "made_up", replace(OPTIONS, fraction_step_std=std), START)
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
    line = linearised(indentation, "made_up", START, times_s=np.array(OPTIONS.relaxation_times_s))
    blocks = blocks_of(indentation, line, Scales(motion=2.0, sharing=3.0))
    gaps, slope = line.residuals.motion, line.motion_slope
    weight = robust_weights(gaps, 2.0) / 12
    cluster = np.broadcast_to(indentation.cluster, indentation.seen.shape)[indentation.seen]
    for number in (0, 5):
        here = cluster == number
        whole = slope[here].T @ (weight[here, None] * slope[here])
        assert blocks.motion_matrix[number] == pytest.approx(whole)
        assert blocks.motion_slope[number] == pytest.approx(slope[here].T @ (weight * gaps)[here])


def test_captures_together_know_more_than_one():
    # Of six and more, captures are drawn too, which takes much of it away again.
    indentations = [press_of(60e3, 0.4, seed) for seed in range(5)]
    widths = []
    for chosen in (indentations[:1], indentations):
        best = fit_direct(chosen, "made_up", OPTIONS, START)
        samples = bootstrap(best, OPTIONS, draws=200, seed=3)
        widths.append(samples[:, :2].std(axis=0))
    # What relaxes, and so E, is held by a prior that captures share; nu by each capture's own.
    assert widths[1][0] < widths[0][0]
    assert widths[1][1] < 0.7 * widths[0][1]
    assert best.parameters[0].poisson_ratio == pytest.approx(0.4, abs=4 * widths[1][1])


def test_intervals_cover_about_as_often_as_they_say():
    hits = np.zeros(2)
    runs = 30
    for seed in range(runs):
        indentation = press_of(25e3, 0.3, 100 + seed)
        best = fit_direct([indentation], "made_up", OPTIONS, START)
        samples = bootstrap(best, OPTIONS, draws=100, seed=seed)
        profile = profile_over_nu(best, OPTIONS, [0.2, 0.3, 0.4])
        found = intervals(best, samples, profile, OPTIONS)
        for k, (name, truth) in enumerate((("youngs_modulus_pa", 25e3), ("poisson_ratio", 0.3))):
            hits[k] += found[name].low <= truth <= found[name].high
    # Of 30 runs at 95 %, fewer than 25 have a chance of three in a thousand.
    assert (hits >= 25).all(), hits


def test_too_few_frames():
    indentation = press_of(25e3, 0.3, 1, frames=7, start_s=0.3)
    with pytest.raises(ValueError, match="frames: expected at least 8, as many as"):
        fit_direct([indentation], "made_up", OPTIONS, START)


@pytest.mark.parametrize("indentation", [{"kept": 1}, {"deepest_m": 4e-4, "least_m": 5e-5}])
def test_one_frame_or_a_small_depth_does_not_tell_nu(indentation):
    indentation = press_of(25e3, 0.3, 1, **indentation)
    found = estimate_direct([indentation], OPTIONS, radius_m=RADIUS_M, seed=1).moduli[
        "poisson_ratio"
    ]
    assert found.verdict == "not identified"
    assert (found.low, found.high) == pytest.approx((0.0, 0.49))


def test_the_law_that_the_press_prefers():
    indentation = press_of(25e3, 0.3, 1)
    samples = indentation.cell_m
    models = {
        "stiffer": model_of(samples, "stiffer", 1.5),
        "made_up": indentation.models["made_up"],
    }
    found = estimate_direct(
        [replace(indentation, models=models)], OPTIONS, radius_m=RADIUS_M, seed=1
    )
    assert found.solution.law == "made_up"
    slopes = {law.law: law.modulus_slope / law.modulus_slope_std for law in found.laws}
    assert abs(slopes["made_up"]) < 2 < abs(slopes["stiffer"])


def test_shallow_presses_take_the_linear_solid():
    indentation = press_of(25e3, 0.3, 1, deepest_m=5e-4, least_m=5e-5)
    models = indentation.models | {"linear": model_of(indentation.cell_m, "linear")}
    indentation = replace(indentation, models=models)
    assert laws_to_try([indentation], OPTIONS, radius_m=RADIUS_M)[0] == ["linear"]
    deep = replace(press_of(25e3, 0.3, 1), models=models)
    assert laws_to_try([deep], OPTIONS, radius_m=RADIUS_M)[0] == ["made_up"]
