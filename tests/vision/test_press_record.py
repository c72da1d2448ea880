"""A press by the tip's path and the force's record: what is known of the synthetic capture."""

import numpy as np
import pytest
from palpate.vision.camera import camera_from_spec
from palpate.vision.clouds import Cloud, Reach, in_mask, object_cloud, probe_places
from palpate.vision.force import FORCE
from palpate.vision.indentation import capture_wrenches
from palpate.vision.options import Clouds, Force
from palpate.vision.probe import AXIS, marker_from_tip, marker_transforms
from synthetic_capture import CLOCK_S, TIME_S, TOP_M, depth_m

STEM = {"stem_m": 0.03}
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


def test_a_thin_stem_leaves_a_slope_its_surface(synthetic):
    """A slope of 30 degrees through the ball's foremost point, within 60 mm of it."""
    place = probe_places(synthetic.poses, synthetic.probe)[DEEP]
    across = np.cross(place.axis, [0.0, 0.0, 1.0])
    across /= np.linalg.norm(across)
    up = np.cross(across, place.axis)
    grid = np.stack(np.meshgrid(*[np.linspace(-0.06, 0.06, 121)] * 2), axis=-1).reshape(-1, 2)
    grid = grid[np.linalg.norm(grid, axis=1) < 0.06]
    slope = np.cos(np.pi / 6) * up - np.sin(np.pi / 6) * place.axis
    foremost = place.tip_m + synthetic.radius_m * place.axis
    points = foremost + grid @ np.stack([across, slope])
    thin = place._replace(exclusion=place.exclusion | STEM)
    cut = [one.holds(points).mean() for one in (place, thin)]
    assert cut[0] > 0.04 > 0.02 > cut[1], cut


def test_a_cloud_is_the_block_without_the_probe(synthetic, sensors):
    """The probe's own surface, 0.3 mm about ball, shaft and board, is gone; the block is there."""
    marker = marker_transforms(synthetic.poses)[DEEP]
    tip = marker @ marker_from_tip(synthetic.probe)
    rng = np.random.default_rng(5)
    ball = rng.normal(size=(2000, 3))
    ball *= synthetic.radius_m / np.linalg.norm(ball, axis=1)[:, None]
    turn = rng.uniform(0, 2 * np.pi, 4000)
    shaft = np.column_stack(
        [0.02 * np.cos(turn), 0.02 * np.sin(turn), rng.uniform(-0.2, -0.01, 4000)]
    )
    board = MIDDLE_M + rng.uniform(-1, 1, (4000, 3)) * [*HALF_M, 0]
    probe = [
        part @ pose[:3, :3].T + pose[:3, 3]
        for part, pose in ((ball, tip), (shaft, tip), (board, marker))
    ]
    block = synthetic.clouds[DEEP][0]
    points, shown = np.concatenate([block, *probe]), np.ones((480, 640), bool)
    camera = camera_from_spec(sensors["kinect"]["color"])
    cloud = object_cloud(
        Cloud(points[in_mask(points, shown, camera)]),
        probe_places(synthetic.poses, synthetic.probe)[DEEP],
        Reach(tip[:3, 3], 0.5, 0.5, synthetic.plane),
        Clouds(),
    )
    height = in_frame(synthetic.camera_from_object, cloud.points_m)[:, 2]
    assert height.max() < TOP_M + 0.001
    kept = block[~of_the_probe(block, marker, tip)]
    assert len(cloud.points_m) > 0.8 * len(kept)
