"""A robot's bag becomes E and nu: those of the same indentation by the target in its pictures."""

import json
import shutil

import numpy as np
import pytest
import yaml
from palpate.__main__ import main
from palpate.capture.poses import PoseRecord, write_poses
from palpate.capture.tables import read_frames
from palpate.vision.follow import followed
from palpate.vision.options import ProbePose
from palpate.vision.probe import marker_transforms
from palpate.yaml_files import load_yaml
from robot_bag import write_bag

CAMERA_FROM_BASE = [[0.6, -0.8, 0, 0.3], [-0.8, -0.6, 0, 0.1], [0, 0, -1, 0.9], [0, 0, 0, 1]]
BASE = {"name": "base_link", "camera_from_base": CAMERA_FROM_BASE}


@pytest.fixture
def lab(root, tmp_path, monkeypatch):
    """The cow's capture, and a camera beside a robot that holds the same probe."""
    own = root / "tests/own_object"
    shutil.copytree(own / "raw", tmp_path / "raw")
    described = tmp_path / "raw/toy_cow/object.yaml"
    described.write_text(described.read_text().replace("simulated", "recorded"))
    for name in ("sensors", "probes"):
        shutil.copytree(own / name, tmp_path / "config" / name)
    (tmp_path / "config/config.yaml").write_text("hertz: {onset_force_n: 0.08}\n")
    sensor, probe = (
        load_yaml(own / name) for name in ("sensors/bench_cam.yaml", "probes/bench_probe.yaml")
    )
    probe["tracked"] = "tip_holder"
    (tmp_path / "config/probes/bench_probe.yaml").write_text(yaml.safe_dump(probe))
    robots = sensor | {"sensor": "arm_cam", "base": BASE}
    del robots["marker"]
    (tmp_path / "config/sensors/arm_cam.yaml").write_text(yaml.safe_dump(robots))
    monkeypatch.chdir(tmp_path)
    return tmp_path / "raw/toy_cow/bench_cam/back", sensor, robots, probe


@pytest.mark.long
def test_a_bag_gives_what_the_target_gives(lab, tmp_path, capsys):
    target, sensor, robots, probe = lab
    # The robot stands where the target says, at 125 Hz.
    time_s = read_frames(target)["time_s"].to_numpy()
    seen = marker_transforms(followed(target, sensor, probe, ProbePose()))
    frames_s = np.concatenate([[time_s[0] - 0.1], time_s, [time_s[-1] + 0.1]])
    poses = np.linalg.inv(CAMERA_FROM_BASE) @ seen[[0, *range(len(seen)), -1]]
    robot_s = np.arange(frames_s[0], frames_s[-1], 1 / 125)
    poses, _ = PoseRecord(frames_s, poses, 0 * frames_s).at(robot_s, largest_gap_s=1)
    recorded = shutil.copytree(target, tmp_path / "recorded")
    write_poses(recorded, PoseRecord(robot_s, poses, np.nan * robot_s))
    write_bag(recorded, tmp_path / "press", robots, probe)

    write_bag(target.parent / "background", tmp_path / "empty", robots, probe)
    assert main(["import", "empty", "raw/toy_cow/arm_cam", "--background"]) == 0
    assert main(["import", "press", "raw/toy_cow/arm_cam/back", "--tracked", "tip_holder"]) == 0
    found = []
    for camera in ("bench_cam", "arm_cam"):
        capsys.readouterr()
        assert main(["direct", f"raw/toy_cow/{camera}/back", "--json"]) == 0
        found.append(json.loads(capsys.readouterr().out))
    for name in ("youngs_modulus_pa", "effective_reduced_modulus_pa", "poisson_ratio"):
        target, robot = (estimate[name] for estimate in found)
        assert target["low"] < robot["value"] < target["high"]
        assert robot["low"] < target["value"] < robot["high"]
