"""What is told of a curve's fit beside the modulus: choices, doubts, ends, its picture."""

import inspect
import json
from dataclasses import fields

import matplotlib.pyplot as plt
import numpy as np
import pytest
from palpate import hertz
from palpate.estimate.hertz.curve_setup import Setup
from palpate.estimate.hertz.fit import _starts
from palpate.estimate.hertz.laws import parabola_force

RADIUS_M, E_STAR = 0.006, 20e3
NOISE_N = 0.002


def curve(*, contact_m=0.002, deepest_m=0.0005, count=200, slope_n_m=0.0, level_n=0.0, noise=1.0):
    depth = np.linspace(0, contact_m + deepest_m, count)
    force = 4 / 3 * E_STAR * np.sqrt(RADIUS_M) * np.maximum(depth - contact_m, 0) ** 1.5
    scatter = noise * NOISE_N * np.random.default_rng(2).normal(size=count)
    return depth, force + slope_n_m * depth + level_n + scatter


def doubts(**given):
    return hertz.fit(*curve(**given), radius_m=RADIUS_M).doubts


def test_a_good_curve_raises_no_doubt():
    found = hertz.fit(*curve(level_n=0.3, noise=0.3), radius_m=RADIUS_M)
    assert found.doubts == () and found.baseline
    assert found.baseline_n == pytest.approx(0.3, abs=1e-3)
    assert found.chosen["baseline"].startswith("fitted, since 1")
    assert found.quality.startswith("fair fit, residuals of 2.")


def test_an_approach_that_slopes():
    # 2 mm of 8 N/m are 16 mN, of a peak of 23 mN; half of a tenth of it is not told.
    assert any("the approach slopes, by +" in line for line in doubts(slope_n_m=8.0))
    assert not any("the approach slopes" in line for line in doubts(slope_n_m=0.2, noise=0.3))


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
def test_a_press_deeper_than_the_sphere(radii, line):
    depth, force = curve(contact_m=0.001, deepest_m=radii * RADIUS_M)
    found = hertz.fit(depth, force, radius_m=RADIUS_M, indenter="parabola").doubts
    deep = [one for one in found if "radii of the sphere" in one]
    assert [one.startswith(line) for one in deep] == ([True] if line else [])


def test_a_press_whose_contact_lies_before_its_record():
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
    assert not any("explains" in line for line in doubts())


def test_few_samples_and_made_up_ones():
    assert any(line.startswith("9 samples lie in contact") for line in doubts(count=44))
    exact = "the samples lie on the law exactly, as made-up ones do: the interval says nothing"
    assert exact in doubts(noise=0.0)
    assert exact not in doubts()


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


def test_starts_lie_where_the_contact_is_even_before_the_record():
    depth = np.linspace(0.001, 0.002, 80)
    for contact in (0.0006, 0.0013, 0.0018):
        force = parabola_force(depth - contact, RADIUS_M) / 1e-6
        starts = _starts(lambda x: parabola_force(x, RADIUS_M) / 1e-6, depth, force, False)
        assert starts[0][1] * 1e-3 == pytest.approx(contact, abs=3e-5)
        assert np.exp(starts[0][0]) == pytest.approx(1, abs=0.2)


def test_the_picture_shows_press_and_law():
    found = hertz.fit(*curve(contact_m=0.01, deepest_m=0.001), radius_m=RADIUS_M)
    figure, axes = plt.subplots()
    found.plot(axes)
    plt.close(figure)
    samples, law, contact = axes.lines
    # In millimetres and millinewtons from the contact; of the approach as much as of the press.
    assert samples.get_xdata() == pytest.approx(1e3 * (found.depth_m - found.contact_m))
    assert samples.get_ydata() == pytest.approx(1e3 * found.force_n)
    assert law.get_ydata() == pytest.approx(1e3 * found.fitted_n)
    assert list(contact.get_xdata()) == [0, 0]
    left, right = axes.get_xlim()
    press = 1e3 * found.press_m
    assert right == pytest.approx(1.05 * press)
    assert -2 * press < left < 0
