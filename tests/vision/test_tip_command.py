"""The tip by command and by the stage: poses of other programs, tables, a film of the lab."""

import json
import re

import numpy as np
import pandas as pd
import pytest
import yaml
from palpate.__main__ import main
from palpate.capture.experiments import check_experiment
from palpate.capture.tables import read_frames, write_frames, write_table
from palpate.config.sensor import covariance_fault
from palpate.units import MILLIMETRES
from palpate.vision.pivot import find_pivot
from palpate.vision.probe import marker_columns
from probe_motion import TIP_M, lab_film, turned_handle

PART = "tip"


@pytest.fixture
def table(tmp_path):
    """Poses as a run's probe_pose.csv has them."""
    path = tmp_path / "poses.csv"
    poses = marker_columns(turned_handle())
    write_table(path, poses.assign(frame=range(200), detected=1))
    return path


def test_matrices_of_another_program(root, given, tmp_path):
    out = tmp_path / "tip.json"
    text = given(root / "tests/real/pivot", "--unit", "mm", "--output", out)
    assert "57 poses, 56 count" in text
    assert "left out: 1378476440277091200: 12.5 mm off" in text
    assert "tip: not determined, to 1.2 mm" in text
    found = json.loads(out.read_text())
    assert found["tip_m"][1] * MILLIMETRES == pytest.approx(394.634, abs=1.5)
    assert list(found["left_out_m"]) == ["1378476440277091200"]


def test_a_table(table, given, tmp_path, root):
    text = given(table, "--board", root / "config/probes/nano25_sphere.yaml")
    assert "200 poses, 200 count" in text
    assert "tip: determined, to" in text
    rows = yaml.safe_load(text[text.index("force_from_tip") :])
    probe = yaml.safe_load((root / "config/probes/nano25_sphere.yaml").read_text())
    tip = np.array(probe["marker_from_force"]) @ np.array(rows["force_from_tip"])
    np.testing.assert_allclose(tip[:3, 3], TIP_M, atol=3e-4)
    assert covariance_fault(rows["tip_covariance_m2"]) == ""
    found = find_pivot(turned_handle(), range(200)).covariance
    np.testing.assert_allclose(rows["tip_covariance_m2"], found, rtol=0.01)


def test_frames_without_the_board_do_not_count(table, given):
    poses = pd.read_csv(table)
    poses.loc[10:19, ["detected", "marker_x_m"]] = 0, np.nan
    write_table(table, poses)
    assert "190 poses, 190 count" in given(table)


def test_what_is_not_there_and_wrong_sources(tmp_path, refused, table):
    assert "expected a recording, a table or a folder" in refused(tmp_path / "none")
    assert "expected files *.txt of 4 x 4 numbers, or a recording's frames.csv" in refused(tmp_path)
    (tmp_path / "frames.csv").write_text("frame,time_s\n")
    assert "--sensor: expected the file" in refused(tmp_path)
    assert "in use already" in refused(table, "--output", table)
    for source in (table, tmp_path):
        assert "--unit: expected one for text files alone" in refused(source, "--unit", "mm")
    (matrices := tmp_path / "matrices").mkdir()
    (matrices / "1.txt").write_text("1 0 0\n")
    assert "1.txt: pose: expected 4 x 4 numbers, found 1 x 3" in refused(matrices)
    np.savetxt(matrices / "1.txt", np.diag([2, 1, 1, 1]))
    assert "1: expected a rotation and a shift" in refused(matrices)


def inverted(facing):
    """Poses target from camera."""
    return marker_columns(np.linalg.inv(turned_handle() @ facing))


TURNS, PLACES = [f"marker_q{axis}" for axis in "xyzw"], [f"marker_{axis}_m" for axis in "xyz"]
NEARER = "poses: expected the tip nearer to the board than to the camera, found it"


@pytest.mark.parametrize(
    ("changed", "line"),
    [
        (lambda t: t.drop(columns="marker_qw"), "marker_qw: expected a column, found none"),
        (lambda t: t.assign(marker_qw=0.1), "marker_qx: expected quaternions of length 1"),
        (lambda t: t.loc[[5] * 20], "poses: expected the handle to turn"),
        (
            lambda t: t.assign(**(t[PLACES] * MILLIMETRES)),
            "poses: expected the tip within 1 m of the board, found it 1.* m away",
        ),
        (
            lambda t: t.assign(**t[TURNS[3:] + TURNS[:3]].set_axis(TURNS, axis=1)),
            "poses: expected the tip to rest at one place, found it .* order of the quaternion",
        ),
        (lambda t: inverted(np.eye(4)), NEARER),
        # Of a target whose z points to the camera, which lies before the target.
        (lambda t: inverted(np.diag([1.0, -1.0, -1.0, 1.0])), NEARER),
    ],
)
def test_a_wrong_table(table, refused, changed, line):
    write_table(table, changed(pd.read_csv(table)))
    assert re.match(re.escape(f"error: {table}: ") + line, refused(table))


@pytest.mark.parametrize("lost", [np.nan, 0.0])
def test_frames_in_which_a_tracker_lost_its_target_are_left_out(table, given, refused, lost):
    poses = pd.read_csv(table).drop(columns=["frame", "detected"])
    poses.loc[[4, 7], :] = lost
    write_table(table, poses)
    lines = given(table)
    assert "left out, since the tracker lost its target: 4, 7" in lines and "198 poses" in lines
    write_table(table, poses.assign(**dict.fromkeys(poses.columns, lost)))
    assert "poses: expected some, found 200 that were lost" in refused(table)


def test_a_tracker_s_z_may_point_away_from_the_target(table, given):
    away = np.diag([1.0, -1.0, -1.0, 1.0])
    (tip,) = [line for line in given(table).splitlines() if line.startswith("  tip ")]
    write_table(table, marker_columns(away @ turned_handle()))
    assert tip in given(table)


def test_a_tip_that_the_file_has_elsewhere(table, given, tmp_path, probe):
    file = tmp_path / "probe.yaml"
    file.write_text(yaml.safe_dump(probe))
    assert "warning" not in given(table, "--board", file)
    probe = probe | {"force_from_tip": np.array(probe["force_from_tip"]).tolist()}
    probe["force_from_tip"][2][3] += 0.05
    file.write_text(yaml.safe_dump(probe))
    assert "warning: 50 mm from where the file has it" in given(table, "--board", file)


SENSOR, PROBE = "tests/sample/sensors/bumblebee.yaml", "config/probes/nano25_sphere.yaml"


@pytest.fixture(scope="module")
def sensor(root):
    return yaml.safe_load((root / SENSOR).read_text())


@pytest.fixture(scope="module")
def recorded(root, sensor, probe, tmp_path_factory):
    """A recording of the handle by the smaller stereo head, and where its probe's tip really is."""
    folder = tmp_path_factory.mktemp("sensors") / "pivot"
    return folder, lab_film(root, folder, sensor, probe, frames=12)["tip_m"]


@pytest.fixture
def found(stage, sensor, probe, tmp_path):
    """Run the stage; give tip.json, or the line that it ends with."""

    def run(folder, of=probe):
        params = {"part": "tip", "sensor": sensor, "probe": of, "options": {}, "more": {}}
        files = {"inputs": {"film": folder}, "outputs": {"fields": "tip.json"}}
        line = stage("probe_calibration", **files, params=params)
        return line or json.loads((tmp_path / "tip.json").read_text())

    return run


def test_the_tip_is_found(recorded, found, sensor, root, tmp_path):
    """By the stage, and as well by the command."""
    folder, tip_m = recorded
    assert not check_experiment(folder, sensor)
    told = found(folder)
    assert told["poses"] == 12
    assert np.linalg.norm(told["tip_m"] - tip_m) < 2e-4
    off = told["tip_m"] - tip_m
    assert off @ np.linalg.solve(told["tip_covariance_m2"], off) < 20
    out = tmp_path / "by_command.json"
    given = folder, "--sensor", root / SENSOR, "--board", root / PROBE, "--output", out
    assert main(["calibrate", "tip", *map(str, given)]) == 0
    assert json.loads(out.read_text()) == told


def test_a_probe_must_be_named_and_a_few_frames_are_rejected(recorded, found, tmp_path):
    folder, _ = recorded
    assert "experiments.probe: expected the recorded probe, found none" in found(folder, None)
    short = tmp_path / "pivot"
    short.mkdir()
    for side in ("left", "right"):
        (short / side).symlink_to(folder / side)
    write_frames(short, read_frames(folder)[:9])
    assert f"{short}: poses: expected at least 10, found 9" in found(short)
