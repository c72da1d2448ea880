"""Force and motion between a table's places, how they are taken from it, and E of a curve by it."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh
from made_up_indentation import NO_RIG, RADIUS_M, made_up_table
from palpate import hertz
from palpate.estimate.curve import estimate_curve
from palpate.estimate.direct.options import Fit, ModelStd
from palpate.estimate.direct.prior import FARTHEST_LAW
from palpate.estimate.direct.table import sample_table
from palpate.solid.indentation_table import IndentationModel
from palpate.solid.laws import SLIDING
from scipy.optimize import brentq

CELLS = np.array([[0.03, 0, 0], [0, -0.05, 0], [0.02, 0.02, 0]])
DEPTH = np.array([0.0004, 0.0031, 0.0077])
TABLE = made_up_table(CELLS)


@pytest.mark.parametrize("law", [0.0, 0.6, -0.4])
def test_depth_is_the_inverse_of_the_force(law):
    for nu in (0.1, 0.3, 0.47):
        force = TABLE.force(DEPTH, nu, law)
        found = TABLE.depth(force, nu, law)
        assert found.depth_m == pytest.approx(DEPTH, rel=1e-6)
        knots = TABLE.depth_m[[2, 5, 10]]
        hertz = 4 / 3 * np.sqrt(RADIUS_M) * knots**1.5 / (1 - nu**2)
        harder = (0.4 - 0.4 * nu) * np.sqrt(knots / 0.009)
        assert TABLE.force(knots, nu, law) == pytest.approx(hertz * np.exp(law * harder), rel=2e-3)
        assert TABLE.stiffening_at(knots, nu)[0] == pytest.approx(harder)
        ends = [TABLE.stiffening_at(DEPTH, nu + step)[0] for step in (1e-6, -1e-6)]
        assert TABLE.stiffening_at(DEPTH, nu)[1] == pytest.approx((ends[0] - ends[1]) / 2e-6)


def test_beyond_the_table_the_power_of_the_force_goes_on_straight():
    last = TABLE.depth_m[-1]
    before, end, beyond = TABLE.force(last + np.array([-1e-6, 0, 1e-3]), 0.3, 0.5) ** (2 / 3)
    assert beyond == end
    wanted = np.array([end + 1e-3 * (end - before) / 1e-6]) ** 1.5
    assert TABLE.depth(wanted, 0.3, 0.5).depth_m == pytest.approx([last + 0.001], abs=1e-6)
    assert TABLE.depth(np.array([0.0]), 0.3, 0.5).depth_m[0] < 1e-5


def test_displacement_between_before_and_beyond_the_places_of_the_table():
    nu, law = 0.3, 0.5
    r = np.linalg.norm(CELLS, axis=1)
    sinking = -DEPTH[:, None] * RADIUS_M / r * (1 - (0.5 + 2 * nu**2) * (r / 0.1))
    stiffening = (0.4 - 0.4 * nu) * np.sqrt(DEPTH / 0.009)
    drawn = -0.2 * stiffening[:, None] * DEPTH[:, None] * (RADIUS_M / r) ** 2
    at_rest = TABLE.motion(DEPTH, nu, law, np.zeros(2)).motion_m
    assert at_rest == pytest.approx(sinking + law * drawn, rel=0.02)
    depth = np.array([-0.001, TABLE.depth_m[-1], TABLE.depth_m[-1] + 0.002])
    found = TABLE.motion(depth, 0.3, 0.5, np.zeros(2))
    assert np.abs(found.motion_m[0]).max() < 1e-15 and not found.by_depth[0].any()
    further = found.motion_m[1] + 0.002 * found.by_depth[1]
    assert found.motion_m[2] == pytest.approx(further, rel=1e-9)
    assert found.by_depth[2] == pytest.approx(found.by_depth[1])


def ball_table(moves):
    """Table of a ball whose surface moves as a function of its place says, at full depth."""
    ball = trimesh.creation.icosphere(4, radius=0.05)
    rest = np.array(ball.vertices)
    move = np.stack([np.zeros_like(rest), moves(rest)])
    return IndentationModel(
        point_m=np.array([0, 0, 0.05]),
        direction=np.array([0.0, 0, -1]),
        radius_m=RADIUS_M,
        laws=("neo_hookean", "blatz_ko"),
        poisson_ratios=np.array([0.0, 0.4]),
        depth_m=np.array([0.0, 0.001]),
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


E_PA, NU, NOISE_N = 40e3, 0.4, 0.004
OPTIONS = Fit(rig=NO_RIG, model_std=ModelStd(log_youngs_modulus=0.0, nu=0.0, sphere_friction=0.0))


@pytest.fixture(scope="module")
def model():
    force, still = TABLE.force_per_modulus_m2, ball_table(lambda rest: 0 * rest)
    return replace(
        still,
        poisson_ratios=TABLE.poisson_ratios,
        depth_m=TABLE.depth_m,
        force_per_modulus_m2=np.stack([force, force * np.exp(TABLE.stiffening)]),
        surface_displacement_m=np.zeros((2, *force.shape, *still.surface_rest_m.shape), np.float32),
    )


def fitted(seed=3, *, law=0.0, wrong=slice(0), **options):
    """A curve of a material that stiffens by a law; samples of `wrong` are so by 0.2 N."""
    depth = np.linspace(0, 0.008, 300)
    force = E_PA * TABLE.force(depth - 0.002, NU, law) + 0.05
    force += NOISE_N * np.random.default_rng(seed).normal(size=300)
    force[wrong] += 0.2
    return hertz.fit(depth, force, radius_m=RADIUS_M, **options)


def modulus(curve, model, ratios=(NU, NU), options=OPTIONS):
    return estimate_curve(curve, model, ratios, options).moduli["youngs_modulus_pa"]


@pytest.mark.parametrize("law", [0.0, 0.7, -0.4])
def test_the_truth_lies_in_the_interval_whatever_the_law(model, law):
    found = estimate_curve(fitted(law=law), model, (NU, NU), OPTIONS)
    E, nu = found.moduli["youngs_modulus_pa"], found.moduli["poisson_ratio"]
    assert E.low < E_PA < E.high
    assert (nu.value, nu.low, nu.high, nu.verdict) == (pytest.approx(NU), NU, NU, "assumed")
    assert abs(found.force_law - law) < 2.5 * found.force_law_std
    assert found.contact_m == pytest.approx(0.002, abs=1e-4)
    assert found.baseline_n == pytest.approx(0.05, abs=0.003)
    assert found.rms_n == pytest.approx(NOISE_N, rel=0.15)


@pytest.mark.parametrize("law", [1.2, 3.0, -3.0])
def test_a_law_beyond_the_range_is_warned_of(model, law):
    """Where the force might fall with depth, the direct estimate does not look either."""
    found = estimate_curve(fitted(law=law), model, (NU, NU), OPTIONS.changed(force_law_std=5.0))
    assert abs(found.force_law) <= FARTHEST_LAW
    warned = any("an end of its range" in line for line in found.warnings)
    assert warned is (abs(law) > FARTHEST_LAW)


def test_intervals_hold_the_truth_as_often_as_they_say(model):
    laws = np.random.default_rng(5).normal(0, 0.5, 40)
    moduli = [modulus(fitted(seed, law=law), model) for seed, law in enumerate(laws)]
    assert sum(one.low < E_PA < one.high for one in moduli) >= 34


def test_weights_of_the_curve_are_those_of_the_fit(model):
    wrong, weights = slice(200, 220), np.ones(300)
    weights[wrong] = 1e-6
    E = [modulus(fitted(wrong=wrong, weights=one), model) for one in (weights, None)]
    assert E[0].low < E_PA < E[0].high
    assert abs(E[0].value / E_PA - 1) < 0.5 * abs(E[1].value / E_PA - 1)


def test_what_is_not_known_of_nu_and_the_rig_widens_e(model):
    curve = fitted()
    known, bounded = (modulus(curve, model, ratios) for ratios in ((NU, NU), (0.2, 0.49)))
    assert bounded.low < known.low and known.high < bounded.high
    real = modulus(curve, model, options=Fit())
    assert real.value == pytest.approx(known.value)
    # 1 % of the force, 1.5 % of the table and 0.6 % by friction at the sphere, at 95 %.
    narrow, wider = (np.log(one.high / one.low) / 2 for one in (known, real))
    added = 1.96 * np.hypot(0.018, 0.006)
    assert np.sqrt(wider**2 - narrow**2) == pytest.approx(added, rel=0.05)


def test_what_the_table_does_not_hold_is_refused(model):
    short = replace(
        model,
        depth_m=model.depth_m[:7],
        force_per_modulus_m2=model.force_per_modulus_m2[..., :7],
        surface_displacement_m=model.surface_displacement_m[:, :, :7],
    )
    with pytest.raises(ValueError, match=r"deepest_m: expected at least the curve's [56]\."):
        modulus(fitted(), short)
    with pytest.raises(ValueError, match=r"poisson_ratio: expected from 0 to 0.4999, low"):
        modulus(fitted(), model, (0.49, 0.3))
