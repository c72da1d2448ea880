"""Force and path of a capture: the frames, and poses from elsewhere between them."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from palpate.capture.poses import PoseRecord, read_poses, write_poses
from palpate.capture.tables import write_frames
from palpate.vision.clouds import probe_places
from palpate.vision.follow import followed
from palpate.vision.force import FORCE
from palpate.vision.indentation import capture_path, capture_wrenches
from palpate.vision.options import Force, ProbePose
from palpate.vision.probe import (
    ALONG_STD,
    AXIS,
    TIP,
    from_pictures,
    marker_from_tip,
    marker_transforms,
)
from synthetic_capture import CLOCK_S, TIME_S, depth_m

FRAMES_S, POSES_S, FORCE_S = (
    np.arange(18) / 6,
    np.arange(-10, 390) / 125,
    np.arange(-300, 1600) / 500,
)
# From 1.5 s on it presses.
DEPTH_M = 0.005 * np.clip(POSES_S - 1.5, 0, 1)
DOWN = np.diag([1.0, -1, -1])
SENSOR = {
    "base": {"camera_from_base": np.eye(4).tolist(), "pose_std_m": 1e-5, "pose_std_rad": 1e-6}
}


@pytest.fixture
def tool(probe):
    kept = {key: value for key, value in probe.items() if key not in ("marker", "load", "gauge")}
    return kept | {"tracked": "tool0"}


@pytest.fixture
def given(tool, tmp_path):
    """What `capture_path` takes: poses with a noise of 30 um along the probe, and the force."""
    tips = np.tile(np.eye(4), (len(POSES_S), 1, 1))
    tips[:, :3, :3] = DOWN
    tips[:, 2, 3] = 0.4 - DEPTH_M + np.random.default_rng(1).normal(0, 3e-5, len(POSES_S))
    poses, std_m = tips @ np.linalg.inv(marker_from_tip(tool)), np.full(len(POSES_S), np.nan)
    write_poses(tmp_path, PoseRecord(POSES_S, poses, std_m))
    write_frames(tmp_path, pd.DataFrame({"frame": range(len(FRAMES_S)), "time_s": FRAMES_S}))
    force = pd.DataFrame(
        {name: 0.0 for name in ("fx_n", "fy_n", "fz_n")}, index=range(len(FORCE_S))
    )
    force = force.assign(tx_nm=0.0, ty_nm=0.0, tz_nm=0.0)
    force.insert(0, "time_s", FORCE_S)
    noise = np.random.default_rng(2).normal(0, 0.002, len(FORCE_S))
    depth = np.interp(FORCE_S, POSES_S, DEPTH_M)
    force["fz_n"] = noise - 6000 * np.maximum(depth, 0) ** 1.5
    table = followed(tmp_path, {"sensor": "cam"} | SENSOR, tool, ProbePose())
    return tmp_path, force, table, SENSOR, tool, Force()


def test_poses_between_the_frames_have_forces_too(given):
    wrenches, path, clock = capture_path(*given, up=-DOWN[2])
    frame = path["frame"].to_numpy()
    at = np.flatnonzero(np.isfinite(frame))
    assert frame[at].tolist() == list(range(len(FRAMES_S))) and not from_pictures(path)
    assert len(path) == 2 * len(at) - 1
    np.testing.assert_allclose(np.diff(path["time_s"]), 1 / 12, atol=1e-9)
    np.testing.assert_array_equal(path[FORCE].to_numpy()[at], wrenches[FORCE])
    # All poses of a tenth of a second count.
    assert path[ALONG_STD].median() == pytest.approx(3e-5 / np.sqrt(12.5), rel=0.2)
    depth = np.interp(path["time_s"], POSES_S, DEPTH_M)
    off_m = (path[TIP[2]] - 0.4 + depth)[(depth == 0) | (depth > 3e-4)]
    assert off_m.std() == pytest.approx(3e-5 / np.sqrt(12.5), rel=0.4)
    np.testing.assert_allclose(-path["fz_n"], 6000 * depth**1.5, atol=0.05)
    # A noisy force would be a wrong depth where the contact begins.
    assert path["fz_n"][path["time_s"] < 1.4].std() < 0.002 / np.sqrt(30)
    assert abs(clock.offset_s) < 3 * clock.std_s + 0.002


def test_between_the_frames_nothing_is_interpolated_over_a_gap(given):
    folder, *others = given
    record = read_poses(folder)
    there = (record.time_s < 0.19) | (record.time_s > 0.31)
    kept = {name: getattr(record, name)[there] for name in ("time_s", "base_from_tracked", "std_m")}
    write_poses(folder, replace(record, **kept))
    _, path, _ = capture_path(folder, *others, up=-DOWN[2])
    assert len(path) == 2 * len(FRAMES_S) - 2
    assert not path["time_s"].between(0.19, 0.31).any()


DEEP = int(np.argmax(depth_m(TIME_S)))


@pytest.fixture(scope="module")
def wrenches(synthetic):
    sensor = {"clock_offset_std_s": 0.01}
    given = synthetic.record, synthetic.poses, sensor, synthetic.probe, Force()
    return capture_wrenches(*given, up=synthetic.plane[:3])


def test_the_force_is_that_of_its_frame(synthetic, wrenches):
    """The sensor's clock goes ahead by 12 ms; uncorrected, or the wrong way, it would be late."""
    table, clock = wrenches
    assert clock.offset_s == pytest.approx(CLOCK_S, abs=3 * clock.std_s)
    assert clock.std_s < 0.003
    found, truth = table[FORCE].to_numpy(), synthetic.forces_n
    rate = np.gradient(truth, TIME_S, axis=0)
    late_s = float(((truth - found) * rate).sum() / (rate**2).sum())
    assert abs(late_s) < 0.003
    along = synthetic.poses[AXIS].to_numpy()[DEEP]
    assert found[DEEP] @ along == pytest.approx(truth[DEEP] @ along, rel=0.01)
    assert truth[DEEP] @ along > 4
    held = table["force_time_s"] - table["time_s"]
    assert np.abs(held).max() <= 0.001 + 1e-9


# By hand, of the probe's file: radii of tip, shaft and board, half the board's sheet.
TIP_M, SHAFT_M, BOARD_M = 0.0085, 0.035, 0.09
MIDDLE_M, HALF_M = np.array([0.03, 0.02, 0.0]), np.array([0.0684, 0.0584])


def in_frame(camera_from_it, points):
    return (points - camera_from_it[:3, 3]) @ camera_from_it[:3, :3]


def of_the_probe(points, camera_from_marker, camera_from_tip, *, stem_m=TIP_M):
    """Near the tip, up stem and shaft, about the board, or where a look goes through its sheet."""
    x, y, z = in_frame(camera_from_tip, points).T
    found = (np.sqrt(x**2 + y**2 + z**2) < TIP_M) | ((z < -stem_m) & (np.hypot(x, y) < SHAFT_M))
    found |= (z < -TIP_M) & (np.hypot(x, y) < TIP_M)
    there, eye = in_frame(camera_from_marker, points), in_frame(camera_from_marker, np.zeros(3))
    found |= np.linalg.norm(there - MIDDLE_M, axis=1) < BOARD_M
    part = eye[2] / (eye[2] - there[:, 2])
    met = eye + part[:, None] * (there - eye) - MIDDLE_M
    return found | ((np.abs(met[:, :2]) < HALF_M).all(axis=1) & (part > 0))


@pytest.mark.parametrize("stem_m", [TIP_M, 0.03])
def test_what_is_cut_away_is_the_probe(synthetic, stem_m):
    """Of points all around it, and of the block's own."""
    marker = marker_transforms(synthetic.poses)[DEEP]
    tip = marker @ marker_from_tip(synthetic.probe)
    place = probe_places(synthetic.poses, synthetic.probe)[DEEP]
    around = tip[:3, 3] + np.random.default_rng(3).uniform(-0.2, 0.2, (20000, 3))
    near = tip[:3, 3] + np.random.default_rng(4).uniform(-0.012, 0.012, (4000, 3))
    points = np.concatenate([around, near, synthetic.clouds[DEEP][0]])
    stem = {} if stem_m == TIP_M else {"stem_m": stem_m}
    found = place._replace(exclusion=place.exclusion | stem).holds(points)
    truth = of_the_probe(points, marker, tip, stem_m=stem_m)
    assert 0.1 < truth.mean() < 0.5
    # The sheet's outline is known to a tenth of a millimetre by hand.
    assert (found != truth).mean() < 5e-4
    block = truth[-len(synthetic.clouds[DEEP][0]) :]
    assert 0 < block.sum() < 0.3 * len(block)
