"""Randomised rigs without pictures: contact solutions come through, and so do errors."""

from copy import deepcopy
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from palpate.estimate.direct.estimate import estimate_direct
from palpate.estimate.direct.options import Fit
from palpate.estimate.direct.table import sample_table
from palpate.estimate.relaxation import relaxed_force
from palpate.modulus import columns
from palpate.plan import Noise, Planned
from palpate.yaml_files import load_yaml
from validation.observations import (
    MODULI,
    Contact,
    Lab,
    _brought,
    by_tenth,
    main,
    relaxed,
    solved_points,
    summary,
)

E_PA = 2e4
FIT = Fit(poisson_ratio_bounds=(0.0, 0.45))


@pytest.fixture(scope="module")
def ranges(root):
    found = load_yaml(root / "config/observations.yaml")
    # The table's block is small, and a camera looks at it from the middle of the range.
    found["evenly"] |= {"azimuth_deg": [0, 0], "elevation_deg": [45, 45]}
    found["relaxation_fraction"] = [0.0, 0.0]
    found["force_n"] = [0.02, 25]
    return found


@pytest.fixture(scope="module")
def lab(synthetic, sensors, ranges):
    """A lab whose contact solution is the table's own: the estimate can know the truth."""
    table, at = synthetic.table(), 1
    noise = Noise(5e-5, 0.005, 1e-4)
    rig = sensors["kinect"], synthetic.probe, noise
    nu = float(table.poisson_ratios[at])
    planned = Planned(table, synthetic.template, synthetic.support, *rig, E_PA, nu, FIT)
    contact = Contact(
        table.point_m,
        table.depth_m,
        E_PA * table.force_per_modulus_m2[0, at],
        table.surface_rest_m,
        table.surface_faces,
        table.surface_displacement_m[0, at].astype(float),
    )
    material = {"youngs_modulus_pa": E_PA, "poisson_ratio": nu, "law": "neo_hookean"}
    return Lab(planned, contact, material, ranges, ranges["noise"]["kinect"])


def quiet(lab):
    """The same rig without an error."""
    ranges = deepcopy(lab.ranges)
    ranges |= {"dropped_frames": 0.0, "force_lag_s": 0.0, "force_drift_std_n": 0.0}
    ranges["rig_std"] = dict.fromkeys(ranges["rig_std"], 0.0)
    none = {"pattern_m": 0.0, "clock_error_s": [0.0, 0.0], "force_n": 1e-4, "depth_delay_s": 0.0}
    tips = {"rig_tip_m": np.zeros(3), "capture_tip_m": np.zeros(3)}
    return replace(
        lab, ranges=ranges, noise=none | tips | {"over_stated": {"tip": 0.0, "surface": 0.0}}
    )


def test_without_errors_the_estimate_is_the_truth(lab):
    captures, material, drawn = quiet(lab).draw(np.random.default_rng(4))
    assert len(captures) == drawn["captures"]
    assert drawn["distance_m"] > 0.6
    found = estimate_direct(captures, FIT, radius_m=lab.planned.table.radius_m).moduli
    # But for the noise with which displacements are drawn in proportion to themselves.
    true = material["youngs_modulus_pa"]
    assert found["youngs_modulus_pa"].value == pytest.approx(true, rel=0.03)
    assert found["poisson_ratio"].value == pytest.approx(material["poisson_ratio"], abs=0.03)


def test_a_clock_that_is_off_is_found(lab):
    """The offset that a run found is 20 ms too large, and the sensor's filter takes 5 ms."""
    of = quiet(lab)
    late = {"force_lag_s": 0.005, "clock_offset_std_s": 0.0}
    of = replace(of, ranges=of.ranges | late, noise=of.noise | {"clock_error_s": [0.02, 0.0]})
    captures, material, _ = of.draw(np.random.default_rng(5))
    assert captures[0].clock_expected_s == pytest.approx(0.02)
    found = estimate_direct(captures, FIT, radius_m=lab.planned.table.radius_m)
    assert found.solution.parameters[0].clock_s == pytest.approx(0.015, abs=0.003)
    true = material["youngs_modulus_pa"]
    assert found.moduli["youngs_modulus_pa"].value == pytest.approx(true, rel=0.03)


def test_a_draw_is_its_seed_s_and_no_other(lab):
    one, same, other = (lab.draw(np.random.default_rng(seed)) for seed in (1, 1, 2))
    assert one[2] == same[2] != other[2]
    np.testing.assert_array_equal(one[0][0].moved_m, same[0][0].moved_m)
    np.testing.assert_array_equal(one[0][0].depth_m, same[0][0].depth_m)


def test_errors_of_the_rig_are_in_all_its_captures(lab):
    """A tip that is off by so much along the indentation, and a force that is too large."""
    of = quiet(lab)
    of = replace(of, ranges=of.ranges | {"captures": [2, 2], "depth_spread": 0.0})
    errors = of.ranges | {"rig_std": of.ranges["rig_std"] | {"force_gain": 0.1}}
    off = replace(of, ranges=errors, noise=of.noise | {"rig_tip_m": np.array([0.001, 0, 0])})
    captures, _, drawn = off.draw(np.random.default_rng(3))
    straight, _, same = of.draw(np.random.default_rng(3))
    assert same["depth_m"] == drawn["depth_m"] and abs(drawn["force_gain"]) > 0.01
    for one, right in zip(captures, straight, strict=True):
        away = one.tip_depth_m - right.tip_depth_m
        assert np.ptp(away) < 1e-12 and abs(away[0]) > 1e-5
        # But for noise of 0.1 mN.
        gain = 1 + drawn["force_gain"]
        assert one.force_n.max() == pytest.approx(gain * right.force_n.max(), abs=3e-4)
    assert np.isclose(*(one.tip_depth_m[0] for one in captures))


def test_captures_at_several_points_are_at_each_in_turn(lab):
    """The second point is three times as stiff."""
    of = quiet(lab)
    of = replace(of, ranges=of.ranges | {"captures": [4, 4], "depth_spread": 0.0})
    first = replace(of.contact, force_n=of.contact.force_n / 3)
    captures, _, drawn = replace(of, contact=first).draw(np.random.default_rng(3), of)
    peaks = np.array([one.force_n.max() for one in captures])
    assert peaks[0] == pytest.approx(drawn["force_n"], rel=0.05)
    assert peaks / peaks[0] == pytest.approx([1, 3, 1, 3], rel=0.05)


def test_points_are_those_whose_contact_the_lab_has_solved(tmp_path, capsys):
    solved = tmp_path / "results/lab/block"
    solved.mkdir(parents=True)
    for point in ("11", "08"):
        (solved / f"contact-{point}.npz").touch()
    assert solved_points(tmp_path / "results", "block") == ["08", "11"]
    # An estimate of recorded captures has no truth to be held to.
    own = tmp_path / "results/sponge/bench_cam"
    own.mkdir(parents=True)
    (own / "direct.json").touch()
    with pytest.raises(SystemExit):
        main([str(tmp_path)])
    assert "found no estimate of an object of the lab" in capsys.readouterr().err


def test_a_table_is_brought_to_where_the_lab_touches(synthetic):
    """On a flat, 5 mm along it: what it does to the surface goes with it."""
    table, aside_m = synthetic.table(), np.array([0.003, 0.004, 0.0])
    found = _brought(table, synthetic.template, table.point_m + aside_m)
    assert found.point_m == pytest.approx(table.point_m + aside_m, abs=1e-6)
    cells = table.point_m + np.array([[0.02, 0, 0], [0, -0.03, 0], [-0.02, 0.02, 0]])
    up = np.tile([0.0, 0, 1], (3, 1))
    moved, expected = (
        sample_table(of, at, up) for of, at in ((found, cells + aside_m), (table, cells))
    )
    assert moved.motion_m == pytest.approx(expected.motion_m, abs=1e-7)


def test_a_careful_protocol_says_all_that_is_drawn(root, ranges):
    careful = load_yaml(root / "config/careful.yaml")
    assert set(careful) - set(ranges) == {"fit", "points", "probe"} and set(ranges) <= set(careful)
    assert set(careful["evenly"]) == set(ranges["evenly"])
    Fit.read(careful["fit"])


def test_the_force_relaxes_as_a_prony_series():
    time_s = np.linspace(0, 2, 401)
    force_n = np.minimum(time_s, 1.0) ** 1.5
    series = {"fractions": [0.1, 0.2], "times_s": [0.3, 3.0]}
    np.testing.assert_allclose(
        relaxed(time_s, force_n, **series), relaxed_force(time_s, force_n, **series), atol=1e-12
    )


def test_the_summary_counts_what_holds_over_all_and_in_tenths():
    rng, n = np.random.default_rng(0), 400
    table = pd.DataFrame({"drawn_depth_m": rng.uniform(size=n), "rig": range(n)})
    # Too narrow by half where the indentation is deep.
    half = np.where(table["drawn_depth_m"] > 0.5, 0.98, 1.96)
    for name in MODULI:
        off, stem = rng.normal(size=n), name.removesuffix("_pa")
        ends = dict(zip(columns(name), (10 + off, 10 + off - half, 10 + off + half), strict=False))
        held = (np.abs(off) < half).astype(object)
        known = {
            f"{stem}_error": off / 10,
            f"{stem}_covered": held,
            f"{stem}_rank": rng.uniform(size=n),
        }
        table = table.assign(**ends, **known)
    table.loc[:9, "effective_reduced_modulus_covered"] = None
    found = summary(table)
    held = [line.split(" of ") for line in found["intervals that hold"]]
    assert [int(of) for _, of in held] == [n - 10, n, n, n]
    assert all(0.76 < int(inside) / int(of) < 0.86 for inside, of in held)
    assert (found["p of even ranks"].astype(float) > 0.001).all()
    tenths = by_tenth(table).query("quantity == 'poisson_ratio'")
    assert tenths["count"].sum() == n and len(tenths) == 10
    deep = tenths["tenth"] >= 5
    assert tenths["mean"][deep].mean() < 0.8 < 0.9 < tenths["mean"][~deep].mean()
