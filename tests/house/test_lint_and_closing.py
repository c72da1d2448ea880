"""The lint filter and the closing lines of a run."""

import pytest
from house.closing import closing_lines
from house.lint import PASSED_OVER, findings

REPORT = f"""Lints for snakefile a.smk:
    * Mixed rules and functions in same snakefile.:
      Why.

Lints for rule b (line 3, a.smk):
    * {PASSED_OVER}:
      Why.
    * No log directive defined:
      Why.
"""


def test_only_the_one_finding_is_passed_over():
    assert findings(REPORT) == [
        "snakefile a.smk: Mixed rules and functions in same snakefile.",
        "rule b (line 3, a.smk): No log directive defined",
    ]


HEAD = (
    "object,sensor,capture,point,method,youngs_modulus_pa,poisson_ratio,poisson_ratio_verdict,"
    "reduced_modulus_pa,provenance\n"
)
SUMMARY = (
    HEAD
    + """pad,kinect,08,08,hertz,,,,25000,simulated
pad,kinect,09,09,hertz,,,,27000,simulated
pad,kinect,10,10,hertz,,,,32000,simulated
pad,kinect,08,08,least_squares_displacement,1,0.1,,1,simulated
pad,kinect,08,08,minimise_displacement,20000,0.25,not identified,21333,simulated
pad,kinect,09,09,minimise_displacement,22000,0.45,identified,27586,simulated
"""
)


def test_closing_lines_sum_up_captures_with_units_verdicts_and_label(tmp_path):
    (tmp_path / "summary.csv").write_text(SUMMARY)
    (tmp_path / "tables").mkdir()
    lines = closing_lines(tmp_path)
    assert lines[0] == f"Results are in {tmp_path}/: tables/, summary.csv"
    assert lines[2] == "pad, kinect (simulated)"
    assert lines[3].split(maxsplit=2)[2] == "E* 27.0 (25.0 to 32.0) kPa; 3 captures"
    assert lines[4].endswith(
        "E 21.0 (20.0 to 22.0) kPa, nu 0.35 (0.25 to 0.45)"
        " [identified 1x, not identified 1x]; 2 captures"
    )
    assert len(lines) == 8
    assert "virtual lab" in lines[-1]


def test_closing_lines_of_recordings_are_not_called_simulated(tmp_path):
    (tmp_path / "summary.csv").write_text(HEAD + "pad,kinect,08,08,hertz,,,,25000,recorded\n")
    lines = closing_lines(tmp_path)
    assert lines[3].endswith("Hertz fit                     E* 25.0 kPa; 1 capture")
    assert "imulated" not in " ".join(lines)


def test_closing_lines_need_a_summary(tmp_path):
    with pytest.raises(ValueError, match=r"summary\.csv: expected the summary of a run"):
        closing_lines(tmp_path)
