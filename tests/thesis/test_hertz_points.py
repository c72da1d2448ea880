"""Section 5.1: attempts, the pattern over the block, and what the figures of both compute."""

from dataclasses import asdict

import numpy as np
import pandas as pd
import pytest
from palpate.estimate.hertz.fit import fit_free_contact, fit_known_contact
from palpate.estimate.hertz.laws import contact_law
from palpate.report import hertz_figures
from thesis.chapter5 import hertz_curves, hertz_maps, hertz_points

RADIUS_M = 0.00622
LAW = contact_law("parabola", "half_space", radius_m=RADIUS_M, thickness_m=0.05, nu=0.0)


def capture(sensor, name):
    known = {"object": "foam_block", "sensor": sensor, "capture": name, "point": name[:2]}
    return known | {"provenance": "simulated"}


def fit(modulus):
    found = {"reduced_modulus_pa": modulus, "reduced_modulus_interval_pa": [0.9 * modulus, 1e6]}
    return dict.fromkeys(("study", "free_contact", "recommended"), found)


def test_the_published_attempts_give_the_published_mean(root):
    printed_attempts = pd.read_csv(root / "config/published/table_5_1.csv")
    names = [f"11-a{k:02d}" for k in printed_attempts["attempt"]]
    captures = [capture("kinect", name) for name in names]
    fits = [fit(value) for value in printed_attempts["reduced_modulus_pa"]]
    hertz = hertz_points.hertz_table(captures, fits)
    table = hertz_points.table_5_1(hertz.sample(frac=1, random_state=0), printed_attempts)
    assert table["attempt"].tolist()[:16] == list(range(1, 17))
    mean, spread = table.iloc[16], table.iloc[17]
    assert (mean["attempt"], spread["attempt"]) == ("mean", "standard deviation (n-1)")
    for column in ("reduced_modulus_pa", "published_reduced_modulus_pa"):
        assert mean[column] == pytest.approx(30843.75)
        assert spread[column] == pytest.approx(2693, abs=0.5)
    # Nothing is published of another sensor.
    hertz = hertz_points.hertz_table([capture("bumblebee", "11-a01")], [fit(2e4)])
    table = hertz_points.table_5_1(hertz, printed_attempts)
    assert len(table) == 3
    assert table["published_reduced_modulus_pa"].isna().all()


def test_pattern_of_the_published_values_is_their_own(root):
    published = pd.read_csv(root / "config/published/table_5_2.csv")
    captures = [capture(row.sensor, f"{row.point:02d}") for row in published.itertuples()]
    fits = [fit(value / 2 + 1000) for value in published["reduced_modulus_pa"]]
    hertz = hertz_points.hertz_table(captures, fits)
    table = hertz_points.table_5_2(hertz, published, block="foam_block")
    pattern = hertz_points.pattern_correlation(table)
    assert pattern["pearson"].tolist() == [1.0] * 9
    assert pattern["spearman"].tolist() == [1.0] * 9
    counts = pattern.groupby("sensor")["points"].first().to_dict()
    assert counts == {"all": 36, "bumblebee": 18, "kinect": 18}
    few = hertz_points.table_5_2(hertz.iloc[:2], published, block="foam_block")
    assert hertz_points.pattern_correlation(few)["pearson"].isna().all()


def make_fit(E_star=25e3, noise_n=0.01, seed=3):
    depth = np.linspace(-0.004, 0.008, 25)
    noise = np.random.default_rng(seed).normal(0, noise_n, 25)
    force = E_star * LAW(depth) + noise
    free = asdict(fit_free_contact(depth, force, LAW))
    return {
        "radius_m": RADIUS_M,
        "range": {"first_frame": 10, "last_frame": 24},
        "samples": {"depth_m": depth.tolist(), "force_n": force.tolist()},
        "study": asdict(fit_known_contact(depth[10:], force[10:], LAW, depth_std_m=0.0)),
        "free_contact": free,
        "recommended": free | {"doubts": []},
    }


def test_band_holds_the_true_curve_as_often_as_it_says():
    depth = np.array([0.004])
    truth = 25e3 * LAW(depth)
    inside = 0
    for seed in range(200):
        _, low, high = hertz_figures.curve_band(make_fit(seed=seed), depth)
        inside += bool(low[0] <= truth[0] <= high[0])
    assert 0.90 <= inside / 200 <= 0.985


def test_curves_meet_where_they_are_aligned():
    for E_star in (15e3, 35e3):
        fit = make_fit(E_star, noise_n=0.0)
        force = np.interp(0.0, hertz_curves.aligned_depth(fit), fit["samples"]["force_n"])
        assert force == pytest.approx(hertz_curves.ALIGNED_AT_N, abs=1e-9)
    with pytest.raises(ValueError, match="force: expected an indentation that passes 9 N, found"):
        hertz_curves.aligned_depth(make_fit(), force_n=9)


def test_map_puts_points_in_their_places(root):
    published = pd.read_csv(root / "config/published/table_5_2.csv")
    shown = [capture("kinect", name) for name in ("01", "05", "08", "17")]
    fits = [make_fit(E, noise_n=0.0) for E in (12800.0, 29800.0, 35500.0, 25000.0)]
    hertz = hertz_points.hertz_table(shown, fits)
    table = hertz_points.table_5_2(hertz, published, block="foam_block")
    found = hertz_maps.modulus_map(table, "reduced_modulus_pa")
    assert found.shape == (3, 6)
    assert found[1, 2] == pytest.approx(35500, rel=1e-6)
    assert found[1, 5] == pytest.approx(25000, rel=1e-6)
    assert np.isnan(found).sum() == 14
    assert hertz_points.correlation(table, "reduced_modulus_pa") == pytest.approx(1.0)
    assert hertz_points.correlation(table[:2], "reduced_modulus_pa") is None
