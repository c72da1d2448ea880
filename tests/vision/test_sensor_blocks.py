"""Calibrated cameras as blocks of a sensor's file, and a pair's rectified camera."""

import cv2
import numpy as np
import pytest
from boards_seen import BOARD, LEFT, RIGHT, RIGHT_FROM_LEFT, poses
from palpate.vision.camera import (
    PinholeCamera,
    camera_from_spec,
    depth_blocks,
    opencv_text,
    rectified,
    stereo_blocks,
)


def test_points_are_where_the_rectified_camera_has_them():
    camera, baseline_m = rectified((LEFT, RIGHT), RIGHT_FROM_LEFT)
    assert baseline_m == pytest.approx(np.linalg.norm(RIGHT_FROM_LEFT[:3, 3]))
    assert not any(camera.distortion)
    pose = poses(1)["00"]
    points = BOARD.points_m @ pose[:3, :3].T + pose[:3, 3]
    turn, shift = RIGHT_FROM_LEFT[:3, :3], RIGHT_FROM_LEFT[:3, 3:]
    lenses = (LEFT.matrix, np.array(LEFT.distortion), RIGHT.matrix, np.array(RIGHT.distortion))
    R1, R2, P1, P2 = cv2.stereoRectify(*lenses, (640, 480), turn, shift, alpha=0)[:4]
    seen = LEFT.project(points)
    flat = cv2.undistortPoints(seen[:, None], *lenses[:2], R=R1, P=P1).reshape(-1, 2)
    assert flat == pytest.approx(camera.project(points @ R1.T), abs=1e-3)
    other = RIGHT.project(points @ turn.T + shift.T)
    right = cv2.undistortPoints(other[:, None], *lenses[2:], R=R2, P=P2).reshape(-1, 2)
    disparity = camera.fx_px * baseline_m / (points @ R1.T)[:, 2]
    apart = np.column_stack([disparity, np.zeros(len(points))])
    assert flat - right == pytest.approx(apart, abs=1e-3)


def test_pairs_that_are_no_stereo_head():
    with pytest.raises(ValueError, match="expected the left camera first"):
        rectified((RIGHT, LEFT), np.linalg.inv(RIGHT_FROM_LEFT))
    other = PinholeCamera(1280, 960, 900.0, 900.0, 640.0, 480.0)
    with pytest.raises(ValueError, match="one size, found 640 x 480 and 1280 x 960"):
        rectified((LEFT, other), RIGHT_FROM_LEFT)


def test_blocks_are_read_as_the_cameras_they_are_of():
    blocks = depth_blocks((LEFT, RIGHT), RIGHT_FROM_LEFT, ("rgb8", "millimetre"))
    assert camera_from_spec(blocks["color"]) == LEFT
    assert camera_from_spec(blocks["depth"]) == RIGHT
    back = np.array(blocks["depth"]["color_from_depth"]) @ RIGHT_FROM_LEFT
    assert back == pytest.approx(np.eye(4), abs=1e-7)
    assert stereo_blocks(RIGHT, 0.0998, "mono8")["stereo"] == {"baseline_m": 0.0998}


def test_opencv_reads_what_is_written_for_it(tmp_path):
    path = tmp_path / "pair.yml"
    path.write_text(opencv_text((LEFT, RIGHT), RIGHT_FROM_LEFT))
    storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_READ)
    assert storage.getNode("M1").mat() == pytest.approx(LEFT.matrix)
    assert storage.getNode("T").mat().ravel() == pytest.approx(RIGHT_FROM_LEFT[:3, 3])
