"""Camera calibration on real boards with a known answer, and on exact synthetic ones."""

import cv2
import numpy as np
import pytest
from palpate.vision.board import Board, board_views
from palpate.vision.calibration import calibrate_camera, calibrate_pair
from palpate.vision.camera import camera_from_spec, with_calibration
from palpate.vision.pose import candidate_poses
from scipy.spatial.transform import Rotation

CALTECH = Board(9, 6, 0.030)


@pytest.fixture(scope="module")
def caltech(root):
    found = {}
    for side in ("left", "right"):
        files = sorted((root / "tests/real/boards").glob(f"{side}*.jpg"))
        images = [(path.stem[-2:], cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)) for path in files]
        found[side], missing = board_views(images, CALTECH)
        assert len(found[side]) + len(missing) == 13
    return found


def test_the_toolboxes_focal_lengths_and_baseline(caltech):
    known = {
        "left": (533.004, 533.153, 341.586, 234.259),
        "right": (536.983, 536.569, 326.472, 249.333),
    }
    cameras = []
    for side, (fx, fy, cx, cy) in known.items():
        result = calibrate_camera(caltech[side], CALTECH, (640, 480))
        camera = result.camera
        assert (camera.fx_px, camera.fy_px) == pytest.approx((fx, fy), rel=1e-3)
        assert (camera.cx_px, camera.cy_px) == pytest.approx((cx, cy), abs=2.0)
        assert result.rms_px < 0.3
        assert 0 < result.standard_errors["fx_px"] < 2
        cameras.append(camera)
    pair = calibrate_pair(caltech["left"], caltech["right"], CALTECH, tuple(cameras))
    baseline = np.linalg.norm(pair.second_from_first[:3, 3])
    assert baseline == pytest.approx(0.09985, abs=1e-4)


def test_each_boards_pose_is_the_calibrations(caltech):
    """The probe's pose solver on real boards: nine-tenths of a millimetre would be a corner off."""
    result = calibrate_camera(caltech["left"], CALTECH, (640, 480))
    middle = CALTECH.points_m.mean(axis=0)
    for name, known in result.camera_from_board.items():
        found = candidate_poses(caltech["left"][name], result.camera, CALTECH, threshold_px=3.0)[0]
        apart = (found.camera_from_marker - known) @ np.append(middle, 1)
        assert found.inliers == np.isfinite(caltech["left"][name][:, 0]).sum() > 48
        assert np.linalg.norm(apart[:3]) < 1e-4


def poses(count, seed=0):
    rng = np.random.default_rng(seed)
    found = {}
    for k in range(count):
        pose = np.eye(4)
        turn = np.deg2rad(rng.uniform(-30, 30, 3)) * [1, 1, 0.5]
        pose[:3, :3] = Rotation.from_rotvec(turn).as_matrix()
        pose[:3, 3] = [*rng.uniform(-0.2, 0.0, 2), rng.uniform(0.5, 1.0)]
        found[f"{k:02d}"] = pose
    return found


def seen(board, views, camera, second_from_first=None, noise_px=0.02):
    second_from_first = np.eye(4) if second_from_first is None else second_from_first
    rng = np.random.default_rng(1)
    corners = {}
    for name, pose in views.items():
        pose = second_from_first @ pose
        points = board.points_m @ pose[:3, :3].T + pose[:3, 3]
        exact = camera.project(points)
        corners[name] = exact + noise_px * rng.standard_normal(exact.shape)
    return corners


@pytest.mark.parametrize("columns", [9, 8], ids=["odd x even", "even x even"])
def test_a_pair_is_found_whichever_way_up_its_boards_are(sensors, columns):
    spec = sensors["kinect"]
    board = Board(columns, 6, 0.025)
    colour, infrared = (camera_from_spec(spec[block]) for block in ("color", "depth"))
    truth = np.linalg.inv(np.array(spec["depth"]["color_from_depth"]))
    views = poses(14)
    first, second = seen(board, views, colour), seen(board, views, infrared, truth)
    if board.ambiguous:
        for name in list(second)[::3]:
            second[name] = second[name][::-1]
    pair = calibrate_pair(first, second, board, (colour, infrared))
    error = np.linalg.inv(truth) @ pair.second_from_first
    assert np.linalg.norm(error[:3, 3]) < 3e-4
    assert Rotation.from_matrix(error[:3, :3]).magnitude() < np.deg2rad(0.02)


def test_a_spoilt_view_is_rejected_and_named(sensors):
    camera = camera_from_spec(sensors["kinect"]["color"])
    board = Board(9, 6, 0.025)
    corners = seen(board, poses(20), camera)
    corners["07"] = corners["07"] + np.random.default_rng(2).normal(0, 3, corners["07"].shape)
    result = calibrate_camera(corners, board, (640, 480))
    assert list(result.rejected) == ["07"]
    assert "residual" in result.rejected["07"]
    assert result.camera.fx_px == pytest.approx(camera.fx_px, rel=1e-3)
    assert set(result.camera_from_board) == set(corners) - {"07"}


def test_a_sensors_own_optics_replace_those_of_its_file(sensors):
    sensor = sensors["kinect"]
    camera = {
        "fx_px": 500.0,
        "fy_px": 501.0,
        "cx_px": 300.0,
        "cy_px": 200.0,
        "distortion": [0.1] * 5,
    }
    shift = np.eye(4).tolist()
    calibration = {
        "cameras": {"color": camera, "infrared": camera | {"fx_px": 600.0}},
        "color_from_infrared": shift,
    }
    found = with_calibration(sensor, calibration)
    assert found["color"]["fx_px"] == 500.0
    assert (found["depth"]["fx_px"], found["depth"]["color_from_depth"]) == (600.0, shift)
    assert found["depth"]["baseline_m"] == sensor["depth"]["baseline_m"]
    assert sensor["color"]["fx_px"] != 500.0


def test_too_few_boards(sensors):
    board = Board(9, 6, 0.025)
    corners = seen(board, poses(4), camera_from_spec(sensors["kinect"]["color"]))
    with pytest.raises(ValueError, match="expected at least 6 views of the board, found 4"):
        calibrate_camera(corners, board, (640, 480))


def test_no_board_in_the_picture():
    grey = np.random.default_rng(0).integers(0, 255, (240, 320), dtype=np.uint8)
    assert CALTECH.find(grey) is None


def test_pairs_of_different_moments(sensors):
    spec = sensors["kinect"]
    board, views = Board(9, 6, 0.025), poses(12)
    colour, infrared = (camera_from_spec(spec[block]) for block in ("color", "depth"))
    first, second = seen(board, views, colour), seen(board, views, infrared)
    names = list(second)
    mixed = dict(zip(names, [second[name] for name in names[1:] + names[:1]], strict=True))
    with pytest.raises(ValueError, match="expected pairs taken at one moment"):
        calibrate_pair(first, mixed, board, (colour, infrared))
