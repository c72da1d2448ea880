"""Hertz on balls, ridges, layers and near edges: the law, or one line that refuses it."""

from dataclasses import replace

import numpy as np
import pytest
from palpate.estimate.hertz.indentation import indentation_of
from palpate.estimate.hertz.laws import contact_law, parabola_force
from palpate.estimate.hertz.models import estimate_hertz, fit_model
from palpate.estimate.hertz.options import Hertz
from palpate.estimate.hertz.shape import Shape, equivalent_radius, side_part
from palpate.solid.support import Support
from palpate.surface.alignment import Alignment
from palpate.surface.template import Template
from scipy.optimize import brentq
from scipy.special import elliprd, elliprf
from trimesh import Trimesh
from trimesh.creation import box, extrude_triangulation, icosphere

R, TRUTH, UP = 0.00622, 27473.0, np.array([0, 0, 1.0])
SHALLOW_M = 0.0006
FREE = {"indenter": "parabola", "contact": "free"}
INSTEAD = "trust the direct estimate"


def ball(radius):
    mesh = icosphere(4, radius=radius)
    return mesh.apply_translation([0, 0, radius])


def block(height=0.0475, width=0.2):
    mesh = box((0.3, width, height))
    return mesh.apply_translation([0, 0, height / 2])


def ridge(radius=0.012, height=0.08, length=0.3):
    """Round above, with sides that fall off at 50 degrees."""
    turn = np.radians(np.linspace(-50, 50, 41))
    arc = np.stack([radius * np.sin(turn), height - radius + radius * np.cos(turn)], axis=1)
    foot = arc[-1, 0] + arc[-1, 1] / np.tan(np.radians(50))
    outline = np.array([*arc[::-1], [-foot, 0], [foot, 0]])
    fan = [[0, k, k + 1] for k in range(1, len(outline) - 1)]
    mesh = extrude_triangulation(outline, fan, length)
    return Trimesh(mesh.vertices[:, [2, 0, 1]] - [length / 2, 0, 0], mesh.faces, process=False)


def pressed(mesh, force_of, *, deepest_m=SHALLOW_M, at=(0.0, 0.0), contact="bonded"):
    """Press straight down to a depth, and a hold there; what of it Hertz takes."""
    time, rng = np.arange(40) / 6, np.random.default_rng(3)
    depth = np.clip((time - 2.2) / 2 * deepest_m, -deepest_m, deepest_m)
    top = np.array([*at, mesh.bounds[1, 2]])
    tips = top + np.outer(R - depth, UP)
    peak = float(np.max(TRUTH * force_of(depth)))
    forces = -np.outer(TRUTH * force_of(depth), UP) + rng.normal(0, 0.002 * peak, (len(time), 3))
    return indentation_of(
        Template(np.asarray(mesh.vertices), np.asarray(mesh.faces)),
        Support(np.zeros(3), UP, 0.001, contact),
        Alignment(np.eye(4), top, 14, 1e-3),
        tips,
        forces,
        time,
        radius_m=R,
        tip_std_m=0.002 * deepest_m,
        options=Hertz(onset_force_n=0.02 * peak),
    )


def advised(indentation, _):
    return estimate_hertz(indentation, Hertz())["recommended"]


def in_series(*radii):
    """Exact Hertz of contacts in series at E* = 1: the depths of one force add up."""
    unit = sum((9 / 16 / radius) ** (1 / 3) for radius in radii)
    return lambda depth: (np.maximum(depth, 0) / unit) ** 1.5


def elliptic_force(low, high):
    """Exact force of an elliptic contact at E* = 1, long half axis 1 by 1/b and pressure p0.

    By the pressure's potential, in Carlson's integrals.
    """
    b = brentq(lambda b: elliprd(0, 1, b * b) / elliprd(0, b * b, 1) - high / low, 1e-3, 1 - 1e-9)
    p0 = low / 2 / (b * elliprd(0, b * b, 1) / 3)
    return (2 / 3 * np.pi * p0 * b) / (p0 * b * elliprf(0, 1, b * b)) ** 1.5


@pytest.mark.parametrize("curvatures", [(160.0, 244.0), (100.0, 400.0), (10.0, 1000.0)])
def test_elliptic_contacts_against_the_potential(curvatures):
    force = parabola_force(1.0, equivalent_radius(*curvatures))
    assert force == pytest.approx(elliptic_force(*curvatures), rel=1e-6)
    # Nearly round, the mean curvature counts.
    assert equivalent_radius(99.999, 100.001) == pytest.approx(0.01, rel=1e-6)


def test_a_loose_ball_gives_way_above_and_below():
    """As a layer that sticks, without curvature and foot, E* would come out at 0.45 of it."""
    press = pressed(ball(0.03), in_series(1 / (1 / R + 1 / 0.03), 0.03), contact="resting")
    assert press[0].shape.support == "round_foot"
    holds(press, "round_foot", flat=("bonded", 0.5))


def test_a_ridge_is_an_elliptic_contact():
    unit = elliptic_force(1 / R, 1 / R + 1 / 0.012)
    press = pressed(ridge(), lambda depth: unit * np.maximum(depth, 0) ** 1.5)
    holds(press, "half_space", flat=("half_space", 0.92))


def holds(press, support, *, flat):
    """Fit and advice by the object's shape; of a flat one E* would be below a part of it."""

    def modulus(indentation, support):
        return fit_model(indentation, Hertz(), support=support, **FREE).reduced_modulus_pa

    assert modulus(press[0], support) == pytest.approx(TRUTH, rel=0.02)
    assert modulus(replace(press[0], shape=Shape()), flat[0]) < flat[1] * TRUTH
    best = advised(*press)
    assert (best["support"], best["warnings"]) == (support, [])
    low, high = best["reduced_modulus_interval_pa"]
    assert low < TRUTH < high


@pytest.mark.parametrize(("contact", "support"), [("bonded", "bonded"), ("resting", "not_bonded")])
def test_a_layer_slides_where_it_only_stands(contact, support):
    law = contact_law("sneddon", support, radius_m=R, thickness_m=0.012, nu=0.33)
    press = pressed(block(0.012), law, deepest_m=0.004, contact=contact)
    assert press[0].chi == pytest.approx(0.416, abs=0.001)
    best = advised(*press)
    assert (best["support"], best["warnings"]) == (support, [])


# Force of finite elements (palpate.solid: block of 47.5 mm, bonded, nu 0.3, sphere of 6.22 mm) at
# 25, 15, 10 and 6 mm from a side over that in the middle, at 1.1, 2.5 and 4.5 mm of depth.
OF_EDGE = {
    0.025: (0.980, 0.972, 0.980),
    0.015: (0.954, 0.943, 0.926),
    0.010: (0.904, 0.887, 0.885),
    0.006: (0.837, 0.797, 0.792),
}


def test_what_a_side_takes_against_finite_elements():
    for side, parts in OF_EDGE.items():
        for depth, part in zip((1.125e-3, 2.475e-3, 4.5e-3), parts, strict=True):
            found = side_part(side, np.sqrt(R * depth), 0.0475)
            assert found == pytest.approx(1 - part, abs=0.04), (side, depth)
    assert side_part(0.0, 0.004, 0.03) == 1.0
    x = 0.35 * 0.004 / 0.01
    assert side_part(0.01, 0.004, np.inf) == pytest.approx(x / (1 + x))
    x *= np.exp(-((0.02 / 0.03) ** 2))
    assert side_part(0.01, 0.004, 0.03) == pytest.approx(x / (1 + x))


@pytest.mark.parametrize(("side_m", "refused"), [(0.025, False), (0.010, True), (0.006, True)])
def test_near_an_edge_the_direct_estimate_is_pointed_to(side_m, refused):
    """The force of a block 150 mm wide that the finite elements have there."""
    law = contact_law("sneddon", "bonded", radius_m=R, thickness_m=0.0475, nu=0.3)
    less = OF_EDGE[side_m][-1]
    at = (0.0, 0.075 - side_m)
    press = pressed(block(width=0.15), lambda d: less * law(d), deepest_m=0.0045, at=at)
    best = advised(*press)
    low, high = best["reduced_modulus_interval_pa"]
    if refused:
        line = f"a free side {1e3 * side_m:g} mm from the contact takes some"
        assert best["warnings"][0].startswith(line)
        assert all(one.endswith(INSTEAD) for one in best["warnings"])
    else:
        assert best["warnings"] == []
    assert low < TRUTH < high


@pytest.mark.parametrize(
    ("mesh", "contact", "line"),
    [
        (ball(0.03), "bonded", "the object is 60 mm thick there, neither a layer"),
        (block(0.004), "bonded", "the layer is thin, chi 0.88 above 0.6"),
    ],
)
def test_where_no_law_holds_the_interval_is_wide(mesh, contact, line):
    """At chi 0.6, where a thin layer's series ends, a bonded base doubles the force."""
    thick = contact_law("sneddon", "half_space", radius_m=R, thickness_m=1.0, nu=0.3)
    thin = contact_law("sneddon", "bonded", radius_m=R, thickness_m=0.004, nu=0.3)
    for law in (thick, thin)[: 2 if "thin" in line else 1]:
        best = advised(*pressed(mesh, law, deepest_m=0.002, contact=contact))
        assert best["support"] == "half_space"
        assert any(one.startswith(line) and one.endswith(INSTEAD) for one in best["warnings"])
    if "thin" in line:
        low, high = best["reduced_modulus_interval_pa"]
        assert low < TRUTH < high and low < 0.5 * best["reduced_modulus_pa"]
