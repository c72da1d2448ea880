"""What a calibration's views tell, and where to hold the board next."""

import numpy as np
import pytest
from boards_seen import BOARD, LEFT, RIGHT, RIGHT_FROM_LEFT, SIZE_PX, poses, seen
from palpate.vision.board import Board
from palpate.vision.calibration import calibrate_camera
from palpate.vision.calibration_verdict import camera_verdict, pair_verdict
from palpate.vision.next_view import next_view
from palpate.vision.pair_calibration import calibrate_pair
from scipy.spatial.transform import Rotation


def leaning(degrees, count=12, shift=(0.0, 0.0), spread_m=0.03):
    """Boards near the middle that lean by so much, to all sides."""
    views = poses(count)
    for k, pose in enumerate(views.values()):
        way = 2 * np.pi * k / count
        turn = np.deg2rad(degrees) * np.array([np.cos(way), np.sin(way), 0])
        pose[:3, :3] = Rotation.from_rotvec(turn).as_matrix()
        pose[:3, 3] = [shift[0] - 0.1, shift[1] - 0.08, 0.7 + 0.2 * np.sin(3 * way)]
        pose[:2, 3] += spread_m * np.array([np.cos(2 * way), np.sin(2 * way)])
    return views


def test_good_views_tell_all():
    views = poses(40, far_m=(0.3, 0.6))
    corners = seen(BOARD, views, RIGHT)
    verdict = camera_verdict(calibrate_camera(corners, BOARD, SIZE_PX), BOARD)
    assert verdict.all_told
    assert len(verdict.lines) == 3


def test_boards_in_the_middle_do_not_tell_the_distortion():
    found = calibrate_camera(seen(BOARD, leaning(30), RIGHT), BOARD, SIZE_PX)
    verdict = camera_verdict(found, BOARD)
    assert verdict.told == {"focal length": True, "principal point": True, "distortion": False}
    assert "corner" in next_view(found, BOARD)


def test_boards_that_hardly_lean_do_not_tell_the_focal_length():
    found = calibrate_camera(seen(BOARD, leaning(6), RIGHT, noise_px=0.1), BOARD, SIZE_PX)
    verdict = camera_verdict(found, BOARD)
    assert not verdict.told["focal length"]
    assert "no board leans by more than 6 degrees" in verdict.lines[-1]
    assert "30 degrees nearer" in next_view(found, BOARD)


def test_bad_corners_at_the_boards_edge():
    board = Board(9, 6, 0.025)
    corners = seen(board, poses(20), LEFT)
    edge = np.ones((6, 9), dtype=bool)
    edge[1:-1, 1:-1] = False
    rng = np.random.default_rng(3)
    for found in corners.values():
        found[edge.ravel()] += rng.normal(0, 0.06, (edge.sum(), 2))
    verdict = camera_verdict(calibrate_camera(corners, board, SIZE_PX), board)
    assert "corners at the board's edge are off by" in verdict.lines[-1]


@pytest.mark.parametrize(("noise_px", "told"), [(0.02, True), (1.5, False)])
def test_whether_the_transform_is_told(noise_px, told):
    views = poses(10)
    sides = [
        seen(BOARD, views, LEFT, noise_px=noise_px),
        seen(BOARD, views, RIGHT, RIGHT_FROM_LEFT, noise_px=noise_px, seed=2),
    ]
    pair = calibrate_pair(*sides, BOARD, (SIZE_PX, SIZE_PX))
    assert pair_verdict(pair).all_told == told
    assert "the translation's standard error" in next_view(pair, BOARD)


def test_the_view_that_is_asked_for_does_what_was_promised():
    """Among many random views none does more, and a leaning one is asked for."""
    views = leaning(15)
    found = calibrate_camera(seen(BOARD, views, RIGHT, noise_px=0.05), BOARD, SIZE_PX)
    promised = float(next_view(found, BOARD).split(" to ")[-1].split()[0])
    before = found.standard_errors["fx_px"]
    others = poses(5, seed=9)
    more = {f"more {name}": pose for name, pose in others.items()}
    after = [
        calibrate_camera(
            seen(BOARD, views | {name: pose}, RIGHT, noise_px=0.05), BOARD, SIZE_PX
        ).standard_errors["fx_px"]
        for name, pose in more.items()
    ]
    assert promised < min(before, 1.05 * min(after))
