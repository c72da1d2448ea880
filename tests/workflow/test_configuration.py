"""What the run refuses before any job, and what the lab may never take over."""

import shutil
from types import SimpleNamespace

import pytest
import yaml
from palpate.workflow.configuration import open_run
from settings import written
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


def drop(root, home, name="foam_block"):
    shutil.copytree(root / "tests/sample/raw/foam_block", home / "raw" / name)
    for sensor in (root / "tests/sample/sensors").glob("*.yaml"):
        shutil.copy(sensor, home / "config/sensors")


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


def test_a_lab_like_another_says_only_what_is_different(home):
    changes = {"like": "config/lab.yaml", "seed": 7, "objects": {"ear": {"motion": {"frames": 9}}}}
    (home / "lab.yaml").write_text(yaml.safe_dump(changes))
    paths = written(home)["paths"]
    lab = opened(home, paths=paths | {"lab": "lab.yaml"}).lab
    expected = yaml.safe_load((home / "config/lab.yaml").read_text())
    expected["seed"], expected["objects"]["ear"]["motion"]["frames"] = 7, 9
    assert lab == expected


def test_a_block_that_others_share_by_an_anchor_changes_alone(home):
    blocks = yaml.safe_load((home / "config/lab.yaml").read_text())["objects"]
    assert blocks["foam_ball"]["motion"] == blocks["foam_block"]["motion"] != {"frames": 41}
    changes = {"like": "config/lab.yaml", "objects": {"foam_ball": {"motion": {"frames": 41}}}}
    (home / "lab.yaml").write_text(yaml.safe_dump(changes))
    lab = opened(home, paths=written(home)["paths"] | {"lab": "lab.yaml"}).lab
    assert lab["objects"]["foam_ball"]["motion"]["frames"] == 41
    assert lab["objects"]["foam_block"]["motion"] == blocks["foam_block"]["motion"]


def test_a_lab_like_a_file_that_is_none(home):
    (home / "lab.yaml").write_text("like: nowhere.yaml\n")
    paths = written(home)["paths"]
    with pytest.raises(ValueError, match="nowhere.yaml: file: expected YAML, found nothing"):
        opened(home, paths=paths | {"lab": "lab.yaml"})


def test_what_is_tracked_is_estimated_where_nothing_else_is_said(home):
    study = written(home)["study"]
    del study["direct"]
    run = opened(home, study=study)
    assert run.direct == run.tracked


def test_the_study_estimates_what_it_does_not_use(home):
    study = written(home)["study"]
    study["captures"]["ear"] = {"bumblebee": ["01"]}
    said = r"study.direct.ear.bumblebee: expected some of study.captures, found 01-a01"
    with pytest.raises(ValueError, match=said):
        opened(home, study=study)


@pytest.mark.parametrize(
    ("captures", "line"),
    [
        (["08", "19"], "captures.foam_block.kinect: expected recordings of the lab, found 19"),
        (["08", "16"], "tracked.foam_block.kinect: expected some of study.captures, found 17"),
    ],
)
def test_the_study_names_recordings_that_it_has(home, captures, line):
    study = written(home)["study"]
    study["captures"]["foam_block"]["kinect"] = captures
    with pytest.raises(ValueError, match=f"study.{line}"):
        opened(home, study=study)


@pytest.mark.parametrize(
    ("spoil", "line"),
    [
        (lambda p: p.write_text(p.read_text() + "points: {}\n"), "expected plain YAML, found none"),
        (lambda p: p.unlink(), "object.yaml: file: expected YAML, found nothing"),
    ],
    ids=["broken", "missing"],
)
def test_captures_without_a_readable_object_are_not_the_labs(root, home, spoil, line):
    drop(root, home)
    path = home / "raw/foam_block/object.yaml"
    path.write_text(path.read_text().replace("simulated", "recorded"))
    spoil(path)
    with pytest.raises(ValueError, match=line):
        opened(home)


def test_what_an_interrupted_lab_left_is_its_own_to_complete(home):
    folder = home / "raw/ear/bumblebee/01"
    folder.mkdir(parents=True)
    (folder / ".snakemake_timestamp").touch()
    assert "ear" in {capture.object for capture in opened(home).simulated}


def test_a_recording_in_the_labs_object_is_not_taken_for_simulated(home):
    folder = home / "raw/ear/bumblebee/01"
    folder.mkdir(parents=True)
    (folder / ".snakemake_timestamp").touch()
    (home / "raw/ear/object.yaml").write_text("provenance: simulated\n")
    opened(home)
    (home / "raw/ear/bumblebee/01-a77").mkdir()
    line = (
        "ear/bumblebee/01-a77: capture: expected the lab's alone in an object that .*lab.yaml makes"
    )
    with pytest.raises(ValueError, match=line):
        opened(home)


def test_experiments_that_people_dropped_are_theirs(root, home):
    assert len(opened(home).lab_experiments) == 15
    dropped = home / "raw/sensors/kinect/loading"
    dropped.parent.mkdir(parents=True)
    shutil.copytree(root / "tests/sample/raw/foam_block/kinect/08", dropped)
    made = home / "raw/sensors/kinect/planes"
    made.mkdir()
    (made / "recording.yaml").write_text("provenance: simulated\n")
    left = opened(home).lab_experiments
    assert "kinect/loading" not in left
    assert {"kinect/planes", "kinect/workspace"} <= set(left)
    (dropped / "force.csv").unlink()
    with pytest.raises(ValueError, match="kinect/loading/force.csv: file: expected a CSV table"):
        opened(home)


def test_experiments_of_unknown_kind_sensor_or_probe(root, home):
    (home / "raw/sensors/kinect/juggling").mkdir(parents=True)
    (home / "raw/sensors/webcam/loading").mkdir(parents=True)
    with pytest.raises(ValueError) as caught:
        opened(home, experiments={"probe": "stick", "cd_case_size_m": [0.14, 0.12, 0.01]})
    message = str(caught.value)
    assert "juggling: experiment: expected one of calibration, cd_case, hand_eye, load" in message
    assert "webcam: sensor: expected one of bumblebee, kinect, kinect_cloud, " in message
    assert "experiments.probe: expected one of nano25_sphere, found stick" in message


def test_optics_that_nobody_can_measure(root, home):
    path = home / "config/sensors/bumblebee.yaml"
    stereo = path.read_text()
    path.write_text(
        (home / "config/sensors/kinect.yaml").read_text().replace("kinect\n", "bumblebee\n", 1)
    )
    with pytest.raises(ValueError, match="bumblebee.yaml: optics: expected pictures of a board in"):
        opened(home)
    path.write_text(stereo + "optics: calibration\n")
    with pytest.raises(
        ValueError, match="bumblebee.yaml: optics: expected stated, those of `palpate"
    ):
        opened(home)


def test_tips_that_nobody_filmed(root, home):
    path = home / "config/probes/nano25_sphere.yaml"
    path.write_text(path.read_text() + "tip: calibration\n")
    pose = SimpleNamespace(object="foam_block", sensor="kinect", capture="08")
    (made,) = opened(home).calibrations_of(pose)
    assert made.endswith("results/sensors/kinect/tip.json")
    lab = home / "config/lab.yaml"
    content = yaml.safe_load(lab.read_text())
    del content["experiments"]["pivot"]
    lab.write_text(yaml.safe_dump(content))
    with pytest.raises(
        ValueError, match="sphere.yaml: tip: expected a recording of the turning handle in"
    ):
        opened(home)


def test_what_a_probe_asks_for_must_be_filmed(root, home):
    path = home / "config/probes/nano25_sphere.yaml"
    probe = yaml.safe_load(path.read_text())
    asks = probe | {"load": "calibration", "axes": "calibration", "stiffness_n_m": "calibration"}
    path.write_text(yaml.safe_dump(asks))
    pose = SimpleNamespace(object="foam_block", sensor="kinect", capture="08")
    made = [place.rpartition("/")[2] for place in opened(home).calibrations_of(pose)]
    assert made == ["load.json", "stiffness.json"]
    lab = home / "config/lab.yaml"
    content = yaml.safe_load(lab.read_text())
    del content["experiments"]["load"], content["experiments"]["stiffness"]
    lab.write_text(yaml.safe_dump(content))
    with pytest.raises(ValueError) as caught:
        opened(home)
    message = str(caught.value)
    assert "sphere.yaml: load: expected a recording of the probe held free in" in message
    assert "stiffness_n_m: expected a recording of a press on something rigid in" in message


def test_a_tip_is_of_the_probe_that_was_filmed(root, home):
    path = home / "config/probes/nano25_sphere.yaml"
    path.write_text(path.read_text() + "tip: calibration\n")
    other = path.read_text().replace("probe: nano25_sphere", "probe: stick", 1)
    (path.parent / "stick.yaml").write_text(other)
    with pytest.raises(
        ValueError, match="tip: expected a recording of nano25_sphere .* one of stick"
    ):
        opened(home, experiments={"probe": "stick", "cd_case_size_m": [0.14, 0.12, 0.01]})


@pytest.fixture
def another_pair(root, home):
    """A second object, of a sensor and a probe of its own."""
    for name in ("mine", "other"):
        drop(root, home, name)
        path = home / f"raw/{name}/object.yaml"
        path.write_text(path.read_text().replace("simulated", "recorded"))
    text = path.read_text().replace("nano25_sphere", "stick")
    path.write_text(text.replace("object: foam_block", "object: other"))
    mine = home / "raw/mine/object.yaml"
    mine.write_text(mine.read_text().replace("object: foam_block", "object: mine"))
    (home / "raw/other/kinect").rename(home / "raw/other/d435")
    devices = {"sensors/d435": "sensors/kinect", "probes/stick": "probes/nano25_sphere"}
    for new, old in devices.items():
        name, other = (home / "config" / f"{one}.yaml" for one in (new, old))
        text = other.read_text().replace(f": {other.stem}\n", f": {name.stem}\n", 1)
        name.write_text(text)
    return home


def jobs(*names):
    return [SimpleNamespace(object=o, sensor=s, capture="08") for o, s in names]


@pytest.mark.parametrize(
    ("file", "field", "change"),
    [
        ("sensors/d435", "range_m", ("range_m: [", "range_m: FILL_IN # [")),
        ("probes/stick", "indenter.radius_m", ("radius_m: 0.00622", "radius_m: FILL_IN")),
    ],
)
def test_a_wrong_device_stops_runs_that_use_it(another_pair, file, field, change):
    path = another_pair / f"config/{file}.yaml"
    path.write_text(path.read_text().replace(*change, 1))
    with pytest.raises(ValueError, match=f"{path.name}: {field}: .* found nothing filled in yet"):
        opened(another_pair)
    mine, _ = jobs(("mine", "kinect"), ("other", "d435"))
    assert opened(another_pair, only="mine").calibrations_of(mine) == []


def test_a_wrong_sensor_of_recordings_alone_stops_whole_runs(another_pair):
    (another_pair / "raw/other/d435").rename(another_pair / "raw/other/kinect")
    path = another_pair / "config/sensors/d435.yaml"
    path.write_text(path.read_text().replace("range_m: [", "range_m: FILL_IN # ["))
    opened(another_pair)
    (another_pair / "raw/sensors/d435").mkdir(parents=True)
    with pytest.raises(ValueError, match="d435.yaml: range_m: .* found nothing filled in yet"):
        opened(another_pair)
    opened(another_pair, only="mine")


def test_the_labs_own_devices_stop_all(home):
    path = home / "config/sensors/kinect.yaml"
    path.write_text(path.read_text().replace("range_m: [", "range_m: FILL_IN # ["))
    with pytest.raises(ValueError, match="kinect.yaml: range_m: .* found nothing filled in yet"):
        opened(home)


def test_a_missing_recording_stops_runs_that_ask_for_it(another_pair):
    path = another_pair / "config/probes/stick.yaml"
    path.write_text(path.read_text() + "tip: calibration\n")
    filmed = {"probe": "stick", "cd_case_size_m": [0.14, 0.12, 0.01]}
    place = "the turning handle in raw/sensors/d435/pivot, found none"
    with pytest.raises(ValueError, match=f"stick.yaml: tip: expected a recording of {place}"):
        opened(another_pair, experiments=filmed)
    run = opened(another_pair, only="mine", experiments=filmed)
    assert run.calibrations_of(jobs(("mine", "kinect"))[0]) == []


def test_missing_optics_stop_runs_that_ask_for_them(another_pair):
    path = another_pair / "config/sensors/d435.yaml"
    text = path.read_text()
    path.write_text(text + "optics: calibration\n")
    line = "d435.yaml: optics: expected pictures of a board in raw/sensors/d435/calibration"
    with pytest.raises(ValueError, match=line):
        opened(another_pair)
    path.write_text(text + "base: {camera_from_base: calibration}\n")
    line = "d435.yaml: base.camera_from_base: expected a recording of a target in raw/sensors/d435"
    with pytest.raises(ValueError, match=line):
        opened(another_pair)


def test_templates_come_from_scans_or_a_file(root, home):
    ear, block = jobs(("ear", "kinect"), ("foam_block", "kinect"))
    run = opened(home)
    assert "ear" in run.scanned and run.scans_of(ear) == "raw/ear/scans"
    assert run.template_of(ear) == "results/ear/template.ply"
    assert run.template_of(block) == "raw/foam_block/template.ply"
    drop(root, home)
    path = home / "raw/foam_block/object.yaml"
    text = path.read_text().replace("simulated", "recorded")
    path.write_text(text.replace("file: template.ply", "scans: scans\n  spacing_m: 0.002"))
    with pytest.raises(ValueError, match="scans: scans: expected PLY files, found none"):
        opened(home)
    (home / "raw/foam_block/scans").mkdir()
    (home / "raw/foam_block/scans/01.ply").touch()
    assert opened(home).scans_of(block) == "raw/foam_block/scans"


def test_a_recorded_object_is_kept(root, home):
    drop(root, home)
    path = home / "raw/foam_block/object.yaml"
    path.write_text(path.read_text().replace("simulated", "recorded"))
    run = opened(home)
    assert not {c for c in run.simulated if c.object == "foam_block"}
    block = [c for c in run.captures if c.object == "foam_block"]
    assert len(block) == 2
    assert set(block) <= set(run.tracked)
    assert run.direct == run.captures


def test_only_one_object_is_checked_when_only_it_is_wanted(root, home):
    (home / "raw/other/kinect/01").mkdir(parents=True)
    assert {c.object for c in opened(home, only="foam_block").captures} == {"foam_block"}
    with pytest.raises(ValueError, match="raw/other"):
        opened(home)


def test_board_that_looks_the_same_from_both_ends(home):
    path = home / "config/probes/nano25_sphere.yaml"
    path.write_text(path.read_text().replace("[4, 3]", "[5, 3]"))
    with pytest.raises(ValueError, match="expected one odd and one even, found 5, 3"):
        opened(home)


def test_unknown_names_in_the_lab(home):
    path = home / "config/lab.yaml"
    text = path.read_text()
    path.write_text(text.replace("probe: nano25_sphere", "probe: needle"))
    with pytest.raises(ValueError, match="object.probe: expected one of nano25_sphere"):
        opened(home)
    path.write_text(text.replace("      kinect: [", "      sonar: ["))
    with pytest.raises(ValueError, match="recordings: expected one of bumblebee, kinect, kin"):
        opened(home)


def test_unknown_object(home):
    line = r"^only: expected an object of raw/ or of the lab \(ear, foam_.*\), found nothing$"
    with pytest.raises(ValueError, match=line):
        opened(home, only="nothing")


@pytest.mark.parametrize(
    ("file", "old", "new", "line"),
    [
        ("sensors/kinect", "[0.5, 8.0]", "[8.0, 0.5]", "range_m: expected increasing distances"),
        (
            "sensors/kinect",
            "0.99998109,",
            "1.1,",
            "expected a rotation and a shift",
        ),
        (
            "probes/nano25_sphere",
            "exclusion:",
            "stiffness_n_m: 0\nexclusion:",
            "stiffness_n_m: expected",
        ),
        ("probes/nano25_sphere", "[1.0, 0.0, 0.0, 0.0]", "[-1.0, 0.0, 0.0, 0.0]", "a mirrored one"),
        (
            "probes/nano25_sphere",
            "0.00622",
            "6.22",
            "radius_m: expected a number <= 0.1, found 6.22",
        ),
        (
            "sensors/bumblebee",
            "baseline_m: 0.12",
            "baseline_m: 120",
            "expected a number <= 2, found 120",
        ),
    ],
)
def test_numbers_that_no_device_has(home, file, old, new, line):
    path = home / f"config/{file}.yaml"
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))
    with pytest.raises(ValueError) as caught:
        opened(home)
    assert line in str(caught.value)


@pytest.mark.parametrize(
    ("change", "line"),
    [
        ({"poisson_ratio_bounds": [0.4, 0.1]}, "poisson_ratio_bounds: expected .* which is fixed"),
        (
            {"start_poisson_ratios": [0.1, 0.4995]},
            "start_poisson_ratios: expected within .* found 0.4995",
        ),
        ({"profile_poisson_ratios": [0.1, 0.3, 0.2]}, "expected increasing numbers"),
        ({"steps": {"other": {"tracker": "elastik"}}}, "steps.other.tracker: .* found elastik"),
        ({"steps": {"far": {"leave_out_radii": -1}}}, "steps.far.leave_out_radii: expected"),
        ({"strain": "logarithmic"}, "strain: expected one of"),
    ],
    ids=["bounds", "start", "profile", "tracker", "radii", "strain"],
)
def test_a_search_that_cannot_start(home, change, line):
    options = written(home)["minimise"] | change
    with pytest.raises(ValueError, match=f"config/(config|thesis).yaml: minimise.*{line}"):
        opened(home, minimise=options)


@pytest.mark.parametrize(
    ("block", "change", "line"),
    [
        ("model", {"poisson_ratios": [0.49, 0.0]}, "model.poisson_ratios: expected increasing"),
        ("model", {"poisson_ratios": [0.0, 0.42]}, "expected low and high within the table's 0 to"),
    ],
    ids=["ratios", "bounds"],
)
def test_a_table_that_does_not_serve(home, block, change, line):
    options = written(home).get("direct", {})
    options[block] = options.get(block, {}) | change
    with pytest.raises(ValueError, match=f"config/config.yaml: direct.*{line}"):
        opened(home, direct=options)


@pytest.mark.parametrize("block", ["tracking", "minimise"])
def test_options_of_an_object_that_is_nowhere(home, block):
    options = written(home)[block]
    options["objects"] = options["objects"] | {"foam_bal": {}}
    line = f"config/thesis.yaml: {block}.objects: expected one of .*foam_ball.*, found foam_bal$"
    with pytest.raises(ValueError, match=line):
        opened(home, **{block: options})
    (home / "raw/foam_bal").mkdir(parents=True)
    with pytest.raises(ValueError, match="raw/foam_bal/object.yaml: file: expected YAML"):
        opened(home, **{block: options})


def test_a_probe_of_experiments_is_asked_for_where_there_are_any(root, home):
    drop(root, home)
    path = home / "raw/foam_block/object.yaml"
    path.write_text(path.read_text().replace("simulated", "recorded"))
    paths = {"lab": None, "sensors": str(root / "tests/sample/sensors")}
    config = {"paths": written(home)["paths"] | paths, "experiments": {"probe": "none_such"}}
    assert opened(home, **config).captures
    (home / "raw/sensors/kinect/trace").mkdir(parents=True)
    with pytest.raises(ValueError, match="experiments.probe: expected one of .*found none_such"):
        opened(home, **config)
