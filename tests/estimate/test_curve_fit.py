"""Fits of bare curves: choices, warnings, laws, flat punches and pyramids, and what is rejected."""

import json
from types import SimpleNamespace

import numpy as np
import pytest
from capture.instruments import written
from palpate import hertz
from palpate.__main__ import main
from palpate.estimate.hertz import laws

RADIUS_M, E_STAR = 0.006, 20e3
NOISE_N = 0.002


def curve(*, contact_m=0.002, deepest_m=0.0005, count=200, slope_n_m=0.0, level_n=0.0, noise=1.0):
    depth = np.linspace(0, contact_m + deepest_m, count)
    force = 4 / 3 * E_STAR * np.sqrt(RADIUS_M) * np.maximum(depth - contact_m, 0) ** 1.5
    scatter = noise * NOISE_N * np.random.default_rng(2).normal(size=count)
    return depth, force + slope_n_m * depth + level_n + scatter


def warned(part, depth, force, **given):
    """Whether a warning says this, in part."""
    found = hertz.fit(depth, force, radius_m=RADIUS_M, **given).warnings
    return any(part in line for line in found)


def test_a_good_curve_has_no_warning():
    found = hertz.fit(*curve(level_n=0.3, noise=0.3), radius_m=RADIUS_M)
    assert found.warnings == () and found.baseline
    assert found.baseline_n == pytest.approx(0.3, abs=1e-3)


SLOPES, UNIT = "the approach slopes, by +", "is the unit of the depth"
MADE_UP, DEEP = "as made-up ones do", " radii of the sphere"


@pytest.mark.parametrize(
    ("part", "within", "beyond"),
    [
        # 2 mm of 8 N/m are 16 mN, of a peak of 23 mN; half of a tenth of it is not told.
        (SLOPES, {"slope_n_m": 0.2, "noise": 0.3}, {"slope_n_m": 8.0, "noise": 1.0}),
        (DEEP, {"contact_m": 0.001, "deepest_m": 0.9 * RADIUS_M}, {"deepest_m": 1.5 * RADIUS_M}),
        (UNIT, {"contact_m": 0.001, "deepest_m": 1.5 * RADIUS_M}, {"deepest_m": 6 * RADIUS_M}),
        ("9 samples lie in contact", {}, {"count": 44}),
        (MADE_UP, {}, {"noise": 0.0}),
    ],
)
def test_warnings_of_a_curve(part, within, beyond):
    # Sneddon's sphere ends at a radius.
    given = {"indenter": "parabola"} if "deepest_m" in beyond else {}
    assert not warned(part.partition(",")[0], *curve(**within), **given)
    assert warned(part, *curve(**within | beyond), **given)


def test_an_indentation_whose_contact_lies_before_its_record():
    depth, force = curve(contact_m=0.0, deepest_m=0.003, noise=0.1)
    late = depth > 0.0005
    found = hertz.fit(depth[late], force[late], radius_m=RADIUS_M)
    assert found.contact_m == pytest.approx(0, abs=1e-4)
    (line,) = [one for one in found.warnings if one.startswith("contact lies")]
    assert f"{1e3 * (depth[late][0] - found.contact_m):.3g} mm before" in line
    assert not found.baseline


def test_a_curve_that_is_hardly_explained():
    """A wave as large as the indentation, between its ends: residuals over the force's squares."""
    depth, force = curve(contact_m=0.0005, deepest_m=0.0005, noise=0.3)
    waved = force + 0.012 * np.sin(np.arange(len(depth))) * (np.abs(depth - 0.0005) < 0.0004)
    found = hertz.fit(depth, waved, radius_m=RADIUS_M)
    explained = 1 - np.mean((found.fitted_n - waved) ** 2) / np.var(waved)
    assert 0.02 < explained < 0.5
    assert any(f"explains {100 * explained:.2g} %" in line for line in found.warnings)
    assert not warned("explains", *curve())


def test_what_would_move_the_modulus_out_of_its_interval():
    """A press of a third of a radius: the paraboloid is some per cent off Sneddon's sphere."""
    found = hertz.fit(*curve(contact_m=0.001, deepest_m=0.002), radius_m=RADIUS_M)
    assert found.indenter == "sneddon"
    (line,) = [one for one in found.depends_on if one.startswith("by parabola")]
    other, (low, high) = found.others["by parabola"], found.reduced_modulus_interval_pa
    assert f"{other / 1e3:.4g} kPa" in line and not low <= other <= high
    assert other == pytest.approx(E_STAR, rel=0.01)


def test_youngs_modulus_and_all_that_is_told():
    found = hertz.fit(*curve(), radius_m=RADIUS_M, poisson_ratio=0.3)
    star, ends = found.reduced_modulus_pa, found.reduced_modulus_interval_pa
    assert found.youngs_modulus_interval_pa(0.4) == pytest.approx(tuple(0.84 * e for e in ends))
    told = json.loads(json.dumps(found.row()))
    assert told["youngs_modulus_pa"] == pytest.approx(0.91 * star)
    assert told["samples"] == 200
    assert told["samples_in_contact"] == (found.depth_m > found.contact_m).sum()
    assert told["setup"]["poisson_ratio"] == 0.3


def test_curves_of_curved_objects_and_unbonded_layers():
    """With the paraboloid, as curved objects had it, E* would be a tenth off."""
    depth = np.linspace(-0.002, 0.005, 80)
    noise = np.random.default_rng(4).normal(0, 0.002, 80)
    force = E_STAR * laws.sneddon_force(depth, RADIUS_M, 1 / 0.03) + noise
    found = hertz.fit(depth, force, radius_m=RADIUS_M, object_radius_m=0.03)
    assert found.indenter == "sneddon"
    assert found.reduced_modulus_pa == pytest.approx(E_STAR, rel=0.01)
    blunt = found.others["by parabola"]
    assert abs(blunt / E_STAR - 1) > 0.05
    law = laws.contact_law("sneddon", "not_bonded", radius_m=RADIUS_M, thickness_m=0.02, nu=0.4)
    layer = {"radius_m": RADIUS_M, "thickness_m": 0.02, "poisson_ratio": 0.4}
    unbonded = hertz.fit(depth, E_STAR * law(depth) + noise, base="not_bonded", **layer)
    assert unbonded.support == "not_bonded"
    assert unbonded.reduced_modulus_pa == pytest.approx(E_STAR, rel=0.01)


def test_a_curve_without_approach_takes_what_is_expected_of_its_contact():
    depth = np.linspace(0.001, 0.002, 40)
    noise_n = np.random.default_rng(1).normal(0, 0.02, 40)
    force = E_STAR * laws.parabola_force(depth, RADIUS_M) + noise_n
    given = {"radius_m": RADIUS_M, "indenter": "parabola", "baseline": False}
    free = hertz.fit(depth, force, **given)
    told = hertz.fit(depth + 1, force, contact_m=(1.0, 5e-5), **given)
    low, high = told.reduced_modulus_interval_pa
    assert low < E_STAR < high
    assert high - low < 0.5 * np.ptp(free.reduced_modulus_interval_pa)
    assert told.contact_m == pytest.approx(1, abs=1e-4)


def test_a_layers_modulus_goes_with_one_poissons_ratio():
    """At chi 0.5 E with another ratio afterwards would be a fifth off, and is refused."""
    height, depth = 0.01, np.linspace(0, 0.25e-4 / RADIUS_M, 60)
    law = laws.contact_law("parabola", "bonded", radius_m=RADIUS_M, thickness_m=height, nu=0.49)
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


# Of the punch.
PUNCH_M, HARD_PA = 0.005, 30e3
DEPTH = np.linspace(-0.001, 0.001, 401)


def noise(std_n, count=401):
    return np.random.default_rng(3).normal(0, std_n, count)


def punched():
    """A flat punch of 5 mm, 1 mm deep into 30 kPa after an approach of 1 mm."""
    return DEPTH, HARD_PA * laws.flat_force(DEPTH, PUNCH_M) + noise(5e-4)


def test_a_flat_punch_and_a_pyramid():
    found = hertz.fit(*punched(), radius_m=PUNCH_M, indenter="flat")
    low, high = found.reduced_modulus_interval_pa
    assert low < HARD_PA < high and high - low < 0.01 * HARD_PA
    assert found.contact_m == pytest.approx(0, abs=5e-6)
    assert found.warnings == () and found.row()["indenter"] == "flat"
    depth, angle = 1e-3 * DEPTH, np.radians(20)
    force = 10e3 * np.sqrt(0.5) * np.tan(angle) * np.maximum(depth, 0) ** 2
    force += 1e-4 * np.ptp(force) * noise(1.0)
    found = hertz.fit(depth, force, indenter="pyramid", half_angle_rad=angle)
    assert found.reduced_modulus_pa == pytest.approx(10e3, rel=2e-3)
    assert found.others.keys() == {"with force_two_thirds compared"}


@pytest.mark.parametrize("radius_m", [PUNCH_M, 0.00635])
def test_a_flat_punch_that_is_taken_for_a_sphere_is_named(radius_m):
    warnings = hertz.fit(*punched(), radius_m=radius_m).warnings
    assert any("--indenter flat" in line for line in warnings)


@pytest.mark.parametrize("std_n", [0.0, 1e-3, 2e-2])
@pytest.mark.parametrize("deepest_m", [0.0005, 0.003, 0.006])
@pytest.mark.parametrize("indenter", ["sneddon", "parabola"])
def test_no_sphere_is_taken_for_a_flat_punch(std_n, deepest_m, indenter):
    depth = np.linspace(-0.001, deepest_m, 401)
    force = 20 * HARD_PA * laws.sneddon_force(depth, PUNCH_M) + noise(std_n)
    bent = 20 * HARD_PA * laws.sneddon_force(depth, PUNCH_M) * (1 - 0.2 * depth / deepest_m)
    for one in (force, bent + noise(std_n)):
        warnings = hertz.fit(depth, one, radius_m=PUNCH_M, indenter=indenter).warnings
        assert not any("flat" in line for line in warnings)


def test_what_a_half_space_assumes():
    """A layer of ten contact radii, 50 mm under a punch of 5 mm."""
    found = hertz.fit(*punched(), radius_m=PUNCH_M, indenter="flat", poisson_ratio=0.5)
    part = 100 * (1 / float(laws.layer_factor(0.1, 0.5, "bonded")) - 1)
    assert "(50 mm)" in found.assumes and f"{part:+.2g} %" in found.assumes
    depth = np.linspace(-0.002, 0.001, 200)
    force = HARD_PA * laws.sneddon_force(depth, 0.006) + noise(1e-3, 200)
    layer = hertz.fit(depth, force, radius_m=0.006, thickness_m=0.02)
    assert not layer.assumes
    assert {"with the layer not bonded", "for nu 0.5"} <= layer.others.keys()


def test_a_loading_with_its_unloading():
    """The way back of what relaxes is softer: both together would be 15 % off."""
    depth, force = punched()
    both = np.r_[depth, depth[::-1]], np.r_[force, 0.7 * force[::-1]]
    alone = hertz.fit(depth, force, radius_m=PUNCH_M, indenter="flat")
    weights = np.linspace(1, 2, 2 * len(depth))
    for given in (None, weights):
        found = hertz.fit(*both, radius_m=PUNCH_M, indenter="flat", weights=given)
        assert found.reduced_modulus_pa == pytest.approx(alone.reduced_modulus_pa, rel=1e-3)
        assert "401 of 802 samples" in found.warnings[0] and len(found.warnings) == 1
    # So are both after the unloading of the loading before, and the loading with that alone.
    for last in (slice(None), slice(len(depth))):
        before = (np.r_[one[len(depth) :], one[last]] for one in both)
        found = hertz.fit(*before, radius_m=PUNCH_M, indenter="flat")
        assert found.reduced_modulus_pa == pytest.approx(alone.reduced_modulus_pa, rel=1e-3)
        assert len(found.depth_m) == pytest.approx(len(depth), abs=2) and found.warnings
    # An unloading alone, and samples in no order, are taken as they are.
    for order in (slice(None, None, -1), np.random.default_rng(0).permutation(len(depth))):
        other = hertz.fit(depth[order], force[order], radius_m=PUNCH_M, indenter="flat")
        assert other.reduced_modulus_pa == pytest.approx(alone.reduced_modulus_pa, rel=1e-6)


def test_a_unit_in_error_is_no_thickness_in_error(tmp_path, capsys):
    depth = np.linspace(-1.0, 2.0, 200)
    force = HARD_PA * laws.sneddon_force(1e-3 * depth, 0.006) + noise(1e-3, 200)
    with pytest.raises(ValueError, match=r"depth_m: .* \d+ \(is the unit of the depth"):
        hertz.fit(depth, force, radius_m=0.006, thickness_m=0.02)
    path = written(tmp_path, "depth (m),force (N)", depth, force)
    assert main(["hertz", str(path), "--radius-mm", "6", "--thickness-mm", "20"]) == 1
    assert "--depth-unit: expected" in capsys.readouterr().err


def fitted(capsys, path, *given):
    assert main(["hertz", str(path), *given, "--json"]) == 0
    return json.loads(capsys.readouterr().out)


def test_indenters_and_bases_as_options(tmp_path, capsys):
    depth, force = punched()
    path = written(tmp_path, "depth (mm),force (N)", 1e3 * depth, force)
    flat = fitted(capsys, path, "--indenter", "flat", "--radius-mm", "5")
    assert flat["reduced_modulus_pa"] == pytest.approx(HARD_PA, rel=2e-3)
    assert "contact radii" in flat["assumes"]
    pyramid = fitted(capsys, path, "--indenter", "pyramid", "--half-angle-deg", "20")
    assert pyramid["setup"]["half_angle_rad"] == pytest.approx(np.radians(20))
    layer = ("--radius-mm", "5", "--thickness-mm", "20")
    bonded, unbonded = (
        fitted(capsys, path, *layer, *base) for base in ((), ("--base", "not_bonded"))
    )
    assert bonded["reduced_modulus_pa"] < unbonded["reduced_modulus_pa"]
    assert unbonded["support"] == "not_bonded"
    assert main(["hertz", str(path), *layer[:2], "--base", "not_bonded"]) == 1
    assert "error: --base: expected with --thickness-mm, of a layer" in capsys.readouterr().err


def test_an_option_has_one_name():
    for given in (["hertz", "a.csv", "--radius", "6"], ["hertz", "a.csv", "--basel"], ["--vers"]):
        with pytest.raises(SystemExit, match="2"):
            main(given)


FLAT, PYRAMID = {"indenter": "flat"}, {"indenter": "pyramid", "radius_m": None}
LAYER = {"thickness_m": 0.02}
REJECTED = [
    (FLAT | {"radius_m": None}, "radius_m: expected the flat punch's radius, found none"),
    (PYRAMID, "half_angle_rad: expected the pyramid's half angle, found none"),
    (PYRAMID | {"half_angle_rad": 1.6}, "half_angle_rad: expected above 0 and"),
    (FLAT | LAYER, "thickness_m: expected none with a flat punch (a layer's factor is a sphere's)"),
    (FLAT | {"object_radius_m": 0.02}, "object_radius_m: expected none with a flat punch"),
    ({"indenter": "cube"}, "indenter: expected one of parabola, sneddon, cone, pyramid, flat,"),
    ({"contact_m": 0.0003}, "contact_m: expected a depth and a deviation above 0, found 0.0003"),
    ({"contact_m": (0.0, 0.0)}, "contact_m: expected a depth and a deviation above 0, found"),
    ({"contact_m": (np.nan, 1e-4)}, "contact_m: expected a depth and a deviation"),
    ({"base": "not_bonded"}, "base: expected with thickness_m"),
    (LAYER | {"base": "glued"}, "base: expected one of bonded, not_bonded, found glued"),
]


@pytest.mark.parametrize(("given", "line"), REJECTED)
def test_what_a_curve_s_fit_rejects(given, line):
    with pytest.raises(ValueError) as raised:
        hertz.fit(*punched(), **{"radius_m": PUNCH_M} | given)
    assert str(raised.value).startswith(line)


@pytest.mark.parametrize(("indenter", "radius_m"), [("sneddon", 0.01), ("flat", PUNCH_M)])
def test_a_curve_s_shape_is_of_its_own_sphere(indenter, radius_m):
    found = hertz.fit(*punched(), radius_m=PUNCH_M, indenter=indenter)
    with pytest.raises(ValueError, match="found: expected a fit of the table's sphere"):
        hertz.fit_shape(found, SimpleNamespace(radius_m=radius_m), (0.3, 0.3))
