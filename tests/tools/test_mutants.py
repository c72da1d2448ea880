"""Which changes of a small package its tests notice."""

import ast

import mutants
import pytest

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
