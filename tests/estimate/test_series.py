"""Series of layers, a cone and two contacts in series, held to the equations that they solve."""

import numpy as np
import pytest
from palpate.estimate.hertz.laws import (
    cone_force,
    contact_law,
    layer_factor,
    layer_moments,
    parabola_force,
    sneddon_force,
)
from scipy.optimize import brentq

R = 0.006


@pytest.mark.parametrize(
    ("nu", "support"), [(0.2, "bonded"), (0.45, "bonded"), (0.3, "not_bonded")]
)
def test_a_layers_factor_solves_its_equation_to_the_fourth_power(nu, support):
    """f = (1 + c chi f)^(3/2) without the change of curvature, which begins with the third."""
    alpha, beta = layer_moments(nu, support)
    c, b = -4 * alpha / (3 * np.pi), 8 * beta / (3 * np.pi)
    chi = np.array([0.002, 0.005])
    factor = layer_factor(chi, nu, support) + 4 / 5 * b * chi**3 + 18 / 5 * b * c * chi**4
    for one, found in zip(chi, factor, strict=True):
        exact = brentq(lambda f, x=one: f - (1 + c * x * f) ** 1.5, 0.9, 1.1, xtol=1e-15)
        assert found == pytest.approx(exact, abs=40 * (c * one) ** 5)
    assert layer_factor(chi, nu, "half_space").tolist() == [1, 1]


def test_a_cone_and_a_curved_object_by_hand():
    depth = np.array([-0.001, 0.0, 0.002])
    assert cone_force(depth, np.pi / 4) == pytest.approx([0, 0, 2 / np.pi * 4e-6])
    assert cone_force(depth, np.arctan(3.0))[2] == pytest.approx(3 * 2 / np.pi * 4e-6)
    curved = parabola_force(depth, R, 50.0)
    assert curved[2] == pytest.approx(4 / 3 * np.sqrt(1 / (1 / R + 50)) * 0.002**1.5)


@pytest.mark.parametrize("force", [parabola_force, sneddon_force])
def test_a_foot_gives_way_as_hertzs_contact_of_its_own(force):
    """Depths of two contacts in series add up at the same force."""
    foot = 30.0
    both = float(force(np.array([0.002]), R, 20.0, foot)[0])
    below = brentq(lambda d: float(parabola_force(d, 1 / foot)) - both, 0, 0.002, xtol=1e-14)
    above = float(force(np.array([0.002 - below]), R, 20.0)[0])
    assert above == pytest.approx(both, rel=1e-5)


@pytest.mark.parametrize("depth_m", [2e-4, 0.003, 0.01])
def test_sneddons_sphere_on_what_is_curved(depth_m):
    """By its radius of contact: depth and force of the sphere, and what the curvature adds."""
    curvature = 40.0

    def depth(a):
        return a / 2 * np.log((R + a) / (R - a)) + curvature * a**2

    a = brentq(lambda a: depth(a) - depth_m, 1e-7, R * (1 - 1e-9), xtol=1e-15)
    force = (a**2 + R**2) / 2 * np.log((R + a) / (R - a)) - a * R + 4 / 3 * curvature * a**3
    found = sneddon_force(np.array([-0.001, depth_m]), R, curvature)
    assert found == pytest.approx([0, force], rel=1e-5)


def test_a_layer_under_a_curved_object():
    law = contact_law(
        *("parabola", "bonded"), radius_m=R, thickness_m=0.03, nu=0.3, curvature_per_m=50.0
    )
    depth = np.array([0.0, 0.002])
    chi = np.sqrt(0.002 / (1 / R + 50)) / 0.03
    expected = parabola_force(0.002, R, 50.0) * layer_factor(chi, 0.3, "bonded")
    assert law(depth) == pytest.approx([0, expected])
