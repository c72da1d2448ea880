"""Frames without the marker, the tip's deviations, and which of two poses stay in the running."""

from types import SimpleNamespace

import numpy as np
import pytest
from palpate.vision.marker import (
    MARGIN,
    CornerFollower,
    expected_region,
)
from palpate.vision.pose import MarkerPose
from palpate.vision.probe import _bridged, _check_gaps, _likely, _tip_std, marker_from_tip
from scipy.spatial.transform import Rotation


def seen(turn_deg, place=(0.0, 0, 0.5), error_px=0.1):
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_euler("z", turn_deg, degrees=True).as_matrix()
    pose[:3, 3] = place
    return MarkerPose(pose, np.eye(6), 12, error_px)


def test_between_two_frames_the_board_turns_and_moves_evenly():
    poses = [seen(0), None, None, seen(40, (0.04, 0, 0.6))]
    found = _bridged(np.array([0.0, 1.0, 2.0, 4.0]), poses)
    turns = Rotation.from_matrix(found[:, :3, :3]).as_euler("zyx", degrees=True)[:, 0]
    assert turns == pytest.approx([0, 10, 20, 40])
    assert found[:, 0, 3] == pytest.approx([0, 0.01, 0.02, 0.04])
    assert found[:, 2, 3] == pytest.approx([0.5, 0.525, 0.55, 0.6])


def test_gaps_that_are_refused():
    one = seen(0)
    _check_gaps([one, None, None, one, None, one], 2, 0.3)
    _check_gaps([one, one], 0, 0.3)
    with pytest.raises(
        ValueError, match="at most 2 frames at a time, found it lost in frames 3 to 5"
    ):
        _check_gaps([one, None, one, None, None, None, one], 2, 0.3)
    with pytest.raises(ValueError, match="first and last frame, found it lost in frame 0"):
        _check_gaps([None, one, None, one], 2, 0.3)
    with pytest.raises(ValueError, match="first and last frame, found it lost in frame 3"):
        _check_gaps([one, None, one, None], 2, 0.3)


def test_the_other_pose_stays_while_it_fits_about_as_well():
    first, near, far = seen(0, error_px=0.1), seen(1, error_px=0.39), seen(2, error_px=0.41)
    assert _likely([first, near, far]) == [first, near]


def test_deviations_of_the_tip(probe):
    """The board's place alone is uncertain, along x and z: so is the tip's."""
    pose = seen(0)
    covariance = np.zeros((6, 6))
    covariance[3, 3], covariance[5, 5] = 1e-8, 4e-8
    found = _tip_std(SimpleNamespace(**vars(pose) | {"covariance": covariance}), probe)
    axis = marker_from_tip(probe)[:3, 2]
    along = np.sqrt(1e-8 * axis[0] ** 2 + 4e-8 * axis[2] ** 2)
    assert found == pytest.approx([1e-4, 0, 2e-4, along])
    # Its turn about x moves the tip by the lever that it has.
    covariance = np.zeros((6, 6))
    covariance[0, 0] = 1e-6
    found = _tip_std(SimpleNamespace(**vars(pose) | {"covariance": covariance}), probe)
    lever = marker_from_tip(probe)[:3, 3]
    assert found[:3] == pytest.approx([0, 1e-3 * abs(lever[2]), 1e-3 * abs(lever[1])])
    assert np.isnan(_tip_std(None, probe)).all()


def corners_at(x, y):
    return np.stack(np.meshgrid(x + 20.0 * np.arange(4), y + 20.0 * np.arange(3)), -1).reshape(
        -1, 2
    )


def test_where_the_board_should_be_next():
    """Moving on as it did, with a margin of a part of its longer side of 60 pixels."""
    margin = MARGIN * 60
    still = expected_region(corners_at(200, 100), None, (400, 600))
    assert (still.x0, still.y0) == (int(200 - margin), int(100 - margin))
    assert (still.x1, still.y1) == (int(np.ceil(260 + margin)), int(np.ceil(140 + margin)))
    moved = expected_region(corners_at(210, 95), corners_at(200, 100), (400, 600))
    assert (moved.x0 - still.x0, moved.y1 - still.y1) == (20, -10)
    cut = expected_region(corners_at(5, 380), None, (400, 600))
    assert (cut.x0, cut.y1) == (0, 400)
    assert expected_region(corners_at(700, 100), None, (400, 600)) is None
    assert expected_region(corners_at(200, -200), None, (400, 600)) is None


def test_a_board_is_followed_until_it_is_lost():
    """After a lost frame it is looked for where it was last."""
    frames = iter([corners_at(200, 100), corners_at(210, 100), None, None, corners_at(240, 100)])
    regions = []

    def find(grey, region=None):
        regions.append(region)
        return next(frames, None)

    follow, grey = CornerFollower(SimpleNamespace(find=find)), np.zeros((400, 600), np.uint8)
    for _ in range(5):
        follow(grey)
    expected = [
        None,
        expected_region(corners_at(200, 100), None, grey.shape),
        expected_region(corners_at(210, 100), corners_at(200, 100), grey.shape),
        None,
        expected_region(corners_at(210, 100), None, grey.shape),
        expected_region(corners_at(240, 100), corners_at(210, 100), grey.shape),
        None,
    ]
    assert regions == expected
