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
STAR = "reduced_modulus_pa"


@pytest.fixture(scope="module")
def compared(root):
    """Table of the comparison with ours."""
    folder = root / "config/published"
    tables = {name: pd.read_csv(folder / f"{name}.csv", dtype={"point": str}) for name in NAMES}
    rows = printed.published_numbers(tables)
    assert not rows.duplicated(printed.KEYS).any() and rows["published"].notna().all()

    def compare(ours, true=None, **more):
        return comparison.comparison(rows, comparison.our_numbers(ours, **more), true or {})

    return compare


def one(table, **wanted):
    (row,) = table[(table[list(wanted)] == pd.Series(wanted)).all(axis=1)].to_dict("records")
    return row


def test_each_printed_number_has_its_row_also_without_captures(compared):
    table = compared({})
    counts = table["artefact"].value_counts()
    assert {name: counts[name] for name in PRINTED} == PRINTED
    assert table["ours"].isna().all()


def test_ours_stands_beside_the_printed_number(compared):
    minimum = {"youngs_modulus_pa": 4e4, "poisson_ratio": 0.2, STAR: 41667}
    rows = [
        {"object": name, "sensor": "kinect", "capture": point, "point": point, "method": method,
         "provenance": "simulated", "poisson_ratio_verdict": ""} | moduli
        for name, point, method, moduli in (
            ("foam_block", "08", "hertz", {STAR: 27000}),
            ("foam_block", "08", "minimise_displacement", minimum),
            ("foam_ball", "01", "minimise_displacement", minimum),
            ("foam_ball", "01", "hertz", {STAR: 2e5}),
        )
    ]  # fmt: skip
    true = {("foam_block", "youngs_modulus"): 25e3}
    table = compared({"summary": pd.DataFrame(rows)}, true)
    block = {"artefact": "table_5_3", "sensor": "kinect", "point": "08"}
    E = one(table, **block, error="displacement", quantity="youngs_modulus")
    assert [E[name] for name in ("published", "ours", "true")] == [35499, 40000, 25000]
    assert (E["ratio"], E["provenance"]) == (pytest.approx(40000 / 35499, abs=1e-4), "simulated")
    hertz = one(table, **block, quantity="hertz_reduced_modulus")
    assert (hertz["published"], hertz["ours"]) == (35500, 27000)
    other = block | {"sensor": "bumblebee", "error": "displacement"}
    assert pd.isna(one(table, **other, quantity="poisson_ratio")["ours"])
    # A printed number without a point takes that of ours.
    ball = {"artefact": "table_5_4", "sensor": "kinect", "error": "displacement"}
    nu = one(table, **ball, quantity="poisson_ratio")
    assert (nu["published"], nu["ours"], nu["point"]) == (0.418, 0.2, "01")


def test_attempts_keep_their_names_and_translations_are_in_metres(compared):
    attempts = pd.DataFrame(
        {"sensor": "kinect", "point": "11", "attempt": ["2", "mean", "standard deviation (n-1)"],
         "reduced_modulus_pa": [28269, 28270, 413], "provenance": "recorded"}
    )  # fmt: skip
    transform = {"row": [1], "r1": 1, "r2": 0, "r3": 0, "t_m": -0.025, "provenance": "simulated"}
    table = compared({"table_5_1": attempts, "equation_4_12": pd.DataFrame(transform)})
    for wanted, published, ours in (
        ({"artefact": "table_5_1", "point": "11-a02"}, 26600, 28269),
        ({"quantity": "reduced_modulus_mean"}, 30800, 28270),
        ({"quantity": "reduced_modulus_std"}, 2700, 413),
        ({"quantity": "t1", "unit": "m"}, -0.0250043218, -0.025),
    ):
        row = one(table, **wanted)
        assert (row["published"], row["ours"]) == (pytest.approx(published), ours)


def steps(*values):
    return [
        {"iteration": k, "lame_lambda_pa": value, "lame_mu_pa": 1e4, "error_m": 2e-3 / k}
        for k, value in enumerate(values, start=1)
    ]


def test_every_sensor_stands_beside_the_iteration_at_which_its_trace_settles(compared):
    assert comparison.settled_iteration(steps(1, 100, 50, 99.5, 100.5, 100)) == 4
    assert comparison.settled_iteration(steps(100, 100, 100)) == 1
    captures = [
        {"object": "foam_block", "sensor": sensor, "point": "16", "provenance": "simulated"}
        for sensor in ("bumblebee", "kinect")
    ]
    traces = [(capture, "force_displacement", steps(1, 100, 100)) for capture in captures]
    table = compared({}, traces=traces, nodes=[(captures[0], 1192)])
    mine = table[(table["artefact"] == "figure_5_8") & (table["quantity"] == "settled_iteration")]
    shown = mine[["sensor", "published", "ours"]].to_numpy().tolist()
    assert shown == [["bumblebee", 40, 2], ["kinect", 40, 2]]
    nodes = one(table, artefact="section_5_2_1")
    assert (nodes["published"], nodes["ours"], nodes["sensor"]) == (1201, 1192, "")
