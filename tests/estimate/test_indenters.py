"""Flat punches and pyramids, what a curve's fit assumes, and what it says of wrong input."""

import json

import numpy as np
import pytest
from palpate import hertz
from palpate.__main__ import main
from palpate.estimate.hertz.laws import flat_force, layer_factor, pyramid_force, sneddon_force
from scipy.optimize import nnls

RADIUS_M, E_STAR = 0.005, 30e3
DEPTH = np.linspace(-0.001, 0.001, 401)


def noise(std_n, count=401):
    return np.random.default_rng(3).normal(0, std_n, count)


def punched():
    """A flat punch of 5 mm, 1 mm deep into 30 kPa after an approach of 1 mm."""
    return DEPTH, E_STAR * flat_force(DEPTH, RADIUS_M) + noise(5e-4)


def boundary_elements(gap_m, side_m, count=26):
    """Force of a rigid indenter of a gap (x, y) over E*, frictionless, one quarter of squares.

    Pressures on squares by Love's solution, none negative.
    """
    step = side_m / count
    x = (np.arange(count) + 0.5) * step
    x, y = (one.ravel() for one in np.meshgrid(x, x))

    def corner(u, v):
        return u * np.arcsinh(v / abs(u)) + v * np.arcsinh(u / abs(v))

    def displaced(u, v):
        h = step / 2
        ends = corner(u + h, v + h) + corner(u - h, v - h)
        return (ends - corner(u + h, v - h) - corner(u - h, v + h)) / np.pi

    compliance = sum(
        displaced(x[:, None] - i * x, y[:, None] - j * y) for i in (1, -1) for j in (1, -1)
    )
    lower = np.linalg.cholesky((compliance + compliance.T) / 2)
    pressure, _ = nnls(lower.T, np.linalg.solve(lower, -gap_m(x, y)), maxiter=10**4)
    return 4 * pressure.sum() * step**2


def test_a_pyramid_against_boundary_elements():
    """Of the angle between axis and face, 4 % stiffer than the law that programs agree on."""
    depth, angle = 1.0, np.radians(20)
    slope = 1 / np.tan(angle)
    found = boundary_elements(
        lambda x, y: slope * np.maximum(x, y) - depth, 0.9 * np.tan(angle) * depth
    )
    assert pyramid_force(np.array([depth]), angle)[0] == pytest.approx(0.958 * found, rel=0.015)
    cone = boundary_elements(
        lambda x, y: slope * np.hypot(x, y) - depth, 0.8 * np.tan(angle) * depth
    )
    assert cone == pytest.approx(2 / np.pi * np.tan(angle), rel=0.005)


def test_a_flat_punch():
    found = hertz.fit(*punched(), radius_m=RADIUS_M, indenter="flat")
    low, high = found.reduced_modulus_interval_pa
    assert low < E_STAR < high and high - low < 0.01 * E_STAR
    assert found.contact_m == pytest.approx(0, abs=5e-6)
    assert found.doubts == () and found.told()["indenter"] == "flat"


def test_a_pyramid():
    depth, angle = 1e-3 * DEPTH, np.radians(20)
    force = 10e3 * np.sqrt(0.5) * np.tan(angle) * np.maximum(depth, 0) ** 2
    force += 1e-4 * np.ptp(force) * noise(1.0)
    found = hertz.fit(depth, force, indenter="pyramid", half_angle_rad=angle)
    assert found.reduced_modulus_pa == pytest.approx(10e3, rel=2e-3)
    assert found.others.keys() == {"with force_two_thirds compared"}


@pytest.mark.parametrize("radius_m", [RADIUS_M, 0.00635])
def test_a_flat_punch_that_is_taken_for_a_sphere_is_named(radius_m):
    doubts = hertz.fit(*punched(), radius_m=radius_m).doubts
    assert any("--indenter flat" in line for line in doubts)


@pytest.mark.parametrize("std_n", [0.0, 1e-3, 2e-2])
@pytest.mark.parametrize("deepest_m", [0.0005, 0.003, 0.006])
@pytest.mark.parametrize("indenter", ["sneddon", "parabola"])
def test_no_sphere_is_taken_for_a_flat_punch(std_n, deepest_m, indenter):
    depth = np.linspace(-0.001, deepest_m, 401)
    force = 20 * E_STAR * sneddon_force(depth, RADIUS_M) + noise(std_n)
    bent = 20 * E_STAR * sneddon_force(depth, RADIUS_M) * (1 - 0.2 * depth / deepest_m)
    for one in (force, bent + noise(std_n)):
        doubts = hertz.fit(depth, one, radius_m=RADIUS_M, indenter=indenter).doubts
        assert not any("flat" in line for line in doubts)


@pytest.mark.parametrize(
    ("given", "line"),
    [
        ({"indenter": "flat"}, "radius_m: expected the flat punch's radius, found none"),
        ({"indenter": "pyramid"}, "half_angle_rad: expected the pyramid's half angle, found none"),
        ({"indenter": "pyramid", "half_angle_rad": 1.6}, "half_angle_rad: expected above 0 and"),
        (
            {"indenter": "flat", "radius_m": RADIUS_M, "thickness_m": 0.02},
            "thickness_m: expected none with a flat punch (a layer's factor is a sphere's)",
        ),
        (
            {"indenter": "flat", "radius_m": RADIUS_M, "object_radius_m": 0.02},
            "object_radius_m: expected none with a flat punch",
        ),
        (
            {"indenter": "cube", "radius_m": RADIUS_M},
            "indenter: expected one of parabola, sneddon, cone, pyramid, flat, found cube",
        ),
    ],
)
def test_what_does_not_go_with_an_indenter(given, line):
    with pytest.raises(ValueError) as raised:
        hertz.fit(*punched(), **given)
    assert str(raised.value).startswith(line)


def test_no_table_of_a_sphere_is_a_flat_punchs():
    table = type("Table", (), {"radius_m": RADIUS_M})
    found = hertz.fit(*punched(), radius_m=RADIUS_M, indenter="flat")
    with pytest.raises(ValueError, match="found: expected a fit of the table's sphere"):
        hertz.fit_shape(found, table, (0.3, 0.4))


def test_what_a_half_space_assumes():
    """A layer of ten contact radii, 50 mm under a punch of 5 mm."""
    found = hertz.fit(*punched(), radius_m=RADIUS_M, indenter="flat", poisson_ratio=0.5)
    part = 100 * (1 / float(layer_factor(0.1, 0.5, "bonded")) - 1)
    assert "(50 mm)" in found.assumes and f"{part:+.2g} %" in found.assumes
    depth = np.linspace(-0.002, 0.001, 200)
    force = E_STAR * sneddon_force(depth, 0.006) + noise(1e-3, 200)
    layer = hertz.fit(depth, force, radius_m=0.006, thickness_m=0.02)
    assert not layer.assumes
    assert {"with the layer not bonded", "for nu 0.5"} <= layer.others.keys()


def test_a_loading_with_its_unloading():
    """The way back of what relaxes is softer: both together would be 15 % off."""
    depth, force = punched()
    both = np.r_[depth, depth[::-1]], np.r_[force, 0.7 * force[::-1]]
    alone = hertz.fit(depth, force, radius_m=RADIUS_M, indenter="flat")
    weights = np.linspace(1, 2, 2 * len(depth))
    for given in ({}, {"weights": weights}):
        found = hertz.fit(*both, radius_m=RADIUS_M, indenter="flat", **given)
        assert found.reduced_modulus_pa == pytest.approx(alone.reduced_modulus_pa, rel=1e-3)
        (line,) = found.doubts
        assert "401 of 802 samples" in line
    # An unloading alone, and samples in no order, are taken as they are.
    for order in (slice(None, None, -1), np.random.default_rng(0).permutation(len(depth))):
        other = hertz.fit(depth[order], force[order], radius_m=RADIUS_M, indenter="flat")
        assert other.reduced_modulus_pa == pytest.approx(alone.reduced_modulus_pa, rel=1e-6)


def test_a_unit_in_error_is_no_thickness_in_error(tmp_path, capsys):
    depth = np.linspace(-1.0, 2.0, 200)
    force = E_STAR * sneddon_force(1e-3 * depth, 0.006) + noise(1e-3, 200)
    with pytest.raises(ValueError, match=r"depth_m: .* \d+ \(is the unit of the depth"):
        hertz.fit(depth, force, radius_m=0.006, thickness_m=0.02)
    path = written(tmp_path, depth, force, "m")
    assert main(["hertz", str(path), "--radius-mm", "6", "--thickness-mm", "20"]) == 1
    assert "--depth-unit: expected" in capsys.readouterr().err


def written(tmp_path, depth, force, unit):
    rows = [f"{d:.6f},{f:.6f}" for d, f in zip(depth, force, strict=True)]
    path = tmp_path / "curve.csv"
    path.write_text("\n".join([f"depth ({unit}),force (N)", *rows]) + "\n")
    return path


def fitted(capsys, path, *given):
    assert main(["hertz", str(path), *given, "--json"]) == 0
    return json.loads(capsys.readouterr().out)


def test_indenters_and_bases_as_options(tmp_path, capsys):
    depth, force = punched()
    path = written(tmp_path, 1e3 * depth, force, "mm")
    flat = fitted(capsys, path, "--indenter", "flat", "--radius-mm", "5")
    assert flat["reduced_modulus_pa"] == pytest.approx(E_STAR, rel=2e-3)
    assert "contact radii" in flat["assumes"]
    pyramid = fitted(capsys, path, "--indenter", "pyramid", "--half-angle-deg", "20")
    assert pyramid["setup"]["half_angle_rad"] == pytest.approx(np.radians(20))
    layer = ("--radius-mm", "5", "--thickness-mm", "20")
    bonded, unbonded = (
        fitted(capsys, path, *layer, *base) for base in ((), ("--base", "not_bonded"))
    )
    assert bonded["reduced_modulus_pa"] < unbonded["reduced_modulus_pa"]
    assert unbonded["support"] == "not_bonded"


def test_an_unbonded_base_alone_asks_for_the_layers_option(tmp_path, capsys):
    np.savetxt(path := tmp_path / "a.csv", np.column_stack(punched()), delimiter=",")
    assert main(["hertz", str(path), "--radius-mm", "5", "--base", "not_bonded"]) == 1
    assert "error: --base: expected with --thickness-mm, of a layer" in capsys.readouterr().err


@pytest.mark.parametrize(
    "given", [["hertz", "a.csv", "--radius", "6"], ["hertz", "a.csv", "--basel"], ["--vers"]]
)
def test_an_option_has_one_name(given, capsys):
    with pytest.raises(SystemExit) as ended:
        main(given)
    assert ended.value.code == 2
