"""YAML and NPZ that people hand in: plain values alone, messages of one line."""

import numpy as np
import pytest
from palpate.npz import read_npz
from palpate.yaml_files import LONGEST_LINE, load_yaml, one_line


def merges(rows):
    return "a0: &a0 {k: 1}\n" + "".join(
        f"a{k}: &a{k} {{<<: [*a{k - 1}, *a{k - 1}]}}\n" for k in range(1, rows)
    )


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (merges(40), "more than 100000 values"),
        ("a: &a [*a]\n", "or one that holds itself"),
        ("a: " + "[" * 20_000, "recursion"),
        ("a: !!float abc\n", "abc"),
        ("a: !!bool maybe\n", "maybe"),
        ("a: 2020-13-45\n", "month"),
        (f"a: {'9' * 5000}\n", "4300"),
        ("#" * 1_100_000, "expected YAML of at most 1000000 bytes, found 1100000"),
    ],
)
def test_yaml_that_is_more_than_plain_values(tmp_path, text, words):
    path = tmp_path / "object.yaml"
    path.write_text(text)
    with pytest.raises(ValueError, match=r"object.yaml: file: expected ") as refused:
        load_yaml(path)
    assert words in str(refused.value)
    assert str(refused.value).isprintable()


def test_aliases_of_people_are_read(tmp_path):
    path = tmp_path / "lab.yaml"
    path.write_text("\ufeffa: &a {x: 1}\r\nb: *a\r\nc: {<<: *a, y: 2}\r\n")
    assert load_yaml(path) == {"a": {"x": 1}, "b": {"x": 1}, "c": {"x": 1, "y": 2}}


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
    assert line.startswith("force.csv: ") and line.endswith(" in data row 3")


def test_arrays_come_back(tmp_path):
    np.savez_compressed(tmp_path / "a.npz", a=np.arange(3), b=np.eye(2))
    arrays = read_npz(tmp_path / "a.npz")
    assert list(arrays) == ["a", "b"]
    assert np.array_equal(arrays["b"], np.eye(2))
