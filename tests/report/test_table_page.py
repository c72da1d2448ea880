"""Tables as pages, and versions of a run's packages."""

import pytest
from palpate.report.run_description import pinned
from palpate.report.table_page import page


def test_text_stays_text_and_nothing_comes_from_elsewhere():
    table = "# T\n\n| E_pa | name |\n|---|---|\n| 1.5e+04 | a<b |\n"
    text = page(table + "\n<script>x</script>\n", title="t")
    assert "a&lt;b" in text
    assert "<script" not in text and "http" not in text


def test_pinned_versions():
    lock = "numpy==2.4.6 \\\n    --hash=sha256:a\nscipy==1.17.1 \\\n    # via numpy==9\n"
    assert pinned(lock, ["scipy", "numpy"]) == {"scipy": "1.17.1", "numpy": "2.4.6"}
    with pytest.raises(ValueError, match="lock: expected a version of vtk, found none"):
        pinned(lock, ["vtk"])
