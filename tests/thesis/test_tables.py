"""Chapter 5: attempts, the block's pattern, minima beside what is published, steps."""

from copy import deepcopy
from dataclasses import asdict

import numpy as np
import pandas as pd
import pytest
from palpate.estimate.hertz.fit import fit_free_contact
from palpate.estimate.hertz.laws import contact_law
from palpate.report import hertz_figures, tables
from palpate.report.estimate_rows import summary
from thesis.chapter5 import hertz_maps, hertz_points, moduli_tables
from thesis.chapter5.minimise_steps import variants
from thesis.chapter5.moduli_tables import least_squares_rows, minimum_rows
from thesis.chapter5.steps_table import relaxed_modulus, steps_summary, steps_table


def captured(sensor, name, thing="foam_block"):
    where = {"object": thing, "sensor": sensor, "capture": name, "point": name[:2]}
    return where | {"provenance": "simulated"}


PLACES = (("kinect", "08"), ("kinect", "11-a03"), ("bumblebee", "08"))
CAPTURES = [captured(*place) for place in PLACES]


@pytest.fixture
def found():
    known = {"youngs_modulus_pa": 2e4, "poisson_ratio": 0.25, "at_bound": False}
    known |= {"reduced_modulus_pa": 2e4 / (1 - 0.25**2)}
    fit = {"youngs_modulus_std_pa": 300.0, "poisson_ratio_std": 0.05, "unknown": None}
    more = {"hertz_reduced_modulus_pa": 25000.0}
    more["profile"] = {"interval": [0.1, 0.35], "verdict": "bounded"}
    more["least_squares"] = {norm: known | fit for norm in ("length", "square")}
    return {("foam_block", *place, "displacement"): known | deepcopy(more) for place in PLACES}


def test_tables_5_3_and_5_4(found, root):
    """Without points in print a value stands beside every point."""
    block, ball = (
        pd.read_csv(root / f"config/published/table_5_{number}.csv") for number in (3, 4)
    )
    minima = pd.DataFrame(minimum_rows(CAPTURES, found))
    table = moduli_tables.moduli_table(minima, block, name="foam_block")
    kinect = table[table["sensor"] == "kinect"].iloc[0]
    names = ["point", "youngs_modulus_pa", "published_youngs_modulus_pa"]
    assert kinect[names].tolist() == [8, 20000, 35499]
    minima = minima.assign(object="foam_ball")
    true = {"youngs_modulus_pa": 25e4, "poisson_ratio": 0.4, "reduced_modulus_pa": 3e5}
    table = moduli_tables.moduli_table(minima, ball, name="foam_ball", material=true)
    printed = table.set_index("sensor")["published_youngs_modulus_pa"]
    assert printed.to_dict() == {"bumblebee": 325370, "kinect": 372530}
    assert (table["true_youngs_modulus_pa"] == 25e4).all()
    assert moduli_tables.moduli_table(minima, ball, name="ear").empty


def test_a_summary_has_a_row_for_each_method_and_what_is_not_judged_stays_blank(found):
    rows = summary([*minimum_rows(CAPTURES, found), *least_squares_rows(CAPTURES, found)])
    assert rows.groupby("capture").size().to_dict() == {"08": 4, "11-a03": 2}
    searched = rows[rows["method"] == "minimise_displacement"]
    assert (searched["poisson_ratio_verdict"] == "bounded").all()
    derived = rows[rows["method"] == "least_squares_displacement"]
    assert (derived["youngs_modulus_std_pa"] == 300).all()
    for minimum in found.values():
        minimum["profile"] |= {"interval": None, "verdict": "not judged"}
        for fit in minimum["least_squares"].values():
            fit |= {"youngs_modulus_std_pa": None, "poisson_ratio_std": None}
    table = tables.rounded(pd.DataFrame(minimum_rows(CAPTURES, found)))
    assert (table["poisson_ratio_verdict"] == "not judged").all()
    assert table[["poisson_ratio_low", "youngs_modulus_std_pa"]].isna().all(axis=None)


RADIUS_M = 0.00622
LAW = contact_law("parabola", "half_space", radius_m=RADIUS_M, thickness_m=0.05, nu=0.0)


def hertz_of(names, moduli, sensors):
    """Table of Hertz's moduli [Pa] of captures by name and sensor."""
    captures = [captured(sensor, name) for name, sensor in zip(names, sensors, strict=True)]
    known = (
        {"reduced_modulus_pa": E, "reduced_modulus_interval_pa": [0.9 * E, 1e6]} for E in moduli
    )
    fits = [dict.fromkeys(("study", "free_contact", "recommended"), one) for one in known]
    return hertz_points.hertz_table(captures, fits)


def test_the_published_attempts_give_the_published_mean(root):
    published = pd.read_csv(root / "config/published/table_5_1.csv")
    names = [f"11-a{k:02d}" for k in published["attempt"]]
    hertz = hertz_of(names, published["reduced_modulus_pa"], ["kinect"] * len(names))
    table = hertz_points.table_5_1(hertz.sample(frac=1, random_state=0), published)
    assert table["attempt"].tolist() == [*range(1, 17), "mean", "standard deviation (n-1)"]
    for column in ("reduced_modulus_pa", "published_reduced_modulus_pa"):
        assert table[column][16] == pytest.approx(30843.75)
        assert table[column][17] == pytest.approx(2693, abs=0.5)
    # Nothing is published of another sensor.
    other = hertz_points.table_5_1(hertz_of(["11-a01"], [2e4], ["bumblebee"]), published)
    assert other["published_reduced_modulus_pa"].isna().all()


def test_pattern_and_map_of_the_published_values_are_their_own(root):
    published = pd.read_csv(root / "config/published/table_5_2.csv")
    names = [f"{point:02d}" for point in published["point"]]
    hertz = hertz_of(names, published["reduced_modulus_pa"] / 2 + 1000, published["sensor"])
    table = hertz_points.table_5_2(hertz, published, block="foam_block")
    pattern = hertz_points.pattern_correlation(table)
    assert pattern["pearson"].tolist() == pattern["spearman"].tolist() == [1.0] * 9
    counts = pattern.groupby("sensor")["points"].first().to_dict()
    assert counts == {"all": 36, "bumblebee": 18, "kinect": 18}
    few = hertz_of(("01", "05", "08", "17"), (12800, 29800, 35500, 25000), ["kinect"] * 4)
    table = hertz_points.table_5_2(few, published, block="foam_block")
    found = hertz_maps.modulus_map(table, "reduced_modulus_pa")
    assert found.shape == (3, 6) and np.isnan(found).sum() == 14
    assert (found[1, 2], found[1, 5]) == pytest.approx((35500, 25000))
    assert hertz_points.correlation(table, "reduced_modulus_pa") == pytest.approx(1.0)
    assert hertz_points.correlation(table[:2], "reduced_modulus_pa") is None


def test_band_holds_the_true_curve_as_often_as_it_says():
    depth, shown, inside = np.linspace(-0.004, 0.008, 25), np.array([0.004]), 0
    for seed in range(200):
        force = 25e3 * LAW(depth) + np.random.default_rng(seed).normal(0, 0.01, 25)
        fit = asdict(fit_free_contact(depth, force, LAW)) | {"warnings": []}
        fit = {"radius_m": RADIUS_M, "free_contact": fit, "recommended": fit}
        fit |= {"samples": {"depth_m": depth.tolist(), "force_n": force.tolist()}}
        fit |= {"range": {"first_frame": 10, "last_frame": 24}}
        _, low, high = hertz_figures.curve_band(fit, shown)
        inside += bool(low[0] <= 25e3 * LAW(shown)[0] <= high[0])
    assert 0.90 <= inside / 200 <= 0.985


STEPS = {"load": {"force_rule": "hertz_patch"}, "other": {"tracker": "other"}}
MATERIAL = {"youngs_modulus_pa": 2e4, "poisson_ratio": 0.3, "reduced_modulus_pa": 2e4 / 0.91}
MATERIAL["relaxation"] = {"fractions": [0.1, 0.2], "times_s": [0.5, 4.0]}


def step_result(variant, E):
    found = vars(variant) | {"nodes": 9, "left_out_nodes": 0, "reduced_model_error": 1e-7}
    found |= {"surface": "study", "error": "displacement", "youngs_modulus_pa": E, "error_m": 1e-4}
    found |= {"poisson_ratio": 0.4, "reduced_modulus_pa": E / 0.84, "at_bound": E > 2e4}
    return found | {"poisson_ratio_verdict": "bounded"}


def test_table_and_its_medians_stand_beside_the_truth():
    relaxed = 2e4 * (1 - 0.1 * (1 - np.exp(-2)) - 0.2 * (1 - np.exp(-0.25)))
    assert relaxed_modulus(MATERIAL, 1.0) == pytest.approx(relaxed)
    assert relaxed_modulus(MATERIAL | {"relaxation": None}, 1.0) == 2e4
    captures = [captured("kinect", name, "pad") for name in ("01", "02")]
    results = [[step_result(variant, E) for variant in variants(STEPS)] for E in (1.8e4, 2.2e4)]
    table = steps_table(captures, results, {"pad": MATERIAL})
    row = table.iloc[0]
    assert (len(table), row["youngs_modulus_ratio"]) == (2 * 7, 0.9)
    assert row["relaxed_modulus_ratio"] == pytest.approx(1.8e4 / relaxed, abs=1e-4)
    assert row["poisson_ratio_error"] == pytest.approx(0.1)
    short = steps_summary(table)
    assert len(short) == 7 and (short["captures"] == 2).all()
    assert (short["captures_at_bound"] == 1).all()
    assert short["youngs_modulus_ratio"].to_numpy() == pytest.approx(1.0)
    assert short["poisson_ratio_largest_error"].to_numpy() == pytest.approx(0.1)
    largest = short["relaxed_modulus_largest_deviation"].iloc[0]
    assert largest == pytest.approx(2.2e4 / relaxed - 1, abs=1e-4)
