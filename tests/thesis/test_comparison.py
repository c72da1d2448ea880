"""Every printed number has its row, with ours and the truth beside it."""

import pandas as pd
import pytest
from thesis.findings import comparison, printed

NAMES = ("table_4_1", "equation_4_12", "table_4_2", "table_5_1", "table_5_2", "table_5_3",
         "table_5_4", "table_5_5", "simulation", "text")  # fmt: skip
# Of the study's tables: cameras, transform, tip, attempts with mean and deviation, points,
# moduli with Hertz's of each point, ball, ear, and three pairs of Lame parameters.
PRINTED = {
    "table_4_1": 8, "equation_4_12": 12, "table_4_2": 6, "table_5_1": 18, "table_5_2": 36,
    "table_5_3": 12 * 3 + 6, "table_5_4": 8, "table_5_5": 4,
    "figure_3_5": 3, "figure_3_7": 2, "figure_3_9": 2,
}  # fmt: skip


@pytest.fixture(scope="module")
def published(root):
    folder = root / "config/published"
    return {name: pd.read_csv(folder / f"{name}.csv", dtype={"point": str}) for name in NAMES}


def summary_row(method, sensor="kinect", point="08", name="foam_block", **values):
    known = {"object": name, "sensor": sensor, "capture": point, "point": point}
    names = ("youngs_modulus_pa", "poisson_ratio", "reduced_modulus_pa")
    blank = dict.fromkeys(names) | {"poisson_ratio_verdict": ""}
    return known | blank | {"method": method, "provenance": "simulated"} | values


@pytest.fixture
def summary():
    moduli = {"youngs_modulus_pa": 4e4, "poisson_ratio": 0.2, "reduced_modulus_pa": 41667}
    rows = [
        summary_row("hertz", reduced_modulus_pa=27000),
        summary_row("minimise_displacement", **moduli),
        summary_row("minimise_displacement", point="01", name="foam_ball", **moduli),
        summary_row("hertz", point="01", name="foam_ball", reduced_modulus_pa=2e5),
    ]
    return pd.DataFrame(rows)


def compared(published, tables, true=None, **more):
    ours = comparison.our_numbers(tables, **more)
    return comparison.comparison(printed.published_numbers(published), ours, true or {})


def one(table, **wanted):
    for name, value in wanted.items():
        table = table[table[name] == value]
    assert len(table) == 1
    return table.iloc[0]


def test_each_printed_number_has_its_row(published):
    rows = printed.published_numbers(published)
    counts = rows["artefact"].value_counts()
    assert {name: counts[name] for name in PRINTED} == PRINTED
    assert not rows.duplicated(printed.KEYS).any()
    assert rows["published"].notna().all()
    # A run without captures keeps them all.
    table = compared(published, {})
    assert len(table) == len(rows)
    assert table["ours"].isna().all()
    assert (table["provenance"] == "").all()


def test_ours_stands_beside_the_printed_number(published, summary):
    table = compared(published, {"summary": summary}, {("foam_block", "youngs_modulus"): 25e3})
    E = one(table, artefact="table_5_3", sensor="kinect", point="08", error="displacement",
            quantity="youngs_modulus")  # fmt: skip
    assert E[["published", "ours", "true"]].tolist() == [35499, 40000, 25000]
    assert E["ratio"] == pytest.approx(40000 / 35499, abs=1e-4)
    assert E["provenance"] == "simulated"
    hertz = one(table, artefact="table_5_3", sensor="kinect", point="08",
                quantity="hertz_reduced_modulus")  # fmt: skip
    assert hertz[["published", "ours", "error"]].tolist() == [35500, 27000, ""]
    missing = one(table, artefact="table_5_3", sensor="bumblebee", point="08",
                  error="displacement", quantity="poisson_ratio")  # fmt: skip
    assert pd.isna(missing["ours"])
    # A printed number without a point takes that of ours.
    ball = one(table, artefact="table_5_4", sensor="kinect", error="displacement",
               quantity="poisson_ratio")  # fmt: skip
    assert ball[["published", "ours", "point"]].tolist() == [0.418, 0.2, "01"]


def test_attempts_keep_their_names_and_translations_are_in_metres(published):
    table = pd.DataFrame(
        {"sensor": "kinect", "point": "11", "attempt": ["2", "mean", "standard deviation (n-1)"],
         "reduced_modulus_pa": [28269, 28270, 413], "provenance": "recorded"}
    )  # fmt: skip
    found = compared(published, {"table_5_1": table})
    assert one(found, artefact="table_5_1", point="11-a02")["published"] == 26600
    assert one(found, artefact="table_5_1", point="11-a02")["ours"] == 28269
    assert one(found, quantity="reduced_modulus_mean")["published"] == 30800
    assert one(found, quantity="reduced_modulus_std")[["published", "ours"]].tolist() == [2700, 413]
    # Translations are in metres.
    table = pd.DataFrame({"row": [1], "r1": 1, "r2": 0, "r3": 0, "t_m": -0.025,
                          "provenance": "simulated"})  # fmt: skip
    found = one(compared(published, {"equation_4_12": table}), quantity="t1")
    assert found["published"] == pytest.approx(-0.0250043218)
    assert found["ours"] == -0.025
    assert found["unit"] == "m"


def steps(*values):
    return [
        {"iteration": k, "lame_lambda_pa": value, "lame_mu_pa": 1e4, "error_m": 2e-3 / k}
        for k, value in enumerate(values, start=1)
    ]


def test_a_trace_settles_when_it_no_longer_leaves():
    assert comparison.settled_iteration(steps(1, 100, 50, 99.5, 100.5, 100)) == 4
    assert comparison.settled_iteration(steps(100, 100, 100)) == 1
    assert comparison.settled_iteration(steps(1, 2, 3)) == 3


def test_every_sensor_stands_beside_an_iteration_that_names_none(published):
    captures = [
        {"object": "foam_block", "sensor": sensor, "point": "16", "provenance": "simulated"}
        for sensor in ("bumblebee", "kinect")
    ]
    traces = [(capture, "force_displacement", steps(1, 100, 100)) for capture in captures]
    table = compared(published, {}, traces=traces, nodes=[(captures[0], 1192)])
    mine = table[(table["artefact"] == "figure_5_8") & (table["quantity"] == "settled_iteration")]
    shown = mine[["sensor", "published", "ours"]].to_numpy().tolist()
    assert shown == [["bumblebee", 40, 2], ["kinect", 40, 2]]
    nodes = one(table, artefact="section_5_2_1")
    assert nodes[["published", "ours", "sensor"]].tolist() == [1201, 1192, ""]


def test_points_that_are_words_stay_words():
    names = [printed.point_name(p) for p in (8, "08", 8.0, "lobe", None)]
    assert names == ["08", "08", "08", "lobe", ""]
