"""The synthetic capture from clouds and forces to E and nu: what each step selects and returns."""

from dataclasses import replace

import numpy as np
import pytest
from made_up_indentation import displacement_of
from palpate.estimate.direct.contact import FORCE_DEVIATIONS
from palpate.estimate.direct.estimate import estimate_direct
from palpate.estimate.direct.motion import observed_motion, rest_frames
from palpate.estimate.direct.options import Fit, Observation, ProbeUncertainty
from palpate.estimate.direct.problem import ProbeRecord, direct_indentation
from palpate.solid.laws import SLIDING
from palpate.solid.smooth_surface import SmoothSurface
from palpate.surface.alignment import align_first, resting_prior
from palpate.surface.options import Aligning
from palpate.surface.pose import to_object
from palpate.vision.force import FORCE
from palpate.vision.indentation import capture_wrenches
from palpate.vision.options import Force
from palpate.vision.probe import AXIS, marker_transforms
from synthetic_capture import (
    CLOCK_S,
    NU,
    POINT_M,
    TIME_S,
    TIP_STD_M,
    TOP_M,
    UP,
    E,
    depth_m,
    force_n,
    sunk_m,
)

DEPTH_M = depth_m(TIME_S)
# Loaded from frame 22 on, and held up to frame 42.
FIRST, LAST = 22, 42
NOISE_N = 0.01
PEAK_N = force_n(DEPTH_M.max(), 0.00622)


def samples():
    """Places all over the top and the front, with their normals; none at a limit."""
    x, y = (one.ravel() for one in np.mgrid[-0.0995:0.13:0.0041, -0.0987:0.0987:0.0041])
    top = np.column_stack([x, y, np.full(x.size, TOP_M)])
    x, z = (one.ravel() for one in np.mgrid[-0.0995:0.13:0.0041, 0.0023:TOP_M:0.0043])
    front = np.column_stack([x, np.full(x.size, -0.1), z])
    normals = np.repeat([UP, [0.0, -1, 0]], [len(top), len(front)], axis=0)
    return np.concatenate([top, front]), normals


CELL_M, NORMAL = samples()


@pytest.fixture(scope="module")
def motion(synthetic):
    """The true one."""
    moved = sunk_m(CELL_M, DEPTH_M, synthetic.radius_m) * (NORMAL @ UP)
    return displacement_of(CELL_M, NORMAL, moved, std_m=3e-5)


@pytest.fixture(scope="module")
def record(synthetic):
    noise = np.random.default_rng(7).normal(0, NOISE_N, synthetic.forces_n.shape)
    forces, turns = synthetic.forces_n + noise, marker_transforms(synthetic.poses)[:, :3, :3]
    return ProbeRecord(TIME_S, synthetic.tips_m, forces, TIP_STD_M, np.inf, CLOCK_S, 0.02, turns)


@pytest.fixture(scope="module")
def direct(synthetic, motion, record):
    """What the estimate compares, with a table, options and changes of the record."""
    block = SmoothSurface(synthetic.template.vertices_m, synthetic.template.faces)

    def made(options=None, table=None, surface=block, support=synthetic.support, **changes):
        given = synthetic.alignment, surface, table or synthetic.table(), support
        return direct_indentation(replace(record, **changes), motion, *given, options or Fit())

    return made


@pytest.fixture(scope="module")
def plain(direct):
    return direct()


@pytest.mark.parametrize("share", [1e-6, 0.02, 0.1, 0.3])
def test_frames_with_force_enough_from_the_touch_to_the_end_of_the_hold(direct, synthetic, share):
    """At least what noise alone may be."""
    truth = np.linalg.norm(synthetic.forces_n, axis=1)
    least_n = share * PEAK_N if share > 1e-6 else FORCE_DEVIATIONS * NOISE_N
    frames = np.flatnonzero(truth > least_n)
    found = direct(Fit(least_force_share=share))
    assert found.frames.tolist() == frames[frames <= LAST].tolist()


def test_jolts_before_the_touch_and_readings_that_fail_are_not_compared(direct, record, synthetic):
    forces = record.forces_n.copy()
    forces[5] += 0.5 * synthetic.forces_n[LAST]
    assert direct(forces_n=forces).frames.min() == FIRST
    forces = record.forces_n.copy()
    forces[30] *= 1.05
    forces[35] *= 0
    found = direct(Fit(least_force_share=0.02), forces_n=forces).frames
    assert sorted(set(range(FIRST, LAST + 1)) - set(found)) == [35]


def test_frames_deeper_than_the_table_are_counted_and_left_out(direct, synthetic):
    whole = synthetic.table()
    short = replace(
        whole,
        depth_m=whole.depth_m[:3],
        force_per_modulus_m2=whole.force_per_modulus_m2[..., :3],
        surface_displacement_m=whole.surface_displacement_m[:, :, :3],
    )
    found = direct(table=short)
    within = np.flatnonzero(DEPTH_M[FIRST : LAST + 1] < short.depth_m[-1]) + FIRST
    assert found.frames.tolist() == within.tolist()
    assert found.frames_beyond == LAST + 1 - FIRST - len(within)


METRES, RADII = {"nearest_radii": 0.0, "nearest_m": 0.031}, {"nearest_radii": 4.5, "nearest_m": 0.0}


@pytest.mark.parametrize("options", [{}, METRES, RADII, {"farthest_m": 0.06}, {"crease_m": 0.021}])
def test_samples_outside_of_the_contact_near_enough_and_off_the_edges(direct, synthetic, options):
    given = {"nearest_radii": 1.5, "nearest_m": 0.004, "farthest_m": 0.1, "crease_m": 0.01}
    given |= options
    radius, tips = synthetic.radius_m, synthetic.tips_m[FIRST : LAST + 1]
    depth = TOP_M + radius - to_object(synthetic.camera_from_object, tips)[:, 2]
    tip = POINT_M + (radius - depth.mean()) * UP
    across = np.linalg.norm((CELL_M - tip)[:, :2], axis=1)
    nearest = given["nearest_radii"] * np.sqrt(radius * depth.max()) + given["nearest_m"]
    # From the block's own edges.
    x, y, z = CELL_M.T
    ends = [0.15 - np.abs(x), 0.1 - np.abs(y), np.minimum(z, TOP_M - z)]
    edge = np.where(NORMAL[:, 2] > 0.5, np.minimum(*ends[:2]), np.minimum(ends[0], ends[2]))
    distance = np.linalg.norm(CELL_M - tip, axis=1)
    chosen = (across > nearest) & (distance < given["farthest_m"]) & (edge > given["crease_m"])
    found = direct(Fit(**options))
    assert 50 < len(found.cell_m) < len(CELL_M)
    assert np.array_equal(found.cell_m, CELL_M[chosen])
    assert np.array_equal(found.moved_m[0] == 0, (NORMAL[chosen, 2] == 0))


@pytest.mark.parametrize(
    "height_m, farthest_m", [(0.06, 0.06), (0.001, np.hypot(0.03, 0.00622)), (0.3, 0.1)]
)
def test_beyond_its_height_a_base_that_may_slide_is_not_compared(
    direct, synthetic, height_m, farthest_m
):
    """But so far that some samples are seen beside the probe, and no farther than others."""
    whole = synthetic.table()
    doubled = {
        name: np.concatenate([getattr(whole, name), getattr(whole, name)[:1]])
        for name in ("force_per_modulus_m2", "surface_displacement_m")
    }
    slides = replace(whole, laws=(*whole.laws, whole.laws[0] + SLIDING), **doubled)
    base = replace(synthetic.support, plane_point_m=POINT_M - height_m * UP)
    options = Fit(nearest_radii=0.0, nearest_m=0.015)
    every, found = direct(options, support=base), direct(options, slides, support=base)
    near = np.linalg.norm(every.cell_m - every.contact_m, axis=1) < farthest_m
    assert np.array_equal(found.cell_m, every.cell_m[near])
    assert near.all() == (farthest_m == 0.1)


def on_top(found):
    """Which samples are on the upper side, whose normals are upright."""
    return np.isclose(found.cell_m[:, 2], TOP_M)


def test_a_force_across_and_a_compliant_probe(direct, record, synthetic, plain):
    """The one is no force along, the other goes in less than its target goes down."""
    across = 0.5 * synthetic.camera_from_object[:3, 0]
    found = direct(forces_n=record.forces_n + across)
    assert found.force_n == pytest.approx(force_n(DEPTH_M, synthetic.radius_m), abs=4 * NOISE_N)
    found = direct(stiffness_n_m=5e3)
    assert plain.depth_m - found.depth_m == pytest.approx(plain.force_n[plain.frames] / 5e3)
    assert plain.tip_depth_m - found.tip_depth_m == pytest.approx(plain.force_n / 5e3)


def off_m(found, radius_m, place_m):
    """How far along x the table's motion, with the contact at a place, is from the true one."""
    depth = np.array([0.004])

    def truth(x):
        return sunk_m(found.cell_m + [x, 0, 0], depth, radius_m)[0] * on_top(found)

    by_x = (truth(-1e-4) - truth(1e-4)) / 2e-4
    error = found.table.motion(depth, NU, 0.0, place_m).motion_m[0] - truth(0.0)
    return float(error @ by_x / (by_x @ by_x))


@pytest.mark.parametrize("beside_m", [0.0, 0.006])
def test_a_table_of_a_point_beside_is_brought_under_the_sphere(direct, synthetic, beside_m):
    found = direct(table=synthetic.table(POINT_M + [beside_m, 0, 0]))
    assert abs(off_m(found, synthetic.radius_m, found.place_expected_m)) < 2e-4
    unit = found.table.force(np.array([0.004]), NU, 0.0)
    assert unit * E == pytest.approx(force_n(0.004, synthetic.radius_m), rel=0.01)


def test_a_table_that_stays_expects_the_contact_there_and_one_far_off_is_rejected(
    direct, synthetic
):
    """Moved by 1.5 mm its surface would reach beyond the edge of a narrower block."""
    narrow = synthetic.template.vertices_m * [0.5, 1, 1] - [0.04, 0, 0]
    surface = SmoothSurface(narrow, synthetic.template.faces)
    found = direct(table=synthetic.table(POINT_M - [0.0015, 0, 0]), surface=surface)
    assert off_m(found, synthetic.radius_m, np.zeros(2)) == pytest.approx(-0.0015, abs=5e-4)
    assert abs(off_m(found, synthetic.radius_m, found.place_expected_m)) < 5e-4
    with pytest.raises(ValueError, match="contact: expected within 2 mm .* found 20.0 mm away"):
        direct(table=synthetic.table(POINT_M + [0.02, 0, 0]))


def test_from_clouds_and_forces_to_the_moduli(synthetic, sensors):
    """Step by step, each with what the one before has found."""
    probe, radius = synthetic.probe, synthetic.radius_m
    given = synthetic.record, synthetic.poses, sensors["kinect"], probe, Force()
    table, clock = capture_wrenches(*given, up=synthetic.plane[:3])
    forces, tips = table[FORCE].to_numpy(), synthetic.tips_m
    peak = int(np.argmax(np.linalg.norm(forces, axis=1)))
    block = synthetic.template, synthetic.support, {"position_m": POINT_M}, synthetic.plane
    resting = resting_prior(*block, tips, FIRST, peak, indenter_radius_m=radius)
    aligned = align_first(block[0], synthetic.clouds[0], resting, FIRST, Aligning())
    gap = aligned.camera_from_object - synthetic.camera_from_object
    assert np.abs(gap[:3, 3]).max() < 5e-5 and np.abs(gap[:3, :3]).max() < 5e-4
    assert aligned.contact_point_m == pytest.approx(POINT_M, abs=1e-4)
    known = synthetic.template, aligned
    rest = rest_frames(*known, tips, forces, radius_m=radius, onset_force_n=0.1)
    assert rest.tolist() == list(range(FIRST))
    seen = synthetic.clouds, (tips, synthetic.poses[AXIS].to_numpy()), rest, sensors["kinect"]
    motion = observed_motion(*known, *seen, Observation(), radius_m=radius)
    top = motion.normal @ UP > 0.9
    error = motion.moved_m[:, top] - sunk_m(motion.cell_m[top], DEPTH_M, radius)
    near = np.linalg.norm(motion.cell_m[top] - POINT_M, axis=1) < 0.05
    assert abs(np.nanmean(error[30:LAST, near])) < 1e-5
    assert np.nanstd(error[30:LAST, near]) < 8e-5
    turns = marker_transforms(synthetic.poses)[:, :3, :3]
    record = ProbeRecord(TIME_S, tips, forces, TIP_STD_M, np.inf, clock.offset_s, 0.01, turns)
    surface = SmoothSurface(synthetic.template.vertices_m, synthetic.template.faces)
    on = surface, synthetic.table(), synthetic.support
    one = direct_indentation(record, motion, aligned, *on, Fit())
    moduli = estimate_direct([one], Fit(), radius_m=radius).moduli
    for name, truth in (("youngs_modulus_pa", E), ("poisson_ratio", NU)):
        assert moduli[name].low < truth < moduli[name].high
        assert moduli[name].verdict == "identified"
    assert moduli["effective_reduced_modulus_pa"].value == pytest.approx(E / (1 - NU**2), rel=0.05)


def test_a_tips_covariance_turns_with_the_probe(synthetic, direct, plain):
    """All of an error along the indentation is the depth's, and none the contact place's."""
    turn = marker_transforms(synthetic.poses)[-1, :3, :3]
    inwards = turn.T @ synthetic.camera_from_object[:3, :3] @ -UP
    along = 1e-6 * np.outer(inwards, inwards) + 1e-16 * np.eye(3)
    found = direct(uncertainty=ProbeUncertainty(tip_covariance_m2=along))
    (moves,) = found.shared_roots_m.values()
    assert np.linalg.norm(moves, axis=1) == pytest.approx([1e-3, 0, 0], abs=1e-6)
    assert found.zero_std_m == pytest.approx(np.hypot(plain.offset_std_m, 1e-3), rel=1e-4)
