"""What a calibration's views determine."""

import numpy as np
import pytest
from boards_seen import BOARD, LEFT, RIGHT, RIGHT_FROM_LEFT, SIZE_PX, poses, seen
from palpate.vision.board import Board
from palpate.vision.calibration import calibrate_camera
from palpate.vision.calibration_report import camera_verdict, pair_verdict
from palpate.vision.pair_calibration import calibrate_pair
from scipy.spatial.transform import Rotation


def tilted(degrees, count=12):
    """Boards near the middle that are tilted by so much, to all sides."""
    views = poses(count)
    for k, pose in enumerate(views.values()):
        way = 2 * np.pi * k / count
        turn = np.deg2rad(degrees) * np.array([np.cos(way), np.sin(way), 0])
        pose[:3, :3] = Rotation.from_rotvec(turn).as_matrix()
        pose[:3, 3] = -0.1, -0.08, 0.7 + 0.2 * np.sin(3 * way)
        pose[:2, 3] += 0.03 * np.array([np.cos(2 * way), np.sin(2 * way)])
    return views


def calibrated(views, noise_px=0.02):
    return calibrate_camera(seen(BOARD, views, RIGHT, noise_px=noise_px), BOARD, SIZE_PX)


def test_good_views_determine_all():
    verdict = camera_verdict(calibrated(poses(40, far_m=(0.3, 0.6))))
    assert all(verdict.determined.values())
    assert len(verdict.lines) == 3


def test_boards_in_the_middle_do_not_determine_the_distortion():
    found = calibrated(tilted(30))
    determined = {"focal length": True, "principal point": True, "distortion": False}
    verdict = camera_verdict(found)
    assert verdict.determined == determined
    (line,) = [one for one in verdict.lines if "not determined" in one]
    assert line.startswith("distortion: ") and line.endswith(": views in the picture's corners")


def test_boards_that_are_hardly_tilted_do_not_determine_the_focal_length():
    found = calibrated(tilted(6), noise_px=0.1)
    verdict = camera_verdict(found)
    assert not verdict.determined["focal length"]
    assert verdict.lines[0].endswith("tilted by 30 degrees to all sides")
    assert "no target tilts by more than 6 degrees" in verdict.lines[-1]


def test_bad_corners_at_the_boards_edge():
    board = Board(9, 6, 0.025)
    corners = seen(board, poses(20), LEFT)
    edge = np.ones((6, 9), dtype=bool)
    edge[1:-1, 1:-1] = False
    rng = np.random.default_rng(3)
    for found in corners.values():
        found[edge.ravel()] += rng.normal(0, 0.06, (edge.sum(), 2))
    verdict = camera_verdict(calibrate_camera(corners, board, SIZE_PX))
    assert "corners at the board's edge are off by" in verdict.lines[-1]


@pytest.mark.parametrize(("noise_px", "determined"), [(0.02, True), (1.5, False)])
def test_whether_the_transform_is_determined(noise_px, determined):
    first = seen(BOARD, poses(10), LEFT, noise_px=noise_px)
    second = seen(BOARD, poses(10), RIGHT, RIGHT_FROM_LEFT, noise_px=noise_px, seed=2)
    pair = calibrate_pair(first, second, BOARD, (SIZE_PX, SIZE_PX))
    assert all(pair_verdict(pair).determined.values()) == determined
