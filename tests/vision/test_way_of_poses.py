"""The cheapest way through the two poses that each frame of a board allows."""

from itertools import pairwise, product

import numpy as np
import pytest
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
