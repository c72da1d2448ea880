"""The path that the estimate compares: the frames, and poses from elsewhere between them."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from palpate.capture.poses import PoseRecord, read_poses, write_poses
from palpate.capture.tables import write_frames
from palpate.vision.follow import followed
from palpate.vision.force import FORCE
from palpate.vision.indentation import capture_path, capture_wrenches
from palpate.vision.options import Force, ProbePose
from palpate.vision.probe import ALONG_STD, TIP, from_pictures, marker_from_tip

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


def test_of_pictures_the_path_is_the_frames(given):
    folder, *others = given
    (folder / "probe_poses.csv").unlink()
    wrenches, path, clock = capture_path(folder, *others, up=-DOWN[2])
    expected, same = capture_wrenches(*others, up=-DOWN[2])
    pd.testing.assert_frame_equal(wrenches, expected)
    assert clock == same
    np.testing.assert_array_equal(path[TIP], others[1][TIP])
