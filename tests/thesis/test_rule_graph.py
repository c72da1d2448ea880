"""Figure 1.1: boxes and arrows follow what the workflow says of its rules."""

import pytest
from palpate.report import style
from thesis.chapter1.rule_graph import PLACES, direct_edges, figure_1_1


def rule(name, stage, reads=(), *, wanted=()):
    files = {other: [f"{other}.npz"] for other in reads}
    return {"rule": name, "stage": stage, "recorded": [], "reads": files, "wanted": list(wanted)}


RULES = [
    rule("mask", "preprocess"),
    rule("clouds", "preprocess", ["mask"]),
    rule("track", "surface", ["clouds", "mask"]),
    rule("minimise", "elasticity", ["track"], wanted=["minimise.json"]),
]


def test_direct_edges_have_no_way_round():
    edges = {("mask", "clouds"), ("clouds", "track"), ("track", "minimise")}
    assert direct_edges({one["rule"]: set(one["reads"]) for one in RULES}) == edges


def test_every_rule_and_what_others_read_of_it_is_shown_in_a_place_of_its_own():
    with style.journal():
        found = {text.get_text() for text in figure_1_1(RULES).findobj(style.matplotlib.text.Text)}
    assert {"mask", "mask.npz", "clouds", "track", "track.npz", "minimise.json"} <= found
    assert len(set(PLACES.values())) == len(PLACES)
    style.plt.close("all")


def test_a_rule_without_a_place():
    with pytest.raises(ValueError, match="rules: expected camera_calibration, .* found despeckle"):
        figure_1_1([*RULES, rule("despeckle", "preprocess")])
