"""What a function makes becomes files: all of them, or none."""

import re
from pathlib import Path

import matplotlib.pyplot as plt
import pandas as pd
import pytest
from palpate.report import outputs
from palpate.report.pages import page
from palpate.report.tables import SIMULATED_NOTE


def paths(folder, **names):
    """Outputs by name."""
    return {key: str(folder / name) for key, name in names.items()}


@pytest.fixture
def frame():
    return pd.DataFrame({"x": [0.1, 2.5], "provenance": ["simulated", "recorded"]})


def test_a_figure_goes_to_both_forms(tmp_path):
    plt.close("all")
    output = paths(tmp_path, png="a.png", svg="a.svg")
    outputs.write(plt.figure(), output)
    assert Path(output["png"]).read_bytes().startswith(b"\x89PNG")
    assert "<svg" in Path(output["svg"]).read_text()
    assert not plt.get_fignums()


def test_a_table_goes_to_csv_markdown_and_page(tmp_path, frame):
    output = paths(tmp_path, csv="a.csv", md="a.md", page="a.html")
    outputs.write(outputs.table(frame, title="Of two"), output)
    assert Path(output["csv"]).read_text() == "x,provenance\n0.1,simulated\n2.5,recorded\n"
    assert SIMULATED_NOTE in Path(output["md"]).read_text()
    assert "<td" in Path(output["page"]).read_text()


def test_other_things_write_as_they_are(tmp_path, frame):
    output = paths(tmp_path, values="a.json", words="a.txt", own="a.bin", exact="a.csv")
    made = {"values": {"a": 1}, "words": "b", "own": lambda path: path.write_bytes(b"c")}
    outputs.write(made | {"exact": outputs.exact(frame)}, output)
    assert Path(output["values"]).read_text() == '{\n  "a": 1\n}\n'
    assert Path(output["words"]).read_text() == "b"
    assert Path(output["own"]).read_bytes() == b"c"
    assert Path(output["exact"]).read_text().startswith("x,provenance\n0.1,")


def test_nothing_is_written_where_one_thing_fails(tmp_path):
    def fails(path):
        path.write_text("half")
        raise OSError("full")

    output = paths(tmp_path, a="a.txt", b="b.txt")
    with pytest.raises(OSError, match="full"):
        outputs.write({"a": "whole", "b": fails}, output)
    assert list(tmp_path.iterdir()) == []


def test_names_that_the_rule_has_not(tmp_path):
    with pytest.raises(ValueError, match="made: expected csv, md, found csv"):
        outputs.write({"csv": "x"}, paths(tmp_path, csv="a.csv", md="a.md"))


def test_text_stays_text_and_nothing_comes_from_elsewhere():
    table = "# T\n\n| E_pa | name |\n|---|---|\n| 1.5e+04 | a<b |\n"
    text = page(table + "\n<script>x</script>\n", title="t")
    assert "a&lt;b" in text
    assert "<script" not in text and not re.search("(src|href)=", text)
