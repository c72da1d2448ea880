"""Every table and figure of the study has a rule of its own, and a plain run makes it."""

import csv
import shutil

import pytest
from sample_run import LEFT_BEHIND, snakemake

pytestmark = pytest.mark.workflow
FILES = {"table": "results/tables/{}.csv", "figure": "results/figures/{}.png"}


@pytest.fixture(scope="module")
def artefacts(root):
    with (root / "config/published/artefacts.csv").open(newline="") as stream:
        return list(csv.DictReader(stream))


@pytest.fixture(scope="module")
def made_by(root, tmp_path_factory):
    """Rule of each file that a run of the study's default configuration makes."""
    folder = tmp_path_factory.mktemp("palpate") / "main"
    shutil.copytree(root, folder, ignore=LEFT_BEHIND)
    done = snakemake(folder, "--summary")
    assert done.returncode == 0, done.stderr[-3000:]
    rows = list(csv.DictReader(done.stdout.splitlines(), delimiter="\t"))
    return {row["output_file"]: row["rule"] for row in rows}


def test_the_list_has_all_61(artefacts):
    names = [entry["id"] for entry in artefacts]
    assert len(names) == len(set(names)) == 61
    assert {entry["kind"] for entry in artefacts} == set(FILES)
    assert all(entry["shows"] for entry in artefacts)


def test_each_is_made_by_the_rule_of_its_name(artefacts, made_by):
    files = {entry["id"]: FILES[entry["kind"]].format(entry["id"]) for entry in artefacts}
    others = {name: made_by.get(file) for name, file in files.items()}
    assert {name: rule for name, rule in others.items() if rule != name} == {}
