"""Direct estimates in tables: rows, truth, errors and coverage."""

from dataclasses import asdict

import pandas as pd
import pytest
from palpate.modulus import LABELS, Modulus
from palpate.report import tables
from palpate.report.moduli_table import accuracy_table, coverage_table, direct_rows, truth_of

CAPTURE = {"object": "foam", "sensor": "kinect", "capture": "01", "point": "01"}
CAPTURE |= {"provenance": "simulated"}
GROUP = {"object": "foam", "sensor": "kinect", "provenance": "simulated"}
MATERIAL = {
    "youngs_modulus_pa": 20000.0,
    "poisson_ratio": 0.3,
    "relaxation": {"fractions": [0.1], "times_s": [1.0]},
}


def estimate(E, nu, half):
    def interval(value, width):
        unit = "Pa" if value > 1 else "1"
        return asdict(Modulus(value, value - width, value + width, "identified", unit))

    residual = {"motion_scale": 1.0, "motion_sharing": 4.0, "depth_scale": 1.0}
    return {
        "youngs_modulus_pa": interval(E, half),
        "reduced_modulus_pa": interval(E / (1 - nu**2), half),
        "youngs_modulus_1s_pa": interval(0.93679 * E, half),
        "poisson_ratio": interval(nu, 0.05),
        "effective_reduced_modulus_pa": interval(E / (1 - nu**2), half),
        "effective": {"depth_m": 0.004},
        "law": {name: {"value": 0.1, "std": 0.2} for name in ("force", "motion")},
        "captures": ["01"],
        "frames": [12],
        "doubts": [],
        "information": {name: {"bound": 0.02, "efficiency": 0.5} for name in LABELS},
        "residuals": [residual],
    }


@pytest.fixture
def summary():
    rows = direct_rows(
        [CAPTURE], [estimate(22000.0, 0.4, 1000.0)], [GROUP], [estimate(20500.0, 0.31, 1000.0)]
    )
    empty = pd.DataFrame(columns=["error"])
    hertz = pd.DataFrame([CAPTURE | {"reduced_modulus_pa": 21000.0}])
    for name in ("free_contact", "recommended"):
        for end in ("reduced_modulus_pa", "low_pa", "high_pa"):
            hertz[f"{name}_{end}"] = 21000.0
    return tables.summary(hertz, empty, empty, rows, empty)


def test_truth_after_a_second():
    truth = truth_of(MATERIAL)
    assert truth["youngs_modulus_pa"] == 20000.0
    assert truth["youngs_modulus_1s_pa"] == pytest.approx(20000 * (1 - 0.1 * 0.632121), rel=1e-6)
    assert truth_of(MATERIAL | {"relaxation": None})["youngs_modulus_1s_pa"] == 20000.0


def test_the_effective_modulus_of_another_law_has_no_truth_here():
    true = truth_of(MATERIAL)
    star = true["reduced_modulus_pa"]
    left = true["youngs_modulus_1s_pa"] / true["youngs_modulus_pa"]
    assert star == 20000 / (1 - 0.3**2) and left < 1
    assert true["effective_reduced_modulus_pa"] == pytest.approx(star * left)
    foam = truth_of(MATERIAL | {"law": "blatz_ko"})
    assert pd.isna(foam["effective_reduced_modulus_pa"]) and foam["reduced_modulus_pa"] == star


def test_one_row_is_recommended_and_none_is_without_a_verdict(summary):
    assert summary.loc[summary["recommended"], ["method", "point"]].values.tolist() == [
        ["direct_joint", "all"]
    ]
    for name in ("youngs_modulus", "poisson_ratio", "reduced_modulus"):
        value = f"{name}_pa" if name != "poisson_ratio" else name
        assert summary.loc[summary[value].notna(), f"{name}_verdict"].notna().all()


def test_errors_and_coverage(summary):
    found = accuracy_table(summary, {"foam": MATERIAL}).set_index("method")
    assert found.loc["direct", "youngs_modulus_error"] == pytest.approx(0.1)
    assert found.loc["direct", "poisson_ratio_error"] == pytest.approx(0.1)
    assert not found.loc["direct", "youngs_modulus_covered"]
    assert found.loc["direct_joint", "youngs_modulus_covered"]
    assert pd.isna(found.loc["hertz", "reduced_modulus_covered"])
    other = accuracy_table(summary, {"foam": MATERIAL | {"law": "blatz_ko"}})
    assert other["effective_reduced_modulus_covered"].isna().all()
    short = coverage_table(found.reset_index()).set_index(["object", "sensor", "method"])
    assert short.loc[("all", "all", "direct"), "youngs_modulus_coverage"] == 0.0
    assert short.loc[("all", "all", "direct_joint"), "poisson_ratio_coverage"] == 1.0


def test_the_information_limit_stands_beside_the_estimates(summary):
    named = ("effective_reduced_modulus", "youngs_modulus", "poisson_ratio")
    direct = summary[summary["method"].str.startswith("direct")]
    for name in named:
        assert (direct[[f"{name}_bound", f"{name}_efficiency"]] == [0.02, 0.5]).all(axis=None)


OTHER = {"sensor": "bumblebee"}


@pytest.mark.parametrize(("E", "verdict"), [(18650.0, "bounded"), (18700.0, "identified")])
def test_sensors_that_exclude_each_other_identify_nothing(E, verdict):
    """Intervals of 1 kPa to each side; the capture alone is of the one sensor."""
    joints = [estimate(20500.0, 0.3, 1000.0), estimate(E, 0.3, 1000.0)]
    rows = direct_rows([CAPTURE], [joints[0]], [GROUP, GROUP | OTHER], joints)
    found = rows[rows["recommended"]]
    for name in ("youngs_modulus", "poisson_ratio"):
        assert found[f"{name}_verdict"].tolist() == [verdict] * 2
    warned = verdict == "bounded"
    assert rows.filter(["doubts"]).notna().to_numpy().sum() == 3 * warned
    assert not joints[0]["doubts"] and joints[0]["poisson_ratio"]["verdict"] == "identified"


def test_a_capture_that_all_together_exclude():
    captures = [CAPTURE | {"capture": f"{k:02d}"} for k in range(5)]
    singles = [estimate(E, 0.3, 1000.0) for E in (20e3, 20e3, 20e3, 20e3, 17e3)]
    rows = direct_rows(captures, singles, [GROUP], [estimate(20500.0, 0.3, 1000.0)])
    assert rows["doubts"].notna().tolist() == [False] * 4 + [True, False]
    assert (rows["youngs_modulus_verdict"] == "identified").all()
    singles[3] = singles[4]
    rows = direct_rows(captures, singles, [GROUP], [estimate(20500.0, 0.3, 1000.0)])
    assert rows["doubts"].notna().tolist() == [False] * 3 + [True] * 3
    assert rows["youngs_modulus_verdict"].tolist() == ["identified"] * 5 + ["bounded"]


def test_other_objects_are_not_compared():
    joints = [estimate(20500.0, 0.3, 1000.0), estimate(10e3, 0.3, 1000.0)]
    rows = direct_rows([], [], [GROUP, GROUP | {"object": "rubber"}], joints)
    assert "doubts" not in rows and (rows["youngs_modulus_verdict"] == "identified").all()
