"""What the run refuses before any job, and what the lab may never take over."""

import shutil
from types import SimpleNamespace

import pytest
import yaml
from palpate.workflow.configuration import open_run
from settings import merged, written
from thesis.options import StudyConfig
from virtual_lab.checks import lab_problems
from virtual_lab.specification import Lab

SOURCES = ("config/config.yaml", "config/thesis.yaml")


@pytest.fixture
def home(root, tmp_path, monkeypatch):
    """A folder with the project's configuration and nothing in raw/."""
    shutil.copytree(root / "config", tmp_path / "config")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def opened(home, **changes):
    config, given = written(home) | changes, {"sources": SOURCES, "project": home}
    return open_run(config, lab_kind=Lab, check_lab=lab_problems, kind=StudyConfig, **given)


def drop(root, home, name="foam_block", provenance="recorded"):
    """An object of a person, whose description's path comes back."""
    shutil.copytree(root / "tests/sample/raw/foam_block", home / "raw" / name)
    for sensor in (root / "tests/sample/sensors").glob("*.yaml"):
        shutil.copy(sensor, home / "config/sensors")
    path = home / f"raw/{name}/object.yaml"
    edit(path, "simulated", provenance)
    return path


def edit(path, old, new):
    """Change a text once in a file, or add it where there is nothing old."""
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1) if old else text + new)


def refuse(home, line, **changes):
    with pytest.raises(ValueError, match=line) as caught:
        opened(home, **changes)
    return str(caught.value)


def test_the_lab_alone(home):
    run = opened(home)
    assert len(run.simulated) == 67
    # Of the lab's recordings the study takes those that it names, and tracks all but the attempts.
    assert {c.object for c in run.captures} == {"ear", "foam_ball", "foam_block"}
    assert len(run.captures) == 18 + 18 + 16 + 15
    assert len([c for c in run.captures if c.capture.startswith("11-a")]) == 16
    attempts = {c for c in run.captures if "-" in c.capture}
    assert set(run.tracked) == set(run.captures) - attempts
    assert len(run.described()) == 67
    assert len(run.simulated.intersection(run.tracked)) == 39
    # Repeated presses of ball and ear are estimated directly; the block's attempts are Hertz's.
    again = {c for c in attempts if c.object != "foam_block"}
    assert set(run.direct) == set(run.tracked) | again
    assert len(run.described("direct")) == 39 + 12
    # What is tracked, where nothing else is said.
    study = written(home)["study"]
    del study["direct"]
    run = opened(home, study=study)
    assert run.direct == run.tracked


def test_a_lab_like_another_says_only_what_is_different(home):
    """A block that others share by an anchor changes alone."""
    expected = yaml.safe_load((home / "config/lab.yaml").read_text())
    blocks = expected["objects"]
    assert blocks["foam_ball"]["motion"] == blocks["foam_block"]["motion"] != {"frames": 41}
    blocks["foam_ball"]["motion"] = blocks["foam_ball"]["motion"] | {"frames": 41}
    expected["seed"], blocks["ear"]["motion"]["frames"] = 7, 9
    changes = {"foam_ball": {"motion": {"frames": 41}}, "ear": {"motion": {"frames": 9}}}
    changes = {"like": "config/lab.yaml", "seed": 7, "objects": changes}
    (home / "lab.yaml").write_text(yaml.safe_dump(changes))
    paths = written(home)["paths"] | {"lab": "lab.yaml"}
    assert opened(home, paths=paths).lab == expected
    (home / "lab.yaml").write_text("like: nowhere.yaml\n")
    refuse(home, "nowhere.yaml: file: expected a file, found none", paths=paths)


@pytest.mark.parametrize(
    ("object_", "sensor", "captures", "line"),
    [
        ("ear", "bumblebee", ["01"],
         "direct.ear.bumblebee: expected some of study.captures, found 01-a01"),
        ("foam_block", "kinect", ["08", "19"],
         "captures.foam_block.kinect: expected recordings of the lab, found 19"),
        ("foam_block", "kinect", ["08", "16"],
         "tracked.foam_block.kinect: expected some of study.captures, found 17"),
    ],
)  # fmt: skip
def test_the_study_names_recordings_that_it_has(home, object_, sensor, captures, line):
    study = written(home)["study"]
    study["captures"][object_] = study["captures"][object_] | {sensor: captures}
    refuse(home, f"study.{line}", study=study)


def test_captures_without_a_readable_object_are_not_the_labs(root, home):
    edit(drop(root, home), "", "points: {}\n")
    refuse(home, "expected plain YAML, found none")


def test_what_an_interrupted_lab_left_is_its_own_to_complete_and_a_recording_there_is_not(home):
    folder = home / "raw/ear/bumblebee/01"
    folder.mkdir(parents=True)
    (folder / ".snakemake_timestamp").touch()
    assert "ear" in {capture.object for capture in opened(home).simulated}
    (home / "raw/ear/object.yaml").write_text("provenance: simulated\n")
    opened(home)
    (home / "raw/ear/bumblebee/01-a77").mkdir()
    line = "01-a77: capture: expected the lab's alone in an object that .*lab.yaml makes"
    refuse(home, f"ear/bumblebee/{line}")


def test_experiments_that_people_dropped_are_theirs(root, home):
    assert len(opened(home).lab_experiments) == 15
    dropped = home / "raw/sensors/kinect/loading"
    shutil.copytree(root / "tests/sample/raw/foam_block/kinect/08", dropped)
    made = home / "raw/sensors/kinect/planes"
    made.mkdir()
    (made / "recording.yaml").write_text("provenance: simulated\n")
    left = opened(home).lab_experiments
    assert "kinect/loading" not in left
    assert {"kinect/planes", "kinect/workspace"} <= set(left)
    (dropped / "force.csv").unlink()
    refuse(home, "kinect/loading/force.csv: file: expected a CSV table")


STICK = {"probe": "stick", "cd_case_size_m": [0.14, 0.12, 0.01]}


def test_experiments_of_unknown_kind_sensor_or_probe(home):
    (home / "raw/sensors/kinect/juggling").mkdir(parents=True)
    (home / "raw/sensors/webcam/loading").mkdir(parents=True)
    message = refuse(home, "experiments.probe: .* nano25_sphere, found stick", experiments=STICK)
    assert "juggling: experiment: expected one of calibration, cd_case, hand_eye, load" in message
    assert "webcam: sensor: expected one of bumblebee, kinect, kinect_cloud, " in message


def test_optics_that_nobody_can_measure(home):
    path = home / "config/sensors/bumblebee.yaml"
    stereo = path.read_text()
    kinect = (home / "config/sensors/kinect.yaml").read_text()
    path.write_text(kinect.replace("kinect\n", "bumblebee\n", 1))
    refuse(home, "bumblebee.yaml: optics: expected pictures of a board in")
    path.write_text(stereo + "optics: calibration\n")
    refuse(home, "bumblebee.yaml: optics: expected stated, those of `palpate")


MISSING = {
    "tip": "of the turning handle in",
    "load": "of the probe held free in",
    "stiffness_n_m": "of a press on something rigid in",
}


def test_what_a_probe_asks_for_must_be_filmed_and_of_this_probe(home):
    path, lab = home / "config/probes/nano25_sphere.yaml", home / "config/lab.yaml"
    probe = yaml.safe_load(path.read_text())
    asks = dict.fromkeys(("load", "axes", "stiffness_n_m", "tip"), "calibration")
    path.write_text(yaml.safe_dump(probe | asks))
    made = opened(home).calibrations_of(jobs(("foam_block", "kinect"))[0])
    names = [place.rpartition("results/sensors/kinect/")[2] for place in made]
    assert sorted(names) == ["load.json", "stiffness.json", "tip.json"]
    whole = lab.read_text()
    content = yaml.safe_load(whole)
    for name in ("pivot", "load", "stiffness"):
        del content["experiments"][name]
    lab.write_text(yaml.safe_dump(content))
    message = refuse(home, "sphere.yaml: tip: expected a recording")
    for field, line in MISSING.items():
        assert f"sphere.yaml: {field}: expected a recording {line}" in message
    lab.write_text(whole)
    other = path.read_text().replace("probe: nano25_sphere", "probe: stick", 1)
    (path.parent / "stick.yaml").write_text(other)
    line = "tip: expected a recording of nano25_sphere .* one of stick"
    refuse(home, line, experiments=STICK)


@pytest.fixture
def another_pair(root, home):
    """A second object, of a sensor and a probe of its own."""
    mine, path = (drop(root, home, name) for name in ("mine", "other"))
    edit(mine, "object: foam_block", "object: mine")
    edit(path, "object: foam_block", "object: other")
    edit(path, "nano25_sphere", "stick")
    (home / "raw/other/kinect").rename(home / "raw/other/d435")
    devices = {"sensors/d435": "sensors/kinect", "probes/stick": "probes/nano25_sphere"}
    for new, old in devices.items():
        name, other = (home / "config" / f"{one}.yaml" for one in (new, old))
        text = other.read_text().replace(f": {other.stem}\n", f": {name.stem}\n", 1)
        name.write_text(text)
    return home


def jobs(*names):
    return [SimpleNamespace(object=o, sensor=s, capture="08") for o, s in names]


UNFILLED = ("range_m: [", "range_m: FILL_IN # [")
PLACE = "raw/sensors/d435"
# Change of a device's file, the line, and what the configuration says instead.
WRONG = [
    ("sensors/d435", *UNFILLED, "range_m: .* found nothing filled in yet", {}),
    ("probes/stick", "radius_m: 0.00622", "radius_m: FILL_IN",
     "indenter.radius_m: .* found nothing filled in yet", {}),
    ("probes/stick", "", "tip: calibration\n",
     f"tip: expected a recording of the turning handle in {PLACE}/pivot, found none",
     {"experiments": STICK}),
    ("sensors/d435", "", "optics: calibration\n",
     f"optics: expected pictures of a board in {PLACE}/calib", {}),
    ("sensors/d435", "", "base: {camera_from_base: calibration}\n",
     f"base.camera_from_base: expected a recording of a target in {PLACE}", {}),
]  # fmt: skip


@pytest.mark.parametrize(("file", "old", "new", "line", "changes"), WRONG)
def test_a_wrong_device_or_a_missing_recording_stops_runs_that_use_it(
    another_pair, file, old, new, line, changes
):
    path = another_pair / f"config/{file}.yaml"
    edit(path, old, new)
    refuse(another_pair, f"{path.name}: {line}", **changes)
    run = opened(another_pair, only="mine", **changes)
    assert run.calibrations_of(jobs(("mine", "kinect"))[0]) == []


def test_a_wrong_sensor_of_recordings_alone_stops_whole_runs_and_the_labs_all(another_pair):
    (another_pair / "raw/other/d435").rename(another_pair / "raw/other/kinect")
    sensors, line = another_pair / "config/sensors", "yaml: range_m: .* found nothing filled in yet"
    edit(sensors / "d435.yaml", *UNFILLED)
    opened(another_pair)
    (another_pair / "raw/sensors/d435").mkdir(parents=True)
    refuse(another_pair, f"d435.{line}")
    opened(another_pair, only="mine")
    shutil.rmtree(another_pair / "raw")
    edit(sensors / "kinect.yaml", *UNFILLED)
    refuse(another_pair, f"kinect.{line}")


def test_templates_come_from_scans_or_a_file(root, home):
    ear, block = jobs(("ear", "kinect"), ("foam_block", "kinect"))
    run = opened(home)
    assert "ear" in run.scanned and run.scans_of(ear) == "raw/ear/scans"
    assert run.template_of(ear) == "results/ear/template.ply"
    assert run.template_of(block) == "raw/foam_block/template.ply"
    path = drop(root, home)
    edit(path, "file: template.ply", "scans: scans\n  spacing_m: 0.002")
    refuse(home, "scans: scans: expected PLY files, found none")
    (home / "raw/foam_block/scans").mkdir()
    (home / "raw/foam_block/scans/01.ply").touch()
    assert opened(home).scans_of(block) == "raw/foam_block/scans"


def test_a_recorded_object_is_kept(root, home):
    drop(root, home)
    run = opened(home)
    assert not {c for c in run.simulated if c.object == "foam_block"}
    block = {c for c in run.captures if c.object == "foam_block"}
    assert len(block) == 2 and block <= set(run.tracked)
    assert run.direct == run.captures


def test_only_one_object_is_checked_when_only_it_is_wanted(home):
    (home / "raw/other/kinect/01").mkdir(parents=True)
    assert {c.object for c in opened(home, only="foam_block").captures} == {"foam_block"}
    refuse(home, "raw/other")
    line = r"^only: expected an object of raw/ or of the lab \(ear, foam_.*\), found nothing$"
    refuse(home, line, only="nothing")


def test_unknown_names_in_the_lab(home):
    path = home / "config/lab.yaml"
    text = path.read_text()
    path.write_text(text.replace("probe: nano25_sphere", "probe: needle"))
    refuse(home, "object.probe: expected one of nano25_sphere")
    path.write_text(text.replace("      kinect: [", "      sonar: ["))
    refuse(home, "recordings: expected one of bumblebee, kinect, kin")


UNABLE = [
    ("minimise", {"poisson_ratio_bounds": [0.4, 0.1]}, "ratio_bounds: expected .* which is fixed"),
    ("minimise", {"start_poisson_ratios": [0.1, 0.4995]},
     "start_poisson_ratios: expected within .* found 0.4995"),
    ("minimise", {"profile_poisson_ratios": [0.1, 0.3, 0.2]}, "expected increasing numbers"),
    ("minimise", {"steps": {"other": {"tracker": "elastik"}}},
     "steps.other.tracker: .* found elastik"),
    ("minimise", {"steps": {"far": {"leave_out_radii": -1}}},
     "steps.far.leave_out_radii: expected"),
    ("minimise", {"strain": "logarithmic"}, "strain: expected one of"),
    ("direct", {"model": {"poisson_ratios": [0.49, 0.0]}},
     "model.poisson_ratios: expected increasing"),
    ("direct", {"model": {"poisson_ratios": [0.0, 0.42]}},
     "expected low and high within the table's 0 to"),
]  # fmt: skip


@pytest.mark.parametrize(("block", "change", "line"), UNABLE)
def test_a_search_that_cannot_start_and_a_table_that_does_not_serve(home, block, change, line):
    options = merged(written(home).get(block, {}), change)
    refuse(home, f"config/(config|thesis).yaml: {block}.*{line}", **{block: options})


@pytest.mark.parametrize("block", ["tracking", "minimise"])
def test_options_of_an_object_that_is_nowhere(home, block):
    options = written(home)[block]
    options["objects"] = options["objects"] | {"foam_bal": {}}
    line = f"config/thesis.yaml: {block}.objects: expected one of .*foam_ball.*, found foam_bal$"
    refuse(home, line, **{block: options})
    (home / "raw/foam_bal").mkdir(parents=True)
    refuse(home, "raw/foam_bal/object.yaml: file: expected a file", **{block: options})


def test_a_probe_of_experiments_is_asked_for_where_there_are_any(root, home):
    drop(root, home)
    paths = {"lab": None, "sensors": str(root / "tests/sample/sensors")}
    config = {"paths": written(home)["paths"] | paths, "experiments": {"probe": "none_such"}}
    assert opened(home, **config).captures
    (home / "raw/sensors/kinect/trace").mkdir(parents=True)
    refuse(home, "experiments.probe: expected one of .*found none_such", **config)
