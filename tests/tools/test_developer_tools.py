"""Tools for developers: quoted figures, mutants of a small package, corrupted inputs."""

import ast
import re
import subprocess
import sys

import corpus
import mutants
import pytest
from corrupted import doors
from quoted import DOCUMENTS, MARK, differences, rewritten

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


def test_a_column_that_is_missing_leaves_cells_empty(run):
    (line,) = differences(QUOTING.replace("%(q)+.1f", "%(p)+.1f"), run)
    assert line.endswith("found | foam ball, Kinect | 25.0 (3.14 mm) | |")


def test_a_table_on_a_page_is_read_as_well(run):
    lines = ["# Title", "", *("| " + row.replace(",", " | ") + " |" for row in ROWS.splitlines())]
    lines.insert(3, "|" + "---|" * 7)
    (run / "results/tables/of.md").write_text("\n".join(lines) + "\n")
    assert differences(QUOTING.replace("of.csv", "of.md"), run) == []


def test_every_table_of_trust_is_marked(root):
    texts = {name: (root / name).read_text() for name in DOCUMENTS}
    marks = {name: len(MARK.findall(text)) for name, text in texts.items()}
    assert marks == {name: text.count("<!-- quoted:") for name, text in texts.items()}
    tables = re.findall(r"^\|[-|]+$", texts["docs/trust.md"], re.MULTILINE)
    assert marks["docs/trust.md"] == len(tables) >= 4 and marks["README.md"] == 1


MODULE = '''
SIDES = 4


def square(a: tuple[int, 1]):
    """Length around it, and area."""
    if a < 0:
        raise ValueError(f"a: expected at least 0, found {a + 0}")
    return SIDES * a, a**2


def spare(a):
    return -a
'''
TESTS = """
from palpate.solid.square import square


def test_square():
    assert square(2.0) == (8.0, 4.0)
"""
AFTER = {
    "killed": [
        "SIDES = 5",
        "if a >= 0:",
        "return (SIDES / a, a ** 2)",
        "return (SIDES * a, a ** 3)",
    ],
    "survived": ["return (SIDES * a, a * 2)", "if a < 1:", "return a"],
}


@pytest.fixture
def project(tmp_path):
    for name, text in {
        "workflow/scripts/palpate/__init__.py": "",
        "workflow/scripts/palpate/solid/__init__.py": "",
        "workflow/scripts/palpate/solid/square.py": MODULE,
        "tests/solid/test_square.py": TESTS,
    }.items():
        place = tmp_path / "project" / name
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_text(text)
    return tmp_path / "project"


@pytest.mark.long
def test_a_weak_test_lets_a_mutant_live(project):
    said = []
    assert mutants.survivors(project, ["solid"], count=100, seed=1, say=said.append) == (3, 7)
    ends = {"killed by solid/test_square.py::test_square": "killed"}
    ends |= {"SURVIVED": "survived"}
    found = {end: [] for end in AFTER}
    for one in said[:-1]:
        words, end = one.split("\n    ")
        found[ends[end.rsplit(" (", 1)[0]]].append(words.split("  ->  ")[1])
    assert {end: sorted(lines) for end, lines in found.items()} == {
        end: sorted(lines) for end, lines in AFTER.items()
    }
    assert said[-1] == "3 of 7 survive"


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ("a @ b", ["a * b"]),
        ("a and b", ["a or b"]),
        ("not a", ["a"]),
        ("min(a)", ["max(a)"]),
        ("a.argmax()", ["a.argmin()"]),
        ("f(True)", ["f(False)"]),
        ("0.5", ["0.55"]),
        ("0.0", ["1.0"]),
        ("1e-300", []),
        ("a += b", ["a -= b"]),
        ("a[-1]", ["a[1]", "a[-0]"]),
        ("option(3)", []),
        ("zip(a, strict=True)", []),
        ("'words'", []),
    ],
)
def test_what_is_changed(before, after):
    count = len(list(mutants.places(ast.parse(before))))
    assert sorted(mutants.mutated(before, index)[-1] for index in range(count)) == sorted(after)


def test_a_line_that_only_grows_is_shown():
    assert mutants._about("x = 0.5", "x = 0.55") == "x = 0.5  ->  x = 0.55"


def test_each_ends_as_it_is_known_to(root):
    command = [sys.executable, str(root / "tools/corpus.py"), "--fast"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


def test_whatever_is_rejected_gets_a_clear_line():
    for entry, (end, line) in corpus.expected().items():
        assert end in doors.ENDS, entry
        assert doors.clear(line) or end not in (doors.BY_FORM, doors.BY_CONTENT), entry
