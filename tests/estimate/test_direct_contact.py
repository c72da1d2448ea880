"""Where a sphere touches a surface, which frames are compared, and a capture on a ball."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh
from floor import floor
from made_up_indentation import displacement_of
from palpate.estimate.direct.contact import Contact, depth_along, object_from_table
from palpate.estimate.direct.options import Fit
from palpate.estimate.direct.problem import ProbeRecord, direct_indentation
from palpate.estimate.direct.table import sample_table
from palpate.solid.indentation_table import IndentationModel
from palpate.solid.laws import LAW_NAMES
from palpate.solid.smooth_surface import SmoothSurface
from palpate.surface.alignment import Alignment
from scipy.spatial.transform import Rotation

UP, DOWN = np.array([0.0, 0, 1]), np.array([0.0, 0, -1])
RADIUS_M, BALL_M = 0.006, 0.06


def smooth(mesh):
    return SmoothSurface(np.array(mesh.vertices), np.array(mesh.faces))


def box():
    return trimesh.creation.box(extents=(0.1, 0.1, 0.04))


def ball(subdivisions):
    return trimesh.creation.icosphere(subdivisions, radius=BALL_M)


def depth_of(mesh, tips):
    return depth_along(smooth(mesh), np.array(tips), DOWN, radius_m=RADIUS_M)


def test_depth_counts_from_the_first_touch():
    """Also beside an edge; and of a ball, whose facets are 0.15 mm lower in their middles."""
    tips = [[0.01, 0.0, 0.02 + RADIUS_M - d] for d in (-0.003, 0.0, 0.004, 0.009)]
    assert depth_of(box(), tips) == pytest.approx([-0.003, 0.0, 0.004, 0.009], abs=1e-6)
    beyond = 0.003
    height = np.sqrt(RADIUS_M**2 - beyond**2)
    tips = [[0.05 + beyond, 0.0, 0.02 + height - 0.002]]
    assert depth_of(box(), tips) == pytest.approx([0.002], abs=1e-5)
    beside = np.array([-0.0008, 0.0, 0.0005, 0.002])
    touch = np.sqrt((BALL_M + RADIUS_M) ** 2 - beside**2)
    depth = depth_of(ball(3), np.column_stack([beside, np.zeros(4), touch - 0.004]))
    assert depth == pytest.approx([0.004] * 4, abs=3e-5)


def box_beside_a_wall():
    """A sphere that passes the wall by a hair marches on in hairs, and never arrives."""
    wall = trimesh.creation.box(extents=(0.02, 0.1, 0.2))
    wall.apply_translation([0.01 + RADIUS_M + 2e-5, 0, 0.12])
    return trimesh.util.concatenate([box(), wall])


@pytest.mark.parametrize(
    ("mesh", "tip"), [(box(), [0.2, 0.0, 0.03]), (box_beside_a_wall(), [0.0, 0.0, 0.03])]
)
def test_a_sphere_that_meets_no_surface_has_no_depth(mesh, tip):
    with pytest.raises(ValueError, match="tip: expected"):
        depth_of(mesh, [tip])


def contact(depth_mm, force_n, onset):
    depth = np.array(depth_mm) * 1e-3
    return Contact(depth, np.array(force_n, dtype=float), least_n=0.1, onset=onset)


@pytest.mark.parametrize(
    ("depth_mm", "force_n", "message"),
    [
        ([-5, -4, -3, -3], [0, 0, 1, 1], "depth: expected a tip .* within 2.5 mm .* 3.0 mm away"),
        ([-1, 1, 2, -1], [0, 0.2, 0.3, 2], "force: expected its peak"),
        ([-5, -4, -3, -5], [0, 0.2, 0.3, 2], "depth: expected a tip that touches"),
        ([-4, -3, -2, -4], [0, 0.2, 0.3, 2], "force: expected its peak .* 1.0 mm above"),
        ([-1, -2, 1, 3], [0, -1, -5, 0.2], "force: expected"),
        ([3, 4, 5, 7], [0, 0.2, 0.3, 2], "depth: expected a force that begins .* 3.0 mm inside"),
    ],
)
def test_force_and_depth_that_contradict_each_other(depth_mm, force_n, message):
    with pytest.raises(ValueError, match=message):
        contact(depth_mm, force_n, 1).check(zero_std_m=1e-3)


def test_the_force_begins_where_the_depth_is_zero_or_an_offset_is_found():
    """As much as the template is beside the object: a sound capture passes."""
    for depth_mm, offset_mm in (
        ([-3, -1, 0.5, 2], 0.0),
        ([-3, -2, -1, 1], -1.0),
        ([-5, -4.2, -3.5, -1], -3.5),
        ([-1, 1.5, 2, 4], 1.5),
    ):
        found = contact(depth_mm, [0, 0, 0.3, 2], 2)
        assert 1e3 * found.zero_m == pytest.approx(offset_mm)
        assert 1e3 * found.pressed_m == pytest.approx(np.array(depth_mm) - offset_mm)
        found.check(zero_std_m=1e-3)


@pytest.mark.parametrize("rate_hz", [6, 15, 30])
@pytest.mark.parametrize("above_m", [0.0005, 0.006])
def test_noise_is_that_of_frames_without_load(rate_hz, above_m):
    """Half a second at rest, then a ramp: the threshold is the stated part of the peak."""
    time = np.arange(0, 6, 1 / rate_hz)
    depth = np.clip((time - 0.5) / 4, 0, 1) * (0.006 + above_m) - above_m
    force = 2e3 * np.maximum(depth, 0) ** 1.5
    force += 0.002 * np.random.default_rng(rate_hz).normal(size=len(time))
    options = Fit()
    least = Contact.of(depth, force, options).least_n
    assert least == pytest.approx(options.least_force_share * force.max(), rel=0.25)


@pytest.mark.parametrize("off_m", [0.0, 0.006])
def test_where_a_sphere_first_touched_is_found_from_the_deepest_frames(off_m):
    """A path that is tilted goes on along the surface: the deep half of it counts.

    The same of them 6 mm above a template that is too low.
    """
    depth = np.array([-0.004, -0.001, 0.002, 0.004, 0.005])
    tips = np.array([0.35 * depth, 0 * depth, 0.02 + RADIUS_M - depth]).T
    depth = depth_of(box(), tips)
    force = np.array([0, 0, 0.5, 1.0, 1.2])
    found = Contact(depth - off_m, force, 0.1, 2).first_touch(tips + [0, 0, off_m], DOWN)
    assert found == pytest.approx([0.35 * 0.0045, 0, 0.02 + RADIUS_M], abs=1e-5)


@pytest.mark.parametrize(
    ("height_m", "contact", "broad"),
    [(0.045, "resting", True), (0.0455, "resting", False), (0.02, "bonded", False)],
)
def test_a_base_is_broad_compared_with_the_height_of_the_contact(height_m, contact, broad):
    """A box of 40 x 40 mm: as a disc of 22.6 mm, half of 45 mm."""
    column = trimesh.creation.box((0.04, 0.04, 0.1)).apply_translation([0, 0, 0.05])
    surface = np.array(column.vertices), np.array(column.faces)
    assert floor(1e-3, contact=contact).is_broad(*surface, height_m * UP) == broad


def table_of(mesh, point):
    """Table of a made-up indentation straight down at a point of a mesh."""
    rest = np.array(mesh.vertices)
    field = np.zeros((len(LAW_NAMES), 2, 2, len(rest), 3))
    field[:, :, 1, :, 2] = -0.002 / (1 + (np.linalg.norm(rest - point, axis=-1) / 0.01) ** 2)
    force = np.tile([0.0, 1e-5], (len(LAW_NAMES), 2, 1))
    return IndentationModel(
        point_m=np.array(point),
        direction=-np.array(point) / np.linalg.norm(point),
        radius_m=RADIUS_M,
        laws=LAW_NAMES,
        poisson_ratios=np.array([0.0, 0.4]),
        depth_m=np.array([0.0, 0.004]),
        force_per_modulus_m2=force,
        surface_rest_m=rest,
        surface_faces=np.array(mesh.faces),
        surface_displacement_m=field,
    )


@pytest.mark.parametrize("seed", range(20))
def test_a_table_turns_with_the_surface_and_not_with_its_facets(seed):
    """On a ball of facets that meet at 13 degrees, to a place 3.6 mm beside."""
    rng, surface = np.random.default_rng(seed), smooth(ball(2))
    towards = rng.normal(size=3)
    towards /= np.linalg.norm(towards)
    beside = np.cross(towards, rng.normal(size=3))
    there = towards + 0.06 * beside / np.linalg.norm(beside)
    there /= np.linalg.norm(there)
    rest = trimesh.Trimesh(surface.nearest(np.array(ball(4).vertices)), ball(4).faces)
    table = table_of(rest, BALL_M * towards)
    found = object_from_table(table, surface, (BALL_M + RADIUS_M) * there)
    # A degree is 0.017.
    assert found[:3, :3] @ towards == pytest.approx(there, abs=0.004)
    assert found[:3, 3] == pytest.approx(np.zeros(3), abs=6e-4)


def test_beside_the_point_of_a_ball_the_indentation_is_along_its_normal_there():
    """13 degrees down the side, unturned, a force would count with its cosine alone."""
    mesh, angle = ball(5), np.deg2rad(13)
    towards = np.array([np.sin(angle), 0, np.cos(angle)])
    depth = np.r_[np.linspace(-0.012, -0.004, 6), np.linspace(0.0005, 0.003, 6)]
    force = np.where(depth > 0, 500 * np.maximum(depth, 0) ** 1.5, 0.0)
    frames, cell = len(depth), np.array(mesh.triangles_center)
    near = np.linalg.norm(cell - BALL_M * towards, axis=1)
    cell = cell[(near > 0.02) & (near < 0.05)]
    tips, forces = np.outer(BALL_M + RADIUS_M - depth, towards), np.outer(-force, towards)
    turns = np.tile(np.eye(3), (frames, 1, 1))
    record = ProbeRecord(np.arange(frames) / 6, tips, forces, 1e-4, np.inf, 0.0, 0.01, turns)
    motion = displacement_of(cell, cell / BALL_M, np.zeros((frames, len(cell))))
    alignment = Alignment(np.eye(4), BALL_M * towards, 6, None)
    support, table = floor(1e-3, height_m=-BALL_M), table_of(mesh, BALL_M * UP)

    def indentation(record):
        return direct_indentation(record, motion, alignment, smooth(mesh), table, support, Fit())

    found = indentation(record)
    assert found.frames.tolist() == list(range(6, 12))
    assert found.depth_m == pytest.approx(depth[6:], abs=3e-5)
    assert found.force_n[6:] == pytest.approx(force[6:], rel=1e-3)
    assert np.rad2deg(found.oblique_rad) < 1
    aside = np.outer(np.tan(np.deg2rad(20)) * depth, [0, 1, 0])
    oblique = indentation(replace(record, tips_m=record.tips_m + aside)).oblique_rad
    assert np.rad2deg(oblique) == pytest.approx(20, abs=2)
    assert found.place_expected_m == pytest.approx([0, 0], abs=1e-4)
    # The table's samples are turned back with their normals.
    back = found.cell_m @ Rotation.from_rotvec([0, angle, 0]).as_matrix()
    known, there = sample_table(table, back, back / BALL_M).motion_m, found.table.motion_m
    assert there == pytest.approx(known, abs=0.06 * np.abs(known).max())
