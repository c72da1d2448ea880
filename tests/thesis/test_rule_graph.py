"""Figure 1.1: boxes and arrows follow what the workflow says of its rules."""

from thesis.chapter1.rule_graph import direct_edges


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
