"""Force: from volts to the wrench at the frames, and what is rejected."""

import numpy as np
import pandas as pd
import pytest
from palpate.vision.force import FORCE, WRENCH, ForceRecord, zeroed
from palpate.vision.indentation import (
    check_indentation,
    depth_along,
    force_along,
    frame_wrenches,
    weight_wrenches,
)
from palpate.vision.options import Force
from palpate.vision.probe import ALONG_STD, AXIS, TIP, marker_columns
from scipy.spatial.transform import Rotation
from virtual_lab.wrench import gauge_record

LAB = {"noise_v": 0.002, "bias_v": 0.3, "mass_kg": 0.03, "centre_of_mass_m": [0, 0, 0.035]}
BIAS_WINDOW_S = 0.4
NEAREST, LINEAR = Force(matching="nearest"), Force(matching="linear")
DOWN = Rotation.from_rotvec([np.pi, 0, 0])


def recorded(time_s, force, rotation, probe, seed):
    """Gauge record of the lab."""
    return gauge_record(time_s, force, rotation, probe, LAB, np.random.default_rng(seed))


def poses_at(times, camera_from_force, probe):
    """Table of the marker's poses, of one (3, 3) or a row of them."""
    poses = np.tile(np.eye(4), (len(times), 1, 1))
    poses[:, :3, :3] = camera_from_force @ np.array(probe["marker_from_force"])[:3, :3].T
    return marker_columns(poses).assign(time_s=np.array(times, dtype=float))


@pytest.fixture
def press(probe):
    """A press that ramps up after half a second, with a tilted probe and a camera above it."""
    time_s = np.arange(2000) / 1000
    force = np.clip(time_s - 0.5, 0, 1)[:, None] * [0, 0, 2.0]
    turn = (DOWN * Rotation.from_rotvec([0.05, 0.02, 0])).as_matrix()
    return recorded(time_s, force, np.tile(turn, (len(time_s), 1, 1)), probe, 0), turn


def wrenches(press, probe, times, options=NEAREST, *, bias_window_s=BIAS_WINDOW_S):
    known = zeroed(press[0], probe, bias_window_s, 0.0)
    return frame_wrenches(known, poses_at(times, press[1], probe), probe, options)


def test_wrench_records_are_read_alike(press, probe):
    record, turn = press
    volts = record[[f"v{k}" for k in range(6)]].to_numpy()
    wrench = pd.DataFrame(volts @ np.array(probe["gauge"]["calibration"]).T, columns=WRENCH)
    wrench.insert(0, "time_s", record["time_s"])
    ours = wrenches(press, probe, [1.0, 1.8])[WRENCH]
    theirs = wrenches((wrench, turn), probe, [1.0, 1.8])[WRENCH]
    assert np.allclose(ours, theirs, atol=1e-9)


@pytest.mark.parametrize("step", [4, 10])
def test_records_of_another_rate_are_averaged_over_the_same_time(press, probe, step):
    record, turn = press
    slower = record.iloc[::step].reset_index(drop=True)
    options = Force(matching="nearest", largest_gap_s=0.006)
    found = wrenches((slower, turn), probe, [1.0, 1.8], options)[WRENCH]
    assert np.abs(found.to_numpy()[:, 2] - [-1.0, -2.0]).max() < 0.3


def test_records_that_are_rejected(press, probe):
    record, turn = press
    for channel, first, value, line in (
        ("v3", 0, 10.0, "v3: expected less than 9.99 V, found saturation"),
        ("v1", 0, 0.5, "v1: expected a live gauge, found one value for 2.0 s"),
        ("v4", 600, 0.0, "v4: expected a live gauge, found one value for 1.4 s"),
    ):
        wrong = record.copy()
        wrong.loc[first:, channel] = value
        with pytest.raises(ValueError, match=line):
            wrenches((wrong, turn), probe, [1.0])
    with pytest.raises(ValueError, match="within 0.02 s of each frame, found 8"):
        wrenches(press, probe, [1.0, 10.0])
    with pytest.raises(ValueError, match="twice as long as the bias window of 1.5 s, found 2 s"):
        wrenches(press, probe, [1.0], bias_window_s=1.5)


def test_a_line_leaves_less_noise_than_the_nearest_reading(press, probe):
    times = np.arange(0.7, 1.4, 0.01)
    expected = np.clip(times - 0.5, 0, 1) * 2.0
    errors = {
        options.matching: wrenches(press, probe, times, options)["fz_n"] + expected
        for options in (NEAREST, LINEAR)
    }
    assert errors["linear"].std() < 0.5 * errors["nearest"].std()
    assert abs(errors["linear"].mean()) < 0.01


def largest_n(table):
    return np.linalg.norm(table[FORCE], axis=1).max()


def test_the_loads_weight_is_taken_out_as_the_probe_turns(probe):
    """A probe that turns by forty degrees in the air presses nothing."""
    time_s = np.arange(2000) / 1000
    turn = Rotation.from_rotvec(np.outer(np.clip(time_s - 0.5, 0, 1) * 0.7, [1, 0.2, 0]))
    rotation = (turn * DOWN).as_matrix()
    record = recorded(time_s, np.zeros((2000, 3)), rotation, probe, 1)
    times = np.arange(0.0, 2.0, 0.2)
    given = poses_at(times, rotation[(times * 1000).astype(int)], probe), probe, LINEAR
    known, up = zeroed(record, probe, BIAS_WINDOW_S, 0.0), np.array([0.0, 0.0, 1.0])
    left_in = frame_wrenches(known, *given)
    assert largest_n(left_in) > 0.15
    assert largest_n(frame_wrenches(known, *given, up=up)) < 0.04
    without = {key: value for key, value in probe.items() if key != "load"}
    same = frame_wrenches(known, given[0], without, LINEAR, up=up)
    assert np.allclose(same[WRENCH], left_in[WRENCH])


def test_force_and_depth_are_taken_along_the_press(press, probe):
    record, _ = press
    time_s, force = force_along(zeroed(record, probe, 0.4, 0.0), probe)
    assert force == pytest.approx(2 * np.clip(time_s - 0.5, 0, 1), abs=0.15)
    poses = pd.DataFrame(np.zeros((3, 7)), columns=[*TIP, *AXIS, ALONG_STD])
    poses[AXIS[0]], poses[AXIS[1]] = [0.6, 0.6, 0.6], [0.7, 0.8, 0.9]
    poses[TIP[0]], poses[TIP[1]] = [0.0, 0.3, -0.8], [0.0, 0.4, 0.6]
    poses[ALONG_STD] = [1e-4, 3e-4, np.nan]
    depth_m, std_m = depth_along(poses)
    assert depth_m == pytest.approx([0, 0.5, 0])
    assert std_m.tolist() == [1e-4, 3e-4, 3e-4]


def test_zero_and_pose_are_of_the_same_moments(probe):
    """A probe that lay on the table as the record began, taken up before the first frame."""
    time_s = np.arange(4000) / 1000
    turn = Rotation.from_rotvec(np.outer(1.5 - 1.5 * np.clip(time_s - 0.8, 0, 1), [1, 0, 0]))
    rotation = (turn * DOWN).as_matrix()
    record = recorded(time_s, np.zeros((len(time_s), 3)), rotation, probe, 1)
    times = np.arange(2.2, 3.9, 0.2)
    given = poses_at(times, rotation[-1], probe), probe, LINEAR
    bias = (zeroed(record, probe, BIAS_WINDOW_S, first_s) for first_s in (0.0, times[0]))
    up = np.array([0.0, 0.0, 1.0])
    early, right = (largest_n(frame_wrenches(known, *given, up=up)) for known in bias)
    # What the probe's weight is wrong by with the zero of the record's beginning.
    assert early > 0.35
    assert right < 0.04


def soft_press(probe, begins_s):
    """A record of four seconds, two of them before the first frame; 1 N/s from a moment on."""
    time_s = np.arange(4000) / 1000
    force = np.clip(time_s - begins_s, 0, 1)[:, None] * [0, 0, 1.0]
    return recorded(time_s, force, np.tile(DOWN.as_matrix(), (len(time_s), 1, 1)), probe, 2)


def test_a_press_that_begins_in_the_films_first_moments(probe):
    known = zeroed(soft_press(probe, 2.1), probe, 0.5, 2.0)
    assert known.wrench[:2000, 2].mean() == pytest.approx(0, abs=0.01)
    assert known.zero_s == (1.5, 2.0)
    later = zeroed(soft_press(probe, 2.6), probe, 0.5, 2.0)
    assert later.zero_s == (2.0, 2.5)


def test_a_press_that_begins_before_the_film_is_refused(probe):
    line = "expected an unloaded probe from 2.000 to 2.500 s of the record, found its load"
    with pytest.raises(ValueError, match=f"force: {line} change by 0.25 N"):
        zeroed(soft_press(probe, 1.7), probe, 0.5, 2.0)
    with pytest.raises(ValueError, match="10 samples from 2.000 to 2.500 s of the record, found 5"):
        zeroed(soft_press(probe, 2.6).iloc[::100], probe, 0.5, 2.0)


def checked(newtons, *, lever_m=0.0, axis_z=1.0):
    force = np.outer(newtons, [0.0, 0.0, 1.0])
    torque = np.outer(newtons, [lever_m, 0.0, 0.0])
    table = pd.DataFrame(np.hstack([force, torque]), columns=WRENCH)
    check_indentation(table, np.tile([0.0, 0.0, axis_z], (len(newtons), 1)), 0.00622)


def test_wrenches_that_no_hand_has():
    checked([0.0, 499.0], lever_m=0.006)
    # Less than 0.2 N says nothing.
    checked([0.0, 0.1], lever_m=0.2, axis_z=-1.0)
    for newtons, how, line in (
        (1740.0, {}, "at most 500 N from an operator, found 1740 N"),
        (np.nan, {}, "at most 500 N from an operator, found nan N"),
        (2.0, {"axis_z": -1.0}, "the press of 2.00 N along the probe, found it 180 degrees off"),
        (2.0, {"lever_m": 0.08}, "within 11.2 mm of the sphere's centre, found .* 80.0 mm"),
    ):
        with pytest.raises(ValueError, match=line):
            checked([0.0, newtons], **how)


def test_weight_of_what_hangs_on_the_sensor():
    """Half a kilogram, 0.1 m along z from the sensor, which lies on its side: z along the floor."""
    side = np.array([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]])
    load = {"mass_kg": 0.5, "centre_of_mass_m": [0, 0, 0.1]}
    (found,) = weight_wrenches(side[None], np.array([0, 0, 1.0]), load)
    # Down is the sensor's x; what pulls x at z = 0.1 turns it about y.
    weight = 0.5 * 9.80665
    assert found == pytest.approx([weight, 0, 0, 0, 0.1 * weight, 0], rel=1e-3)


def test_the_wrench_is_taken_to_the_tip_and_turned_to_the_camera(probe):
    """The object pushes the tip by 2 N across, at its end, with 0.01 Nm about the axis."""
    time = np.arange(0, 2, 0.001)
    wrench = np.tile([2.0, 0, 0, 0, 0.06 * 2.0, 0.01], (len(time), 1))
    record = ForceRecord(time, wrench, (0.0, 0.1), tuple(WRENCH))
    pose = np.eye(4)
    pose[:3, :3] = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]]) @ (
        np.array(probe["marker_from_force"])[:3, :3].T
    )
    poses = marker_columns(np.stack([pose] * 2)).assign(time_s=[0.5, 1.0])
    table = frame_wrenches(record, poses, probe, Force(matching="linear"))
    expected = [0, -2.0, 0, 0, 0, -0.01]
    assert table[WRENCH].to_numpy() == pytest.approx(np.array([expected] * 2), abs=1e-9)
