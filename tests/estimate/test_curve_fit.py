"""Fits of bare curves: choices, warnings, laws, and what is rejected."""

import inspect
import json
from dataclasses import fields
from types import SimpleNamespace

import numpy as np
import pytest
from palpate import hertz
from palpate.estimate.hertz.curve_setup import Setup
from palpate.estimate.hertz.laws import contact_law, parabola_force, sneddon_force

RADIUS_M, E_STAR = 0.006, 20e3
NOISE_N = 0.002


def curve(*, contact_m=0.002, deepest_m=0.0005, count=200, slope_n_m=0.0, level_n=0.0, noise=1.0):
    depth = np.linspace(0, contact_m + deepest_m, count)
    force = 4 / 3 * E_STAR * np.sqrt(RADIUS_M) * np.maximum(depth - contact_m, 0) ** 1.5
    scatter = noise * NOISE_N * np.random.default_rng(2).normal(size=count)
    return depth, force + slope_n_m * depth + level_n + scatter


def warnings(**given):
    return hertz.fit(*curve(**given), radius_m=RADIUS_M).doubts


def test_a_good_curve_has_no_warning():
    found = hertz.fit(*curve(level_n=0.3, noise=0.3), radius_m=RADIUS_M)
    assert found.doubts == () and found.baseline
    assert found.baseline_n == pytest.approx(0.3, abs=1e-3)
    assert found.chosen["baseline"].startswith("fitted, since 1")
    assert found.quality.startswith("fair fit, residuals of 2.")


def test_an_approach_that_slopes():
    # 2 mm of 8 N/m are 16 mN, of a peak of 23 mN; half of a tenth of it is not told.
    assert any("the approach slopes, by +" in line for line in warnings(slope_n_m=8.0))
    assert not any("the approach slopes" in line for line in warnings(slope_n_m=0.2, noise=0.3))


@pytest.mark.parametrize(
    ("radii", "line"),
    [
        (0.9, None),
        (1.5, "the indentation is 1.5 radii of the sphere deep: no law of a sphere holds there"),
        (
            6.0,
            "the indentation is 6 radii of the sphere deep: is the unit of the depth,",
        ),
    ],
)
def test_an_indentation_deeper_than_the_sphere(radii, line):
    depth, force = curve(contact_m=0.001, deepest_m=radii * RADIUS_M)
    found = hertz.fit(depth, force, radius_m=RADIUS_M, indenter="parabola").doubts
    deep = [one for one in found if "radii of the sphere" in one]
    assert [one.startswith(line) for one in deep] == ([True] if line else [])


def test_an_indentation_whose_contact_lies_before_its_record():
    depth, force = curve(contact_m=0.0, deepest_m=0.003, noise=0.1)
    late = depth > 0.0005
    found = hertz.fit(depth[late], force[late], radius_m=RADIUS_M)
    assert found.contact_m == pytest.approx(0, abs=1e-4)
    (line,) = [one for one in found.doubts if one.startswith("contact lies")]
    assert line.startswith(f"contact lies {1e3 * (depth[late][0] - found.contact_m):.3g} mm before")
    assert not found.baseline
    assert found.chosen["baseline"] == "none, since no approach determines it"


def test_a_law_that_explains_little_of_the_force():
    """A wave about as large as the press, between its ends: residuals over the force's squares."""
    depth, force = curve(contact_m=0.0005, deepest_m=0.0005, noise=0.3)
    between = np.abs(depth - 0.0005) < 0.0004
    waved = force + 0.012 * np.sin(np.arange(len(depth))) * between
    found = hertz.fit(depth, waved, radius_m=RADIUS_M)
    power = np.sum((waved - waved.mean()) ** 2)
    explained = 1 - np.sum((found.fitted_n - waved) ** 2) / power
    assert 0.02 < explained < 0.5
    assert f"the law explains {100 * explained:.2g} % of the force's scatter" in found.doubts
    assert not any("explains" in line for line in warnings())


def test_few_samples_and_made_up_ones():
    assert any(line.startswith("9 samples lie in contact") for line in warnings(count=44))
    exact = "the samples lie on the law exactly, as made-up ones do: the interval says nothing"
    assert exact in warnings(noise=0.0)
    assert exact not in warnings()


def test_what_would_move_the_modulus_out_of_its_interval():
    """A press of a third of a radius: the paraboloid is some per cent off Sneddon's sphere."""
    found = hertz.fit(*curve(contact_m=0.001, deepest_m=0.002), radius_m=RADIUS_M)
    assert found.indenter == "sneddon"
    (line,) = [one for one in found.hangs_on if one.startswith("by parabola")]
    other = found.others["by parabola"]
    assert f"{other / 1e3:.4g} kPa" in line
    low, high = found.reduced_modulus_interval_pa
    assert not low <= other <= high
    assert other == pytest.approx(E_STAR, rel=0.01)


def test_youngs_modulus_and_all_that_is_told():
    found = hertz.fit(*curve(), radius_m=RADIUS_M, poisson_ratio=0.3)
    star, ends = found.reduced_modulus_pa, found.reduced_modulus_interval_pa
    assert found.youngs_modulus_interval_pa(0.4) == pytest.approx(tuple(0.84 * e for e in ends))
    told = json.loads(json.dumps(found.told()))
    assert told["youngs_modulus_pa"] == pytest.approx(0.91 * star)
    assert told["samples"] == 200
    assert told["samples_in_contact"] == (found.depth_m > found.contact_m).sum()
    assert told["setup"]["poisson_ratio"] == 0.3


def test_what_is_not_said_is_the_same_in_both_places():
    said = inspect.signature(hertz.fit).parameters
    for one in fields(Setup):
        assert one.default == (None if one.name == "radius_m" else said[one.name].default)


def test_curves_of_curved_objects_and_unbonded_layers():
    """With the paraboloid, as curved objects had it, E* would be a tenth off."""
    depth = np.linspace(-0.002, 0.005, 80)
    noise = np.random.default_rng(4).normal(0, 0.002, 80)
    force = E_STAR * sneddon_force(depth, RADIUS_M, 1 / 0.03) + noise
    found = hertz.fit(depth, force, radius_m=RADIUS_M, object_radius_m=0.03)
    assert found.indenter == "sneddon"
    assert found.reduced_modulus_pa == pytest.approx(E_STAR, rel=0.01)
    blunt = found.others["by parabola"]
    assert abs(blunt / E_STAR - 1) > 0.05
    law = contact_law("sneddon", "not_bonded", radius_m=RADIUS_M, thickness_m=0.02, nu=0.4)
    layer = {"radius_m": RADIUS_M, "thickness_m": 0.02, "poisson_ratio": 0.4}
    unbonded = hertz.fit(depth, E_STAR * law(depth) + noise, base="not_bonded", **layer)
    assert unbonded.support == "not_bonded"
    assert unbonded.reduced_modulus_pa == pytest.approx(E_STAR, rel=0.01)
    with pytest.raises(ValueError, match="base: expected one of bonded, not_bonded, found glued"):
        hertz.fit(depth, force, base="glued", **layer)


def test_a_curve_without_approach_takes_what_is_expected_of_its_contact():
    depth = np.linspace(0.001, 0.002, 40)
    force = E_STAR * parabola_force(depth, RADIUS_M) + np.random.default_rng(1).normal(0, 0.02, 40)
    given = {"radius_m": RADIUS_M, "indenter": "parabola", "baseline": False}
    free = hertz.fit(depth, force, **given)
    told = hertz.fit(depth + 1, force, contact_m=(1.0, 5e-5), **given)
    low, high = told.reduced_modulus_interval_pa
    assert low < E_STAR < high
    assert high - low < 0.5 * np.ptp(free.reduced_modulus_interval_pa)
    assert told.contact_m == pytest.approx(1, abs=1e-4)
    with pytest.raises(
        ValueError, match="contact_m: expected a depth and a deviation above 0, found"
    ):
        hertz.fit(depth, force, contact_m=(0.0, 0.0), **given)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        (
            {"contact_m": 0.0003},
            "contact_m: expected a depth and a deviation above 0, found 0.0003",
        ),
        ({"contact_m": (np.nan, 1e-4)}, "contact_m: expected a depth and a deviation"),
        ({"base": "not_bonded"}, "base: expected with thickness_m"),
    ],
)
def test_what_a_curve_s_fit_rejects(wrong, message):
    depth = np.linspace(-0.002, 0.004, 60)
    with pytest.raises(ValueError, match=message):
        hertz.fit(depth, E_STAR * sneddon_force(depth, RADIUS_M), radius_m=RADIUS_M, **wrong)


def test_a_curve_s_shape_is_of_its_own_sphere():
    depth = np.linspace(-0.002, 0.004, 60)
    found = hertz.fit(depth, E_STAR * sneddon_force(depth, RADIUS_M), radius_m=RADIUS_M)
    with pytest.raises(ValueError, match=r"found: expected a fit of the table's sphere of 0.01 m"):
        hertz.fit_shape(found, SimpleNamespace(radius_m=0.01), (0.3, 0.3))


def test_a_layers_modulus_goes_with_one_poissons_ratio():
    """At chi 0.5 E with another ratio afterwards would be a fifth off, and is refused."""
    height, depth = 0.01, np.linspace(0, 0.25e-4 / RADIUS_M, 60)
    law = contact_law("parabola", "bonded", radius_m=RADIUS_M, thickness_m=height, nu=0.49)
    given = {"radius_m": RADIUS_M, "thickness_m": height, "indenter": "parabola"}
    given |= {"depth_m": depth, "force_n": E_STAR * law(depth), "baseline": False}
    right, other = (hertz.fit(**given, poisson_ratio=nu) for nu in (0.49, 0.33))
    E = E_STAR * (1 - 0.49**2)
    assert right.youngs_modulus_pa(0.49) == pytest.approx(E, rel=1e-3)
    assert other.reduced_modulus_pa * (1 - 0.49**2) > 1.2 * E
    line = "poisson_ratio: expected 0.33, which the layer was fitted with, found 0.49"
    for of in (other.youngs_modulus_pa, other.youngs_modulus_interval_pa):
        with pytest.raises(ValueError, match=line):
            of(0.49)
