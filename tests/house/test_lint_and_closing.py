"""The lint filter and the closing lines of a run."""

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


def test_closing_lines_carry_units_and_label(tmp_path):
    (tmp_path / "summary.csv").write_text(
        "object,sensor,capture,point,method,youngs_modulus_pa,poisson_ratio,reduced_modulus_pa,"
        "provenance\n"
        "pad,kinect,08,08,hertz,,,25000,simulated\n"
        "pad,kinect,08,08,minimise_displacement,20000,0.25,21333,simulated\n"
    )
    lines = closing_lines(tmp_path)
    assert lines[1].endswith("hertz: E* 25.00 kPa")
    assert lines[2].endswith("minimise_displacement: E 20.00 kPa, nu 0.250, E* 21.33 kPa")
    assert "simulated" in lines[-1]
