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


def test_what_is_made_goes_to_files_by_the_names_of_the_outputs(tmp_path, frame):
    plt.close("all")
    names = {"png": "a.png", "svg": "a.svg", "csv": "a.csv", "md": "a.md", "page": "a.html"}
    output = paths(tmp_path, **names, values="a.json", own="a.bin", exact="b.csv")
    made = {"figure": plt.figure(), "values": {"a": 1}, "own": lambda path: path.write_bytes(b"c")}
    made |= outputs.table(frame, title="Of two") | {"exact": outputs.exact(frame)}
    outputs.write(made, output)
    text = {name: Path(path).read_bytes() for name, path in output.items()}
    assert text["png"].startswith(b"\x89PNG") and b"<svg" in text["svg"]
    assert text["csv"] == b"x,provenance\n0.1,simulated\n2.5,recorded\n"
    assert SIMULATED_NOTE in text["md"].decode() and b"<td" in text["page"]
    assert text["values"] == b'{\n  "a": 1\n}\n' and text["own"] == b"c"
    assert text["exact"].startswith(b"x,provenance\n0.1,")
    assert not plt.get_fignums()


def test_nothing_is_written_where_one_thing_fails(tmp_path):
    def fails(path):
        path.write_text("half")
        raise OSError("full")

    output = paths(tmp_path, a="a.txt", b="b.txt")
    with pytest.raises(OSError, match="full"):
        outputs.write({"a": "whole", "b": fails}, output)
    assert list(tmp_path.iterdir()) == []


def test_text_stays_text_and_nothing_comes_from_elsewhere():
    table = "# T\n\n| E_pa | name |\n|---|---|\n| 1.5e+04 | a<b |\n"
    text = page(table + "\n<script>x</script>\n", title="t")
    assert "a&lt;b" in text
    assert "<script" not in text and not re.search("(src|href)=", text)
