"""Rows of a summary: of direct estimates, of Hertz fits, and what speaks against them."""

from dataclasses import asdict

import pandas as pd
import pytest
from palpate.modulus import LABELS, Modulus
from palpate.report import estimate_rows

CAPTURE = {"object": "foam", "sensor": "kinect", "capture": "01", "point": "01"}
CAPTURE |= {"provenance": "simulated"}
GROUP = {"object": "foam", "sensor": "kinect", "provenance": "simulated"}


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
        "budget": [
            {"source": "noise of the depth", "contribution_log_effective_reduced_modulus": 0.02}
        ],
    }


def fit(doubts=()):
    model = {"reduced_modulus_pa": 21e3, "reduced_modulus_interval_pa": [20e3, 22e3]}
    return {"study": model, "free_contact": model, "recommended": model | {"doubts": [*doubts]}}


def direct_rows(*of):
    return pd.DataFrame(estimate_rows.direct_rows(*of))


def test_a_hertz_fit_with_doubts_is_not_judged():
    fits = fit(), fit(["no layer"])
    found = estimate_rows.summary([*estimate_rows.hertz_rows([CAPTURE] * 2, fits)])
    verdicts = found.groupby("method")["reduced_modulus_verdict"].agg(sorted).to_dict()
    assert verdicts == {
        "hertz": ["not judged"] * 2,
        "hertz_free_contact": ["interval"] * 2,
        "hertz_recommended": ["interval", "not judged"],
    }
    assert found["youngs_modulus_pa"].isna().all() and not found["recommended"].any()


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
    # Other objects are not compared.
    rows = direct_rows([], [], [GROUP, GROUP | OTHER | {"object": "rubber"}], joints)
    assert "doubts" not in rows and (rows["youngs_modulus_verdict"] == "identified").all()


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


def test_whether_points_differ_is_in_the_summary_of_three_or_more():
    captures = [CAPTURE | {"capture": name, "point": name} for name in ("01", "02", "03")]
    joint, last = [estimate(20500.0, 0.3, 1000.0)], []
    for E in (20e3, 30e3):
        singles = [estimate(20e3, 0.3, 1000.0), estimate(20.2e3, 0.3, 1000.0)]
        rows = direct_rows(captures, [*singles, estimate(E, 0.3, 1000.0)], [GROUP], joint)
        assert rows["points"].isna().tolist() == [True] * 3 + [False]
        last.append(rows.iloc[-1])
    alike, apart = last
    assert alike["points"] == 3 and alike["homogeneity_p"] > 0.5 > 1e-3 > apart["homogeneity_p"]
    assert alike["heterogeneity_percent"] == 0 and 15 < apart["heterogeneity_percent"] < 35
    two = direct_rows(captures[:2], singles, [GROUP], joint).iloc[-1]
    assert two["points"] == 2 and "homogeneity_p" not in two
