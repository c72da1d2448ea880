"""Pose of rendered boards with known pose."""

import cv2
import numpy as np
import pytest
from palpate.vision.camera import PinholeCamera
from palpate.vision.marker import board_points, find_corners, marker_pose
from palpate.vision.probe import marker_from_tip, track_probe
from scipy.spatial.transform import Rotation

CAMERA = PinholeCamera(1024, 768, 790.0, 790.0, 512.0, 384.0)
SUPERSAMPLING = 6
NO_FILTER = {"method": "none", "measurement_std_m": 1e-3, "acceleration_std_m_s2": 1.0}


def board_image(pose, marker, camera=CAMERA):
    """Draw the board by its homography, supersampled, on grey."""
    step, margin = 100, 80
    columns, rows = marker["inner_corners"]
    texture = np.full(((rows + 1) * step + 2 * margin, (columns + 1) * step + 2 * margin), 230.0)
    for i in range(rows + 1):
        for j in range(columns + 1):
            if (i + j) % 2 == 0:
                y, x = margin + i * step, margin + j * step
                texture[y : y + step, x : x + step] = 25.0
    square = marker["square_m"] / step
    offset = (margin + step - 0.5) * square
    to_board = np.array([[square, 0, -offset], [0, square, -offset], [0, 0, 1]])
    projection = camera.matrix @ pose[:3, [0, 1, 3]]
    scale = SUPERSAMPLING
    finer = np.array([[scale, 0, (scale - 1) / 2], [0, scale, (scale - 1) / 2], [0, 0, 1]])
    size = (camera.width_px * scale, camera.height_px * scale)
    big = cv2.warpPerspective(
        texture,
        finer @ projection @ to_board,
        size,
        borderMode=cv2.BORDER_CONSTANT,
        borderValue=110,
    )
    small = cv2.resize(big, (camera.width_px, camera.height_px), interpolation=cv2.INTER_AREA)
    return np.clip(np.round(small), 0, 255).astype(np.uint8)


def pose_of(rotation_vector, shift):
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_rotvec(rotation_vector).as_matrix()
    pose[:3, 3] = shift
    return pose


POSES = [
    pose_of([0.35, 0.0, 0.0], [-0.03, -0.12, 0.62]),
    pose_of([0.4, 0.2, 0.05], [0.05, -0.05, 0.55]),
    pose_of([-0.3, 0.35, -0.1], [-0.15, 0.02, 0.7]),
]


@pytest.mark.parametrize("pose", POSES)
def test_pose_of_a_rendered_board(pose, probe):
    found = marker_pose(
        board_image(pose, probe["marker"]), CAMERA, probe["marker"], threshold_px=0.25
    )
    assert found.inliers >= 10
    tip = marker_from_tip(probe)
    gap = (found.camera_from_marker @ tip - pose @ tip)[:3, 3]
    assert np.linalg.norm(gap) < 0.6e-3


def test_corners_come_in_the_boards_order_whichever_way_up(probe):
    for turn in (0.0, np.pi):
        pose = pose_of([0, 0, turn], [0.0, 0.0, 0.6])
        corners = find_corners(board_image(pose, probe["marker"]), probe["marker"])
        points = board_points(probe["marker"]) @ pose[:3, :3].T + pose[:3, 3]
        assert np.abs(corners - CAMERA.project(points)).max() < 0.15


def test_no_board_no_pose(probe):
    blank = np.full((768, 1024), 120, np.uint8)
    assert marker_pose(blank, CAMERA, probe["marker"], threshold_px=0.25) is None


def test_lost_marker_is_bridged_or_refused(probe):
    seen, blank = board_image(POSES[0], probe["marker"]), np.full((768, 1024), 120, np.uint8)
    options = {"threshold_px": 0.25, "filter_options": NO_FILTER}
    table = track_probe(
        [seen, blank, seen], np.arange(3.0), CAMERA, probe, largest_gap_frames=1, **options
    )
    assert table["detected"].tolist() == [1, 0, 1]
    assert np.allclose(table["tip_x_m"], table["tip_x_m"][0])
    with pytest.raises(ValueError, match="lost in frames 1 to 1"):
        track_probe(
            [seen, blank, seen], np.arange(3.0), CAMERA, probe, largest_gap_frames=0, **options
        )
    with pytest.raises(ValueError, match="found in none of 2"):
        track_probe([blank, blank], np.arange(2.0), CAMERA, probe, largest_gap_frames=5, **options)


def test_camera_round_trip_with_distortion():
    camera = PinholeCamera(640, 480, 520.0, 518.0, 310.0, 233.0, (0.1, -0.2, 0.001, -0.002, 0.05))
    points = np.array([[0.1, 0.05, 0.8], [-0.2, 0.1, 1.0], [0.0, -0.2, 0.9]])
    rays = camera.rays(camera.project(points))
    assert np.allclose(rays * points[:, 2:], points, atol=1e-6)
