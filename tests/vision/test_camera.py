"""The pinhole camera and its lens, optics of a calibration, and a pair's rectified camera."""

import json

import cv2
import numpy as np
import pytest
from boards_seen import BOARD, LEFT, RIGHT, RIGHT_FROM_LEFT, poses
from palpate.vision.camera import (
    PinholeCamera,
    camera_from_spec,
    rectified,
    sensor_with_optics,
)


@pytest.mark.parametrize("block", ["color", "depth"])
def test_rays_take_the_distortion_out(sensors, block):
    camera = camera_from_spec(sensors["kinect"][block])
    pixels = camera.pixel_grid()[::37]
    assert np.abs(camera.project(camera.rays(pixels) * 1.3) - pixels).max() < 1e-4
    straight = camera.rays(pixels)[:, :2] * [camera.fx_px, camera.fy_px]
    moved = np.linalg.norm(straight + [camera.cx_px, camera.cy_px] - pixels, axis=1)
    # The lens is one: it matters in the corners and hardly in the middle.
    assert moved.max() > 5
    assert moved[np.linalg.norm(pixels - [camera.cx_px, camera.cy_px], axis=1) < 40].max() < 0.3


def test_optics_of_a_calibration_go_before_the_files(tmp_path):
    spec = {"color": {"fx_px": 500.0, "width_px": 640}}
    spec["depth"] = {"fx_px": 580.0, "baseline_m": 0.075}
    assert sensor_with_optics(spec, None) is spec and sensor_with_optics(spec, []) is spec
    rest = {"fy_px": 1, "cx_px": 2, "cy_px": 3, "distortion": [0.0] * 5}
    cameras = {name: rest | {"fx_px": fx} for name, fx in (("color", 501), ("infrared", 581))}
    path = tmp_path / "calibration.json"
    path.write_text(json.dumps({"cameras": cameras, "color_from_infrared": [[1]]}))
    found = sensor_with_optics(spec, path)
    assert (found["color"]["fx_px"], found["depth"]["fx_px"]) == (501, 581)
    assert (found["depth"]["cx_px"], found["depth"]["cy_px"]) == (2, 3)
    assert found["color"]["width_px"] == 640 and found["depth"]["color_from_depth"] == [[1]]
    assert spec["color"]["fx_px"] == 500.0 and found["depth"]["baseline_m"] == 0.075
    spec["depth"]["infrared_shift_px"] = [5, 4]
    found = sensor_with_optics(spec, path)["depth"]
    assert (found["cx_px"], found["cy_px"]) == (2 - 5, 3 - 4)


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
    other = PinholeCamera(1280, 960, 900.0, 900.0, 640.0, 480.0)
    with pytest.raises(ValueError, match="one size, found 640 x 480 and 1280 x 960"):
        rectified((LEFT, other), RIGHT_FROM_LEFT)
