"""What a run of one object shows of the others: what stands, and follows from what is there."""

import os
import shutil
from pathlib import Path

import pytest
import yaml
from palpate.workflow.configuration import open_run
from palpate.workflow.standing import ORIGIN, Standing
from settings import written
from thesis.options import StudyConfig


@pytest.fixture
def raw(root, tmp_path):
    """Two objects of one capture each."""
    block = root / "tests/sample/raw/foam_block"
    spec = yaml.safe_load((block / "object.yaml").read_text())
    for name in ("cushion", "sponge"):
        target = tmp_path / "raw" / name
        shutil.copytree(block / "kinect", target / "kinect")
        shutil.copy(block / "template.ply", target)
        (target / "object.yaml").write_text(yaml.safe_dump(spec | {"object": name}))
    return tmp_path / "raw"


def standing(root, raw, **changes):
    config = written(root) | changes
    config["paths"] |= {"raw": str(raw), "results": str(raw.with_name("results")), "lab": None}
    config["paths"] |= {"sensors": str(root / "tests/sample/sensors")}
    sources = ["config/config.yaml"]
    run = open_run(config, sources=sources, project=root, kind=StudyConfig)
    return Standing(run)


@pytest.fixture
def made(root, raw):
    """Results of a run of both."""
    both = standing(root, raw)
    for name in ("cushion", "sponge"):
        place = Path(both.run.results(f"{name}/{ORIGIN}"))
        files = ("kinect/08/tracked-study.npz", "kinect/08/hertz.json", "summary.csv")
        for path in map(place.parent.joinpath, files):
            path.parent.mkdir(parents=True, exist_ok=True)
            path.touch()
        place.write_text(f"{both.origin(name)}\n")
    return raw


def test_a_run_of_all_has_none_beside_it(root, made):
    assert standing(root, made).names == []


def test_results_of_others_stay_and_say_what_they_are(root, made):
    beside = standing(root, made, only="sponge")
    assert beside.names == ["cushion"] and beside.told("Summary") == "Summary"
    (shown,) = beside.tracked()
    assert (shown["object"], shown["capture"], shown["sensor"]) == ("cushion", "08", "kinect")
    assert shown["provenance"] == "simulated" and beside.run.with_minima([shown]) == []


def touched(raw):
    os.utime(raw / "cushion/kinect/08/force.csv")


def lacking(raw):
    shutil.rmtree(raw / "cushion/kinect/08")


@pytest.mark.parametrize(
    ("change", "options"), [(touched, {}), (lacking, {}), (None, {"seed": 99})]
)
def test_what_changed_since_is_left_out_and_told(root, made, change, options):
    if change:
        change(made)
    beside = standing(root, made, only="sponge", **options)
    assert beside.names == [] and beside.tracked() == []
    assert beside.told("Summary") == "Summary, without cushion (changed since its last run)"


def test_an_object_that_is_gone_is_shown_no_more(root, made):
    shutil.rmtree(made / "cushion")
    beside = standing(root, made, only="sponge")
    assert beside.names == [] and beside.told("Summary") == "Summary"
