"""Hertz fits of made-up captures: what a wrong zero of the depth and forces across may do."""

import numpy as np
import pytest
from palpate.estimate.direct.options import Rig
from palpate.estimate.hertz.indentation import indentation_of
from palpate.estimate.hertz.laws import contact_law, finite_strain_factor
from palpate.estimate.hertz.models import estimate_hertz, fit_model
from palpate.estimate.hertz.options import Hertz
from palpate.solid.support import Support
from palpate.surface.alignment import Alignment, AlignmentResidual
from palpate.surface.template import Template
from trimesh.creation import box

R, TRUTH, NU, HEIGHT = 0.00622, 27473.0, 0.3, 0.0475
TIP_STD_M, NOISE_N, TO_DEEPEST, WHOLE = 5e-5, 0.005, 25, 36
MODEL = {"indenter": "sneddon", "support": "bonded", "contact": "free"}
OPTIONS = Hertz(assumed_poisson_ratio=NU)
TIME = np.arange(WHOLE) / 6
# The alignment has made its own residual small, whatever its error.
RESIDUAL = AlignmentResidual(1e-3, 5e-4, 1.7e-4, 5e-4, 300)


def depths(late_s=0.0):
    """Twelve frames of approach, twelve down to 7.5 mm, twelve held there [m]."""
    return np.clip((TIME + late_s - 1.95) * 0.0037, -0.007, 0.0075)


def force_of(depth_m):
    small = contact_law("sneddon", "bonded", radius_m=R, thickness_m=HEIGHT, nu=NU)
    return TRUTH * small(depth_m) * finite_strain_factor(depth_m / R, NU)


def pressed(zero_m=0.0, across=0.0, noise_n=NOISE_N, frames=WHOLE, seed=1, late_s=0.0, first=0):
    """Press of the middle of a block, its depth's zero off; across it friction, of that part.

    Forces are read so much later than they say.
    """
    block, rng, depth = box((0.3, 0.2, HEIGHT)), np.random.default_rng(seed), depths()
    tip = HEIGHT / 2 + R - depth - zero_m + rng.normal(0, TIP_STD_M, len(TIME))
    force = force_of(depths(late_s))
    # To one side and the other, from frame to frame.
    forces = np.stack([across * force * (-1) ** np.arange(len(TIME)), 0 * force, -force], axis=1)
    return indentation_of(
        Template(np.asarray(block.vertices), np.asarray(block.faces)),
        Support(np.array([0, 0, -HEIGHT / 2]), np.array([0.0, 0, 1]), 0.001),
        Alignment(np.eye(4), np.array([0, 0, HEIGHT / 2]), 12, RESIDUAL),
        np.stack([0 * tip, 0 * tip, tip], axis=1)[first:frames],
        (forces + rng.normal(0, noise_n, forces.shape))[first:frames],
        TIME[first:frames],
        radius_m=R,
        tip_std_m=TIP_STD_M,
        options=Hertz(),
    )


def test_the_depths_zero_is_in_doubt_by_tip_and_alignment():
    indentation, _ = pressed()
    assert indentation.contact_std_m == pytest.approx(np.hypot(TIP_STD_M, Hertz().offset_std_m))
    assert indentation.frame_std_m == TIP_STD_M


def best(press, **known):
    return estimate_hertz(press[0], Hertz(), **known)["recommended"]


def test_the_interval_holds_what_the_clocks_and_the_rig_may_be_off_by():
    ends = {}
    for name, known in {
        "alone": {},
        "clock": {"clock_std_s": 0.05},
        "rig": {"rig": Rig()},
    }.items():
        found = best(pressed(), **known)
        low, high = np.log(np.array(found["reduced_modulus_interval_pa"]))
        ends[name] = found["rig_std"], (high - low) / 2
        assert found["reduced_modulus_pa"] == best(pressed())["reduced_modulus_pa"]
    # What forces do that were read 50 ms too late or too early.
    E = [best(pressed(late_s=late_s))["reduced_modulus_pa"] for late_s in (-0.05, 0.0, 0.05)]
    moved = np.sqrt(np.mean(np.log(np.array(E)[[0, 2]] / E[1]) ** 2))
    assert moved > 0.02
    assert ends["clock"][0] == pytest.approx(moved, rel=0.3)
    # 1 % of the force's scale, 0.6 % of the curvature, 0.3 % of zero and drift.
    assert ends["rig"][0] == pytest.approx(0.0125, rel=0.1)
    for std, half in ends.values():
        assert np.sqrt(half**2 - ends["alone"][1] ** 2) == pytest.approx(1.96 * std, rel=0.05)


@pytest.mark.parametrize("zero_m", [-1e-3, 1e-3])
@pytest.mark.parametrize("frames", [TO_DEEPEST, WHOLE])
def test_an_interval_holds_the_modulus_though_the_depths_zero_is_off(zero_m, frames):
    """By 1 mm, a deviation of it, in 0.06 N of noise, which leaves the contact's prior a say."""
    found = best(pressed(zero_m, noise_n=0.06, frames=frames, seed=2))
    low, high = found["reduced_modulus_interval_pa"]
    assert low < TRUTH < high < 2.5 * low


def test_the_force_s_scatter_is_that_at_rest():
    indentation, _ = pressed()
    assert indentation.force_std_n == pytest.approx(NOISE_N, rel=0.4)
    assert len(indentation.time_s) == WHOLE


def test_without_samples_at_rest_there_is_a_warning():
    assert best(pressed(first=11))["doubts"] == [
        "too few samples to allow for relaxation and finite strain"
    ]


def test_noise_alone_is_no_force():
    indentation, told = pressed(noise_n=0.06)
    rest = slice(indentation.onset - 1)
    error = 0.06 / np.sqrt(indentation.onset - 1)
    assert abs(indentation.force_n[rest].mean()) < 3 * error
    # What the study's fit and the samples' table have.
    assert indentation.magnitude_n[rest].mean() > 3 * error
    kept = np.array(told["samples"]["force_n"])[: len(indentation.force_n)]
    assert kept == pytest.approx(indentation.magnitude_n)


def test_friction_across_the_press_is_no_stiffness():
    straight, across = (best(pressed(across=part))["reduced_modulus_pa"] for part in (0.0, 0.4))
    assert across == pytest.approx(straight, rel=0.005)
    indentation, _ = pressed(across=0.4)
    alone = fit_model(pressed()[0], OPTIONS, **MODEL).reduced_modulus_pa
    assert fit_model(indentation, OPTIONS, **MODEL).reduced_modulus_pa == pytest.approx(
        alone, rel=0.005
    )
