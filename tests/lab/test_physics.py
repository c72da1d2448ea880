"""The lab's physics against closed forms and balances."""

import numpy as np
import pytest
from palpate.lab.block import press_block
from palpate.lab.block_mesh import block_mesh, graded_axis
from palpate.lab.contact import SphereContact
from palpate.lab.material import neo_hookean
from palpate.lab.motion import Hand
from palpate.lab.relaxation import relaxed_force

R = 0.00622
MOTION = {
    "rest_s": 0.5,
    "approach_s": 0.6,
    "press_s": 1.8,
    "approach_m": 0.015,
    "depth_m": 0.008,
    "tilt_deg": 4.0,
    "tilt_tremor_deg": 0.25,
    "depth_tremor_m": 3e-5,
    "lateral_tremor_m": 6e-4,
}


@pytest.fixture(scope="module")
def thick():
    """A thick block, a quarter of it by symmetry, pressed a little."""
    E, nu = 25e3, 0.3
    axis = graded_axis(0.0, 0.12, 0.0, 0.0007, 1.7)
    height = graded_axis(0.0, 0.12, 0.12, 0.0007, 1.7)
    mesh = block_mesh(axis, axis, height, reach_m=0.006, centre_m=np.zeros(2))
    fixed = np.zeros(mesh.nodes_m.shape, dtype=bool)
    fixed[mesh.nodes_m[:, 2] < 1e-9] = True
    for side in range(2):
        fixed[mesh.nodes_m[:, side] < 1e-9, side] = True
    contact = SphereContact(
        mesh,
        neo_hookean(E, nu),
        point_m=np.array([0, 0, 0.12]),
        radius_m=R,
        stiffness_pa=E,
        fixed=fixed,
    )
    depths = np.array([0.0001, 0.0002, 0.0003, 0.0004, 0.0005])
    return depths, contact.press(depths), E / (1 - nu**2)


def test_hertz_at_small_depth(thick):
    """Against Hertz with the first term of the bonded layer's correction (Dimitriadis 2002)."""
    depths, steps, E_star = thick
    nu = 0.3
    a = -(1.2876 - 1.4678 * nu + 1.3442 * nu**2) / (1 - nu)
    layer = 1 - 2 * a / np.pi * np.sqrt(R * depths) / 0.12
    force = -4 * np.array([step.force_n[2] for step in steps])
    hertz = 4 / 3 * E_star * np.sqrt(R) * depths**1.5 * layer
    assert np.abs(force[2:] / hertz[2:] - 1).max() < 0.03


def test_balances(thick):
    depths, steps, _ = thick
    for step in steps:
        assert step.force_n[2] + step.support_n[2] == pytest.approx(
            0, abs=1e-6 * abs(step.force_n[2])
        )
        assert step.penetration_m < 2e-5
    # Work of a force that grows as d^1.5 over each step, against the stored energy.
    force = -np.array([step.force_n[2] for step in steps])
    work = 0.4 * force[-1] * depths[-1]
    assert steps[-1].energy_j == pytest.approx(work, rel=0.05)


def test_stress_is_the_derivative_of_energy():
    law = neo_hookean(25e3, 0.3)
    rng = np.random.default_rng(0)
    F = np.eye(3) + 0.2 * rng.normal(size=(3, 3))
    d = rng.normal(size=(3, 3))
    h = 1e-6
    _, P, A = law(F)
    ahead, behind = law(F + h * d), law(F - h * d)
    assert (ahead[0] - behind[0]) / (2 * h) == pytest.approx((P * d).sum(), rel=1e-6)
    assert np.allclose((ahead[1] - behind[1]) / (2 * h), np.einsum("iJkL,kL->iJ", A, d), rtol=1e-5)


def test_what_the_lab_refuses(root):
    import yaml

    spec = yaml.safe_load((root / "config/lab.yaml").read_text())["objects"]["foam_block"]
    with pytest.raises(ValueError, match="point: expected on the block's top face"):
        press_block(spec, [0.4, 0, 0.0475], R)
    deep = spec | {"contact": spec["contact"] | {"deepest_m": 0.05}}
    with pytest.raises(ValueError, match="deepest_m: expected 0 < depth < 0.0475 m"):
        press_block(deep, [0, 0, 0.0475], R)
    with pytest.raises(ValueError, match="poisson_ratio: expected 0 <= nu < 0.5, found 0.5"):
        neo_hookean(1e4, 0.5)


def test_relaxation_of_a_held_step_and_of_a_ramp():
    time_s = np.linspace(0, 5, 5001)
    series = {"fractions": [0.2, 0.1], "times_s": [0.3, 3.0]}
    step = relaxed_force(time_s, np.ones_like(time_s), **series)
    exact = 1 - 0.2 * (1 - np.exp(-time_s / 0.3)) - 0.1 * (1 - np.exp(-time_s / 3.0))
    assert np.allclose(step, exact, atol=1e-12)
    ramp = relaxed_force(time_s, time_s, **series)
    integral = 0.7 * time_s
    for g, tau in zip(series["fractions"], series["times_s"], strict=True):
        integral = integral + g * tau * (1 - np.exp(-time_s / tau))
    assert np.allclose(ramp, integral, atol=1e-9)
    with pytest.raises(ValueError, match="relaxation: expected fractions with a sum < 1"):
        relaxed_force(time_s, time_s, fractions=[0.6, 0.5], times_s=[1, 2])


def test_motion_is_smooth_and_touches_at_the_point():
    point = np.array([-0.05, 0, 0.0475])
    hand = Hand(
        MOTION,
        point_m=point,
        radius_m=R,
        facing=np.array([0, -1.0, 0]),
        rng=np.random.default_rng(1),
    )
    time_s = np.arange(0, 4, 0.001)
    path = hand.at(time_s)
    assert path.depth_m[0] == pytest.approx(-0.015)
    assert path.depth_m.max() == pytest.approx(0.008, abs=2e-4)
    assert np.abs(np.diff(path.tip_m, axis=0)).max() < 0.06 * 0.001 * 2
    touching = path.depth_m >= 0
    sideways = path.tip_m[touching, :2] - point[:2]
    assert np.abs(sideways).max() < 1e-9
    lowest = path.tip_m[:, 2] - R
    assert np.allclose(point[2] - lowest, path.depth_m)
    turns = path.object_from_force
    assert np.allclose(np.linalg.det(turns), 1)
    tilt = np.degrees(np.arccos(-turns[:, 2, 2]))
    assert tilt.max() < 8
