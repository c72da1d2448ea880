"""Section 5.1: attempts, the pattern over the block, and what the figures of both compute."""

from dataclasses import asdict

import numpy as np
import pandas as pd
import pytest
from palpate.estimate.hertz.fit import fit_free_contact
from palpate.estimate.hertz.laws import contact_law
from palpate.report import hertz_figures
from thesis.chapter5 import hertz_maps, hertz_points

RADIUS_M = 0.00622
LAW = contact_law("parabola", "half_space", radius_m=RADIUS_M, thickness_m=0.05, nu=0.0)


def hertz_of(names, moduli, sensors):
    """Table of Hertz's moduli [Pa] of captures by name and sensor."""
    captures = [
        {"object": "foam_block", "sensor": sensor, "capture": name, "point": name[:2],
         "provenance": "simulated"}
        for name, sensor in zip(names, sensors, strict=True)
    ]  # fmt: skip
    known = ({"reduced_modulus_pa": E, "reduced_modulus_interval_pa": [0.9 * E, 1e6]}
             for E in moduli)  # fmt: skip
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
        fit = asdict(fit_free_contact(depth, force, LAW)) | {"doubts": []}
        fit = {"radius_m": RADIUS_M, "free_contact": fit, "recommended": fit}
        fit |= {"samples": {"depth_m": depth.tolist(), "force_n": force.tolist()}}
        fit |= {"range": {"first_frame": 10, "last_frame": 24}}
        _, low, high = hertz_figures.curve_band(fit, shown)
        inside += bool(low[0] <= 25e3 * LAW(shown)[0] <= high[0])
    assert 0.90 <= inside / 200 <= 0.985
