"""Camera calibration on real boards and on made-up ones, its verdicts; the camera model."""

import json

import cv2
import numpy as np
import pytest
from boards import BOARD, CALTECH, LEFT, RIGHT, RIGHT_FROM_LEFT, SIZE_PX, caltech, poses, seen
from palpate.vision.board import Board
from palpate.vision.calibration import calibrate_camera
from palpate.vision.calibration_report import camera_verdict, pair_verdict
from palpate.vision.camera import PinholeCamera, camera_from_spec, rectified, sensor_with_optics
from palpate.vision.pair_calibration import calibrate_pair
from palpate.vision.pose import candidate_poses
from scipy.spatial.transform import Rotation

KINECT = PinholeCamera(640, 480, 522.6, 520.6, 310.7, 233.3, (0.26, -0.84, -0.002, 0.001, 0.91))


def calibrated(views, noise_px=0.02):
    return calibrate_camera(seen(BOARD, views, RIGHT, noise_px=noise_px), BOARD, SIZE_PX)


def is_right(found, known):
    return abs(found.camera.fx_px - known.fx_px) < 3 * found.standard_errors["fx_px"]


@pytest.mark.parametrize(
    ("side", "known"),
    [
        ("left", (533.004, 533.153, 341.586, 234.259)),
        ("right", (536.983, 536.569, 326.472, 249.333)),
    ],
)
def test_the_toolboxes_focal_lengths(root, side, known):
    fx, fy, cx, cy = known
    result = calibrate_camera(caltech(root, side), CALTECH, SIZE_PX)
    camera = result.camera
    assert (camera.fx_px, camera.fy_px) == pytest.approx((fx, fy), rel=1e-3)
    assert (camera.cx_px, camera.cy_px) == pytest.approx((cx, cy), abs=2.0)
    assert result.rms_px < 0.3
    assert 0.3 < result.standard_errors["fx_px"] < 0.6


def test_each_boards_pose_is_the_calibrations(root):
    """The probe's pose solver on real boards: nine-tenths of a millimetre would be a corner off."""
    corners = caltech(root, "left")
    result = calibrate_camera(corners, CALTECH, SIZE_PX)
    middle = CALTECH.points_m.mean(axis=0)
    for name, known in result.camera_from_board.items():
        found = candidate_poses(corners[name], result.camera, CALTECH, threshold_px=3.0)[0]
        apart = (found.camera_from_marker - known) @ np.append(middle, 1)
        assert found.inliers == np.isfinite(corners[name][:, 0]).sum() > 48
        assert np.linalg.norm(apart[:3]) < 1e-4


def test_a_spoilt_view_is_rejected_and_named(sensors):
    camera = camera_from_spec(sensors["kinect"]["color"])
    board = Board(9, 6, 0.025)
    corners = seen(board, poses(20), camera)
    corners["07"] = corners["07"] + np.random.default_rng(2).normal(0, 3, corners["07"].shape)
    result = calibrate_camera(corners, board, SIZE_PX)
    assert list(result.rejected) == ["07"]
    assert "residual" in result.rejected["07"]
    assert result.camera.fx_px == pytest.approx(camera.fx_px, rel=1e-3)
    assert set(result.camera_from_board) == set(corners) - {"07"}


def test_a_board_that_tilts_in_place_is_not_one_view():
    """The views that determine the focal length best."""
    camera = PinholeCamera(640, 480, 580.0, 580.0, 319.5, 239.5)
    board, views = Board(9, 6, 0.025), {}
    tilts = [(0, 0), *((a, b) for s in (15, 25) for a, b in ((s, 0), (-s, 0), (0, s), (0, -s)))]
    for k, tilt in enumerate(np.deg2rad(tilts)):
        pose = np.eye(4)
        pose[:3, :3] = Rotation.from_rotvec([*tilt, 0]).as_matrix()
        pose[:3, 3] = [0, 0, 0.6] - pose[:3, :3] @ board.points_m.mean(axis=0)
        views[f"{k:02d}"] = pose
    result = calibrate_camera(seen(board, views, camera, noise_px=0.1), board, SIZE_PX)
    assert not result.rejected
    assert is_right(result, camera)
    assert result.standard_errors["fx_px"] < 3


def test_outlying_corners_are_named_and_do_no_harm():
    corners = seen(BOARD, poses(12), LEFT, noise_px=0.1)
    corners["03"][[0, 7, 29]] += [9.0, -4.0]
    corners["05"][11] += [0.0, 1.0]
    result = calibrate_camera(corners, BOARD, SIZE_PX)
    assert result.rejected_corners == {"03": [0, 7, 29], "05": [11]}
    assert result.rejected == {}
    assert result.fit.sigma_px[0] == pytest.approx(0.1, rel=0.15)
    assert is_right(result, LEFT)


def test_outliers_are_judged_by_the_cameras_own_scatter():
    result = calibrate_camera(seen(BOARD, poses(12), LEFT, noise_px=1.0), BOARD, SIZE_PX)
    assert (result.rejected, result.rejected_corners) == ({}, {})
    assert is_right(result, LEFT)


def test_boards_that_are_half_hidden():
    corners = seen(BOARD, poses(14), LEFT, noise_px=0.05)
    rng = np.random.default_rng(4)
    for found in corners.values():
        found[rng.random(len(found)) < 0.4] = np.nan
    corners["02"][3:] = np.nan
    result = calibrate_camera(corners, BOARD, SIZE_PX)
    assert result.rejected == {"02": "3 corners seen, expected at least 8"}
    assert is_right(result, LEFT)
    assert result.rms_px == pytest.approx(0.05 * np.sqrt(2), rel=0.15)


@pytest.mark.parametrize(
    ("camera", "count"), [(RIGHT, 0), (LEFT, 2), pytest.param(KINECT, 5, marks=pytest.mark.long)]
)
def test_no_more_distortion_than_the_corners_determine(camera, count):
    board, far_m = (Board(9, 6, 0.025), (0.3, 0.5)) if count == 5 else (BOARD, (0.4, 0.8))
    corners = seen(board, poses(20, far_m=far_m), camera)
    result = calibrate_camera(corners, board, SIZE_PX)
    assert result.terms == ("k1", "k2", "p1", "p2", "k3")[:count]
    assert result.camera.distortion[:1] == pytest.approx(camera.distortion[:1], abs=0.01)
    assert not np.any(result.camera.distortion[count:])
    assert not np.diag(result.covariance)[4 + count :].any()


def parallel(count):
    views = poses(count)
    for pose in views.values():
        pose[:3, :3] = np.eye(3)
    return views


@pytest.mark.parametrize(
    ("board", "views", "line"),
    [
        (BOARD, poses(4), "expected at least 6 views of the board, found 4"),
        (
            BOARD,
            {f"{k:02d}": poses(1)["00"] for k in range(20)},
            "at least 6 different views of the board, found 1 .19 that another is the same as",
        ),
        (BOARD, parallel(10), "expected views that determine the focal length"),
        (Board(6, 4, 0.04), poses(8), r"00: corners: expected \(30, 2\), found \(24, 2\)"),
    ],
    ids=["too few", "one view", "all parallel", "another board"],
)
def test_views_that_determine_nothing(board, views, line):
    with pytest.raises(ValueError, match=line):
        calibrate_camera(seen(board, views, RIGHT, noise_px=0.1), BOARD, SIZE_PX)


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


def test_good_views_determine_all():
    assert all(camera_verdict(calibrated(poses(40, far_m=(0.3, 0.6)))).determined.values())


def test_boards_in_the_middle_do_not_determine_the_distortion():
    found = camera_verdict(calibrated(tilted(30)))
    known = {"focal length": True, "principal point": True, "distortion": False}
    assert found.determined == known
    (line,) = [one for one in found.lines if "not determined" in one]
    assert line.startswith("distortion: ") and line.endswith(": views in the picture's corners")


def test_boards_that_are_hardly_tilted_do_not_determine_the_focal_length():
    verdict = camera_verdict(calibrated(tilted(6), noise_px=0.1))
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
