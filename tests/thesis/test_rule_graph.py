"""Figure 1.1: boxes and arrows follow what the workflow says of its rules."""

import pytest
from thesis.chapter1.rule_graph import direct_edges, figure_1_1


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


@pytest.mark.parametrize(
    ("rules", "line"),
    [([], "at least one, found none"), ([rule("mask", "preprocess", ["lost"])], "found lost")],
)
def test_what_cannot_be_drawn(rules, line):
    with pytest.raises(ValueError, match=f"rules: expected .*{line}"):
        figure_1_1(rules)
