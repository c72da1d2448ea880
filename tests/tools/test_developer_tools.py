"""Tools for developers: quoted figures, corrupted inputs."""

import subprocess
import sys

import corpus
import pytest
from corrupted import doors
from quoted import differences, rewritten

QUOTING = """Text.

<!-- quoted: results/tables/of.csv where recommended=True
| %(object)s, true | %(true_pa_kpa).0f | |
| %(object)s, %(sensor)s | %(E_kpa).1f (%(depth_mm).2f mm) | %(q)+.1f |
-->

| object | E (kPa) | q |
|---|---|---|
| foam ball, true | 24 | |
| foam ball, Kinect | 25.0 (3.14 mm) | -0.4 |
| foam ear, true | 7 | |
| foam ear, Bumblebee2 | 7.0 (0.50 mm) | |

More text.
"""
ROWS = """object,sensor,recommended,E_pa,true_pa_pa,depth_m,q
foam_ball,kinect,True,25049,24000,0.003141,-0.36
foam_ball,kinect,False,99000,99000,0.009,0
foam_ear,bumblebee,True,6950,7000,0.0005,
"""


@pytest.fixture
def run(tmp_path):
    folder = tmp_path / "results/tables"
    folder.mkdir(parents=True)
    (folder / "of.csv").write_text(ROWS)
    return tmp_path


def test_what_a_file_has_to_the_printed_digits_is_right(run):
    assert differences(QUOTING, run) == []


@pytest.mark.parametrize(
    ("quoted", "otherwise", "found"),
    [
        ("25.0 (3.14 mm)", "25.1 (3.14 mm)", "| foam ball, Kinect | 25.0 (3.14 mm) | -0.4 |"),
        ("24 |", "240 |", "| foam ball, true | 24 | |"),
        ("-0.4", "+0.4", "| foam ball, Kinect | 25.0 (3.14 mm) | -0.4 |"),
        ("foam ear, Bumble", "foam eye, Bumble", "no such row"),
    ],
)
def test_what_differs_is_named_with_what_the_file_has_and_can_be_written(
    run, quoted, otherwise, found
):
    text = QUOTING.replace(quoted, otherwise)
    line, *left_out = differences(text, run)
    assert otherwise in line and line.endswith(f"found {found}")
    assert len(left_out) == (found == "no such row")
    assert rewritten(text, run) == QUOTING


def test_a_row_that_is_left_out_is_named(run):
    row = "| foam ear, true | 7 | |\n"
    (line,) = differences(QUOTING.replace(row, ""), run)
    assert line == f"results/tables/of.csv: left out {row.strip()}"


def test_a_file_that_is_missing_is_named(tmp_path):
    assert rewritten(QUOTING, tmp_path) == QUOTING
    (line,) = differences(QUOTING, tmp_path)
    assert line.startswith("results/tables/of.csv: expected") and line.endswith("found no file")


def test_a_table_on_a_page_is_read_as_well(run):
    lines = ["# Title", "", *("| " + row.replace(",", " | ") + " |" for row in ROWS.splitlines())]
    lines.insert(3, "|" + "---|" * 7)
    (run / "results/tables/of.md").write_text("\n".join(lines) + "\n")
    assert differences(QUOTING.replace("of.csv", "of.md"), run) == []


def test_each_ends_as_it_is_known_to(root):
    command = [sys.executable, str(root / "tools/corpus.py"), "--fast"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


def test_whatever_is_rejected_gets_a_clear_line():
    for entry, (end, line) in corpus.expected().items():
        assert end in doors.ENDS, entry
        assert doors.clear(line) or end not in (doors.BY_FORM, doors.BY_CONTENT), entry
