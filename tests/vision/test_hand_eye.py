"""The camera in a base frame, and a probe's parts, by the poses of a robot or a tracker."""

import json

import numpy as np
import pandas as pd
import pytest
import yaml
from boards import noisy, picture
from palpate.__main__ import main
from palpate.capture.experiments import check_experiment
from palpate.capture.images import write_image
from palpate.capture.poses import PoseRecord, write_poses
from palpate.capture.tables import WRENCH_COLUMNS, write_force, write_frames
from palpate.vision.board import Board
from palpate.vision.board_pictures import Views
from palpate.vision.calibration_problem import matrix_of
from palpate.vision.camera import PinholeCamera, camera_block
from palpate.vision.hand_eye import find_hand_eye
from palpate.vision.indentation import weight_wrenches
from probe_motion import TIP_M, held_free, turned_handle
from scipy import stats
from scipy.spatial.transform import Rotation

BOARD, CAMERA = Board(5, 4, 0.02), PinholeCamera(480, 360, 450.0, 450.0, 240.0, 180.0)
CAMERA_FROM_BASE = matrix_of(np.array([2.0, 0.3, -0.4, 0.1, 0.2, 0.9]))
TRACKED_FROM_TARGET = matrix_of(np.array([0.2, -0.1, 1.2, 0.03, -0.05, 0.08]))
STD = np.repeat([5e-4, 1e-4], 3)  # of a pose [rad, m]
CLOCK_STD_S = 0.05


def stepped(poses, steps):
    """Poses after rotation vectors and shifts (n, 6) in the frame that they are in."""
    found = poses.copy()
    found[:, :3, :3] = Rotation.from_rotvec(steps[:, :3]).as_matrix() @ poses[:, :3, :3]
    found[:, :3, 3] += steps[:, 3:]
    return found


def scene(seed, count=12, *, tilts=(1, 1, 1), late_s=0.0, speed=0.0):
    """Corners with noise of 0.1 px of a target that tilts, and poses with theirs."""
    rng = np.random.default_rng(seed)
    place = rng.uniform([-0.1, -0.1, 0.5], [0.05, 0.05, 0.65], (count, 3))
    turn = Rotation.from_rotvec(rng.uniform(-0.5, 0.5, (count, 3)) * tilts)
    seen = np.tile(np.eye(4), (count, 1, 1))
    seen[:, :3, :3] = (Rotation.from_rotvec([0.3, 0.2, 0]) * turn).as_matrix()
    seen[:, :3, 3] = place
    tracked = np.linalg.inv(CAMERA_FROM_BASE) @ seen @ np.linalg.inv(TRACKED_FROM_TARGET)
    speeds = rng.normal(0, speed, (count, 6)) * np.repeat([5, 1], 3)
    errors = rng.normal(0, STD, (count, 6)) - late_s * speeds
    corners = [CAMERA.project(BOARD.points_m @ p[:3, :3].T + p[:3, 3]) for p in seen]
    corners += rng.normal(0, 0.1, (count, len(BOARD.points_m), 2))
    start = stepped(seen, rng.normal(0, 1e-3, (count, 6)))
    names, std = np.array([f"pose {k}" for k in range(count)]), np.tile(STD, (count, 1))
    return Views(names, corners, start, stepped(tracked, errors), std, speeds)


def found(views):
    return find_hand_eye(views, BOARD, CAMERA, clock_std_s=CLOCK_STD_S)


def off(one):
    turn = CAMERA_FROM_BASE[:3, :3] @ one.camera_from_base[:3, :3].T
    shift = CAMERA_FROM_BASE[:3, 3] - one.camera_from_base[:3, 3]
    return np.append(Rotation.from_matrix(turn).as_rotvec(), shift)


def test_the_camera_and_its_covariance():
    draws = [found(scene(seed)) for seed in range(60)]
    for one in draws[:20]:
        assert (np.abs(off(one)) < 4 * np.sqrt(np.diag(one.covariance))).all()
        assert one.verdict.startswith("camera: determined") and not one.warnings
    squares = sum(off(one) @ np.linalg.solve(one.covariance, off(one)) for one in draws)
    low, high = stats.chi2.ppf([0.005, 0.995], 6 * len(draws))
    assert low < squares < high


def test_poses_that_come_late_while_the_target_moves():
    one = found(scene(1, 40, late_s=0.02, speed=0.02))
    assert one.clock_offset_std_s < 0.004
    assert one.clock_offset_s == pytest.approx(0.02, abs=4 * one.clock_offset_std_s)
    assert (np.abs(off(one)) < 4 * np.sqrt(np.diag(one.covariance))).all()


def test_turns_about_one_axis_do_not_determine_the_shift_along_it():
    along = CAMERA_FROM_BASE[:3, :3].T @ Rotation.from_rotvec([0.3, 0.2, 0]).apply([0, 0, 1])
    along *= np.sign(along[np.abs(along).argmax()])
    place = ", ".join(f"{value:.2f}" for value in along)
    with pytest.raises(ValueError, match=rf"along \({place}\) of the base is not determined"):
        found(scene(2, tilts=(0, 0, 1)))
    with pytest.raises(ValueError, match="expected the target to turn by 2 degrees or more"):
        found(scene(2, tilts=(0, 0, 0)))


def test_turns_of_few_degrees_about_the_second_axis():
    one = found(scene(6, 24, tilts=(0.15, 0.15, 1)))
    assert (np.abs(off(one)) < 4 * np.sqrt(np.diag(one.covariance))).all()


def test_a_pose_that_is_off_and_poses_that_are_worse_than_stated():
    views = scene(4)
    views.base_from_tracked[7, 0, 3] += 0.005
    one = found(views)
    assert list(one.left_out_m) == ["pose 7"]
    assert one.left_out_m["pose 7"] == pytest.approx(0.005, abs=0.001)
    views = scene(4)
    views.std[:] /= 5
    assert "times what is stated" in found(views).warnings[0]
    views.base_from_tracked[:6, 1, 3] += 0.2
    with pytest.raises(ValueError, match="expected camera and target at rest in their frames"):
        found(views)
    assert "5 poses count: 12 or more show whether one is off" in found(scene(3, 5)).warnings
    with pytest.raises(ValueError, match="expected at least 3 with the target, found 2"):
        found(scene(3, 2))


def test_a_recording(tmp_path, capfd, stage, sensors):
    """Six pictures of a target, two of each pose, and a record that begins before them."""
    folder, rng, views = tmp_path / "hand_eye", np.random.default_rng(0), scene(5, 6)
    (folder / "color").mkdir(parents=True)
    names, time_s = [f"color/{k:06d}.png" for k in range(12)], 100 + np.arange(12) * 0.5
    shown = CAMERA_FROM_BASE @ views.base_from_tracked @ TRACKED_FROM_TARGET
    for name, pose in zip(names, np.repeat(shown, 2, axis=0), strict=True):
        image = noisy(picture(BOARD, pose, CAMERA), rng)
        write_image(folder / name, np.repeat(image[..., None], 3, axis=2), "rgb8")
    write_frames(folder, pd.DataFrame({"frame": range(12), "time_s": time_s, "color": names}))
    tracked = np.repeat(views.base_from_tracked, 2, axis=0)
    write_poses(folder, PoseRecord(time_s, tracked, np.full(12, 1e-4)))
    target = {"marker": {"inner_corners": [5, 4], "square_m": 0.02}}
    (folder / "target.yaml").write_text(yaml.safe_dump(target))
    color = camera_block(CAMERA, "rgb8")
    sensor = sensors["kinect"] | {"kind": "depth", "color": color, "optics": "stated"}
    sensor["depth"] = color | {"encoding": "millimetre", "color_from_depth": np.eye(4).tolist()}
    file, out = tmp_path / "arm.yaml", tmp_path / "by_command.json"
    file.write_text(yaml.safe_dump(sensor | {"sensor": "arm"}))
    assert not check_experiment(folder, sensor)
    given = ("hand-eye", folder, "--sensor", file, "--output", out)
    assert main(["calibrate", *map(str, given)]) == 0, capfd.readouterr().err
    assert "6 poses, 6 count" in capfd.readouterr().out
    one = json.loads(out.read_text())
    away = np.array(one["camera_from_base"]) - CAMERA_FROM_BASE
    assert one["poses"] == 6 and np.abs(away[:3, 3]).max() < 0.004
    files = {"inputs": {"recording": folder}, "outputs": {"hand_eye": "hand_eye.json"}}
    assert stage("hand_eye", **files, params={"sensor": sensor | {"sensor": "arm"}}) is None
    assert json.loads((tmp_path / "hand_eye.json").read_text()) == one


@pytest.fixture
def calibrated(root, probe, tmp_path, capsys):
    """Calibrate a part by poses and forces of a tracked probe without a target."""

    def run(part, time_s, poses, forces_s=(), wrench=None):
        folder, file, out = tmp_path / part, tmp_path / "probe.yaml", tmp_path / f"{part}.json"
        folder.mkdir()
        record = PoseRecord(time_s, poses, np.full(len(time_s), np.nan), tracked="tool0")
        write_poses(folder, record)
        if wrench is not None:
            table = pd.DataFrame(wrench, columns=list(WRENCH_COLUMNS))
            write_force(folder, table.assign(time_s=forces_s))
        known = {k: probe[k] for k in ("probe", "marker_from_force", "force_from_tip")}
        file.write_text(yaml.safe_dump(known | {"tracked": "tool0"}))
        given = ["calibrate", part, folder, "--board", file, "--output", out]
        assert main(list(map(str, given))) == 0, capsys.readouterr().err
        return json.loads(out.read_text())

    return run


def test_a_tip_by_poses_in_a_base_frame(calibrated):
    one = calibrated("tip", np.arange(200) / 25, turned_handle())
    assert one["tip_m"] == pytest.approx(TIP_M, abs=3e-4)


def test_a_payload_by_gravity_along_the_base(calibrated, probe):
    load = {"mass_kg": 0.3, "centre_of_mass_m": [0.0, 0.001, 0.04]}
    time_s, forces_s, rng = np.arange(0, 24, 0.05), np.arange(0, 24, 0.01), np.random.default_rng(6)
    poses, turn = held_free(), np.array(probe["marker_from_force"])[:3, :3]
    wrench = weight_wrenches(poses[:, :3, :3] @ turn, np.array([0, 0, 1.0]), load)
    wrench = np.repeat(wrench, 200, axis=0) + rng.normal(0, np.repeat([1e-2, 1e-4], 3), (2400, 6))
    one = calibrated("load", time_s, np.repeat(poses, 40, axis=0), forces_s, wrench)
    assert one["mass_kg"] == pytest.approx(0.3, abs=1e-3)
    assert np.array(one["marker_from_force_rotation"]) == pytest.approx(turn, abs=0.01)


def test_the_compliance_of_an_arm(calibrated, probe):
    time_s, forces_s = np.arange(0, 11, 0.01), np.arange(-0.1, 11.1, 0.005)
    force_n = 10 * np.clip(np.sin(2 * np.pi * (forces_s - 1) / 10), 0, None) * (forces_s > 1)
    wrench, poses = np.zeros((len(forces_s), 6)), np.tile(np.eye(4), (len(time_s), 1, 1))
    wrench[:, 2] = -force_n + np.random.default_rng(7).normal(0, 0.01, len(forces_s))
    axis = (np.array(probe["marker_from_force"]) @ np.array(probe["force_from_tip"]))[:3, 2]
    poses[:, :3, 3] = np.interp(time_s, forces_s, force_n)[:, None] * axis / 2e4
    one = calibrated("stiffness", time_s, poses, forces_s, wrench)
    assert one["stiffness_n_m"] == pytest.approx(2e4, rel=0.02)
