"""Indentations of the Kinect that a robot or a tracker follows, or that are recorded as clouds."""

from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from palpate.capture.images import read_image
from palpate.capture.poses import POSES, read_poses
from palpate.open3d_core import o3d
from palpate.vision.clouds import scene_points
from virtual_lab.motion import Operator
from virtual_lab.poses import record_poses
from virtual_lab.probe import make_probe
from virtual_lab.record import FACING, record_capture
from virtual_lab.rig import make_rig
from virtual_lab.rig_errors import errors_of
from virtual_lab.rules import LabRules

R, STOP_S = 0.00622, 3.0


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


def test_sensors_share_what_the_kinect_records(rig, spec, steps, probe, tmp_path):
    files = {}
    for name in ("kinect", "kinect_robot", "kinect_cloud", "kinect_cloud_2"):
        (folder := tmp_path / name).mkdir()
        record_capture(folder, rig(name.removesuffix("_2")), steps, spec, probe, seed=[1, 2])
        found = (path for path in folder.rglob("*") if path.is_file())
        files[name] = {str(path.relative_to(folder)): path.read_bytes() for path in found}
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
        assert np.allclose(points, scene_points({"depth": depth}, sensor), atol=1e-6)
