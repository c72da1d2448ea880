"""What the cut of the study ran: every rule, but for those that others run."""

import csv
import subprocess
import sys

import pytest
from thesis.artefacts import ARTEFACTS

pytestmark = pytest.mark.cut
OWN_OBJECTS = "for people's own objects: tests/workflow/test_own_object.py runs them"
NOT_RUN = {
    "all": "a target",
    "lab": "a target: all that the lab makes",
    "validation": "a target",
    "curve": OWN_OBJECTS,
    "own_hertz_fit": OWN_OBJECTS,
    "own_moduli": OWN_OBJECTS,
    "own_report": OWN_OBJECTS,
    "own_surface": OWN_OBJECTS,
}
SENSORS = ("bumblebee", "kinect")
FILES = {"table": "tables/{}.csv", "figure": "figures/{}.png"}


@pytest.fixture(scope="module")
def results(root):
    folder = root / "results/cut/results"
    assert folder.is_dir(), "run `make cut`, which makes what this looks at"
    return folder


def test_every_rule_ran_but_those_that_are_named(root, results):
    command = [sys.executable, "-m", "snakemake", "--configfile", "tests/cut/config.yaml"]
    listed = subprocess.run(
        [*command, "--list-rules"], cwd=root, capture_output=True, text=True, check=True
    )
    ran = {path.name.removesuffix(".tsv") for path in (results / "benchmarks").iterdir()}
    rules = {*listed.stdout.split(), *(entry.name for entry in ARTEFACTS)}
    assert rules - ran == set(NOT_RUN)


def test_all_artefacts_and_pages_are_there(root, results):
    with (root / "config/published/artefacts.csv").open(newline="") as stream:
        wanted = [FILES[row["kind"]].format(row["id"]) for row in csv.DictReader(stream)]
    assert len(wanted) == 61
    wanted += ["report.html", "objects.html", "summary.csv"]
    assert [name for name in wanted if not (results / name).is_file()] == []


def test_every_kind_of_capture_went_through(results):
    places = {path.relative_to(results).parts[:2] for path in results.glob("*/*/*/hertz.json")}
    pairs = {(name, sensor) for name in ("foam_block", "foam_ball") for sensor in SENSORS}
    assert places == pairs | {("ear", "bumblebee")}
