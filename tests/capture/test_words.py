"""Messages stay on one line, whatever names they hold."""

import pytest
from palpate.capture.words import LONGEST_LINE, one_line


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("a\nb.png", r"a\nb.png"),
        ("a\x1b[31mred", r"a\x1b[31mred"),
        ("\udc80.csv", r"\udc80.csv"),
        ("left\u202eright", r"left\u202eright"),
        ("größe.csv: E* 25 kPa", "größe.csv: E* 25 kPa"),
    ],
)
def test_what_a_terminal_would_obey_is_written_out(text, line):
    assert one_line(text) == line


def test_a_long_middle_is_cut():
    line = one_line("force.csv: " + "9" * 2_000_000 + " in data row 3")
    assert len(line) <= LONGEST_LINE
    assert line.startswith("force.csv: ")
    assert line.endswith(" in data row 3")
