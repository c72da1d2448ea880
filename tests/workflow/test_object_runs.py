"""Runs of a part of many objects: one, or a batch, and what it shows and hangs on of others."""

import os
import shutil
from pathlib import Path

import pytest
import yaml
from palpate.capture.discover import CaptureId
from palpate.workflow.configuration import open_run
from palpate.workflow.own_objects import ORIGIN, Standing, kept_files
from sample_run import ran
from settings import full, written
from thesis.options import StudyConfig
from thesis.run import StudyRun

OBJECTS = ("--configfile", "run.yaml", "--dry-run")


def two_objects(root, folder):
    """Two objects of one capture each."""
    block = root / "tests/sample/raw/foam_block"
    spec = yaml.safe_load((block / "object.yaml").read_text())
    for name in ("cushion", "sponge"):
        shutil.copytree(block / "kinect", folder / name / "kinect")
        shutil.copy(block / "template.ply", folder / name)
        (folder / name / "object.yaml").write_text(yaml.safe_dump(spec | {"object": name}))
    return folder


@pytest.mark.workflow
def test_a_run_may_be_of_one_object_or_a_batch(root, fresh):
    """Configuration and list of what was made are the last full run's, as its tables are."""
    two_objects(root, fresh / "raw")
    (fresh / "run.yaml").write_text("paths: {sensors: tests/sample/sensors, lab: null}\n")
    text = ran(fresh, *OBJECTS, "--config", "only=sponge", "methods=[hertz]")
    assert "own_summary " in text and "objects_page " in text and "configuration " not in text
    text = ran(fresh, *OBJECTS, "--batch", "objects=1/2", "--", "objects")
    assert "results/cushion/report.html" in text and "results/sponge/" not in text


def standing(root, raw, **changes):
    config = written(root) | changes
    config["paths"] |= {"raw": str(raw), "results": str(raw.with_name("results")), "lab": None}
    config["paths"] |= {"sensors": str(root / "tests/sample/sensors")}
    sources = ["config/config.yaml"]
    run = open_run(config, sources=sources, project=root, kind=StudyConfig)
    return Standing(run)


@pytest.fixture
def made(root, tmp_path):
    """Results of a run of both."""
    raw = two_objects(root, tmp_path / "raw")
    both = standing(root, raw)
    for name in ("cushion", "sponge"):
        place = Path(both.run.results(f"{name}/{ORIGIN}"))
        files = ("kinect/08/tracked-study.npz", "kinect/08/hertz.json", "summary.csv")
        for path in map(place.parent.joinpath, files):
            path.parent.mkdir(parents=True, exist_ok=True)
            path.touch()
        place.write_text(f"{both.origin(name)}\n")
    return raw


def test_results_of_others_stay_and_say_what_they_are(root, made):
    assert standing(root, made).names == []
    beside = standing(root, made, only="sponge")
    assert beside.names == ["cushion"] and beside.told("Summary") == "Summary"
    (shown,) = beside.tracked()
    assert (shown["object"], shown["capture"], shown["sensor"]) == ("cushion", "08", "kinect")
    assert shown["provenance"] == "simulated" and beside.run.with_minima([shown]) == []


@pytest.mark.parametrize("change", ["seed", "touched", "missing"])
def test_what_changed_since_is_left_out_and_told(root, made, change):
    if change == "touched":
        os.utime(made / "cushion/kinect/08/force.csv")
    if change == "missing":
        shutil.rmtree(made / "cushion/kinect/08")
    options = {"seed": 99} if change == "seed" else {}
    beside = standing(root, made, only="sponge", **options)
    assert beside.names == [] and beside.tracked() == []
    assert beside.told("Summary") == "Summary, without cushion (changed since its last run)"
    # An object that is gone is shown no more.
    shutil.rmtree(made / "cushion")
    beside = standing(root, made, only="sponge", **options)
    assert beside.names == [] and beside.told("Summary") == "Summary"


STICK = {"probe": "stick"}


def test_objects_of_the_study_are_nobodys_own(root):
    config = full(root)
    config["study"] |= {"block": "brick", "captures": {"slab": {}}}
    names = ("brick", "cushion", "ear", "foam_ball", "slab")
    found = tuple(CaptureId(name, "kinect", "01") for name in names)
    given = {"sensors": {}, "probes": {}, "lab": None, "curves": (), "seen": {}}
    run = StudyRun(config=config, found=found, simulated=frozenset(), **given)
    assert run.own == {"cushion"} and run.minimised == tuple(c for c in found if c != found[1])


def test_files_outside_the_object_count(tmp_path):
    paths = {"raw": str(tmp_path / "raw"), "meshes": str(tmp_path / "meshes")}
    sensors = {"kinect": {"optics": "calibration"}, "stereo": {"optics": {"focal_px": 1.0}}}
    board = Path(paths["raw"]) / "sensors/kinect/calibration/board.png"
    board.parent.mkdir(parents=True)
    board.write_bytes(b"one")
    first = kept_files("cushion", sensors, STICK, paths)
    assert set(first) == {"kinect/calibration"}
    (board.parents[1] / "hand_eye").mkdir()
    arm = {"kinect": {"base": {"camera_from_base": "calibration"}}}
    assert set(kept_files("cushion", arm, STICK, paths)) == {"kinect/hand_eye"}
    film = board.parents[1] / "pivot/frames.csv"
    film.parent.mkdir()
    film.write_text("frame,time_s\n")
    turned = STICK | {"tip": "calibration"}
    expected = {"kinect/calibration", "kinect/pivot"}
    assert set(kept_files("cushion", sensors, turned, paths)) == expected
    # A probe with a tip of its own does not hang on it.
    assert kept_files("cushion", sensors, STICK, paths) == first
    film.unlink()
    film.parent.rmdir()
    board.write_bytes(b"another")
    assert kept_files("cushion", sensors, STICK, paths) != first
    Path(paths["meshes"]).mkdir()
    (Path(paths["meshes"]) / "cushion.vtu").write_bytes(b"mesh")
    assert set(kept_files("cushion", sensors, STICK, paths)) == {"kinect/calibration", "mesh"}
