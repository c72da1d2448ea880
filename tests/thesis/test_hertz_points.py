"""Section 5.1: attempts, the pattern over the block, and the figures of both."""

from dataclasses import asdict

import numpy as np
import pandas as pd
import pytest
from palpate.estimate.hertz.fit import fit_free_contact, fit_known_contact
from palpate.estimate.hertz.laws import contact_law
from palpate.report import hertz_figures, style
from thesis.chapter5 import hertz_curves, hertz_maps, hertz_points

RADIUS_M = 0.00622
LAW = contact_law("parabola", "half_space", radius_m=RADIUS_M, thickness_m=0.05, nu=0.0)


def capture(sensor, name):
    return {
        "object": "foam_block",
        "sensor": sensor,
        "capture": name,
        "point": name[:2],
        "provenance": "simulated",
    }


def fit(modulus):
    found = {"reduced_modulus_pa": modulus, "reduced_modulus_interval_pa": [0.9 * modulus, 1e6]}
    return dict.fromkeys(("study", "free_contact", "recommended"), found)


@pytest.fixture
def printed_attempts(root):
    return pd.read_csv(root / "config/published/table_5_1.csv")


def test_the_published_attempts_give_the_published_mean(printed_attempts):
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


def test_attempts_of_another_sensor_have_nothing_published(printed_attempts):
    hertz = hertz_points.hertz_table([capture("bumblebee", "11-a01")], [fit(2e4)])
    table = hertz_points.table_5_1(hertz, printed_attempts)
    assert len(table) == 3
    assert table["published_reduced_modulus_pa"].isna().all()


def test_pattern_of_the_published_values_is_their_own(root):
    published = pd.read_csv(root / "config/published/table_5_2.csv")
    captures = [capture(row.sensor, f"{row.point:02d}") for row in published.itertuples()]
    fits = [fit(value / 2 + 1000) for value in published["reduced_modulus_pa"]]
    hertz = hertz_points.hertz_table(captures, fits)
    pattern = hertz_points.pattern_correlation(
        hertz_points.table_5_2(hertz, published, block="foam_block")
    )
    assert pattern["pearson"].tolist() == [1.0] * 9
    assert pattern["spearman"].tolist() == [1.0] * 9
    assert pattern.groupby("sensor")["points"].first().to_dict() == {
        "all": 36,
        "bumblebee": 18,
        "kinect": 18,
    }
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


def shown_captures(sensor, names):
    return [capture(sensor, name) for name in names]


def texts(figure):
    return {text.get_text() for text in figure.findobj(style.matplotlib.text.Text)}


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


def test_a_press_too_light_to_align():
    with pytest.raises(ValueError, match="force: expected a press that passes 9 N, found"):
        hertz_curves.aligned_depth(make_fit(), force_n=9)


def test_figure_5_3_gives_mean_and_spread(root):
    fits = [make_fit(E, seed=k) for k, E in enumerate((22e3, 24e3, 26e3))]
    published = pd.read_csv(root / "config/published/table_5_1.csv")
    shown = shown_captures("kinect", ["11-a01", "11-a02", "11-a03"])
    figure = hertz_curves.figure_5_3(shown, fits, published)
    # Table 5.1: mean 30844 Pa, standard deviation 2693 Pa.
    assert "30.8 ± 2.7\n(8.7 %)" in texts(figure)
    assert "Kinect, point 11, 3 recordings" in texts(figure)
    style.plt.close(figure)


def test_appendix_leaves_missing_points_empty():
    shown = shown_captures("kinect", ["01", "02", "06"])
    figure = hertz_curves.figure_a(shown, [make_fit(seed=k) for k in range(3)])
    panels = [axes for axes in figure.axes if axes.get_lines()]
    assert len(figure.axes) == 6
    assert len(panels) == 3
    assert "no recording" in texts(figure)
    style.plt.close(figure)


@pytest.fixture
def table(root):
    published = pd.read_csv(root / "config/published/table_5_2.csv")
    shown = shown_captures("kinect", ["01", "05", "08", "17"])
    fits = [make_fit(E, noise_n=0.0) for E in (12800.0, 29800.0, 35500.0, 25000.0)]
    hertz = hertz_points.hertz_table(shown, fits)
    return hertz_points.table_5_2(hertz, published, block="foam_block")


def test_map_puts_points_in_their_places(table):
    found = hertz_maps.modulus_map(table, "reduced_modulus_pa")
    assert found.shape == (3, 6)
    assert found[1, 2] == pytest.approx(35500, rel=1e-6)
    assert found[1, 5] == pytest.approx(25000, rel=1e-6)
    assert np.isnan(found).sum() == 14


def test_correlation_of_the_published_values_with_themselves(table):
    assert hertz_maps.correlation(table) == pytest.approx(1.0)
    with pytest.raises(ValueError, match="points: expected at least 3 with both, found 2"):
        hertz_maps.correlation(table[:2])


def test_figure_5_1_numbers_its_points():
    points = {"01": np.array([-0.1, 0, 0.05]), "02": np.array([0.1, 0, 0.05])}
    pixels = np.array([[20.0, 30.0], [80.0, 30.0]])
    figure = hertz_maps.figure_5_1(
        np.full((60, 100), 120, np.uint8),
        pixels,
        points,
        np.array([[-0.2, -0.1], [0.2, 0.1]]),
        capture=shown_captures("kinect", ["01"])[0],
    )
    assert {"01", "02", "simulated captures"} <= texts(figure)
    style.plt.close(figure)
