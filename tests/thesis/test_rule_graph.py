"""Figure 1.1: boxes and layers follow what the workflow says of its rules."""

import pytest
from palpate.report import style
from thesis.chapter1 import rule_graph


def rule(name, stage, reads=(), *, recorded=(), wanted=()):
    files = {other: [f"{other}.npz"] for other in reads}
    return {
        "rule": name,
        "stage": stage,
        "recorded": list(recorded),
        "reads": files,
        "wanted": list(wanted),
    }


@pytest.fixture
def rules():
    return [
        rule("mask", "preprocess", recorded=["capture"]),
        rule("clouds", "preprocess", ["mask"], recorded=["capture"]),
        rule("track", "surface", ["clouds", "mask"]),
        rule("minimise", "elasticity", ["track"], wanted=["minimise.json"]),
    ]


def texts(figure):
    return [text.get_text() for text in figure.findobj(style.matplotlib.text.Text)]


def test_layers_are_longest_ways_and_direct_edges_have_no_way_round(rules):
    steps = rule_graph.steps_of(rules)
    layers = rule_graph.layers_of(steps)
    assert layers == {"mask": 0, "clouds": 1, "track": 2, "minimise": 3}
    edges = {("mask", "clouds"), ("clouds", "track"), ("track", "minimise")}
    assert rule_graph.direct_edges(steps) == edges


def test_files_on_the_way_are_those_that_others_read_or_that_are_wanted(rules):
    writes = {step.name: step.writes for step in rule_graph.steps_of(rules)}
    assert writes["mask"] == ("mask.npz",)
    assert writes["minimise"] == ("minimise.json",)


def test_a_new_rule_gets_a_box_and_a_place_of_its_own(rules):
    rules[2]["reads"]["despeckle"] = ["despeckle.npz"]
    rules.append(rule("despeckle", "preprocess", ["mask"]))
    steps = rule_graph.steps_of(rules)
    layers, (columns, lanes) = rule_graph.layers_of(steps), rule_graph.columns_of(steps)
    assert len({(columns[name], layers[name]) for name in layers}) == 5
    assert lanes == [("preprocess", 0, 2), ("surface", 2, 1), ("elasticity", 3, 1)]
    with style.journal():
        found = texts(rule_graph.figure_1_1(rules))
    assert {"mask", "clouds", "despeckle", "despeckle.npz", "track", "minimise"} <= set(found)
    style.plt.close("all")


def test_stages_without_a_title_keep_their_name(rules):
    with style.journal():
        found = texts(rule_graph.figure_1_1([*rules, rule("extra", "denoise")]))
    assert {"denoise", "seeing\nand force"} <= set(found)
    style.plt.close("all")


def test_rules_in_a_circle(rules):
    rules[0]["reads"]["track"] = ["track.npz"]
    with pytest.raises(ValueError, match="rules: expected no circle, found one through"):
        rule_graph.layers_of(rule_graph.steps_of(rules))


def test_unknown_rules(rules):
    rules[0]["reads"]["lost"] = ["lost.npz"]
    with pytest.raises(ValueError, match="rules: mask: expected known rules, found lost"):
        rule_graph.steps_of(rules)


def test_no_rules():
    with pytest.raises(ValueError, match="rules: expected at least one, found none"):
        rule_graph.steps_of([])


def test_bytes_are_the_same_each_time(rules, tmp_path):
    for name in "ab":
        with style.journal():
            figure = rule_graph.figure_1_1(rules)
            style.save(figure, tmp_path / f"{name}.png", tmp_path / f"{name}.svg")
    assert (tmp_path / "a.svg").read_bytes() == (tmp_path / "b.svg").read_bytes()
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()
