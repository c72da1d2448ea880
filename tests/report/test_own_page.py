"""Page of one object: numbers as people read them, verdicts explained, doubts told."""

import re
from dataclasses import asdict
from html import unescape

import numpy as np
import pandas as pd
import pytest
from palpate.modulus import Modulus
from palpate.report.budget_bars import bars, largest
from palpate.report.held import Held
from palpate.report.other_methods import PRESUMED, others
from palpate.report.own_page import SIMULATED_NOTE, own_page
from palpate.report.own_words import law
from palpate.report.tables import AT_BOUND_NOTE

ADVISED = {
    "object": "toy",
    "sensor": "my_cam",
    "capture": "all",
    "point": "all",
    "method": "direct_joint",
    "recommended": True,
    "effective_depth_m": 0.0042,
    "force_law": 0.12,
    "force_law_std": 0.3,
    "captures": 2,
    "motion_scale": 1.1,
    "provenance": "recorded",
}
KNOWN = {
    "youngs_modulus_pa": Modulus(38120.0, 35000.0, 41049.0, "identified", "Pa"),
    "youngs_modulus_1s_pa": Modulus(35000.0, 34000.0, 36000.0, "identified", "Pa"),
    "poisson_ratio": Modulus(0.384, 0.2, 0.49, "bounded", "1"),
    "reduced_modulus_pa": Modulus(44500.0, 43000.0, 46000.0, "identified", "Pa"),
    "effective_reduced_modulus_pa": Modulus(45000.0, 44000.0, 46000.0, "identified", "Pa"),
}
ADVISED |= {key: cell for name, one in KNOWN.items() for key, cell in one.cells(name).items()}
HERTZ = {"object": "toy", "sensor": "my_cam", "capture": "1", "point": "1", "method": "hertz"}
HERTZ |= {"recommended": False, "reduced_modulus_pa": 41000.0, "provenance": "recorded"}
PRESS = {"sensor": "my_cam", "capture": "1"}


SEARCHED = HERTZ | {"method": "minimise_displacement", "youngs_modulus_pa": 1e8}
SEARCHED |= {"poisson_ratio": 0.0, "reduced_modulus_pa": 1e8}


PARTS = (
    "log_effective_reduced_modulus",
    "log_reduced_modulus",
    "log_youngs_modulus",
    "poisson_ratio",
)


def source(name, *parts):
    row = {"source": name, "standard_uncertainty": 0.0005, "unit": "m", "origin": "observed"}
    return row | {f"contribution_{of}": part for of, part in zip(PARTS, parts, strict=True)}


BUDGET = [
    source("noise of the depth", 0.02, 0.031, 0.03, 0.01),
    source("clocks", 1e-4, 1e-4, 1e-3, 1e-4),
]
FIT = {
    "samples": {"force_n": [0.0, 2.1, 2.0], "depth_m": [-0.00104, 0.0046, 0.00455]},
    "radius_m": 0.006,
    "range": {"first_frame": 0, "last_frame": 1},
}
POSES = pd.DataFrame({"time_s": [0.5, 2.5, 3.5], "detected": [1, 1, 0]})
POSES = POSES.assign(tip_x_m=0.0, tip_y_m=0.3, tip_z_m=0.4, raw_tip_std_along_m=5e-5)
DEPTH = np.array([0.0, 0.00564, 0.00559])
DIRECT = {
    "frames": [9],
    "frames_beyond_lookup": [0],
    "nuisances": [{"offset_m": 0.00104, "offset_std_m": 0.003}],
    "residuals": [{"cells": 80, "motion_scale": 1.26, "depth_scale": 1.1}],
    "converged": True,
}


YOUNG = asdict(KNOWN["youngs_modulus_pa"])
JOINT = {
    **{name: asdict(KNOWN[name]) for name in ("youngs_modulus_1s_pa", "poisson_ratio")},
    "youngs_modulus_pa": YOUNG,
    "shear_modulus_pa": YOUNG | {"value": 13800.0},
    "bulk_modulus_pa": YOUNG | {"value": 54800.0, "high": None},
    "effective": {"strain": 0.18, "depth_m": 0.00282},
}


def held(poses=POSES, **changes):
    return Held(PRESS, FIT, DIRECT | changes, poses, DEPTH, np.arange(1, 3))


NOTHING = {"pictures": {}, "glimpses": (), "settings": "", "files": "", "style": ""}


def page(at_bound=False, presses=None, **changes):
    rows = pd.DataFrame([HERTZ, SEARCHED | {"at_bound": at_bound}, ADVISED | changes])
    joints = {"my_cam": JOINT | {"budget": BUDGET}}
    return own_page("toy", rows, presses or [held()], joints=joints, **NOTHING)


def text_of(html):
    """Words that a reader sees, a space between cells."""
    words = re.sub(r"<style>.*?</style>", "", html, flags=re.DOTALL)
    return unescape(re.sub(r"\s+", " ", re.sub(r"<[^>]*>", " ", words)))


def test_the_first_screen_has_the_numbers_and_what_limits_them():
    text = text_of(page())
    first = text[: text.index("How stiff")]
    assert "its effective E*, 4.2 mm deep and after 1 s, is 45.0 kPa" in first
    assert "E at once is 38.1 kPa (35.0 to 41.0) and" in first
    assert "nu is within 0.20 to 0.49 (likeliest 0.38)." in first
    assert "from depths of 5.6 to" in first and "to 5.6 mm and times to 3.0 s." in first
    assert "all 6 checks of one capture passed." in first
    assert "(100 % of effective E*, 100 % of E at once, 100 % of nu)." in first
    assert "effective E* 45.0 kPa 44.0 to 46.0 known" in text
    assert "nu 0.38 0.20 to 0.49 within limits" in text
    assert "E after 1 s 35.0 kPa 34.0 to 36.0 known" in text
    assert "G 13.8 kPa" in text and "K 35.0 kPa or more" in text
    assert "mean strain of 18 %, 2.8 mm deep" in text
    assert "the tip was there 1.0 s after the touch (18 % a second)" in text
    assert "deepest after 2.0 s" in text


def test_times_that_were_recorded_are_known_and_no_later_ones():
    short = held(poses=POSES.assign(time_s=[0.0, 0.4, 0.8]))
    ends = "extrapolated: the captures end at 0.8 s"
    assert f"E after 1 s 35.0 kPa 34.0 to 36.0 {ends}" in text_of(page(presses=[short]))
    long = held(poses=POSES.assign(time_s=[0.0, 2.0, 12.0]))
    text = text_of(page(presses=[short, long]))
    assert "extrapolated:" not in text
    text = text_of(page(presses=[held(poses=POSES.assign(detected=[1, 0, 1]))]))
    assert "probe found from touch to maximum depth: 1 of 2, good is all" in text


@pytest.mark.parametrize(
    ("place", "std", "told"),
    [
        (0.1, 0.2, "near neo-Hooke's law: 0.10 of the way to Blatz and Ko's (-0.29 to 0.49)."),
        (0.9, 0.2, "near Blatz and Ko's law: 0.90 of the way from neo-Hooke's (0.51 to 1.29)."),
        (0.0, 0.5, "is not known: neo-Hooke's and Blatz and Ko's both fit"),
        (0.5, 0.4, "is not known: neo-Hooke's and Blatz and Ko's both fit"),
        (0.5, 0.18, "neither neo-Hooke's nor Blatz and Ko's law but between the two: 0.50"),
        (-0.5, 0.2, "but outside the two: -0.50 of the way (-0.89 to -0.11)."),
        # Where a warning speaks nothing is found of the law.
        (-0.86, 0.07, "force is -0.86 (-1.00 to -0.72), neither 0 (neo-Hooke's law) nor 1"),
        (0.5, 0.16, "(Blatz and Ko's): a warning speaks against it."),
    ],
)
def test_the_law_is_told_by_what_is_possible(place, std, told):
    assert told in law(place, std)
    assert told in text_of(page(force_law=place, force_law_std=std))


def test_a_recommended_curve_without_the_effective_one():
    nothing = dict.fromkeys((name for name in ADVISED if name.startswith("effective")), None)
    nothing |= {"force_law": None, "captures": None, "sensor": "curve", "capture": "back"}
    nothing |= {"method": "curve_table"}
    text = text_of(page(**nothing | {"poisson_ratio_verdict": "assumed"}))
    assert "For comparison, by curve back: its E* at small strain is 44.5 kPa" in text
    assert "was assumed, not measured" in text and "The force rises" not in text


def test_bars_add_up():
    parts = (0.03, 0.03, 0.04, 0.01), (0.04, 0.04, 0.03, 0.02)
    rows = [source("clocks", *parts[0]), source("noise of the depth", *parts[1])]
    html = bars(rows)
    widths = [float(one) for one in re.findall(r"width:([\d.]+)%", html)]
    # The larger of the two in anything comes first: nu, 4 to 1.
    assert widths == [64.0, 36.0, 80.0, 36.0, 64.0, 20.0]
    told = largest(rows)
    assert "(64 % of effective E*, 80 % of nu), " in told and "(64 % of E at once)." in told


@pytest.mark.parametrize(
    ("name", "std", "unit", "told"),
    [
        ("relaxing shares", 0.07, "1", "±7 % of E at each time"),
        ("law of the force", 0.5, "1", "±0.5 of the way between the laws"),
        ("indentation table: motion", 0.01, "1", "±0.01 of nu"),
        ("clocks", 0.01, "s", "±10 ms"),
        ("curvature of the template", 2.0, "1/m", "±2 /m"),
        ("compliance of the probe", 2e-6, "m/N", "±2 µm/N"),
    ],
)
def test_a_source_is_known_to_so_much_of_what(name, std, unit, told):
    row = source(name, 0.02, 0.02, 0.02, 0.02) | {"standard_uncertainty": std, "unit": unit}
    text = text_of(bars([row]))
    assert told in text


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"residuals": [{"cells": 80, "motion_scale": 4.2, "depth_scale": 1.1}]}, "4.2 times"),
        ({"residuals": [{"cells": 80, "motion_scale": 1.2, "depth_scale": 9.0}]}, "9.0 times"),
        ({"nuisances": [{"offset_m": -0.0153, "offset_std_m": 0.003}]}, "5.1 times"),
        ({"frames_beyond_lookup": [2]}, "2 of 11"),
        ({"converged": False}, "no"),
    ],
)
def test_a_recording_that_fails_a_check_is_told_first(changes, told):
    text = text_of(page(presses=[held(**changes)]))
    first = text[: text.index("How stiff")]
    assert "Look at the recording: 1 of 6 checks failed: my_cam 1 (" in first
    assert f": {told}, good is " in first and f"✗ {told}" in text


def test_an_offset_within_its_uncertainty_passes_and_a_doubt_stands_on_the_first_screen():
    far = {"offset_m": -0.005, "offset_std_m": 0.003}
    assert "all 6 checks of one capture passed" in text_of(page(presses=[held(nuisances=[far])]))
    text = text_of(page(doubts="the fit did not converge; nu is far"))
    assert "my_cam: the fit did not converge." in text[: text.index("How stiff")]


def test_a_search_that_ended_at_a_bound_and_simulated_captures_are_told():
    assert SIMULATED_NOTE in page(provenance="simulated") and SIMULATED_NOTE not in page()
    text = text_of(page(at_bound=True))
    assert text.count("(at a bound)") == 3 and AT_BOUND_NOTE in text
    assert "(at a bound)" not in text_of(page())


def other_methods(*rows):
    """What a page says of other methods than the recommended one."""
    tables = "".join(others(pd.DataFrame([*rows, ADVISED]), {}))
    return text_of(tables)


def test_others_are_told_by_what_is_on_the_page():
    of_hertz, of_one, of_search = PRESUMED.values()
    stiffer = HERTZ | {"reduced_modulus_pa": 47170.0, "capture": "2"}
    text = other_methods(HERTZ, stiffer)
    assert "differ from it: here by -8 to +6 % in E*." in text
    assert of_hertz in text and of_one not in text and of_search not in text
    text = other_methods(ADVISED | {"method": "direct", "capture": "1", "recommended": False})
    assert of_one in text and of_hertz not in text
    # What a bound ended is not a method's answer.
    text = other_methods(HERTZ, SEARCHED | {"at_bound": True})
    assert of_search in text and "here by -8 %" in text
    assert "rest on less" not in other_methods()


def test_a_summary_without_a_recommended_row():
    with pytest.raises(ValueError, match="recommended: expected a row for each sensor"):
        own_page("toy", pd.DataFrame([HERTZ]), [held()], joints={}, **NOTHING)
