"""Minima beside the published values, and their rows of the summary."""

import pandas as pd
import pytest
from palpate.report import tables
from palpate.report.estimate_rows import summary
from thesis.chapter5 import moduli_tables
from thesis.chapter5.moduli_tables import least_squares_rows, minimum_rows

CAPTURES = [
    {"object": "foam_block", "sensor": sensor, "capture": capture, "point": capture[:2],
     "provenance": "simulated"}
    for sensor, capture in (("kinect", "08"), ("kinect", "11-a03"), ("bumblebee", "08"))
]  # fmt: skip


@pytest.fixture
def found():
    known = {"youngs_modulus_pa": 2e4, "poisson_ratio": 0.25, "at_bound": False}
    known |= {"reduced_modulus_pa": 2e4 / (1 - 0.25**2)}
    fit = {"youngs_modulus_std_pa": 300.0, "poisson_ratio_std": 0.05, "unknown": None}
    return {
        (capture["object"], capture["sensor"], capture["capture"], "displacement"): known
        | {
            "hertz_reduced_modulus_pa": 25000.0,
            "profile": {"interval": [0.1, 0.35], "verdict": "bounded"},
            "least_squares": {norm: known | fit for norm in ("length", "square")},
        }
        for capture in CAPTURES
    }


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
