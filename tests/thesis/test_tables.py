"""Tables beside the published values, and what they say of minima."""

import json
from types import SimpleNamespace

import pandas as pd
import pytest
from palpate.report import style, tables
from palpate.report.estimate_rows import summary
from thesis.chapter5 import minimisation_figures as figures
from thesis.chapter5 import moduli_tables
from thesis.minimum_rows import least_squares_rows, minimum_rows

CAPTURES = [
    {"object": "foam_block", "sensor": s, "capture": c, "point": c[:2], "provenance": p}
    for s, c, p in (
        ("kinect", "08", "simulated"),
        ("kinect", "11-a03", "simulated"),
        ("bumblebee", "08", "recorded"),
    )
]


def minimum(E, nu):
    known = {"youngs_modulus_pa": E, "poisson_ratio": nu, "at_bound": False}
    known |= {"reduced_modulus_pa": E / (1 - nu**2)}
    fit = {"youngs_modulus_std_pa": 300.0, "poisson_ratio_std": 0.05, "unknown": None}
    return known | {
        "hertz_reduced_modulus_pa": 25000.0,
        "trace": [
            {"iteration": k, "lame_lambda_pa": 1e4 + k, "lame_mu_pa": 9e3, "error_m": 1e-3 / k}
            for k in range(1, 30)
        ],
        "profile": {"interval": [0.1, 0.35], "verdict": "bounded"},
        "least_squares": {norm: known | fit for norm in ("length", "square")},
    }


@pytest.fixture
def found():
    keys = [(c["object"], c["sensor"], c["capture"], "displacement") for c in CAPTURES]
    return {key: minimum(20000.0, 0.25) for key in keys}


@pytest.fixture
def minima(found):
    return pd.DataFrame(minimum_rows(CAPTURES, found))


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


def test_a_minimum_at_a_bound_says_so_in_its_figure(tmp_path):
    results = [minimum(2e4, 0.25), minimum(3e4, 0.2) | {"at_bound": True}]
    paths = [tmp_path / f"{k}.json" for k in range(2)]
    for path, result in zip(paths, results, strict=True):
        path.write_text(json.dumps(result))
    params = {"captures": CAPTURES[::2], "error": "displacement", "iterations": None}
    with style.journal():
        figure = figures.minimisation(SimpleNamespace(results=paths), SimpleNamespace(**params))
    texts = [text.get_text() for text in figure.findobj(style.matplotlib.text.Text)]
    assert sum(text.count("(at a bound)") for text in texts) == 1
    style.plt.close(figure)


def test_what_is_not_judged_stays_blank(found):
    for minimum in found.values():
        minimum["profile"] |= {"interval": None, "verdict": "not judged"}
        for fit in minimum["least_squares"].values():
            fit |= {"youngs_modulus_std_pa": None, "poisson_ratio_std": None}
    table = tables.rounded(pd.DataFrame(minimum_rows(CAPTURES, found)))
    assert (table["poisson_ratio_verdict"] == "not judged").all()
    assert table[["poisson_ratio_low", "youngs_modulus_std_pa"]].isna().all(axis=None)


def test_a_summary_has_a_row_for_each_method(found):
    rows = summary([*minimum_rows(CAPTURES, found), *least_squares_rows(CAPTURES, found)])
    assert rows.groupby("capture").size().to_dict() == {"08": 4, "11-a03": 2}
    searched = rows[rows["method"] == "minimise_displacement"]
    assert (searched["poisson_ratio_verdict"] == "bounded").all()
    derived = rows[rows["method"] == "least_squares_displacement"]
    assert (derived["youngs_modulus_std_pa"] == 300).all()
