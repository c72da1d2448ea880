"""Poses of a robot or a tracker: read, written, interpolated, and what is rejected of them."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from palpate.capture.check import check_object
from palpate.capture.poses import POSES, PoseRecord, read_poses, write_poses
from palpate.capture.tables import write_frames
from palpate.yaml_files import load_yaml
from scipy.spatial.transform import Rotation, Slerp

CAPTURE = "kinect/08"


def recorded(time_s, std_m=np.nan):
    """A tool that turns steadily and falls with an acceleration of 0.2 m/s2."""
    poses = np.tile(np.eye(4), (len(time_s), 1, 1))
    turns = Rotation.from_rotvec(np.outer(time_s, [0.1, -0.2, 0.3]) + [1.0, 0, 0])
    poses[:, :3, :3] = turns.as_matrix()
    poses[:, :3, 3] = np.outer(time_s**2, [0, 0, -0.1]) + [0.4, -0.2, 0.3]
    return PoseRecord(time_s, poses, np.full(len(time_s), std_m), "base", "tool0")


TIME_S = np.arange(-50, 450) / 125
RECORD = recorded(TIME_S)


@pytest.mark.parametrize("std_m", [np.nan, 2e-4])
def test_what_is_written_is_read_with_times_from_the_first_frame(tmp_path, std_m):
    began_s = 1.7e9
    write_poses(tmp_path, replace(recorded(TIME_S, std_m), time_s=TIME_S + began_s))
    frames = pd.DataFrame({"frame": [0, 1], "time_s": began_s + np.array([0.0, 0.5])})
    write_frames(tmp_path, frames)
    table = pd.read_csv(tmp_path / POSES)
    table[table.columns[::-1]].to_csv(tmp_path / POSES, index=False)
    found = read_poses(tmp_path)
    np.testing.assert_allclose(found.time_s, TIME_S, atol=2e-6)
    np.testing.assert_allclose(found.base_from_tracked, RECORD.base_from_tracked, atol=2e-9)
    np.testing.assert_equal(found.std_m, np.full(len(TIME_S), std_m))
    assert (found.base, found.tracked) == ("base", "tool0")


def test_rows_that_are_not_valid_or_empty_do_not_count(tmp_path):
    write_poses(tmp_path, RECORD)
    table = pd.read_csv(tmp_path / POSES).assign(valid=1)
    table.loc[3, "valid"], table.loc[5, "qx"] = 0, np.nan
    table.to_csv(tmp_path / POSES, index=False)
    np.testing.assert_allclose(read_poses(tmp_path).time_s, np.delete(TIME_S, [3, 5]), atol=1e-9)


def test_turns_between_poses_are_scipys_and_places_on_straight_lines():
    times = np.random.default_rng(1).uniform(*TIME_S[[0, -1]], 40)
    poses, std_m = recorded(TIME_S, 1e-4).at(times, largest_gap_s=0.01)
    turns = Slerp(TIME_S, Rotation.from_matrix(RECORD.base_from_tracked[:, :3, :3]))
    np.testing.assert_allclose(poses[:, :3, :3], turns(times).as_matrix(), atol=1e-12)
    np.testing.assert_allclose(poses[:, 2, 3], 0.3 - 0.1 * times**2, atol=2e-6)
    np.testing.assert_allclose(std_m, 1e-4, rtol=1e-3)
    assert np.isnan(RECORD.at(times, largest_gap_s=0.01)[1]).all()


def test_inside_a_gap_a_pose_is_known_worse_and_inside_a_long_one_not_at_all():
    kept = (TIME_S < 1) | (TIME_S > 1.08)
    record = recorded(TIME_S[kept], 1e-5)
    _, std_m = record.at([0.5, 1.035], largest_gap_s=0.1)
    # An acceleration's a h^2 / 8 off the chord.
    assert std_m == pytest.approx([1e-5, 0.2 * 0.096**2 / 8], rel=0.1)
    poses, std_m = record.at([0.992, 1.035, 1.088], largest_gap_s=0.05)
    assert np.isnan(poses).all(axis=(1, 2)).tolist() == np.isnan(std_m).tolist()
    assert np.isnan(std_m).tolist() == [False, True, False]


def test_nothing_is_extrapolated():
    with pytest.raises(ValueError, match="cover 0 to 4 s, found -0.4 to 3.592 s"):
        RECORD.at([0.0, 4.0], largest_gap_s=1)


# Columns that are changed or left out, and the line.
READ = [
    ({"qw": None}, "columns: expected qw, found time_s"),
    ({"qw": lambda table: table["qw"] + 0.1}, "expected length 1"),
    ({"x_m": lambda table: table["x_m"] * 1e3}, "(millimetres?)"),
    ({"time_s": lambda table: table["time_s"][::-1].to_numpy()}, "increasing values"),
    ({"base": ["a", "b"] * 250}, "in all rows, found a and b"),
    ({"y_m": "lost"}, "y_m: expected numbers, or nothing, found lost in data"),
    ({"valid": 0}, "rows: expected at least 2 valid poses, found 0"),
    ({"std_m": 0}, "std_m: expected numbers above 0, or nothing, found 0"),
]


@pytest.mark.parametrize(("columns", "line"), READ)
def test_what_is_no_record_of_poses_is_told(tmp_path, columns, line):
    write_poses(tmp_path, RECORD)
    table = pd.read_csv(tmp_path / POSES).assign(**columns)
    left = [name for name in table if columns.get(name, 0) is not None]
    table[left].to_csv(tmp_path / POSES, index=False)
    with pytest.raises(ValueError) as error:
        read_poses(tmp_path)
    assert line in str(error.value) and "\n" not in str(error.value)


@pytest.fixture
def tracked(block, root, probe):
    """The block with poses in place of a target, and its files."""
    (block / CAPTURE / POSES).unlink(missing_ok=True)
    write_poses(block / CAPTURE, RECORD)
    kinect = load_yaml(root / "tests/sample/sensors/kinect.yaml")
    kinect["base"] = {"name": "base", "camera_from_base": np.eye(4).tolist()}
    del kinect["marker"]
    probe = {key: value for key, value in probe.items() if key != "marker"} | {"tracked": "tool0"}
    return block, {"kinect": kinect}, {probe["probe"]: probe}


def lines_of(tracked, record=None, **changes):
    block, sensors, probes = tracked
    if record is not None:
        write_poses(block / CAPTURE, record)
    sensor = {"kinect": sensors["kinect"] | changes}
    return [line.partition("kinect/08/")[2] for line in check_object(block, sensor, probes)]


def test_what_poses_of_a_capture_are_compared_with(tracked):
    block, sensors, probes = tracked
    (probe,) = probes.values()
    cut = (TIME_S < 0.5) | (TIME_S > 2.5)
    assert lines_of(tracked) == []
    (line,) = lines_of(tracked, replace(RECORD, time_s=TIME_S + 3600))
    assert line == (
        f"{POSES}: time_s: expected a record that covers the frames' 0 to 3 s, found 3599.600000 to"
        " 3603.592000 s (another clock?)"
    )
    (line,) = lines_of(tracked, replace(RECORD, tracked="flange"))
    assert line == f"{POSES}: tracked: expected tool0, found flange (poses of another tool?)"
    (line,) = lines_of(tracked, replace(RECORD, base="world"))
    assert line == f"{POSES}: base: expected base, found world (poses of another base?)"
    # The sample has three frames in a second: too few are lost for a word beforehand.
    assert lines_of(tracked, recorded(TIME_S[cut])) == []
    assert lines_of(tracked, replace(RECORD, base="", tracked="")) == []
    del sensors["kinect"]["base"]
    (line,) = lines_of(tracked)
    assert line.startswith(f"{POSES}: base: expected a sensor whose file places it")
    del probe["tracked"]
    assert "names the tracked frame (tracked of nano25_sphere)" in lines_of(tracked)[1]
    (block / CAPTURE / POSES).unlink()
    (line,) = lines_of(tracked)
    words = "expected poses (sensor kinect and probe nano25_sphere without marker), found nothing"
    assert line == f"{POSES}: file: {words}"
    (line,) = check_object(block, sensors, probes, files=False)
    assert line.endswith(f"kinect/08/{POSES}: file: expected a CSV table, found nothing")
