"""Force: from volts to the wrench at the frames, and what is refused."""

import numpy as np
import pandas as pd
import pytest
from palpate.vision.force import (
    WRENCH,
    block_mean,
    check_direction,
    check_lever,
    frame_wrenches,
    local_lines,
    match_nearest,
    zeroed,
)
from palpate.vision.indentation import depth_along, force_along
from palpate.vision.probe import ALONG_STD, AXIS, TIP
from scipy.spatial.transform import Rotation
from virtual_lab.wrench import gauge_record

LAB = {
    "noise_v": 0.002,
    "bias_v": 0.3,
    "mass_kg": 0.03,
    "centre_of_mass_m": [0, 0, 0.035],
}
BIAS_WINDOW_S = 0.4
OPTIONS = {
    "up": None,
    "matching": "nearest",
    "linear_window_s": 0.1,
    "largest_gap_s": 0.02,
}


@pytest.fixture
def press(probe):
    """A press that ramps up after half a second, with a tilted probe and a camera above it."""
    time_s = np.arange(2000) / 1000
    force = np.clip(time_s - 0.5, 0, 1)[:, None] * [0, 0, 2.0]
    down = Rotation.from_rotvec([np.pi, 0, 0]) * Rotation.from_rotvec([0.05, 0.02, 0])
    rotation = np.tile(down.as_matrix(), (len(time_s), 1, 1))
    record = gauge_record(time_s, force, rotation, probe, LAB, np.random.default_rng(0))
    marker = np.eye(4)
    marker[:3, :3] = rotation[0] @ np.array(probe["marker_from_force"])[:3, :3].T
    return record, marker


def wrenches(press, probe, times, *, bias_window_s=BIAS_WINDOW_S, **options):
    record, marker = press
    poses = np.tile(marker, (len(times), 1, 1))
    known = zeroed(record, probe, bias_window_s, 0.0)
    return frame_wrenches(known, np.array(times), poses, probe, **(OPTIONS | options))


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
    with pytest.raises(ValueError, match="v1: expected a live gauge, found one value for 2.0 s"):
        wrenches((dead, marker), probe, [1.0])
    unplugged = record.copy()
    unplugged.loc[600:, "v4"] = 0.0
    with pytest.raises(ValueError, match="v4: expected a live gauge, found one value for 1.4 s"):
        wrenches((unplugged, marker), probe, [1.0])
    with pytest.raises(ValueError, match="matching: expected nearest or linear, found best"):
        wrenches(press, probe, [1.0], matching="best")


def test_a_line_leaves_less_noise_than_the_nearest_reading(press, probe):
    times = np.arange(0.7, 1.4, 0.01)
    expected = np.clip(times - 0.5, 0, 1) * 2.0
    errors = {
        matching: wrenches(press, probe, times, matching=matching)["fz_n"] + expected
        for matching in ("nearest", "linear")
    }
    assert errors["linear"].std() < 0.5 * errors["nearest"].std()
    assert abs(errors["linear"].mean()) < 0.01


def test_local_lines_are_exact_on_lines():
    time_s = np.arange(100) / 100
    values = np.column_stack([2 * time_s, 1 - time_s])
    found = local_lines(np.array([0.0, 0.333, 0.99]), time_s, values, window_s=0.1)
    assert found == pytest.approx(np.array([[0, 1], [0.666, 0.667], [1.98, 0.01]]))


def test_local_lines_are_of_the_samples_around_a_time():
    """Of a kinked record: level before half a second, rising after; two samples at least."""
    time_s = np.arange(101) / 100
    values = np.maximum(time_s - 0.5, 0)[:, None]
    values[0] = -1.0
    at = np.array([0.0, 0.25, 0.44, 0.56, 1.0])
    found = local_lines(at, time_s, values, window_s=0.1)
    assert found[1:, 0] == pytest.approx([0, 0, 0.06, 0.5])
    # Of five samples, -1 and four times 0: mean -0.2, slope 0.2 a sample.
    assert found[0, 0] == pytest.approx(-0.6)
    few = local_lines(np.array([0.0, 0.999]), time_s, values, window_s=0.004)
    assert few[:, 0] == pytest.approx([-1.0, 0.499])


def test_the_loads_weight_is_taken_out_as_the_probe_turns(probe):
    """A probe that turns by forty degrees in the air presses nothing."""
    time_s = np.arange(2000) / 1000
    turn = Rotation.from_rotvec(np.outer(np.clip(time_s - 0.5, 0, 1) * 0.7, [1, 0.2, 0]))
    rotation = (turn * Rotation.from_rotvec([np.pi, 0, 0])).as_matrix()
    record = gauge_record(
        time_s, np.zeros((2000, 3)), rotation, probe, LAB, np.random.default_rng(1)
    )
    times = np.arange(0.0, 2.0, 0.2)
    poses = np.tile(np.eye(4), (len(times), 1, 1))
    from_marker = np.array(probe["marker_from_force"])[:3, :3].T
    poses[:, :3, :3] = rotation[(times * 1000).astype(int)] @ from_marker
    options = OPTIONS | {"matching": "linear"}
    up = np.array([0.0, 0.0, 1.0])
    known = zeroed(record, probe, BIAS_WINDOW_S, 0.0)
    left_in = frame_wrenches(known, times, poses, probe, **options)
    taken_out = frame_wrenches(known, times, poses, probe, **(options | {"up": up}))
    size = [np.linalg.norm(t[["fx_n", "fy_n", "fz_n"]], axis=1).max() for t in (left_in, taken_out)]
    assert size[0] > 0.15
    assert size[1] < 0.04
    without = {key: value for key, value in probe.items() if key != "load"}
    same = frame_wrenches(known, times, poses, without, **(options | {"up": up}))
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
    rotation = (turn * Rotation.from_rotvec([np.pi, 0, 0])).as_matrix()
    still = np.zeros((len(time_s), 3))
    record = gauge_record(time_s, still, rotation, probe, LAB, np.random.default_rng(1))
    times = np.arange(2.2, 3.9, 0.2)
    poses = np.tile(np.eye(4), (len(times), 1, 1))
    poses[:, :3, :3] = rotation[-1] @ np.array(probe["marker_from_force"])[:3, :3].T
    options = OPTIONS | {"matching": "linear", "up": np.array([0.0, 0.0, 1.0])}
    largest = {}
    for first_s in (times[0], 0.0):
        known = zeroed(record, probe, BIAS_WINDOW_S, first_s)
        found = frame_wrenches(known, times, poses, probe, **options)
        largest[first_s] = np.linalg.norm(found[WRENCH[:3]], axis=1).max()
    # What the probe's weight is wrong by with the zero of the record's beginning.
    assert largest[0.0] > 0.35
    assert largest[times[0]] < 0.04


def soft_press(probe, begins_s):
    """A record of four seconds, two of them before the first frame; 1 N/s from a moment on."""
    time_s = np.arange(4000) / 1000
    force = np.clip(time_s - begins_s, 0, 1)[:, None] * [0, 0, 1.0]
    down = np.tile(Rotation.from_rotvec([np.pi, 0, 0]).as_matrix(), (len(time_s), 1, 1))
    return gauge_record(time_s, force, down, probe, LAB, np.random.default_rng(2))


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


def test_a_press_that_does_not_push_along_the_probe(press, probe):
    table = wrenches(press, probe, [0.2, 1.0, 1.8])
    axis = np.tile([0.0, 0.0, -1.0], (3, 1))
    check_direction(table, axis)
    with pytest.raises(ValueError, match="along the probe, found it 1[78]. degrees off"):
        check_direction(table, -axis)
    check_direction(wrenches(press, probe, [0.1, 0.2]), -axis[:2])


def test_a_bias_window_as_long_as_the_record(press, probe):
    with pytest.raises(ValueError, match="twice as long as the bias window of 1.5 s, found 2 s"):
        wrenches(press, probe, [1.0], bias_window_s=1.5)


def pressed(newtons, lever_m=0.0):
    force = np.outer(newtons, [0.0, 0.0, 1.0])
    torque = np.outer(newtons, [lever_m, 0.0, 0.0])
    return pd.DataFrame(np.hstack([force, torque]), columns=WRENCH)


def test_a_force_that_no_hand_has():
    axis = np.tile([0.0, 0.0, 1.0], (2, 1))
    check_direction(pressed([0.0, 499.0]), axis)
    for newtons in (1740.0, np.nan):
        with pytest.raises(ValueError, match="at most 500 N from a hand, found (1740|nan) N"):
            check_direction(pressed([0.0, newtons]), axis)


def test_a_force_that_passes_beside_the_sphere():
    check_lever(pressed([0.0, 2.0], lever_m=0.006), 0.00622)
    check_lever(pressed([0.0, 0.1], lever_m=0.2), 0.00622)
    with pytest.raises(ValueError, match="within 11.2 mm of the sphere's centre, found .* 80.0 mm"):
        check_lever(pressed([0.0, 2.0], lever_m=0.08), 0.00622)
