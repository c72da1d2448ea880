"""Tables of Section 5.1: attempts, the pattern over the block, and models against the truth."""

import numpy as np
import pandas as pd
import pytest
from palpate.report import hertz_tables


def capture(sensor, name):
    return {
        "object": "foam_block",
        "sensor": sensor,
        "capture": name,
        "point": name[:2],
        "provenance": "simulated",
    }


def model(indenter, contact, modulus, half_width):
    return {
        "indenter": indenter,
        "support": "half_space",
        "contact": contact,
        "relaxation": "none",
        "reduced_modulus_pa": modulus,
        "reduced_modulus_interval_pa": [modulus - half_width, modulus + half_width],
    }


def fit(modulus):
    """The paraboloid misses the truth of 25 kPa in its interval where it is off by 500 Pa."""
    models = [model("parabola", "known", modulus, 500), model("sneddon", "free", modulus, 5000)]
    return {
        "study": {"reduced_modulus_pa": modulus},
        "free_contact": models[1],
        "models": models,
        "recommended": models[1] | {"doubts": []},
    }


@pytest.fixture
def printed_attempts(root):
    return pd.read_csv(root / "config/published/table_5_1.csv")


def test_the_published_attempts_give_the_published_mean(printed_attempts):
    names = [f"11-a{k:02d}" for k in printed_attempts["attempt"]]
    captures = [capture("kinect", name) for name in names]
    fits = [fit(value) for value in printed_attempts["reduced_modulus_pa"]]
    hertz = hertz_tables.hertz_table(captures, fits)
    table = hertz_tables.table_5_1(hertz.sample(frac=1, random_state=0), printed_attempts)
    assert table["attempt"].tolist()[:16] == list(range(1, 17))
    mean, spread = table.iloc[16], table.iloc[17]
    assert (mean["attempt"], spread["attempt"]) == ("mean", "standard deviation (n-1)")
    for column in ("reduced_modulus_pa", "published_reduced_modulus_pa"):
        assert mean[column] == pytest.approx(30843.75)
        assert spread[column] == pytest.approx(2693, abs=0.5)


def test_attempts_of_another_sensor_have_nothing_published(printed_attempts):
    hertz = hertz_tables.hertz_table([capture("bumblebee", "11-a01")], [fit(2e4)])
    table = hertz_tables.table_5_1(hertz, printed_attempts)
    assert len(table) == 3
    assert table["published_reduced_modulus_pa"].isna().all()


def test_pattern_of_the_published_values_is_their_own(root):
    published = pd.read_csv(root / "config/published/table_5_2.csv")
    captures = [capture(row.sensor, f"{row.point:02d}") for row in published.itertuples()]
    fits = [fit(value / 2 + 1000) for value in published["reduced_modulus_pa"]]
    hertz = hertz_tables.hertz_table(captures, fits)
    pattern = hertz_tables.pattern_correlation(
        hertz_tables.table_5_2(hertz, published, block="foam_block")
    )
    assert pattern["pearson"].tolist() == [1.0] * 9
    assert pattern["spearman"].tolist() == [1.0] * 9
    assert pattern.groupby("sensor")["points"].first().to_dict() == {
        "all": 36,
        "bumblebee": 18,
        "kinect": 18,
    }
    few = hertz_tables.table_5_2(hertz.iloc[:2], published, block="foam_block")
    assert hertz_tables.pattern_correlation(few)["pearson"].isna().all()


def test_accuracy_against_a_known_truth():
    captures = [capture("kinect", name) for name in ("01", "02", "03")]
    terms = {"fractions": [0.08, 0.07], "times_s": [0.3, 3.0]}
    material = {"reduced_modulus_pa": 25000.0, "relaxation": terms}
    fits = [fit(value) for value in (25000, 25400, 27500)]
    table = hertz_tables.accuracy_table(captures, fits, {"foam_block": material})
    assert len(table) == 6
    assert table["true_relaxed_reduced_modulus_pa"].unique() == pytest.approx([21250])
    short = hertz_tables.accuracy_summary(table).set_index("indenter")
    assert short.loc["parabola", "median_ratio"] == pytest.approx(25400 / 25000)
    assert short.loc["parabola", "share_of_intervals_that_cover"] == pytest.approx(2 / 3, abs=1e-3)
    assert short.loc["sneddon", "share_of_intervals_that_cover"] == 1
    assert short.loc["recommended", "captures"] == 3
    spread = np.std([1, 1.016, 1.1], ddof=1)
    assert short.loc["recommended", "ratio_standard_deviation"] == pytest.approx(spread, abs=1e-4)


def test_a_model_with_relaxation_is_judged_after_a_while_too():
    """The modulus of a term of 0.2 at 1 s is 1 - 0.2 (1 - 1/e) of itself after 1 s."""
    left = 1 - 0.2 * (1 - np.exp(-1))
    material = {"reduced_modulus_pa": 25000.0, "relaxation": {"fractions": [0.2], "times_s": [1.0]}}
    known, half_width = fit(25000), 500.0
    later = {
        "relaxation": "prony",
        "later_s": 1.0,
        "later_reduced_modulus_pa": 25000 * left + 2 * half_width,
        "later_reduced_modulus_interval_pa": [25000 * left + half_width, 25000.0],
    }
    known["models"].append(model("sneddon", "weighted", 24000, half_width) | later)
    known["recommended"] = known["models"][-1]
    table = hertz_tables.accuracy_table(
        [capture("kinect", "01")], [known], {"foam_block": material}
    )
    assert table["recommended"].tolist() == [False, False, True]
    assert table["later_ratio"].tolist()[:2] == pytest.approx([np.nan] * 2, nan_ok=True)
    best = hertz_tables.accuracy_summary(table).iloc[-1]
    assert best["relaxation"] == "recommended"
    assert best["median_ratio"] == pytest.approx(24 / 25)
    assert best["median_later_ratio"] == pytest.approx(1 + 1000 / (25000 * left), abs=1e-4)
    assert best["share_of_later_intervals_that_cover"] == 0
