"""Tables beside the published values, and figures that are the same bytes each time."""

import numpy as np
import pandas as pd
import pytest
from palpate.report import hertz_tables, style, tables
from thesis.chapter5 import minimisation_figures as figures
from thesis.chapter5 import moduli_tables

CAPTURES = [
    {"object": "foam_block", "sensor": s, "capture": c, "point": c[:2], "provenance": p}
    for s, c, p in (
        ("kinect", "08", "simulated"),
        ("kinect", "11-a03", "simulated"),
        ("bumblebee", "08", "recorded"),
    )
]


def model(indenter, contact, modulus):
    return {
        "indenter": indenter,
        "support": "half_space",
        "contact": contact,
        "relaxation": "none",
        "reduced_modulus_pa": modulus,
        "reduced_modulus_interval_pa": [modulus - 500, modulus + 500],
    }


def fit(modulus):
    return {
        "radius_m": 0.00622,
        "range": {"first_frame": 2, "last_frame": 5},
        "samples": {
            "depth_m": [-0.002, -0.001, 0.001, 0.003, 0.005, 0.007, 0.007],
            "force_n": [0.0, 0.01, 0.1, 0.5, 1.0, 1.7, 1.6],
        },
        "study": {"reduced_modulus_pa": modulus, "rms_n": 0.02},
        "models": [model("parabola", "known", modulus), model("sneddon", "free", modulus + 200)],
        "recommended": model("sneddon", "free", modulus + 200) | {"doubts": []},
        "free_contact": {
            "reduced_modulus_pa": modulus + 100,
            "reduced_modulus_interval_pa": [modulus - 1000, modulus + 1200],
            "contact_depth_m": 1e-4,
        },
    }


def minimum(E, nu):
    trace = [
        {"iteration": k, "lame_lambda_pa": 1e4 + k, "lame_mu_pa": 9e3, "error_m": 1e-3 / k}
        for k in range(1, 30)
    ]
    return {
        "youngs_modulus_pa": E,
        "poisson_ratio": nu,
        "reduced_modulus_pa": E / (1 - nu**2),
        "hertz_reduced_modulus_pa": 25000.0,
        "at_bound": False,
        "trace": trace,
        "profile": {
            "poisson_ratios": [0.0, 0.2, 0.4],
            "youngs_moduli_pa": [2e4, 1.9e4, 1.7e4],
            "errors_m": [2e-4, 1.9e-4, 1.95e-4],
            "interval": [0.1, 0.35],
            "verdict": "bounded",
        },
        "least_squares": {
            norm: {
                "youngs_modulus_pa": E + 10,
                "youngs_modulus_std_pa": 300.0,
                "poisson_ratio": nu,
                "poisson_ratio_std": 0.05,
                "at_bound": False,
                "unknown": None,
                "reduced_modulus_pa": (E + 10) / (1 - nu**2),
            }
            for norm in ("length", "square")
        },
    }


@pytest.fixture
def hertz():
    return hertz_tables.hertz_table(CAPTURES, [fit(25000.4), fit(24000.0), fit(26000.0)])


@pytest.fixture
def found():
    keys = [(c["object"], c["sensor"], c["capture"], "displacement") for c in CAPTURES]
    return {key: minimum(20000.0, 0.25) for key in keys}


@pytest.fixture
def minima(found):
    return tables.minimum_table(CAPTURES, found)


@pytest.fixture
def squares(found):
    return tables.least_squares_table(CAPTURES, found)


def test_table_5_2(hertz, root):
    published = pd.read_csv(root / "config/published/table_5_2.csv")
    table = tables.rounded(hertz_tables.table_5_2(hertz, published, block="foam_block"))
    assert table["sensor"].tolist() == ["bumblebee", "kinect"]
    assert table["published_reduced_modulus_pa"].tolist() == [31100, 35500]
    assert table["reduced_modulus_pa"].tolist() == [26000, 25000]
    assert table[["row", "column"]].iloc[0].tolist() == [2, 3]
    assert hertz_tables.table_5_2(hertz, published, block="another").empty


def test_table_5_3(minima, root):
    published = pd.read_csv(root / "config/published/table_5_3.csv")
    table = moduli_tables.moduli_table(minima, published, name="foam_block")
    kinect = table[table["sensor"] == "kinect"].iloc[0]
    assert kinect["published_youngs_modulus_pa"] == 35499
    assert kinect["youngs_modulus_pa"] == 20000
    assert kinect["point"] == 8
    assert not any(name.startswith("true_") for name in table)


def test_a_table_without_points_stands_beside_every_point(minima, root):
    published = pd.read_csv(root / "config/published/table_5_4.csv")
    ball = minima.assign(object="foam_ball")
    true = {"youngs_modulus_pa": 25e4, "poisson_ratio": 0.4, "reduced_modulus_pa": 3e5}
    table = moduli_tables.moduli_table(ball, published, name="foam_ball", material=true)
    printed = table.set_index("sensor")["published_youngs_modulus_pa"]
    assert printed.to_dict() == {"bumblebee": 325370, "kinect": 372530}
    assert (table["true_youngs_modulus_pa"] == 25e4).all()
    assert "published_reduced_modulus_pa" not in table
    assert moduli_tables.moduli_table(ball, published, name="ear").empty


@pytest.mark.parametrize("read", [lambda found: found, lambda found: found.astype(str)])
def test_a_minimum_at_a_bound_says_so(minima, read):
    minima["at_bound"] = minima["sensor"] == "kinect"
    lines = tables.to_markdown(read(minima), title="Minima", notes=[]).splitlines()
    assert tables.AT_BOUND_NOTE in lines
    for line in lines:
        marked = 3 if line.startswith("| foam_block | kinect") else 0
        assert line.count("(at a bound)") == marked
    minima["at_bound"] = False
    assert "at a bound" not in tables.to_markdown(minima, title="Minima", notes=[]).lower()


def test_accuracy_of_a_minimum_at_a_bound_says_so():
    from thesis.accuracy.capture import _moduli

    material = {"youngs_modulus_pa": 2e4, "poisson_ratio": 0.3, "reduced_modulus_pa": 2.2e4}
    results = {"hertz": fit(25000.0), "minima": {"displacement": minimum(1e8, 0.0)}}
    results["minima"]["displacement"]["at_bound"] = True
    text = tables.to_markdown(pd.DataFrame(_moduli(material, results)), title="", notes=[])
    assert text.count("(at a bound)") == 3 and "| 100000000 (at a bound) |" in text


def test_summary_has_a_row_for_each_method(hertz, minima, squares):
    summary = tables.summary(hertz, minima, squares, pd.DataFrame(), pd.DataFrame())
    assert len(summary) == 5 * len(CAPTURES)
    assert summary.groupby("capture").size().to_dict() == {"08": 10, "11-a03": 5}
    searched = summary[summary["method"] == "minimise_displacement"]
    assert (searched["poisson_ratio_verdict"] == "bounded").all()
    derived = summary[summary["method"] == "least_squares_displacement"]
    assert (derived["youngs_modulus_std_pa"] == 300).all()


def test_what_is_not_judged_stays_blank(found):
    for minimum in found.values():
        minimum["profile"] |= {"interval": None, "verdict": "not judged"}
        for fit in minimum["least_squares"].values():
            fit |= {"youngs_modulus_std_pa": None, "poisson_ratio_std": None}
    table = tables.rounded(tables.minimum_table(CAPTURES, found))
    assert (table["poisson_ratio_verdict"] == "not judged").all()
    assert table[["poisson_ratio_low", "youngs_modulus_std_pa"]].isna().all(axis=None)


def test_summary_of_a_run_that_minimises_nothing(hertz):
    searched = (make(CAPTURES, {}) for make in (tables.minimum_table, tables.least_squares_table))
    summary = tables.summary(hertz, *searched, pd.DataFrame(), pd.DataFrame())
    assert set(summary["method"]) == {"hertz", "hertz_free_contact", "hertz_recommended"}
    assert summary["youngs_modulus_pa"].isna().all()


def test_a_hertz_fit_with_doubts_is_not_judged():
    doubtful = fit(2e4)
    doubtful["recommended"] = doubtful["recommended"] | {"doubts": ["no layer"]}
    hertz = hertz_tables.hertz_table(CAPTURES[:2], [fit(2e4), doubtful])
    searched = (make([], {}) for make in (tables.minimum_table, tables.least_squares_table))
    summary = tables.summary(hertz, *searched, pd.DataFrame(), pd.DataFrame())
    best = summary[summary["method"] == "hertz_recommended"]
    assert best["reduced_modulus_verdict"].tolist() == ["interval", "not judged"]


def test_what_is_written_says_what_is_simulated(hertz, root):
    published = pd.read_csv(root / "config/published/table_5_2.csv")
    table = tables.rounded(hertz_tables.table_5_2(hertz, published, block="foam_block"))
    text = tables.markdown(table, title="Table 5.2")
    assert tables.SIMULATED_NOTE in text
    assert tables.PUBLISHED_NOTE in text
    assert "| simulated |" in text


def test_figures_repeat_and_carry_their_label(tmp_path):
    shown = CAPTURES[::2]
    for k in "ab":
        with style.journal():
            results = [minimum(2e4, 0.25), minimum(3e4, 0.2) | {"at_bound": True}]
            figure = figures.figure_5_8(shown, results, error="displacement")
            style.save(figure, tmp_path / f"{k}.png", tmp_path / f"{k}.svg")
    for ending in ("png", "svg"):
        one, other = ((tmp_path / f"{k}.{ending}").read_bytes() for k in "ab")
        assert one == other
    drawn = (tmp_path / "a.svg").read_text()
    assert "simulated captures" in drawn and drawn.count("(at a bound)") == 1


def test_accuracy_of_a_known_error():
    from thesis.accuracy.capture import _force, _tip

    down = np.tile([0, 0, -1.0], (4, 1))
    truth = {"tip_m": np.zeros((4, 3)), "force_n": 2 * down, "axis": down}
    turned = np.tile([0, np.sin(0.02), -np.cos(0.02)], (4, 1))
    turned[1] = [0, np.sin(0.5), -np.cos(0.5)]
    results = {
        "axis": turned,
        "tip_m": np.tile([3e-4, 4e-4, 0], (4, 1)),
        "raw_tip_m": np.zeros((4, 3)),
        "force_n": np.tile([0, 0, -2.1], (4, 1)),
    }
    found = {row["quantity"]: row["value"] for row in _tip(truth, results) + _force(truth, results)}
    assert found["tip_position_rms"] == pytest.approx(0.5)
    assert found["force_rms"] == pytest.approx(0.1)
    assert found["force_magnitude_rms_of_peak"] == pytest.approx(5)
    assert found["force_direction_mean"] == pytest.approx(0, abs=1e-4)
    assert found["axis_direction_max"] == pytest.approx(np.degrees(0.5))
    assert found["flipped_frames"] == 1
