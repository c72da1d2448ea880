"""Force and motion of samples between a table's places, and how they are taken from it."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh
from made_up_indentation import RADIUS_M, made_up_table
from palpate.estimate.direct.table import sample_table
from palpate.solid.indentation_table import IndentationModel
from palpate.solid.laws import SLIDING
from scipy.optimize import brentq

CELLS = np.array([[0.03, 0, 0], [0, -0.05, 0], [0.02, 0.02, 0]])
DEPTH = np.array([0.0004, 0.0031, 0.0077])


@pytest.fixture(scope="module")
def table():
    return made_up_table(CELLS)


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
        ends = [table.stiffening_at(DEPTH, nu + step)[0] for step in (1e-6, -1e-6)]
        assert table.stiffening_at(DEPTH, nu)[1] == pytest.approx((ends[0] - ends[1]) / 2e-6)


def test_beyond_the_table_the_power_of_the_force_goes_on_straight(table):
    last = table.depth_m[-1]
    before, end, beyond = table.force(last + np.array([-1e-6, 0, 1e-3]), 0.3, 0.5) ** (2 / 3)
    assert beyond == end
    wanted = np.array([end + 1e-3 * (end - before) / 1e-6]) ** 1.5
    assert table.depth(wanted, 0.3, 0.5).depth_m == pytest.approx([last + 0.001], abs=1e-6)
    assert table.depth(np.array([0.0]), 0.3, 0.5).depth_m[0] < 1e-5


def test_displacement_between_before_and_beyond_the_places_of_the_table(table):
    nu, law = 0.3, 0.5
    r = np.linalg.norm(CELLS, axis=1)
    sinking = -DEPTH[:, None] * RADIUS_M / r * (1 - (0.5 + 2 * nu**2) * (r / 0.1))
    stiffening = (0.4 - 0.4 * nu) * np.sqrt(DEPTH / 0.009)
    drawn = -0.2 * stiffening[:, None] * DEPTH[:, None] * (RADIUS_M / r) ** 2
    at_rest = table.motion(DEPTH, nu, law, np.zeros(2)).motion_m
    assert at_rest == pytest.approx(sinking + law * drawn, rel=0.02)
    depth = np.array([-0.001, table.depth_m[-1], table.depth_m[-1] + 0.002])
    found = table.motion(depth, 0.3, 0.5, np.zeros(2))
    assert np.abs(found.motion_m[0]).max() < 1e-15 and not found.by_depth[0].any()
    further = found.motion_m[1] + 0.002 * found.by_depth[1]
    assert found.motion_m[2] == pytest.approx(further, rel=1e-9)
    assert found.by_depth[2] == pytest.approx(found.by_depth[1])


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


def test_a_broad_base_slides_half_way():
    """Half as hard and twice as far where it slides: means of log force and of displacement."""
    ball = ball_table(lambda rest: np.tile([0.0, 0.0, -0.001], (len(rest), 1)))
    force, moved = ball.force_per_modulus_m2, ball.surface_displacement_m
    slides = replace(
        ball,
        laws=(*ball.laws, ball.laws[0] + SLIDING),
        force_per_modulus_m2=np.concatenate([force, force[:1] / 2]),
        surface_displacement_m=np.concatenate([moved, 2 * moved[:1]]),
    )
    top = np.array([[0.0, 0.0, 0.05]]), np.array([[0.0, 0.0, 1.0]])
    stuck, found = (sample_table(one, *top) for one in (ball, slides))
    assert found.softer is not None and stuck.softer is None
    assert found.force_per_modulus_m2 == pytest.approx(stuck.force_per_modulus_m2 / np.sqrt(2))
    assert found.motion_m == pytest.approx(1.5 * stuck.motion_m, abs=1e-6)
    assert found.stiffening == pytest.approx(stuck.stiffening)
