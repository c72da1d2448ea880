"""The probe by poses of a robot or a tracker; the way through the poses that frames allow."""

import json
from dataclasses import replace
from itertools import pairwise, product

import numpy as np
import pandas as pd
import pytest
from palpate.capture.poses import PoseRecord, read_poses, write_poses
from palpate.capture.tables import read_frames, write_frames
from palpate.vision.calibrated_probe import placed_sensor
from palpate.vision.follow import followed
from palpate.vision.options import ProbePose
from palpate.vision.pose import MarkerPose, settle, smooth_tip
from palpate.vision.probe import (
    AXIS,
    RAW_TIP,
    TIP,
    TIP_STD,
    check_steepness,
    marker_from_tip,
    marker_transforms,
    pose_table,
)
from scipy.spatial.transform import Rotation

FRAMES_S, POSES_S = np.arange(20) / 15, np.arange(-10, 180) / 125
CAMERA_FROM_BASE = np.eye(4)
CAMERA_FROM_BASE[:3, :3] = Rotation.from_euler("xyz", [140, 20, 30], degrees=True).as_matrix()
CAMERA_FROM_BASE[:3, 3] = [0.1, 0.2, 0.9]
BASE = {"camera_from_base": CAMERA_FROM_BASE.tolist(), "pose_std_m": 5e-5, "pose_std_rad": 1e-3}
UP = CAMERA_FROM_BASE[:3, 2]
POINT, SUPPORT = {"position_m": [0, 0, 0]}, {"plane_normal": [0, 0, 1]}


@pytest.fixture
def tool(probe):
    """The study's probe, its target taken for a tracked frame."""
    return {key: value for key, value in probe.items() if key != "marker"} | {"tracked": "tool0"}


@pytest.fixture
def capture(tool, tmp_path):
    """A probe that goes straight down in the base frame, somewhat tilted."""
    downward = Rotation.from_rotvec([np.pi, 0, 0]) * Rotation.from_rotvec([0.1, 0.05, 0.6])
    poses = np.tile(np.eye(4), (len(POSES_S), 1, 1))
    poses[:, :3, :3] = downward.as_matrix()
    poses[:, :3, 3] = np.outer(POSES_S, [0, 0, -0.02]) + [0.5, 0, 0.3]
    poses = poses @ np.linalg.inv(marker_from_tip(tool))
    std_m = np.full(len(poses), np.nan)
    write_poses(tmp_path, PoseRecord(POSES_S, poses, std_m, "base", "tool0"))
    write_frames(tmp_path, pd.DataFrame({"frame": range(len(FRAMES_S)), "time_s": FRAMES_S}))
    return tmp_path


def table_of(folder, tool, **base):
    return followed(folder, {"sensor": "cam", "base": BASE | base}, tool, ProbePose())


def rewritten(folder, **changes):
    record = read_poses(folder)
    write_poses(folder, replace(record, **changes))
    return record


def test_a_table_is_that_of_the_same_poses_by_hand(capture, tool):
    table = table_of(capture, tool)
    poses, _ = read_poses(capture).at(FRAMES_S, largest_gap_s=0.1)
    noise = np.diag([1e-6] * 3 + [2.5e-9] * 3)
    found = [MarkerPose(CAMERA_FROM_BASE @ pose, noise) for pose in poses]
    time_s = read_frames(capture)["time_s"].to_numpy()
    by_hand = pose_table(found, time_s, tool, ProbePose(), sought="by hand: poses")
    pd.testing.assert_frame_equal(table, by_hand, check_exact=False, rtol=0, atol=1e-9)
    assert (table["detected"] == 1).all() and (table["inliers"] == 0).all()
    assert table["reprojection_error_px"].isna().all()
    fall = np.outer(FRAMES_S, [0, 0, -0.02]) + [0.5, 0, 0.3]
    expected = fall @ CAMERA_FROM_BASE[:3, :3].T + CAMERA_FROM_BASE[:3, 3]
    np.testing.assert_allclose(table[RAW_TIP], expected, atol=1e-8)
    np.testing.assert_allclose(table[TIP], expected, atol=1e-5)
    np.testing.assert_allclose(marker_transforms(table), CAMERA_FROM_BASE @ poses, atol=1e-9)


def test_what_the_tracker_says_of_its_poses_goes_before_the_sensors_file(capture, tool):
    lever_m = np.linalg.norm(marker_from_tip(tool)[:3, 3])
    stated = table_of(capture, tool, pose_std_rad=1e-9)[TIP_STD].to_numpy()
    np.testing.assert_allclose(stated, 5e-5, rtol=0.01)
    turned = table_of(capture, tool, pose_std_m=1e-9)[TIP_STD[:3]].to_numpy()
    np.testing.assert_allclose(np.linalg.norm(turned, axis=1), 2**0.5 * 1e-3 * lever_m, rtol=0.01)
    rewritten(capture, std_m=np.full(len(POSES_S), 3e-4))
    said = table_of(capture, tool, pose_std_rad=1e-9)[TIP_STD].to_numpy()
    np.testing.assert_allclose(said, 3e-4, rtol=0.01)


def test_a_short_gap_is_bridged_and_a_long_one_told(capture, tool):
    record = read_poses(capture)

    def without(start_s, end_s):
        kept = (POSES_S < start_s) | (POSES_S > end_s)
        parts = record.time_s, record.base_from_tracked, record.std_m
        write_poses(capture, PoseRecord(*(part[kept] for part in parts)))
        return table_of(capture, tool)

    table = without(0.45, 0.56)
    assert np.flatnonzero(table["detected"] == 0).tolist() == [7, 8]
    assert np.isfinite(table[[*TIP, *AXIS]].to_numpy()).all()
    with pytest.raises(ValueError, match=r"probe_poses.csv: expected to be lost for at most 2"):
        without(0.45, 0.95)
    with pytest.raises(ValueError, match="cover 0 to 1.26666667 s, found .*nothing is extrapol"):
        without(-1, 0.1)


def test_a_base_that_nobody_places(capture, tool):
    with pytest.raises(ValueError, match="base.camera_from_base: expected the hand_eye.json"):
        table_of(capture, tool, camera_from_base="calibration")


@pytest.mark.parametrize(
    ("wrong", "line"),
    [
        ("order", "found it .* quaternions with the scalar last"),
        ("inverse", "poses of the base in the tracked frame"),
        ("tool", "marker_from_force. base.camera_from_base. poses of another tool"),
    ],
)
def test_a_probe_that_does_not_press_towards_the_object(capture, tool, wrong, line):
    def check(probe=tool):
        check_steepness(table_of(capture, probe), probe, UP, POINT, SUPPORT, BASE)

    check()
    poses = read_poses(capture).base_from_tracked.copy()
    turns = Rotation.from_matrix(poses[:, :3, :3])
    if wrong == "order":
        # Columns x, y, z, w under the names of w, x, y, z.
        poses[:, :3, :3] = Rotation.from_quat(turns.as_quat(), scalar_first=True).as_matrix()
    elif wrong == "inverse":
        poses[:, :3, :3] = turns.inv().as_matrix()
    else:
        across = Rotation.from_rotvec([0, np.pi / 2, 0]).as_matrix()
        poses[:, :3, :3] = poses[:, :3, :3] @ np.array(tool["marker_from_force"])[:3, :3] @ across
    rewritten(capture, base_from_tracked=poses)
    with pytest.raises(ValueError, match=line):
        check()


def test_the_place_of_a_base_by_a_calibration(tmp_path):
    fields = {"camera_from_base": BASE["camera_from_base"], "sensor": "cam"}
    fields["covariance"] = np.diag([1e-6] * 6).tolist()
    asks = {"sensor": "cam", "base": {"camera_from_base": "calibration", "pose_std_m": 2e-4}}
    path = tmp_path / "hand_eye.json"
    path.write_text(json.dumps(fields))
    found = placed_sensor(asks, [tmp_path / "tip.json", path])["base"]
    assert found["camera_from_base"] == BASE["camera_from_base"] and found["pose_std_m"] == 2e-4
    assert found["covariance"] == fields["covariance"]
    assert placed_sensor(asks, []) is asks
    stated = {"sensor": "cam", "base": BASE}
    assert placed_sensor(stated, [path]) is stated
    for name, value, line in (
        ("sensor", "other", "sensor: expected cam, found other"),
        ("covariance", np.eye(6).tolist(), "expected deviations up to 0.1 rad or m"),
        ("camera_from_base", (2 * np.eye(4)).tolist(), "expected a rotation and a shift"),
    ):
        path.write_text(json.dumps(fields | {name: value}))
        with pytest.raises(ValueError, match=line):
            placed_sensor(asks, [path])


# A hand's turn in one frame.
TURN_DEG = 5.0


def pose_of(turn_deg, error_px, inliers=12):
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_euler("xyz", turn_deg, degrees=True).as_matrix()
    return MarkerPose(pose, np.eye(6), inliers, error_px)


@pytest.mark.parametrize("seed", range(6))
def test_no_other_way_is_cheaper(seed):
    rng = np.random.default_rng(seed)
    frames = [
        [
            pose_of(rng.normal(0, 4, 3), rng.uniform(0.1, 0.3), int(rng.integers(8, 13)))
            for _ in "ab"
        ]
        for _ in range(6)
    ]
    scale = np.median([candidates[0].reprojection_error_px for candidates in frames])

    def cost(way):
        misfit = sum(p.inliers * (p.reprojection_error_px / scale) ** 2 for p in way)
        turns = [Rotation.from_matrix(p.camera_from_marker[:3, :3]) for p in way]
        steps = [(a.inv() * b).magnitude() for a, b in pairwise(turns)]
        return misfit + (np.rad2deg(steps) ** 2).sum() / TURN_DEG**2

    best = min(product(*frames), key=cost)
    assert [*map(id, settle(frames))] == [*map(id, best)]


def test_a_turn_over_lost_frames_is_no_jump():
    """Twenty-five degrees in five frames are a hand's; in one frame the other solution is."""
    first, turned = pose_of([0, 0, 0], 0.2), pose_of([25, 0, 0], 0.2)
    other = pose_of([2, 0, 0], 0.25)
    assert settle([[first], [], [], [], [], [turned, other]])[-1] is turned
    assert settle([[first], [turned, other]])[-1] is other


def test_one_jump_costs_no_more_than_its_limit():
    """A film that goes on at the other side stays there, however far that is."""
    here = [pose_of([k, 0, 0], 0.2) for k in range(5)]
    there = [pose_of([120 + k, 0, 0], 0.2) for k in range(30)]
    frames = [[pose] for pose in here] + [[pose, pose_of([4, 0, 0], 0.5)] for pose in there]
    assert [*map(id, settle(frames))] == [*map(id, here + there)]


def test_frames_without_the_board_are_bridged():
    flat, tilted = pose_of([0, 0, 0], 0.2), pose_of([40, 0, 0], 0.19)
    frames = [[flat], [], [tilted, flat], []]
    assert settle(frames) == [flat, None, flat, None]
    assert settle([[], []]) == [None, None]


def test_smoother_is_the_likeliest_path():
    """Of all starts and accelerations, each constant between two frames, by least squares."""
    rng = np.random.default_rng(2)
    time_s, acceleration = np.cumsum(rng.uniform(0.1, 0.3, 9)), 0.4
    std, values = rng.uniform(0.01, 0.03, 9), rng.normal(0, 0.05, 9)
    values[[0, 4]] = np.nan
    # Place and speed over start, speed and eight accelerations.
    place, speed = np.zeros((2, 9, 10))
    place[0, 0] = speed[0, 1] = 1
    for k, step in enumerate(np.diff(time_s)):
        place[k + 1] = place[k] + step * speed[k]
        speed[k + 1] = speed[k]
        place[k + 1, 2 + k], speed[k + 1, 2 + k] = step**2 / 2, step
    seen = np.isfinite(values)
    scale = np.r_[1, 1, np.full(8, acceleration)]
    rows = np.concatenate([place[seen] / std[seen, None], np.diag(1 / scale)])
    wanted = np.r_[values[seen] / std[seen], values[1], np.zeros(9)]
    likeliest = place @ np.linalg.lstsq(rows, wanted, rcond=None)[0]
    tips, stds = (np.column_stack([column] * 3) for column in (values, std))
    found = smooth_tip(time_s, tips, stds, acceleration_std_m_s2=acceleration)
    assert found == pytest.approx(np.column_stack([likeliest] * 3), abs=1e-9)
