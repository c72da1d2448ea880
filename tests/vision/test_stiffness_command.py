"""`palpate calibrate stiffness` on tables of a press on something rigid."""

import json

import numpy as np
import pandas as pd
import pytest
import yaml
from palpate.capture.tables import write_table
from palpate.config.model import problems
from palpate.config.probe import ProbeSpec
from palpate.workflow.options import partly

PART = "stiffness"


@pytest.fixture
def table(tmp_path):
    """A table of a press to 5 N and back, seen to 0.05 mm."""

    def written(stiffness_n_m=2e4, power=1.0, names=("depth_m", "force_n"), scale=(1, 1)):
        rng, path = np.random.default_rng(0), tmp_path / "press.csv"
        force = 5 * np.sin(np.linspace(0, np.pi, 300))
        way = 0.01 + (force / stiffness_n_m) ** power + rng.normal(0, 5e-5, 300)
        columns = way * scale[0], (force + rng.normal(0, 0.02, 300)) * scale[1]
        write_table(path, pd.DataFrame(dict(zip(names, columns, strict=True))))
        return path

    return written


def test_a_table(table, given, tmp_path):
    out = tmp_path / "stiffness.json"
    text = given(table(), "--output", out)
    assert "samples in contact, 0.5" in text
    assert "  stiffness: determined, to " in text
    found = json.loads(out.read_text())
    assert abs(found["stiffness_n_m"] - 2e4) < 4 * found["stiffness_std_n_m"]
    block = yaml.safe_load(text[text.index("\nstiffness_n_m:") : text.index("written")])
    assert block["stiffness_n_m"] == pytest.approx(found["stiffness_n_m"], rel=0.005)
    assert block["compliance_std_m_n"] == pytest.approx(found["compliance_std_m_n"], rel=0.05)
    assert not problems(partly(ProbeSpec), block)


def test_other_columns_and_units(table, given):
    plain = given(table())
    path = table(names=("weg (mm)", "fz"), scale=(1e3, 1e3))
    other = given(path, "--force-unit", "mN", "--force-column", "fz")
    assert plain.splitlines()[2:] == other.splitlines()[2:]
    assert "depth in mm" in other and "force in mN" in other


def test_a_handle_of_steel_is_left_out_of_the_file(table, given, tmp_path):
    out = tmp_path / "stiffness.json"
    text = given(table(1e7), "--output", out)
    assert "stiffness: not determined, stiffer than " in text
    assert "N/m (95 %): leave it out of the probe's file" in text
    assert "\nstiffness_n_m" not in text
    found = json.loads(out.read_text())
    line = yaml.safe_load(text[text.index("\ncompliance_std_m_n") : text.index("written")])
    parts = found["compliance_m_n"], found["compliance_std_m_n"]
    assert line["compliance_std_m_n"] == pytest.approx(np.hypot(*parts), rel=0.05)
    assert found["stiffness_n_m"] is None and 1e5 < found["stiffer_than_n_m"] < 1e7


def test_foam(table, refused, tmp_path):
    path, out = table(7e3, 2 / 3), tmp_path / "stiffness.json"
    line = refused(path, "--output", out)
    assert line.startswith(f"error: {path}: way: expected it in proportion to the force")
    assert not out.exists()


def test_a_table_without_force(table, refused):
    line = refused(table(names=("depth_m", "time_s")))
    assert "expected one column of force" in line


def test_weights_on_paper(given, tmp_path):
    """Without noise nothing is surer than 1e-8 m/N, in digits that are read."""
    path, force = tmp_path / "weights.csv", np.arange(1, 12) * 0.5
    write_table(path, pd.DataFrame({"depth_m": force / 2e4, "force_n": force}))
    text = given(path)
    assert text.endswith("stiffness_n_m: 20000\ncompliance_std_m_n: 1.0e-08\n")


def test_no_table(refused, tmp_path):
    none = tmp_path / "nowhere.csv"
    line = f"{none}: source: expected a recording or a table, found none"
    assert line in refused(none)
    assert line in refused(none, "--sensor", tmp_path / "none.yaml")
    assert "frames.csv: expected a recording's, found none" in refused(tmp_path)
