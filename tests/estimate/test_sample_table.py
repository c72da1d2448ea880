"""Force and motion of samples between a table's places, and how they are taken from it."""

import numpy as np
import pytest
import trimesh
from made_up_press import RADIUS_M, sliding
from palpate.estimate.direct.support_motion import rocking_axes
from palpate.estimate.direct.table import (
    SampleTable,
    _under,
    sample_table,
    shape_operators,
)
from palpate.solid.indentation_table import IndentationModel
from scipy.optimize import brentq

CELLS = np.array([[0.03, 0, 0], [0, -0.05, 0], [0.02, 0.02, 0]])
DEPTH = np.array([0.0004, 0.0031, 0.0077])


@pytest.fixture(scope="module")
def table():
    return sliding(CELLS)


@pytest.mark.parametrize("law", [0.0, 0.6, -0.4])
def test_depth_is_the_inverse_of_the_force(table, law):
    for nu in (0.1, 0.3, 0.47):
        force = table.force(DEPTH, nu, law)
        found = table.depth(force, nu, law)
        assert found.depth_m == pytest.approx(DEPTH, rel=1e-6)
        knots = table.depth_m[[2, 5, 10]]
        hertz = 4 / 3 * np.sqrt(RADIUS_M) * knots**1.5 / (1 - nu**2)
        harder = (0.4 - 0.4 * nu) * np.sqrt(knots / 0.009)
        assert table.force(knots, nu, law) == pytest.approx(hertz * np.exp(law * harder), rel=2e-3)
        assert table.stiffening_at(knots, nu)[0] == pytest.approx(harder)


def test_derivatives_of_the_depth(table):
    nu, law, step = 0.3, 0.5, 1e-6
    force = table.force(np.append(DEPTH, 0.0088), nu, law)
    found = table.depth(force, nu, law)
    for name, far, near, size in (
        ("by_unit_per_m", (force * (1 + step), nu, law), (force * (1 - step), nu, law), force),
        ("by_nu_m", (force, nu + step, law), (force, nu - step, law), 1),
        ("by_law_m", (force, nu, law + step), (force, nu, law - step), 1),
        ("by_foot_m", (force, nu, law, step), (force, nu, law, -step), 1),
    ):
        slope = (table.depth(*far).depth_m - table.depth(*near).depth_m) / (2 * step * size)
        assert getattr(found, name) == pytest.approx(slope, rel=1e-4)


def test_slope_of_the_stiffening(table):
    ends = [table.stiffening_at(DEPTH, 0.3 + step)[0] for step in (1e-6, -1e-6)]
    assert table.stiffening_at(DEPTH, 0.3)[1] == pytest.approx((ends[0] - ends[1]) / 2e-6)


def test_beyond_the_table_the_power_of_the_force_goes_on_straight(table):
    last = table.depth_m[-1]
    power, slope, *_ = table._power(np.array([last, last + 0.001]), 0.3, 0.5, 0.0)
    assert power[1] == pytest.approx(power[0] + 0.001 * slope[0])
    wanted = power[1] ** 1.5
    assert table.depth(np.array([wanted]), 0.3, 0.5).depth_m == pytest.approx([last + 0.001])
    assert table.force(np.array([last + 0.001]), 0.3, 0.5) == pytest.approx(power[0] ** 1.5)
    assert table.depth(np.array([0.0]), 0.3, 0.5).depth_m[0] < 1e-5


def test_motion_and_its_derivatives(table):
    nu, law, place = 0.3, 0.5, np.array([2e-4, -3e-4, 1e-4, 4e-4])
    found = table.motion(DEPTH, nu, law, place)
    r = np.linalg.norm(CELLS, axis=1)
    sinks = -DEPTH[:, None] * RADIUS_M / r * (1 - (0.5 + 2 * nu**2) * (r / 0.1))
    stiffening = (0.4 - 0.4 * nu) * np.sqrt(DEPTH / 0.009)
    drawn = -0.2 * stiffening[:, None] * DEPTH[:, None] * (RADIUS_M / r) ** 2
    at_rest = table.motion(DEPTH, nu, law, np.zeros(4)).motion_m
    assert at_rest == pytest.approx(sinks + law * drawn, rel=0.02)
    step = 1e-6
    for name, far, near in (
        ("by_depth", (DEPTH + step, nu, law, place), (DEPTH - step, nu, law, place)),
        ("by_nu_m", (DEPTH, nu + step, law, place), (DEPTH, nu - step, law, place)),
        ("by_law_m", (DEPTH, nu, law + step, place), (DEPTH, nu, law - step, place)),
        ("by_foot_m", (DEPTH, nu, law, place, step), (DEPTH, nu, law, place, -step)),
    ):
        slope = (table.motion(*far).motion_m - table.motion(*near).motion_m) / (2 * step)
        assert getattr(found, name) == pytest.approx(slope, rel=1e-4, abs=1e-9)
    for k in range(4):
        aside = step * np.eye(4)[k]
        ends = [table.motion(DEPTH, nu, law, place + sign * aside).motion_m for sign in (1, -1)]
        assert found.by_place[k] == pytest.approx((ends[0] - ends[1]) / (2 * step), rel=1e-6)


def test_nothing_moves_before_the_contact_and_all_goes_on_beyond_the_table(table):
    depth = np.array([-0.001, table.depth_m[-1], table.depth_m[-1] + 0.002])
    found = table.motion(depth, 0.3, 0.5, np.zeros(4))
    assert np.abs(found.motion_m[0]).max() < 1e-15 and not found.by_depth[0].any()
    further = found.motion_m[1] + 0.002 * found.by_depth[1]
    assert found.motion_m[2] == pytest.approx(further, rel=1e-9)
    assert found.by_depth[2] == pytest.approx(found.by_depth[1])


def test_how_a_spheres_normals_turn():
    """By 1/R along the sphere, by nothing across; a flat's by nothing at all."""
    ball = trimesh.creation.icosphere(3, radius=0.05)
    normal = ball.vertices / 0.05
    found = shape_operators(np.array(ball.vertices), normal)
    tangent = np.eye(3) - normal[:, :, None] * normal[:, None, :]
    assert found == pytest.approx(tangent / 0.05, abs=0.1)
    flat = np.random.default_rng(1).uniform(size=(20, 3)) * [1, 1, 0]
    assert not shape_operators(flat, np.tile([0, 0, 1.0], (20, 1))).any()
    # Samples of two faces at a right angle tell each other nothing.
    side = np.tile([[0, 0, 1.0], [1, 0, 0]], (10, 1))
    assert np.abs(shape_operators(flat, side)).max() < 1e-12


def ball_table(moves):
    """Table of a ball whose surface moves as a function of its place says, at full depth."""
    ball = trimesh.creation.icosphere(4, radius=0.05)
    rest = np.array(ball.vertices)
    depth = np.array([0.0, 0.001])
    move = np.stack([np.zeros_like(rest), moves(rest)])
    return IndentationModel(
        point_m=np.array([0, 0, 0.05]),
        direction=np.array([0.0, 0, -1]),
        radius_m=RADIUS_M,
        laws=("neo_hookean", "blatz_ko"),
        poisson_ratios=np.array([0.0, 0.4]),
        depth_m=depth,
        force_per_modulus_m2=np.array([[[0.0, 1], [0, 2]], [[0, 3], [0, 4]]]),
        surface_rest_m=rest,
        surface_faces=np.array(ball.faces),
        surface_displacement_m=np.stack([[move, move], [2 * move, 2 * move]]).astype(np.float32),
    )


def test_a_shifted_balls_motion_along_its_normals():
    """Where a line through the old centre meets a sphere that was shifted by s across it."""
    shift = np.array([0.001, 0.002, -0.0015])
    moved = ball_table(lambda rest: np.tile(shift, (len(rest), 1)))
    rng = np.random.default_rng(3)
    normal = rng.normal(size=(40, 3))
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    # Neighbours tell how the surface bends.
    normal = np.concatenate([normal, *(normal + rng.normal(0, 0.03, (5, 40, 3)))])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    found = sample_table(moved, 0.05 * normal, normal)
    along = normal @ shift
    across = (shift**2).sum() - along**2
    expected = along + np.sqrt(0.05**2 - across) - 0.05
    assert found.motion_m[1, 1, :40] == pytest.approx(expected[:40], abs=1e-5)
    # Three times and twice as hard under the second law.
    assert found.stiffening[:, 1] == pytest.approx(np.log([3, 2]))
    assert not found.motion_m[:, 0].any() and not found.stiffening[:, 0].any()
    # It moves twice as far at a depth, and has the first one's force at a part of it.
    part = brentq(lambda x: x * 3 ** (2 / 3 * x) - 1, 0.1, 1)
    twice = part * (2 * along + np.sqrt(0.05**2 - 4 * across) - 0.05)
    assert found.motion_change_m[0, 1, :40] == pytest.approx((twice - expected)[:40], abs=4e-5)


def test_what_was_at_a_sample_moves_along_any_way():
    shift = np.array([0.001, 0.002, -0.0015])
    moved = ball_table(lambda rest: np.tile(shift, (len(rest), 1)))
    cell = np.array([[0, 0, 0.05], [0.03, 0, 0.04], [0, -0.03, 0.04], [0, 0.05, 0]])
    way = np.array([[1.0, 0, 0], [0, 1, 0], [0.6, 0, 0.8], [0, 1, 0]])
    found = sample_table(moved, cell, way, material=np.array([True, True, True, False]))
    assert found.motion_m[0, 1, :3] == pytest.approx(way[:3] @ shift, abs=1e-7)
    # The last one is where the surface comes to lie on its normal.
    assert found.motion_m[0, 1, 3] == pytest.approx(0.002, abs=1e-4)


def test_what_a_window_follows_is_the_mean_over_it():
    """Of a motion that grows with the square of x: a twelfth of the side's square beside it."""
    bent = ball_table(lambda rest: np.outer(10 * rest[:, 0] ** 2, [0, 0, 1.0]))
    cell, way = np.array([[0.0, 0, 0.05], [0.01, 0, 0.049]] * 2), np.tile([0.0, 0, 1], (4, 1))
    windows, followed = np.array([[[0.012, 0, 0], [0, 0.01, 0]]] * 4), np.arange(4) < 2
    found = sample_table(bent, cell, way, material=followed, window_m=windows).motion_m[0, 1]
    wider = followed * 0.012**2 / 12
    assert found == pytest.approx(10 * (cell[:, 0] ** 2 + wider), abs=3e-4 * 0.1)


def test_a_softer_law_is_deeper_under_the_same_force_and_moves_no_more_far_off():
    """Half as hard as the first: what is moved in proportion to the force is moved alike."""
    depth = np.linspace(0, 0.004, 9)
    force = np.array([depth**1.5, 0.9 * depth**1.5])
    none = np.zeros((*force.shape, 0))
    half = np.where(depth > 0, np.log(0.5), 0.0) * np.ones_like(force)
    forces = SampleTable(
        np.array([0.0, 0.4]),
        depth,
        force,
        half,
        none,
        none,
        0 * force,
        none,
        np.zeros((2, 2, 9, 0)),
    )
    moved = np.array([[0.3 * f, f] for f in 0.5 * force]).swapaxes(1, 2)
    under = _under(forces, moved)
    inside = depth * 2 ** (2 / 3) <= depth[-1]
    assert under[:, inside] == pytest.approx(2 * moved[:, inside], rel=0.02, abs=1e-6)
    # Beyond the table it goes on as it ended.
    assert under == pytest.approx(2 * moved, rel=0.1, abs=1e-6)


def test_a_contact_farther_on_is_a_sample_farther_back():
    """A motion that grows along x by 1 % of the way, at a flat's samples."""
    tilted = ball_table(lambda rest: np.outer(0.01 * rest[:, 0], [0, 0, 1.0]))
    cells = np.array([[0.0, 0, 0.05], [0.001, 0, 0.05], [0, 0.001, 0.05], [-0.001, 0, 0.05]])
    normal = np.tile([0.0, 0, 1], (4, 1))
    found = sample_table(tilted, cells, normal)
    assert not found.motion_by_place[2:].any()
    followed = np.arange(4) < 3
    both = sample_table(tilted, cells, normal, material=followed).motion_by_place
    assert both[2:] == pytest.approx(both[:2] * followed)
    by_place = found.motion_by_place[:2, 0, 1, 0]
    # Along x, whichever axis that is; nothing along y.
    assert np.sort(np.abs(by_place)) == pytest.approx([0, 0.01], abs=1e-4)
    x = int(np.argmax(np.abs(by_place)))
    axis = rocking_axes(np.array([0.0, 0, -1]))[x]
    assert by_place[x] == pytest.approx(-0.01 * axis[0], abs=1e-4)
