"""Force: from volts to the wrench at the frames, and what is refused."""

import numpy as np
import pandas as pd
import pytest
from palpate.lab.wrench import gauge_record
from palpate.vision.force import WRENCH, block_mean, frame_wrenches, match_nearest
from scipy.spatial.transform import Rotation

LAB = {
    "noise_v": 0.002,
    "bias_v": 0.3,
    "mass_kg": 0.03,
    "centre_of_mass_m": [0, 0, 0.035],
}
OPTIONS = {"bias_window_s": 0.4, "largest_gap_s": 0.02}


@pytest.fixture
def press(probe):
    """A press that ramps up after half a second, with a tilted probe and a camera above it."""
    time_s = np.arange(2000) / 1000
    force = np.clip(time_s - 0.5, 0, 1) * 2.0
    down = Rotation.from_rotvec([np.pi, 0, 0]) * Rotation.from_rotvec([0.05, 0.02, 0])
    rotation = np.tile(down.as_matrix(), (len(time_s), 1, 1))
    record = gauge_record(time_s, force, rotation, probe, LAB, np.random.default_rng(0))
    marker = np.eye(4)
    marker[:3, :3] = rotation[0] @ np.array(probe["marker_from_force"])[:3, :3].T
    return record, marker


def wrenches(press, probe, times, **options):
    record, marker = press
    poses = np.tile(marker, (len(times), 1, 1))
    return frame_wrenches(record, np.array(times), poses, probe, **(OPTIONS | options))


def test_force_on_the_object_in_the_cameras_frame(press, probe):
    table = wrenches(press, probe, [0.2, 1.0, 1.8])
    found = table[WRENCH].to_numpy()
    expected = np.array([[0, 0, 0], [0, 0, -1.0], [0, 0, -2.0]])
    assert np.abs(found[:, :3] - expected).max() < 0.12
    assert np.abs(found[:, 3:]).max() < 4e-3


def test_wrench_records_are_read_alike(press, probe):
    record, marker = press
    volts = record[[f"v{k}" for k in range(6)]].to_numpy()
    wrench = pd.DataFrame(volts @ np.array(probe["gauge"]["calibration"]).T, columns=WRENCH)
    wrench.insert(0, "time_s", record["time_s"])
    ours = wrenches(press, probe, [1.0, 1.8])[WRENCH]
    theirs = wrenches((wrench, marker), probe, [1.0, 1.8])[WRENCH]
    assert np.allclose(ours, theirs, atol=1e-9)


@pytest.mark.parametrize("step", [4, 10])
def test_records_of_another_rate_are_averaged_over_the_same_time(press, probe, step):
    record, marker = press
    slower = record.iloc[::step].reset_index(drop=True)
    found = wrenches((slower, marker), probe, [1.0, 1.8], largest_gap_s=0.006)[WRENCH]
    assert np.abs(found.to_numpy()[:, 2] - [-1.0, -2.0]).max() < 0.3


def test_block_mean_and_nearest():
    assert block_mean(np.arange(25.0), 10).tolist() == [4.5, 14.5]
    nearest, gap = match_nearest(
        np.array([0.1, 0.26]), np.array([0.0, 0.1, 0.2, 0.3]), largest_gap_s=0.1
    )
    assert nearest.tolist() == [1, 3]
    assert gap == pytest.approx([0, 0.04])


def test_bad_records_are_refused(press, probe):
    record, marker = press
    with pytest.raises(ValueError, match="within 0.02 s of each frame, found 8"):
        wrenches(press, probe, [1.0, 10.0])
    saturated = record.assign(v3=10.0)
    with pytest.raises(ValueError, match="v3: expected less than 9.99 V, found saturation"):
        wrenches((saturated, marker), probe, [1.0])
    dead = record.assign(v1=0.5)
    with pytest.raises(ValueError, match="v1: expected a live gauge, found 0.5 V"):
        wrenches((dead, marker), probe, [1.0])
