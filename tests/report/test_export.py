"""The command ``palpate export``: what it takes of a run, and what it rejects in one line."""

import json
import re
import shlex

import pandas as pd
import pytest
from palpate.__main__ import main
from palpate.modulus import LABELS
from palpate.report import tables
from palpate.report.estimate_rows import direct_rows, summary
from test_estimate_rows import estimate as any_estimate

SENSOR = {"object": "sponge", "sensor": "kinect", "provenance": "own"}
RELAXATION = {"times_s": [0.2, 1.0], "fractions": [0.02, 0.0]}


def interval(value, low, high, verdict="identified"):
    return {"value": value, "low": low, "high": high, "verdict": verdict, "unit": "Pa"}


def estimate(**changed):
    moduli = {name: interval(25e3, 23e3, 27e3) for name in LABELS}
    moduli["poisson_ratio"] = interval(0.3, 0.22, 0.38) | {"unit": "1"}
    return any_estimate(25e3, 0.3, 2e3) | {"relaxation": RELAXATION} | moduli | changed


def write(folder, *found, sensors=("kinect",)):
    """Results of a run: estimates, and the summary that the workflow's own tables make of them."""
    groups = [SENSOR | {"sensor": name} for name in sensors]
    rows = summary([*direct_rows([], [], groups, found)])
    for name, one in zip(sensors, found, strict=True):
        path = folder / "results/sponge" / name / "direct.json"
        path.parent.mkdir(parents=True)
        path.write_text(json.dumps(one))
    tables.rounded(rows).to_csv(folder / "results/sponge/summary.csv", index=False)


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def export(*more, name="sponge", to="abaqus"):
    return main(["export", name, "--to", to, *more])


@pytest.fixture
def rejected(here, capsys):
    """What a call says that writes nothing: one line."""

    def line_of(*more, **how):
        assert export(*more, **how) == 1
        (line,) = capsys.readouterr().err.splitlines()
        assert not list(here.glob("*material*")) and not list(here.glob(".part*"))
        return line

    return line_of


@pytest.mark.parametrize("to, ending", [("felupe", "py"), ("febio", "feb"), ("abaqus", "inp")])
def test_a_card_is_written_and_told(here, capsys, to, ending):
    write(here, estimate())
    assert export(to=to) == 0
    told = capsys.readouterr().out
    assert told == (
        f"sponge-material.{ending}: E = 25.0 kPa (23.0 to 27.0), identified;"
        " nu = 0.30 (0.22 to 0.38), identified\n"
    )
    text = (here / f"sponge-material.{ending}").read_text()
    assert "law of the force: +0.10 +- 0.20" in text and "at 4.0 mm" in text
    again = export("--output", "again.txt", to=to)
    assert again == 0 and (here / "again.txt").read_text() == text


def test_the_example_of_its_help_runs(here, capsys):
    write(here, estimate())
    with pytest.raises(SystemExit, match="0"):
        main(["export", "--help"])
    last = capsys.readouterr().out.rstrip().splitlines()[-1]
    assert main(shlex.split(re.fullmatch(r"  palpate (export .+)", last).group(1))) == 0


def test_terms_that_take_nothing_are_left_out(here):
    write(here, estimate())
    export()
    rows = (here / "sponge-material.inp").read_text().split("TIME=PRONY\n")[1]
    assert rows == "0.02, 0.02, 0.2\n"


def test_of_two_sensors_one_is_chosen(here, capsys, rejected):
    other = estimate(youngs_modulus_pa=interval(31e3, 30e3, 32e3))
    write(here, estimate(), other, sensors=("kinect", "zed"))
    assert "summary.csv: sensor: expected one of kinect, zed (--sensor), found none" in rejected()
    assert "expected one of kinect, zed, found x" in rejected("--sensor", "x")
    assert export("--sensor", "zed") == 0
    assert "E = 31.0 kPa" in capsys.readouterr().out


def test_of_several_curves_one_is_chosen(here, capsys, rejected):
    write(here, estimate())
    path = here / "results/sponge/summary.csv"
    row = pd.read_csv(path).assign(sensor="curve", method="curve_table", youngs_modulus_pa=31e3)
    pd.concat([row.assign(capture=name) for name in ("back", "08")]).to_csv(path, index=False)
    assert "expected one of curve/back, curve/08 (--sensor)" in rejected()
    assert export("--sensor", "curve/08") == 0
    assert "E = 31.0 kPa" in capsys.readouterr().out
    # No direct.json says how it relaxes.
    assert "VISCOELASTIC" not in (here / "sponge-material.inp").read_text()


def test_an_object_without_results_is_named(here, rejected):
    expected = "error: results: results: expected those of a run (snakemake), found none"
    assert rejected() == expected
    write(here, estimate())
    for name in ("nix", "results/sponge", "."):
        expected = f"error: results: object: expected one of sponge, found {name}"
        assert rejected(name=name) == expected


def test_a_place_that_takes_no_file_is_named(here, rejected):
    write(here, estimate())
    (here / "taken").mkdir()
    (here / "file").touch()
    assert rejected("--output", "taken") == "error: taken: Is a directory"
    assert rejected("--output", "file/card.inp") == "error: file: File exists"


def test_a_summary_without_an_estimate_is_rejected(here, rejected):
    write(here, estimate())
    path = here / "results/sponge/summary.csv"
    rows = pd.read_csv(path)
    rows.assign(recommended=False).to_csv(path, index=False)
    expected = "summary.csv: recommended: expected an estimate of E and nu, found none"
    assert expected in rejected()
    for name in ("recommended", "object"):
        rows.drop(columns=name).to_csv(path, index=False)
        assert f"summary.csv: columns: expected '{name}', found none" in rejected()


RATIO = {"unit": "1"}
SUMMARY, ESTIMATE = "summary.csv: ", "kinect/direct.json: "
UNKNOWN = [
    ({"youngs_modulus_pa": interval(25e3, 2e3, 90e3, "not identified")}, SUMMARY,
     "youngs_modulus_pa: expected one that the captures tell, found 25.0 kPa (2.0 to 90.0),"
     " not identified"),
    ({"poisson_ratio": interval(0.3, 0.0, 0.49, "not identified") | RATIO}, SUMMARY,
     "found 0.30 (0.00 to 0.49), not identified"),
    ({"poisson_ratio": interval(0.49, 0.41, 0.49, "bounded") | RATIO}, SUMMARY,
     "found 0.49 (0.41 to 0.49), bounded, at the bound of its range"),
    ({"relaxation": None}, ESTIMATE, "times_s and fractions, found none"),
    ({"relaxation": {"times_s": [1.0], "fractions": [1.2]}}, ESTIMATE,
     "sum to less than 1, found others"),
    ({"relaxation": {"times_s": [1.0], "fractions": ["a"]}}, ESTIMATE,
     "fractions: expected numbers, found others"),
]  # fmt: skip


@pytest.mark.parametrize("changed, file, expected", UNKNOWN)
def test_what_is_not_well_known_is_named_with_its_file(here, rejected, changed, file, expected):
    write(here, estimate(**changed))
    line = rejected()
    assert file in line and line.endswith(expected)
    assert line.count("error") == 1 and ("summary.csv" in line) == (file == SUMMARY)


def test_a_ratio_that_was_declared_goes_out(here, capsys):
    declared = interval(0.45, 0.4461, 0.4539, "assumed") | RATIO
    write(here, estimate(poisson_ratio=declared))
    assert export() == 0 and "nu = 0.45" in capsys.readouterr().out
