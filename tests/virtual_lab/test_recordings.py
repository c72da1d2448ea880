"""What the lab records, small: captures, calibration, traces, poses and clouds, their seeds."""

from types import SimpleNamespace

import cv2
import numpy as np
import pandas as pd
import pytest
from palpate.capture.images import read_image
from palpate.capture.poses import POSES, read_poses
from palpate.open3d_core import o3d
from palpate.vision.camera import camera_from_spec
from palpate.vision.clouds import scene_cloud
from virtual_lab.motion import Operator
from virtual_lab.poses import record_poses
from virtual_lab.probe import make_probe
from virtual_lab.record import FACING, record_capture
from virtual_lab.rig import bare_bench, make_rig
from virtual_lab.rig_errors import errors_of
from virtual_lab.rules import LabRules
from virtual_lab.sensor_experiments import record_calibration, record_workspace

R = 0.00622


def test_a_jolted_camera_records_on_from_beside(recorded, common, spec, bench, half):
    """From the second of three frames; where the table lies then follows from the two poses."""
    shift, motion = {"jolted_m": np.array([0.004, 0.0, 0.0])}, spec["motion"] | {"tilt_deg": 4.0}
    folder, _ = recorded("kinect", half["kinect"], motion=motion, **shift)
    files = sorted((folder / "color").iterdir())
    table = [read_image(file, "mono8")[160:].astype(float) for file in files]
    window = cv2.createHanningWindow(table[0].shape[::-1], cv2.CV_64F)
    moved_px = [cv2.phaseCorrelate(table[0], now, window)[0] for now in table[1:]]
    place = errors_of(common, spec, half["kinect"]), spec["cameras"]["kinect"], bench
    before, after = (make_rig(common, *place, **more).reference for more in ({}, shift))
    middle_px = np.array([[159.5, 199.5]])
    origin_m, ray = before.rays(middle_px)
    on_table = origin_m - ray * origin_m[2] / ray[0, 2]
    expected = (after.camera.project(after.local(on_table)) - middle_px)[0]
    assert np.allclose(moved_px, [expected] * 2, atol=0.1)


@pytest.mark.long
def test_a_capture_is_the_same_for_the_same_seed_alone(recorded, files_of, common, spec, half):
    of, motion = ("kinect", half["kinect"]), spec["motion"] | {"tilt_deg": 4.0, "frames": 2}
    (one, truth), (same, _), (other, others) = (
        recorded(*of, folder=str(k), seed=seed, motion=motion) for k, seed in enumerate((2, 2, 3))
    )
    assert files_of(one) == files_of(same)
    assert files_of(one).keys() == files_of(other).keys() and files_of(one) != files_of(other)
    # Motion and noise differ, the object's mechanics do not.
    assert np.array_equal(truth["surface_rest_m"], others["surface_rest_m"])
    assert not np.array_equal(truth["tip_m"], others["tip_m"])
    assert abs(truth["clock_offset_s"]) <= common["timing"]["clock_offset_s"]


def test_calibration_pairs_show_the_target_to_both_cameras(lab, common, sensors, tmp_path):
    options = lab["experiments"]["calibration"] | {"pairs": 3}
    errors = errors_of(common, {}, sensors["kinect"])
    rig = make_rig(common, errors, options["camera"], bare_bench(common, name="c"))
    truth = record_calibration(tmp_path, rig, options, None, seed=[1])
    columns, rows, square_m = pd.read_csv(tmp_path / "board.csv").iloc[0]
    size = int(columns), int(rows)
    assert size == (9, 6)
    camera = camera_from_spec(sensors["kinect"]["color"])
    y, x = np.mgrid[: size[1], : size[0]] * square_m
    corners = np.column_stack([x.ravel(), y.ravel(), 0 * x.ravel()])
    for k, pose in enumerate(truth["camera_from_board"]):
        expected = camera.project(corners @ pose[:3, :3].T + pose[:3, 3])
        for stream in ("color", "infrared"):
            image = read_image(tmp_path / stream / f"{k:06d}.png", "mono8")
            found, points = cv2.findChessboardCornersSB(image, size)
            assert found
            if stream == "color":
                ways = (points.reshape(-1, 2)[::step] - expected for step in (1, -1))
                assert min(np.linalg.norm(way, axis=1).mean() for way in ways) < 0.15


def test_the_workspaces_grid(lab, common, half, probe, tmp_path):
    options = lab["experiments"]["workspace"] | {"columns": 2, "rows": 1, "frames": 2}
    errors = errors_of(common, {}, half["bumblebee"])
    rig = make_rig(common, errors, options["camera"], bare_bench(common, name="w"))
    truth = record_workspace(tmp_path, rig, options, probe, seed=[1])
    grid = pd.read_csv(tmp_path / "grid.csv")
    assert grid[["row", "column"]].to_numpy().tolist() == [[1, 1], [1, 2]]
    assert np.linalg.norm(np.diff(truth["tip_m"], axis=0)) == pytest.approx(options["step_m"])
    images = [(tmp_path / "01/left" / f"00000{k}.png").read_bytes() for k in range(2)]
    assert images[0] != images[1]


STOP_S = 3.0


@pytest.fixture
def rig(lab, common, spec, bench, small):
    """The rig of a sensor, as the lab's rules give it."""
    rules = LabRules(SimpleNamespace(lab=lab, sensors=small, sensor_spec=lambda w: small[w.sensor]))

    def make(name):
        sensor = rules.sensor(SimpleNamespace(object="foam_block", sensor=name))
        return make_rig(common, errors_of(common, spec, sensor), spec["cameras"][name], bench)

    return make


@pytest.fixture
def followed(rig, lab, probe, steps, tmp_path):
    """What a base's owner records of a motion: record, true places of the tip, motion, truth."""

    def follow(name):
        ours, motion = rig(name), lab["objects"]["foam_block"]["motion"] | {"frames": 18}
        real = ours.errors.probe(probe)
        how = {"point_m": steps.point_m, "radius_m": R, "facing": FACING}
        operator = Operator(motion, **how, rng=np.random.default_rng(3))
        how = {"tracked": "target", "seed": [1, 2]}
        truth = record_poses(tmp_path, ours, operator, make_probe(real), **how)
        record = read_poses(tmp_path)
        marker_from_tip = real["marker_from_force"] @ np.array(real["force_from_tip"])
        tips = truth["camera_from_base"] @ record.base_from_tracked @ marker_from_tip[:, 3]

        def error_m(late_s):
            path = operator.at(record.time_s - late_s)
            return np.linalg.norm(tips[:, :3] - ours.reference.local(path.tip_m), axis=1)

        return record, error_m, truth, motion

    return follow


def test_a_robots_poses_are_the_true_ones_but_for_noise_and_latency(followed, rig):
    record, error_m, truth, _ = followed("kinect_robot")
    assert np.diff(record.time_s) == pytest.approx(1 / 125, abs=1e-7)
    assert record.time_s[0] < 0 and record.time_s[-1] > STOP_S
    # Three axes of 0.05 mm, and 0.1 mrad over the arm of a decimetre and a half.
    assert 0.00007 < np.sqrt((error_m(0.020) ** 2).mean()) < 0.00012
    assert error_m(0.0).max() > 0.0005
    assert (record.base, truth["pose_clock_offset_s"]) == ("base_link", 0.020)
    stated = np.array(rig("kinect_robot").sensor["base"]["camera_from_base"])
    turn = np.linalg.norm(truth["camera_from_base"][:3, :3] - stated[:3, :3]) / np.sqrt(2)
    shift_m = np.linalg.norm(truth["camera_from_base"][:3, 3] - stated[:3, 3])
    assert 0.0001 < turn < 0.002 and 0.00005 < shift_m < 0.0012


def test_a_tracker_loses_some_rows_and_states_its_noise(followed):
    record, error_m, _, motion = followed("kinect_tracker")
    steps = np.diff(record.time_s) * 60
    start_s = record.time_s[steps.argmax()] - motion["rest_s"]
    assert 4 <= round(steps.max()) <= 7 and 2 <= (steps > 1.5).sum() < 12
    assert -0.05 < start_s < motion["approach_s"]
    assert 0.00013 < record.std_m.min() < 0.0002 < record.std_m.max() < 0.00027
    assert 0.0003 < np.sqrt((error_m(0.0) ** 2).mean()) < 0.0005


def test_sensors_share_what_the_kinect_records(rig, files_of, spec, steps, probe, tmp_path):
    files = {}
    for name in ("kinect", "kinect_robot", "kinect_cloud", "kinect_cloud_2"):
        (folder := tmp_path / name).mkdir()
        record_capture(folder, rig(name.removesuffix("_2")), steps, spec, probe, seed=[1, 2])
        files[name] = files_of(folder)
    kinect, robot, cloud = (files[name] for name in ("kinect", "kinect_robot", "kinect_cloud"))
    assert robot.keys() - kinect.keys() == {POSES} and cloud == files["kinect_cloud_2"]
    assert all(robot[name] == kinect[name] for name in kinect if name != "force.csv")
    assert all(cloud[name] == robot[name] for name in (POSES, "force.csv"))
    force_s = pd.read_csv(tmp_path / "kinect_robot/force.csv")["time_s"]
    assert np.diff(force_s) == pytest.approx(1 / 500, abs=1e-7)
    sensor = rig("kinect").sensor
    for frame, name in enumerate(pd.read_csv(tmp_path / "kinect_cloud/frames.csv")["cloud"]):
        points = o3d.io.read_point_cloud(str(tmp_path / "kinect_cloud" / name)).points
        depth = read_image(tmp_path / f"kinect/depth/{frame:06d}.png", sensor["depth"]["encoding"])
        assert np.allclose(points, scene_cloud({"depth": depth}, sensor).points_m, atol=1e-6)
