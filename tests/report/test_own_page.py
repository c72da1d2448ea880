"""Page of one object: its numbers with verdicts, what limits them, and what speaks against them."""

from dataclasses import asdict
from html.parser import HTMLParser

import numpy as np
import pandas as pd
import pytest
from palpate.modulus import Modulus
from palpate.report.budget_bars import bars
from palpate.report.held import Held
from palpate.report.other_methods import others
from palpate.report.own_page import own_page
from palpate.report.point_maps import point_maps
from test_estimate_rows import estimate

KNOWN = {
    "youngs_modulus_pa": Modulus(38120.0, 35000.0, 41049.0, "identified", "Pa"),
    "youngs_modulus_1s_pa": Modulus(35000.0, 34000.0, 36000.0, "identified", "Pa"),
    "poisson_ratio": Modulus(0.384, 0.2, 0.49, "bounded", "1"),
    "reduced_modulus_pa": Modulus(44500.0, 43000.0, 46000.0, "identified", "Pa"),
    "effective_reduced_modulus_pa": Modulus(45000.0, 44000.0, 46000.0, "identified", "Pa"),
}
ADVISED = {"object": "toy", "sensor": "my_cam", "capture": "all", "point": "all"}
ADVISED |= {"method": "direct_joint", "recommended": True, "effective_depth_m": 0.0042}
ADVISED |= {"force_law": 0.12, "force_law_std": 0.3, "captures": 2, "provenance": "recorded"}
ADVISED |= {key: cell for name, one in KNOWN.items() for key, cell in one.cells(name).items()}
HERTZ = {"object": "toy", "sensor": "my_cam", "capture": "1", "point": "1", "method": "hertz"}
HERTZ |= {"recommended": False, "reduced_modulus_pa": 41000.0, "provenance": "recorded"}
SEARCHED = HERTZ | {"method": "minimise_displacement", "youngs_modulus_pa": 1e8}
SEARCHED |= {"poisson_ratio": 0.0, "reduced_modulus_pa": 1e8}
PARTS = ("log_effective_reduced_modulus", "log_youngs_modulus", "poisson_ratio")


def source(name, *parts, std=0.0005, unit="m"):
    row = {"source": name, "standard_uncertainty": std, "unit": unit, "origin": "observed"}
    return row | {f"contribution_{of}": part for of, part in zip(PARTS, parts, strict=True)}


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
    "shear_modulus_pa": YOUNG | {"value": 13800.0},
    "bulk_modulus_pa": YOUNG | {"value": 54800.0, "high": None},
    "effective": {"strain": 0.18, "depth_m": 0.00282},
    "budget": [source("noise of the depth", 0.02, 0.03, 0.01), source("clocks", 1e-4, 1e-3, 1e-4)],
}
NOTHING = {"pictures": {}, "glimpses": (), "files": {}, "checksums": [{"file": "a"}]}
NOTHING |= {"settings": [{"setting": "a"}]}


def held(poses=POSES, **changes):
    capture = {"sensor": "my_cam", "capture": "1"}
    return Held(capture, FIT, DIRECT | changes, poses, DEPTH, np.arange(1, 3))


def page(at_bound=False, captures=None, maps=(), **changes):
    rows = pd.DataFrame([HERTZ, SEARCHED | {"at_bound": at_bound}, ADVISED | changes])
    return own_page(
        "toy", rows, captures or [held()], joints={"my_cam": JOINT}, maps=maps, **NOTHING
    )


class Words(HTMLParser):
    """What a reader sees of HTML whose elements end as they should; first: the first section."""

    def __init__(self, html):
        super().__init__()
        self.open, self.words, self.first = [], [], ""
        self.feed(html)
        assert not self.open
        self.text = " ".join(self.words)

    def handle_starttag(self, tag, attrs):
        self.open += [tag] * (tag not in ("meta", "br", "img", "input"))

    def handle_startendtag(self, tag, attrs):
        """Of a drawing, without an end of its own."""

    def handle_endtag(self, tag):
        assert self.open.pop() == tag
        if tag == "section" and not self.first:
            self.first = " ".join(self.words)

    def handle_data(self, data):
        if not {"style", "script"} & set(self.open):
            self.words += data.split()


def test_the_first_screen_has_numbers_verdicts_and_what_limits_them():
    found = Words(page())
    assert "4.2 mm, after 1 s 45.0 kPa (44.0 to 46.0) identified" in found.first
    assert "38.1 kPa (35.0 to 41.0) identified" in found.first
    assert "0.38 (0.20 to 0.49) bounded" in found.first
    assert "depths of 5.6 to 5.6 mm and times up to 3.0 s." in found.first
    assert "All 6 checks of one capture passed." in found.first
    assert "(100 % of effective E*, 100 % of instantaneous E, 100 % of nu)." in found.first
    assert "E at 1 s 35.0 kPa 34.0 to 36.0 identified" in found.text
    assert "G 13.8 kPa" in found.text and "K 35.0 kPa or more" in found.text
    assert "mean strain of 18 %, 2.8 mm deep" in found.text
    assert "0 s after the touch (18 % per second) and at maximum depth after 2.0 s" in found.text


def test_times_later_than_the_captures_are_extrapolated():
    short = held(poses=POSES.assign(time_s=[0.0, 0.4, 0.8]))
    assert "36.0 extrapolated: the captures end at 0.8 s" in Words(page(captures=[short])).text
    long = held(poses=POSES.assign(time_s=[0.0, 2.0, 12.0]))
    assert "extrapolated:" not in Words(page(captures=[short, long])).text


def test_a_recommended_curve_without_the_effective_modulus():
    nothing = dict.fromkeys((name for name in ADVISED if name.startswith("effective")), None)
    nothing |= {"force_law": None, "captures": None, "sensor": "curve", "capture": "back"}
    found = Words(page(**nothing, method="curve_table", poisson_ratio_verdict="assumed"))
    assert "curve back, for comparison E* at small strain 44.5 kPa" in found.first
    assert "assumed, not measured" in found.first and "material-law" not in found.first


def test_shares_add_up_and_sizes_have_units():
    rows = [source("clocks", 0.03, 0.04, 0.01, std=0.01, unit="s")]
    rows += [source("noise of the depth", 0.04, 0.03, 0.02, std=2e-4)]
    found = bars(rows)
    # The larger of the two in anything comes first: nu, 4 to 1.
    assert [one["name"] for one in found["sources"]][1] == "clocks of camera and force"
    assert np.array([one["parts"] for one in found["sources"]]) == pytest.approx(
        np.array([[64.0, 36.0, 80.0], [36.0, 64.0, 20.0]])
    )
    assert [one["size"] for one in found["sources"]] == ["±0.2 mm", "±10 ms"]


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"residuals": [{"cells": 80, "motion_scale": 4.2, "depth_scale": 1.1}]}, "4.2 times"),
        ({"residuals": [{"cells": 80, "motion_scale": 1.2, "depth_scale": 9.0}]}, "9.0 times"),
        ({"nuisances": [{"offset_m": -0.0153, "offset_std_m": 0.003}]}, "5.1 times"),
        ({"frames_beyond_lookup": [2]}, "2 of 11"),
        ({"converged": False}, "no"),
        ({"poses": POSES.assign(detected=[1, 0, 1])}, "1 of 2"),
    ],
)
def test_a_failed_check_is_on_the_first_screen(changes, told):
    found = Words(page(captures=[held(**changes)]))
    assert "1 of 6 checks" in found.first and f": {told}, expected " in found.first
    assert f"✗ {told}" in found.text


def test_warnings_simulated_captures_and_bounds_are_told():
    found = Words(page(doubts="the fit did not converge; nu is far", provenance="simulated"))
    assert "Warning: the fit did not converge. Warning: nu is far." in found.first
    assert "Simulated" in found.first and "Simulated" not in Words(page()).text
    assert Words(page(at_bound=True)).text.count("(at a bound)") == 3
    assert "(at a bound)" not in Words(page()).text


def test_how_far_other_methods_are_from_the_recommended_estimate():
    stiffer = HERTZ | {"reduced_modulus_pa": 47170.0, "capture": "2"}
    assert "by -8 to +6 % in E*" in others(pd.DataFrame([HERTZ, stiffer, ADVISED]))["why"]
    # What a bound ended is not a method's answer.
    bound = SEARCHED | {"at_bound": True}
    assert "by -8 % in E*" in others(pd.DataFrame([HERTZ, bound, ADVISED]))["why"]
    assert others(pd.DataFrame([ADVISED]))["why"] == ""


def test_a_map_takes_three_points():
    places = {name: np.array([0.01 * k, 0.0, 0.0]) for k, name in enumerate("123")}
    captures = [{"object": "toy", "sensor": "my_cam", "point": name} for name in places]
    group, singles = (
        {"object": "toy", "sensor": "my_cam"},
        [estimate(E, 0.3, 2e3) for E in (2e4, 3e4, 2e4)],
    )
    found = [point_maps(captures[:k], singles[:k], [group], places) for k in (2, 3)]
    two, three = (Words(page(maps=maps)).text for maps in found)
    assert "my_cam, 2 points: a map of stiffness takes 3." in two and "by point" not in two
    assert "my_cam, 3 points: the points differ by more than their uncertainty (p < 0.0001" in three
    assert "2 10, 0, 0 33.0 kPa (31.0 to 35.0) 3.1 % identified" in three


def test_a_summary_without_a_recommended_row():
    with pytest.raises(ValueError, match="recommended: expected a row for each sensor"):
        own_page("toy", pd.DataFrame([HERTZ]), [held()], joints={}, **NOTHING)
