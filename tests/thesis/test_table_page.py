"""Tables as pages, and the description of a run."""

import re

import numpy as np
import pytest
from palpate.report.run_description import describe, pinned
from palpate.report.table_page import STYLE, page

TABLE = "# T\n\nNote.\n\n| E_pa | name |\n|---|---|\n| 1.5e+04 | a<b |\n| -3 | 3.11.7 |\n"


def test_numbers_stand_right_and_names_may_break():
    text = page(TABLE, title="t & u")
    assert '<td class="number">1.5e+04</td>' in text
    assert '<td class="number">-3</td>' in text
    assert "<td>3.11.7</td>" in text
    assert "<th>E_<wbr>pa</th>" in text
    assert "<title>t &amp; u</title>" in text


def test_text_stays_text_and_nothing_comes_from_elsewhere():
    text = page(TABLE + "\n<script>x</script>\n", title="t")
    assert "a&lt;b" in text
    assert "<script" not in text
    assert "http" not in text


def test_pinned_versions():
    lock = "numpy==2.4.6 \\\n    --hash=sha256:a\nscipy==1.17.1 \\\n    # via numpy==9\n"
    assert pinned(lock, ["scipy", "numpy"]) == {"scipy": "1.17.1", "numpy": "2.4.6"}
    with pytest.raises(ValueError, match="lock: expected a version of vtk, found none"):
        pinned(lock, ["vtk"])


def test_description_is_the_same_for_the_same_run():
    config = {"seed": 1, "starts": (0.1, 0.2), "only": None}
    text = describe(config, {"palpate": "0.1.0"})
    assert text == describe(dict(config), {"palpate": "0.1.0"})
    assert "| palpate | 0.1.0 |" in text
    assert "seed: 1\nstarts:\n- 0.1\n- 0.2\nonly: null" in text


def luminance(colour):
    """Relative luminance (WCAG 2.1)."""
    digits = colour if len(colour) == 6 else "".join(2 * digit for digit in colour)
    parts = np.array([int(digits[k : k + 2], 16) / 255 for k in (0, 2, 4)])
    linear = np.where(parts <= 0.03928, parts / 12.92, ((parts + 0.055) / 1.055) ** 2.4)
    return float(linear @ [0.2126, 0.7152, 0.0722])


def test_words_stand_out_on_light_and_on_dark_paper():
    for sheet in re.findall(r":root \{(.*?)\}", STYLE, flags=re.DOTALL):
        colours = dict(re.findall(r"--(\w+): #([0-9a-f]+)", sheet))
        for front in ("ink", "quiet", "accent"):
            for back in ("paper", "soft"):
                ends = sorted(luminance(colours[name]) for name in (front, back))
                assert (ends[1] + 0.05) / (ends[0] + 0.05) > 4.5, (front, back)
