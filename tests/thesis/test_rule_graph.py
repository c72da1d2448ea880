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


def test_rules_that_only_some_runs_have_get_a_place_too():
    more = [rule("tip", "calibration"), rule("load", "calibration")]
    with style.journal():
        figure = figure_1_1([*RULES, *more])
    places = {text.get_text(): text.get_position() for text in figure.axes[0].texts}
    assert places["tip"] != places["load"] and places["tip"][0] == places["load"][0]
    style.plt.close("all")


@pytest.mark.parametrize(
    ("rules", "line"),
    [([], "at least one, found none"), ([rule("mask", "preprocess", ["lost"])], "found lost")],
)
def test_what_cannot_be_drawn(rules, line):
    with pytest.raises(ValueError, match=f"rules: expected .*{line}"):
        figure_1_1(rules)
