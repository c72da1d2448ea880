"""Page of one object: numbers as people read them, verdicts explained, doubts told."""

import pandas as pd
import pytest
from palpate.report.own_page import own_page, press_of
from palpate.report.tables import AT_BOUND_NOTE

ADVISED = {
    "object": "toy",
    "sensor": "my_cam",
    "capture": "all",
    "point": "all",
    "method": "direct_joint",
    "recommended": True,
    "youngs_modulus_pa": 38120.0,
    "youngs_modulus_low_pa": 35000.0,
    "youngs_modulus_high_pa": 41049.0,
    "youngs_modulus_verdict": "identified",
    "youngs_modulus_1s_pa": 35000.0,
    "youngs_modulus_1s_low_pa": 34000.0,
    "youngs_modulus_1s_high_pa": 36000.0,
    "youngs_modulus_1s_verdict": "identified",
    "poisson_ratio": 0.384,
    "poisson_ratio_low": 0.2,
    "poisson_ratio_high": 0.49,
    "poisson_ratio_verdict": "bounded",
    "reduced_modulus_pa": 44500.0,
    "reduced_modulus_low_pa": 43000.0,
    "reduced_modulus_high_pa": 46000.0,
    "reduced_modulus_verdict": "identified",
    "equivalent_reduced_modulus_pa": 45000.0,
    "equivalent_reduced_modulus_low_pa": 44000.0,
    "equivalent_reduced_modulus_high_pa": 46000.0,
    "equivalent_reduced_modulus_verdict": "identified",
    "equivalent_depth_m": 0.0042,
    "force_law": 0.12,
    "force_law_std": 0.3,
    "captures": 2,
    "motion_scale": 1.1,
    "provenance": "recorded",
}
HERTZ = {"object": "toy", "sensor": "my_cam", "capture": "1", "point": "1", "method": "hertz"}
HERTZ |= {"recommended": False, "reduced_modulus_pa": 41000.0, "provenance": "recorded"}
PRESS = {"sensor": "my_cam", "capture": "1"}


SEARCHED = HERTZ | {"method": "minimise_displacement", "youngs_modulus_pa": 1e8}
SEARCHED |= {"poisson_ratio": 0.0, "reduced_modulus_pa": 1e8}


PARTS = (
    "log_equivalent_reduced_modulus",
    "log_reduced_modulus",
    "log_youngs_modulus",
    "poisson_ratio",
)


def source(name, *parts):
    row = {"source": name, "standard_uncertainty": 0.0005, "unit": "m"}
    return row | {f"contribution_{of}": part for of, part in zip(PARTS, parts, strict=True)}


BUDGET = [
    source("noise of the depth", 0.02, 0.031, 0.03, 0.01),
    source("clocks", 1e-4, 1e-4, 1e-3, 1e-4),
]


def page(pictures=None, at_bound=False, **changes):
    rows = pd.DataFrame([HERTZ, SEARCHED | {"at_bound": at_bound}, ADVISED | changes])
    return own_page("toy", rows, [PRESS], pictures or {}, {"my_cam": BUDGET})


def test_the_recommended_row_comes_first_with_its_intervals():
    text = page()
    assert (
        "| my_cam | 2 | 44.5 kPa (43.0 to 46.0): identified | 45.0 kPa (44.0 to 46.0): identified"
        " | 38.1 kPa (35.0 to 41.0): identified | 0.38 (0.20 to 0.49): bounded" in text
    )
    assert "| 35.0 kPa (34.0 to 36.0): identified | 4.2 | +0.12 ± 0.30 |" in text
    assert text.index("## How stiff") < text.index("## Captures") < text.index("## All estimates")


def test_the_budget_shows_what_counts():
    text = page()
    assert "| noise of the depth | 0.0005 m | 2.0 | 3.1 | 3.0 | 0.010 |" in text
    assert "clocks" not in text


def test_just_the_verdicts_that_occur_are_explained():
    text = page()
    assert "- *bounded*: " in text and "- *identified*: " in text
    assert "- *not identified*: " not in text


def test_a_surface_unlike_the_model_is_told():
    assert "by 4.2 times what its noise explains" in page(motion_scale=4.2)
    assert "unlike the model" not in page()


def test_a_search_that_ended_at_a_bound_is_told():
    text = page(at_bound=True)
    assert "| 100.0 MPa (at a bound) |  | 100.0 MPa (at a bound) | 0.00 (at a bound) |" in text
    assert text.count("(at a bound)") == 3 and AT_BOUND_NOTE in text
    assert "at a bound" not in page() and AT_BOUND_NOTE not in page()


def test_simulated_captures_are_told_and_recorded_ones_not():
    assert "virtual lab" in page(provenance="simulated")
    assert "virtual lab" not in page()


def test_pictures_are_in_the_page():
    assert "![moduli](data:image/png;base64,YWJj)" in page({"moduli": b"abc"})


def test_a_summary_without_a_recommended_row():
    with pytest.raises(ValueError, match="recommended: expected a row for each sensor"):
        own_page("toy", pd.DataFrame([HERTZ]), [PRESS], {}, {})


def test_what_a_capture_held():
    fit = {
        "samples": {"force_n": [0.0, 2.1], "depth_m": [-0.001, 0.0046]},
        "depth_over_radius": 0.77,
        "radius_m": 0.006,
    }
    direct = {"frames": [9], "nuisances": [{"offset_m": 0.00104}]}
    direct["residuals"] = [{"cells": 80, "motion_scale": 1.26}]
    row = press_of(PRESS, fit, direct)
    assert row["peak force (N)"] == "2.10"
    assert row["greatest depth (mm)"] == "5.6" and row["of it fitted offset (mm)"] == "1.0"
    assert row["depth over radius"] == "0.94"
    assert row["frames"] == "2" and row["frames compared"] == "9"
    assert row["motion's noise over expected"] == "1.3"
