"""`palpate calibrate tip` on poses of other programs, on a table and on a film."""

import json
from dataclasses import replace

import cv2
import numpy as np
import pandas as pd
import pytest
import yaml
from palpate.capture.tables import write_table
from palpate.config.probe import covariance_fault
from palpate.estimate.direct.rig import ProbeUncertainty
from palpate.units import MILLIMETRES
from palpate.vision.calibrated_probe import calibrated_probe
from palpate.vision.camera import camera_from_spec
from palpate.vision.marker import board_of
from palpate.vision.pivot import find_pivot
from palpate.vision.pivot_json import probe_with_tip, verdict
from palpate.vision.probe import marker_columns, marker_from_tip
from printed_boards import noisy, picture
from turned_handle import TIP_M, turned_handle

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
    assert "tip: not told, to 1.2 mm" in text
    found = json.loads(out.read_text())
    assert found["tip_m"][1] * MILLIMETRES == pytest.approx(394.634, abs=1.5)
    assert list(found["left_out_m"]) == ["1378476440277091200"]


def test_a_table(table, given, tmp_path, root):
    text = given(table, "--board", root / "config/probes/nano25_sphere.yaml")
    assert "200 poses, 200 count" in text
    assert "tip: told, to" in text
    rows = yaml.safe_load("\n".join(text[text.index("force_from_tip") :].splitlines()))
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


def test_a_film(tmp_path, given, root):
    sensor = root / "tests/sample/sensors/bumblebee.yaml"
    spec = yaml.safe_load(sensor.read_text())
    camera, baseline_m = camera_from_spec(spec["color"]), spec["stereo"]["baseline_m"]
    probe = root / "config/probes/nano25_sphere.yaml"
    board = board_of(yaml.safe_load(probe.read_text())["marker"])
    rng = np.random.default_rng(1)
    rows = []
    for k, pose in enumerate(turned_handle(frames=16, noise_deg=0, noise_m=0)):
        row = {"frame": k, "time_s": k / 10}
        for side, shift_m in (("left", 0), ("right", baseline_m)):
            seen = pose.copy()
            seen[0, 3] -= shift_m
            row[side] = f"{side}/{k:06d}.png"
            (tmp_path / side).mkdir(exist_ok=True)
            image = noisy(picture(board, seen, camera), rng)
            if spec["color"]["encoding"] == "rgb8":
                image = cv2.merge([image] * 3)
            cv2.imwrite(str(tmp_path / row[side]), image)
        rows.append(row)
    write_table(tmp_path / "frames.csv", pd.DataFrame(rows))
    text = given(tmp_path, "--sensor", sensor, "--board", probe, "--output", tmp_path / "tip.json")
    assert "16 poses" in text
    found = json.loads((tmp_path / "tip.json").read_text())
    assert found["probe"] == "nano25_sphere"
    assert np.linalg.norm(found["tip_m"] - TIP_M) < 3 * np.linalg.norm(found["tip_std_m"])
    assert np.linalg.norm(found["tip_std_m"]) < 5e-4


def test_what_is_not_there(tmp_path, refused, table):
    assert "expected a film, a table or a folder" in refused(tmp_path / "none")
    assert "expected files *.txt of 4 x 4 numbers, or a film's frames.csv" in refused(tmp_path)
    (tmp_path / "frames.csv").write_text("frame,time_s\n")
    assert "--sensor: expected the file" in refused(tmp_path)
    assert "in use already" in refused(table, "--output", table)


def test_wrong_poses(tmp_path, refused, table):
    poses = pd.read_csv(table)
    write_table(table, poses.drop(columns="marker_qw"))
    assert "poses.csv: marker_qw: expected a column, found none" in refused(table)
    write_table(table, poses.assign(marker_qw=0.1))
    assert "expected quaternions of length 1" in refused(table)
    folder = tmp_path / "matrices"
    folder.mkdir()
    (folder / "1.txt").write_text("1 0 0\n")
    assert "1.txt: pose: expected 4 x 4 numbers, found 1 x 3" in refused(folder)
    np.savetxt(folder / "1.txt", np.diag([2, 1, 1, 1]))
    assert "1: expected a rotation and a shift" in refused(folder)


@pytest.mark.parametrize("lost", [np.nan, 0.0])
def test_frames_in_which_a_tracker_lost_its_target_are_left_out(table, given, refused, lost):
    poses = pd.read_csv(table).drop(columns=["frame", "detected"], errors="ignore")
    before = given(table)
    poses.loc[[4, 7], :] = lost
    write_table(table, poses)
    lines = given(table)
    assert "left out, since the tracker lost its target: 4, 7" in lines
    assert f"{len(poses) - 2} poses" in lines and f"{len(poses)} poses" in before
    write_table(table, poses.assign(**dict.fromkeys(poses.columns, lost)))
    assert f"poses: expected some, found {len(poses)} that were lost" in refused(table)


def test_a_tracker_s_z_may_point_away_from_the_target(table, given):
    away = np.diag([1.0, -1.0, -1.0, 1.0])
    (tip,) = [line for line in given(table).splitlines() if line.startswith("  tip ")]
    write_table(table, marker_columns(away @ turned_handle()))
    assert tip in given(table)


def test_a_refusal_names_the_source(table, refused):
    poses = pd.read_csv(table)
    write_table(table, poses.loc[[5] * 20])
    assert f"{table}: poses: expected the handle to turn" in refused(table)


def test_units_and_orders_that_are_not_told(tmp_path, table, refused):
    poses = pd.read_csv(table)
    places = ["marker_x_m", "marker_y_m", "marker_z_m"]
    write_table(table, poses.assign(**{name: poses[name] * MILLIMETRES for name in places}))
    line = refused(table)
    assert "poses: expected the tip within 1 m of the board, found it 1" in line
    assert "m away (unit of the poses?)" in line
    assert "--unit: expected one for text files alone" in refused(table, "--unit", "mm")
    (tmp_path / "frames.csv").write_text("frame,time_s\n")
    assert "--unit: expected one for text files alone" in refused(tmp_path, "--unit", "mm")


def test_a_quaternion_with_w_first(table, refused):
    poses = pd.read_csv(table)
    turns = [f"marker_q{axis}" for axis in "xyzw"]
    first = poses[[turns[k] for k in (3, 0, 1, 2)]].to_numpy()
    write_table(table, poses.assign(**dict(zip(turns, first.T, strict=True))))
    line = refused(table)
    assert "poses: expected the tip to rest at one place, found it" in line
    assert "order of the quaternion?" in line


def inverted(poses):
    """Poses board from camera."""
    return marker_columns(np.linalg.inv(poses))


def test_poses_that_are_the_other_way(table, refused):
    write_table(table, inverted(turned_handle()))
    line = refused(table)
    assert "poses: expected the tip nearer to the board than to the camera, found it" in line
    # Of a board whose z points to the camera that lies before the board.
    facing = turned_handle() @ np.diag([1.0, -1.0, -1.0, 1.0])
    write_table(table, inverted(facing))
    line = refused(table)
    assert "poses: expected the tip nearer to the board than to the camera, found it" in line


def test_a_tip_that_the_file_has_elsewhere(table, given, tmp_path, probe):
    file = tmp_path / "probe.yaml"
    file.write_text(yaml.safe_dump(probe))
    assert "doubtful" not in given(table, "--board", file)
    probe = probe | {"force_from_tip": np.array(probe["force_from_tip"]).tolist()}
    probe["force_from_tip"][2][3] += 0.05
    file.write_text(yaml.safe_dump(probe))
    assert "doubtful: 50 mm from where the file has it" in given(table, "--board", file)


def test_no_film_is_asked_for_that_none_makes():
    found = find_pivot(turned_handle(), range(200))
    said = verdict(replace(found, covariance=found.covariance * 50**2))
    assert "1000 frames would not tell it: bring the board nearer" in said


def tip_json(tip_m, std_m=1e-5):
    """What of tip.json a probe takes."""
    fields = {"tip_m": tip_m.tolist(), "tip_covariance_m2": (np.eye(3) * std_m**2).tolist()}
    return json.dumps(fields)


def test_a_probes_tip_of_a_calibration(tmp_path, probe):
    path = tmp_path / "tip.json"
    path.write_text(tip_json(TIP_M + [0.001, 0, 0]))
    found = marker_from_tip(probe_with_tip(probe | {"tip": "calibration"}, path))
    np.testing.assert_allclose(found[:3, 3], TIP_M + [0.001, 0, 0], atol=1e-12)
    np.testing.assert_allclose(found[:3, :3], marker_from_tip(probe)[:3, :3])
    assert calibrated_probe(probe, [path]) is probe


def test_a_calibrations_covariance_goes_with_its_tip(tmp_path, probe):
    path = tmp_path / "tip.json"
    path.write_text(tip_json(TIP_M, std_m=3e-5))
    asks = probe | {"tip": "calibration"}
    known = ProbeUncertainty.of(probe_with_tip(asks, path))
    np.testing.assert_allclose(known.tip_covariance_m2, np.eye(3) * 9e-10)
    assert known.tip == "calibrated"
    fields = json.loads(path.read_text())
    fields["tip_covariance_m2"][0][1] = 1e-10
    path.write_text(json.dumps(fields))
    with pytest.raises(ValueError, match="tip.json: tip_covariance_m2: expected a symmetric"):
        probe_with_tip(asks, path)


def test_the_tip_of_another_probe(tmp_path, probe):
    path = tmp_path / "tip.json"
    path.write_text(tip_json(np.array([0.03, 0.2, 0.08])))
    with pytest.raises(ValueError, match="tip.json: tip_m: expected within 20 mm .* 30 mm away"):
        probe_with_tip(probe, path)
    path.write_text(tip_json(TIP_M, std_m=0.002))
    with pytest.raises(ValueError, match="told to 0.2 mm, found one to 2 mm"):
        probe_with_tip(probe, path)
    path.write_text("{}")
    with pytest.raises(ValueError, match="tip_m: expected a value, found none"):
        probe_with_tip(probe, path)
