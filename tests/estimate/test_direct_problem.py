"""From captures to what the direct estimate compares."""

import numpy as np
import pytest
import trimesh
from floor import floor
from palpate.estimate.direct.contact import (
    Contact,
    depth_along,
    least_force,
    loaded_frames,
    oblique,
    unloaded,
)
from palpate.estimate.direct.motion import SurfaceMotion, no_pictures
from palpate.estimate.direct.options import Fit
from palpate.estimate.direct.placement import object_from_table
from palpate.estimate.direct.problem import ProbeRecord, direct_indentation
from palpate.estimate.direct.table import sample_table
from palpate.solid.indentation_table import IndentationModel
from palpate.solid.laws import LAW_NAMES
from palpate.solid.smooth_surface import SmoothSurface
from palpate.surface.alignment import Alignment
from palpate.surface.pose import to_object
from scipy.spatial.transform import Rotation

DOWN = np.array([0.0, 0.0, -1.0])
RADIUS_M = 0.006


def box():
    mesh = trimesh.creation.box(extents=(0.1, 0.1, 0.04))
    return SmoothSurface(np.array(mesh.vertices), np.array(mesh.faces))


def test_depth_counts_from_the_first_touch():
    tips = np.array([[0.01, 0.0, 0.02 + RADIUS_M - d] for d in (-0.003, 0.0, 0.004, 0.009)])
    depth = depth_along(box(), tips, DOWN, radius_m=RADIUS_M)
    assert depth == pytest.approx([-0.003, 0.0, 0.004, 0.009], abs=1e-6)


def test_a_ball_of_few_facets_is_touched_where_the_ball_is():
    mesh = trimesh.creation.icosphere(3, radius=0.06)
    ball = SmoothSurface(np.array(mesh.vertices), np.array(mesh.faces))
    beside = np.array([-0.0008, 0.0, 0.0005, 0.002])
    touch = np.sqrt((0.06 + RADIUS_M) ** 2 - beside**2)
    tips = np.column_stack([beside, np.zeros(4), touch - 0.004])
    depth = depth_along(ball, tips, DOWN, radius_m=RADIUS_M)
    # Facets are 0.15 mm lower in their middles.
    assert depth == pytest.approx([0.004] * 4, abs=3e-5)
    assert np.ptp(depth) < 3e-5


def test_depth_beside_an_edge_counts_from_the_edge():
    beyond = 0.003
    height = np.sqrt(RADIUS_M**2 - beyond**2)
    tips = np.array([[0.05 + beyond, 0.0, 0.02 + height - 0.002]])
    assert depth_along(box(), tips, DOWN, radius_m=RADIUS_M) == pytest.approx([0.002], abs=1e-5)


def test_a_sphere_that_passes_by_meets_no_surface():
    tips = np.array([[0.2, 0.0, 0.03]])
    with pytest.raises(ValueError, match="tip: expected a way along the press that meets"):
        depth_along(box(), tips, DOWN, radius_m=RADIUS_M)


def test_a_wall_beside_the_way_is_no_depth():
    """A sphere that passes it by a hair marches on in hairs, and never arrives."""
    floor = trimesh.creation.box(extents=(0.1, 0.1, 0.04))
    wall = trimesh.creation.box(extents=(0.02, 0.1, 0.2))
    wall.apply_translation([0.01 + RADIUS_M + 2e-5, 0, 0.12])
    mesh = trimesh.util.concatenate([floor, wall])
    surface = SmoothSurface(np.array(mesh.vertices), np.array(mesh.faces))
    with pytest.raises(ValueError, match="tip: expected a way along the press that meets"):
        depth_along(surface, np.array([[0.0, 0.0, 0.03]]), DOWN, radius_m=RADIUS_M)


def press(depth_mm, force_n):
    return np.array(depth_mm) * 1e-3, np.array(force_n, dtype=float)


def contact(depth_mm, force_n, onset):
    return Contact(*press(depth_mm, force_n), least_n=0.1, onset=onset)


def test_a_sound_press_passes():
    contact([-2, -1, 1, 2, 3, 3], [0, 0, 0.2, 0.6, 1, 0.9], 2).check(zero_std_m=1e-3)


@pytest.mark.parametrize(
    ("depth_mm", "force_n", "message"),
    [
        ([-5, -4, -3, -3], [0, 0, 1, 1], "depth: expected a tip .* within 2.5 mm .* 3.0 mm away"),
        ([-1, 1, 2, -1], [0, 0.2, 0.3, 2], "force: expected its peak while the tip presses"),
        ([-5, -4, -3, -5], [0, 0.2, 0.3, 2], "depth: expected a tip that touches"),
        ([-4, -3, -2, -4], [0, 0.2, 0.3, 2], "force: expected its peak .* 1.0 mm above"),
        ([-1, -2, 1, 3], [0, -1, -5, 0.2], "force: expected a press that does work"),
        ([3, 4, 5, 7], [0, 0.2, 0.3, 2], "depth: expected a force that begins .* 3.0 mm inside"),
    ],
)
def test_force_and_depth_that_contradict_each_other(depth_mm, force_n, message):
    with pytest.raises(ValueError, match=message):
        contact(depth_mm, force_n, 1).check(zero_std_m=1e-3)


@pytest.mark.parametrize(
    ("depth_mm", "zero_mm"),
    [
        ([-3, -1, 0.5, 2], 0.0),
        ([-3, -2, -1, 1], -1.0),
        ([-5, -4.2, -3.5, -1], -3.5),
        ([-1, 1.5, 2, 4], 1.5),
    ],
)
def test_the_force_begins_where_the_depth_is_zero_or_says_that_it_is_not(depth_mm, zero_mm):
    found = contact(depth_mm, [0, 0, 0.3, 2], 2)
    assert 1e3 * found.zero_m == pytest.approx(zero_mm)
    assert 1e3 * found.pressed_m == pytest.approx(np.array(depth_mm) - zero_mm)
    # As much as the template is beside the object: a press of a sound one passes.
    found.check(zero_std_m=1e-3)


@pytest.mark.parametrize("rate_hz", [6, 15, 30])
@pytest.mark.parametrize("above_m", [0.0005, 0.006])
def test_noise_is_that_of_frames_at_rest(rate_hz, above_m):
    """Half a second of rest, four of press: the threshold is the stated part of the peak."""
    time = np.arange(0, 6, 1 / rate_hz)
    depth = np.clip((time - 0.5) / 4, 0, 1) * (0.006 + above_m) - above_m
    force = 2e3 * np.maximum(depth, 0) ** 1.5
    force += 0.002 * np.random.default_rng(rate_hz).normal(size=len(time))
    options = Fit()
    least = least_force(force, unloaded(depth, force), options)
    assert least == pytest.approx(options.least_force_share * force.max(), rel=0.25)


def test_a_tip_that_never_rests_has_its_first_frames():
    depth, force = np.linspace(-0.002, 0.006, 20), np.linspace(-0.1, 2, 20)
    assert list(unloaded(depth, force)) == [0, 1, 2]


def test_a_release_is_not_compared():
    depth = (
        np.r_[np.full(3, -2), np.linspace(-2, 6, 9), np.full(5, 6.0), np.linspace(6, -2, 9)] * 1e-3
    )
    force = 2e3 * np.maximum(depth, 0) ** 1.5
    frames = loaded_frames(depth, force, 6, 0.02, tip_std_m=1e-4)
    assert list(frames) == list(range(6, 18))
    held = depth[:17]
    whole = loaded_frames(held, force[:17], 6, 0.02, tip_std_m=1e-4)
    assert list(whole) == list(range(6, 17))


def dent(points, middle):
    """What goes down around a place, less with the distance."""
    away = np.linalg.norm(points - middle, axis=-1)
    return -0.002 / (1 + (away / 0.01) ** 2)


def table_of(mesh, point):
    """Table of a made-up press straight down at a point of a mesh."""
    rest = np.array(mesh.vertices)
    field = np.zeros((len(LAW_NAMES), 2, 2, len(rest), 3))
    field[:, :, 1, :, 2] = dent(rest, point)
    force = np.tile([0.0, 1e-5], (len(LAW_NAMES), 2, 1))
    return IndentationModel(
        point_m=np.array(point),
        direction=DOWN,
        radius_m=RADIUS_M,
        laws=LAW_NAMES,
        poisson_ratios=np.array([0.0, 0.4]),
        depth_m=np.array([0.0, 0.004]),
        force_per_modulus_m2=force,
        surface_rest_m=rest,
        surface_faces=np.array(mesh.faces),
        surface_displacement_m=field,
    )


def fine_box():
    return trimesh.creation.box(extents=(0.1, 0.1, 0.04)).subdivide_to_size(0.003)


def test_a_table_lies_where_the_sphere_presses():
    """5 mm beside the declared point, samples 14 mm away move by up to a half more or less."""
    mesh, beside = fine_box(), np.array([0.005, 0, 0])
    point, table = np.array([0, 0, 0.02]), table_of(fine_box(), [0, 0, 0.02])
    surface = SmoothSurface(np.array(mesh.vertices), np.array(mesh.faces))
    place = object_from_table(table, surface, point + beside - RADIUS_M * DOWN)
    cell = point + 0.014 * np.array([[1.0, 0, 0], [-1, 0, 0], [0, 1, 0]])
    normal = np.tile(-DOWN, (3, 1))
    found = sample_table(table, to_object(place, cell), normal).motion_m[0, 1]
    truth = dent(cell, point + beside)
    assert found == pytest.approx(truth, rel=0.02)
    assert np.abs(sample_table(table, cell, normal).motion_m[0, 1] / truth - 1).max() > 0.3


def test_what_its_place_does_is_told_with_the_table():
    table, point = table_of(fine_box(), [0, 0, 0.02]), np.array([0, 0, 0.02])
    cell = point + np.array([[0.014, 0.003, 0], [-0.02, 0, 0]])
    known = sample_table(table, cell, np.tile(-DOWN, (2, 1)))
    moved = known.motion(np.array([0.004]), 0.2, 0.0, np.array([0.0005, 0.001, 0, 0])).motion_m[0]
    # Across a press downward: it x object's x, and it x that.
    truth = dent(cell, point + [-0.001, -0.0005, 0]) - dent(cell, point)
    still = known.motion(np.array([0.004]), 0.2, 0.0, np.zeros(4)).motion_m[0]
    assert moved - still == pytest.approx(truth, rel=0.15)


def test_a_table_turns_with_a_ball():
    mesh = trimesh.creation.icosphere(5, radius=0.06)
    surface = SmoothSurface(np.array(mesh.vertices), np.array(mesh.faces))
    angle = 0.005 / 0.06
    towards = np.array([np.sin(angle), 0, np.cos(angle)])
    place = object_from_table(table_of(mesh, [0, 0, 0.06]), surface, (0.06 + RADIUS_M) * towards)
    assert place[:3, :3] @ [0, 0, 1] == pytest.approx(towards, abs=0.01)
    assert place[:3, 3] == pytest.approx(np.zeros(3), abs=6e-4)


def test_near_an_edge_a_table_stays_or_is_refused():
    mesh = fine_box()
    surface = SmoothSurface(np.array(mesh.vertices), np.array(mesh.faces))
    point = np.array([0.035, 0, 0.02])
    table = table_of(mesh, point)
    near, far = (point + [by, 0, 0] - RADIUS_M * DOWN for by in (0.0015, 0.005))
    assert np.array_equal(object_from_table(table, surface, near), np.eye(4))
    expected = (
        r"contact: expected within 2 mm .* found 5.0 mm away \(a point .* \[0.04, 0.0, 0.02\]"
    )
    with pytest.raises(ValueError, match=expected):
        object_from_table(table, surface, far)


@pytest.mark.parametrize("degrees", [0.0, 20.0, 90.0])
def test_a_way_beside_the_press(degrees):
    way = np.array([np.sin(np.deg2rad(degrees)), 0, -np.cos(np.deg2rad(degrees))])
    found = oblique(np.array([0.01, 0, 0.03]), np.array([0.01, 0, 0.03]) + 0.02 * way, DOWN)
    assert np.rad2deg(found) == pytest.approx(degrees, abs=1e-6)


def test_what_stands_broad_and_loose():
    mesh, contact = fine_box(), np.array([0, 0, 0.02])
    surface = np.array(mesh.vertices), np.array(mesh.faces)
    loose, bonded = (floor(1e-3, height_m=-0.02, contact=kind) for kind in ("resting", "bonded"))
    assert loose.is_broad(*surface, contact)
    assert not bonded.is_broad(*surface, contact)
    ball = trimesh.creation.icosphere(5, radius=0.06)
    surface = np.array(ball.vertices), np.array(ball.faces)
    assert not floor(1e-3, height_m=-0.06, contact="resting").is_broad(*surface, 3 * contact)


def test_where_a_sphere_first_touched_is_told_by_its_deepest_frames():
    """A way that leans by 20 degrees goes on along the surface: the deep half of it counts."""
    depth = np.array([-0.004, -0.001, 0.002, 0.004, 0.005])
    tips = np.array([0.35 * depth, 0 * depth, 0.02 + RADIUS_M - depth]).T
    depth = depth_along(box(), tips, DOWN, radius_m=RADIUS_M)
    force = np.array([0, 0, 0.5, 1.0, 1.2])
    found = Contact(depth, force, 0.1, 2).first_touch(tips, DOWN)
    assert found == pytest.approx([0.35 * 0.0045, 0, 0.02 + RADIUS_M], abs=1e-5)
    # 6 mm above a template that is too low, the same of them.
    high = Contact(depth - 0.006, force, 0.1, 2).first_touch(tips + [0, 0, 0.006], DOWN)
    assert high == pytest.approx(found, abs=1e-5)


def test_beside_the_point_of_a_ball_the_press_is_along_its_normal_there():
    """13 degrees down the side, unturned, a force would count with its cosine alone."""
    mesh = trimesh.creation.icosphere(5, radius=0.06)
    surface = SmoothSurface(np.array(mesh.vertices), np.array(mesh.faces))
    angle = np.deg2rad(13)
    towards = np.array([np.sin(angle), 0, np.cos(angle)])
    depth = np.r_[np.linspace(-0.012, -0.004, 6), np.linspace(0.0005, 0.003, 6)]
    force = np.where(depth > 0, 500 * np.maximum(depth, 0) ** 1.5, 0.0)
    frames, cell = len(depth), np.array(mesh.triangles_center)
    near = np.linalg.norm(cell - 0.06 * towards, axis=1)
    cell = cell[(near > 0.02) & (near < 0.05)]
    count = len(cell)
    record = ProbeRecord(
        time_s=np.arange(frames) / 6,
        tips_m=np.outer(0.06 + RADIUS_M - depth, towards),
        forces_n=np.outer(-force, towards),
        tip_std_m=1e-4,
        stiffness_n_m=np.inf,
        clock_offset_s=0.0,
        clock_std_s=0.01,
        turns=np.tile(np.eye(3), (frames, 1, 1)),
    )
    motion = SurfaceMotion(
        cell_m=cell,
        normal=cell / 0.06,
        moved_m=np.zeros((frames, count)),
        std_m=np.full((frames, count), 1e-4),
        rest_height_m=np.zeros(count),
        rest_std_m=np.full(count, 1e-5),
        points=np.full((frames, count), 9),
        rest_frames=np.arange(6),
        **no_pictures(frames, count),
    )
    alignment = Alignment(np.eye(4), 0.06 * towards, 6, None)
    support = floor(1e-3, height_m=-0.06)
    table = table_of(mesh, [0, 0, 0.06])
    found = direct_indentation(record, motion, alignment, surface, table, support, Fit())
    assert found.frames.tolist() == list(range(6, 12))
    assert found.depth_m == pytest.approx(depth[6:], abs=3e-5)
    assert found.force_n[6:] == pytest.approx(force[6:], rel=1e-3)
    assert found.sideways_n.max() < 0.02 * force.max()
    assert np.rad2deg(found.oblique_rad) < 1
    assert found.place_expected_m == pytest.approx([0, 0], abs=1e-4)
    # The table's samples are turned back with their normals.
    back = found.cell_m @ Rotation.from_rotvec([0, angle, 0]).as_matrix()
    known, there = sample_table(table, back, back / 0.06).motion_m, found.table.motion_m
    assert there == pytest.approx(known, abs=0.06 * np.abs(known).max())
