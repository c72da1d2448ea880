"""A press by the tip's path and the force's record: what is known of the synthetic capture."""

import numpy as np
import pytest
from palpate.vision.clouds import probe_places
from palpate.vision.force import FORCE
from palpate.vision.indentation import capture_wrenches
from palpate.vision.options import Force
from palpate.vision.probe import AXIS, marker_from_tip, marker_transforms
from synthetic_capture import CLOCK_S, TIME_S, depth_m

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
