"""The cheapest way through the poses that frames allow, and the tip's filter and smoother."""

from itertools import pairwise, product

import numpy as np
import pytest
from palpate.vision.kalman import smooth_tip, study_filter
from palpate.vision.pose import MarkerPose, settle
from scipy.spatial.transform import Rotation

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


def test_study_filter_by_hand():
    # P0 = 0 gives gain 0, then P = 1 gives 1/11, then P = 10/11 + 1 gives 21/131.
    found = study_filter(np.array([[1.0], [2.0], [2.0], [3.0]])).ravel()
    second = 1 + 1 / 11
    assert found == pytest.approx([1, 1, second, second + 21 / 131 * (3 - second)])


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
