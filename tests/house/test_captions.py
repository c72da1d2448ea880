"""Captions of the report: one for each figure, titled, with a unit or a reason for none."""

import re

import pytest
from docutils.core import publish_parts
from jinja2 import Environment


def captions(root):
    return sorted(set(root.glob("workflow/report/*.rst")) - {root / "workflow/report/workflow.rst"})


def test_every_figure_of_a_rule_is_in_the_report(root):
    rules = "\n".join(path.read_text() for path in sorted(root.glob("workflow/rules/*.smk")))
    outputs = re.findall(r"^ +\w*png=(?!png).*", rules, re.MULTILINE)
    assert len(outputs) > 30
    assert [line for line in outputs if "captioned(" not in line] == []


def test_captions_are_titled_and_render(root):
    environment = Environment(trim_blocks=True, lstrip_blocks=True)
    assert len(captions(root)) > 60
    for path in captions(root):
        title, line, *_ = path.read_text().splitlines()
        assert line == "=" * len(title), path.name
        environment.parse(path.read_text())
        plain = re.sub(r"{[{%].*?[%}]}", "x", path.read_text())
        parts = publish_parts(plain, writer="html", settings_overrides={"halt_level": 2})
        assert parts["title"] and len(parts["body"]) > 40, path.name


@pytest.mark.parametrize("name", ["figure_5_8", "figure_a_1", "table_5_1", "tracking_accuracy"])
def test_captions_name_where_their_data_come_from(root, name):
    text = (root / f"workflow/report/{name}.rst").read_text()
    assert "provenance" in text or "imulated" in text
