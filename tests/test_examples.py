"""The worked examples of docs/examples run as they stand, with the output that they show."""

import doctest
import re

import pytest

# It makes a table by finite elements.
LONG = {"capture": pytest.mark.long}
PAGES = [pytest.param(name, marks=LONG.get(name, ())) for name in ("curve", "capture")]


@pytest.mark.parametrize("name", PAGES)
def test_the_example_runs(root, monkeypatch, name):
    monkeypatch.chdir(root)
    page = (root / f"docs/examples/{name}.md").read_text(encoding="utf-8")
    blocks = re.findall(r"^```python\n(.*?)^```$", page, re.MULTILINE | re.DOTALL)
    example = doctest.DocTestParser().get_doctest("\n".join(blocks), {}, name, name, 0)
    said = []
    failed, tried = doctest.DocTestRunner(verbose=False).run(example, out=said.append)
    assert tried > 5 and not failed, "".join(said)
