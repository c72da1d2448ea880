"""What wrong optics do to a tip, and whether its deviations hold over cameras."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from palpate.vision.camera import camera_from_spec, with_calibration
from palpate.vision.marker import board_of
from palpate.vision.pivot import (
    LARGEST_STD_M,
    find_pivot,
    fit_pivot,
    recorded_pivot,
    stated_covariance,
    tip_by_optics,
)
from palpate.vision.pose import candidate_poses, settle
from turned_handle import TIP_M, turned_handle
from virtual_lab.rig_errors import errors_of

# As the validation draws its rigs.
SIZES = {"focal": 0.001, "principal_px": 0.5, "distortion_px": 0.3}
STILL = {"probe_error": {"angle_deg": 0.0, "shift_m": 0.0}}
# The pose is refined on the picture, to a fifth of what corners know.
FRAMES, NOISE_PX, THRESHOLD_PX = 60, 0.01, 2.0
NAMES = range(FRAMES)
TRUE = turned_handle(frames=FRAMES, noise_deg=0, noise_m=0)
LONG = turned_handle(noise_deg=0, noise_m=0)


@pytest.fixture(scope="module")
def board(probe):
    return board_of(probe["marker"])


@pytest.fixture(scope="module")
def color(sensors):
    return sensors["kinect"]["color"]


def seen(camera, board, noise_px=0.0, rng=None, poses=TRUE):
    """Corners of the turned handle's target in the pictures of a camera."""
    for pose in poses:
        corners = camera.project(board.points_m @ pose[:3, :3].T + pose[:3, 3])
        yield corners + (rng.normal(0, noise_px, corners.shape) if rng else 0.0)


def read(corners, camera, board):
    """Poses as a run finds them of corners."""
    each = [candidate_poses(one, camera, board, threshold_px=THRESHOLD_PX) for one in corners]
    return np.stack([pose.camera_from_marker for pose in settle(each)])


def drawn_camera(sizes, seed, sensors):
    errors = errors_of(STILL | {"seed": seed}, {"device": sizes, "rig": "drawn"}, sensors["kinect"])
    return camera_from_spec(errors.sensor["color"])


def normalised(found):
    off = found.tip_m - TIP_M
    return off @ np.linalg.solve(found.covariance, off) / 3


def test_deviations_hold_over_cameras(sensors, board, color):
    """Cameras that the lab draws, each read as its sensor's file says it is."""
    stated, rng = camera_from_spec(color), np.random.default_rng(5)
    with_optics, alone = [], []
    for draw in range(40):
        real = drawn_camera(SIZES, draw, sensors)
        poses = read(seen(real, board, NOISE_PX, rng), stated, board)
        with_optics.append(normalised(recorded_pivot(poses, NAMES, board, color)))
        alone.append(normalised(find_pivot(poses, NAMES)))
    # Of 40 draws with three degrees of freedom the mean's own deviation is 0.13.
    assert np.mean(with_optics) == pytest.approx(1, abs=0.35)
    assert np.mean(alone) > 4


@pytest.fixture(scope="module", params=range(4))
def by_wrong_optics(request, sensors, board, color):
    """Poses by optics that are wrong by more: neighbours are off alike, by 0.2 mm at the tip."""
    rng, wrong = np.random.default_rng(request.param), {k: 1.5 * v for k, v in SIZES.items()}
    real = drawn_camera(wrong, request.param, sensors)
    return read(seen(real, board, NOISE_PX / 2, rng, LONG), camera_from_spec(color), board)


def test_a_still_tip_that_neighbouring_frames_have_off_alike(by_wrong_optics):
    find_pivot(by_wrong_optics, range(200))


@pytest.mark.parametrize(("begins", "ends"), [(0, 200), (40, 41), (100, 101), (170, 171)])
@pytest.mark.parametrize("step_m", [(0.001, 0, 0), (0, 0, -0.001)])
def test_a_tip_that_slides_under_optics_that_are_wrong(by_wrong_optics, begins, ends, step_m):
    share = np.clip((np.arange(200) - begins) / (ends - begins), 0, 1)
    poses = by_wrong_optics.copy()
    poses[:, :3, 3] += share[:, None] * step_m
    with pytest.raises(ValueError, match="expected the tip to rest at one place"):
        find_pivot(poses, range(200))


def test_a_longer_recording_determines_the_optics_no_better(board, color):
    short, long = (
        recorded_pivot(turned_handle(frames=count), range(count), board, color)
        for count in (100, 400)
    )
    assert long.optics_std_m == pytest.approx(short.optics_std_m, rel=0.05)
    noise = [found.covariance - found.optics_covariance for found in (short, long)]
    assert np.trace(noise[0]) / np.trace(noise[1]) == pytest.approx(4, rel=0.3)


@pytest.mark.parametrize("steps", [{"cx_px": 0.3}, {"cy_px": 0.3}, {"fx_px": 0.5, "fy_px": 0.5}])
def test_a_tip_moves_with_the_optics(board, color, steps):
    """By first order as the poses do that are read again."""
    camera = camera_from_spec(color)
    wrong = replace(camera, **{name: getattr(camera, name) + step for name, step in steps.items()})
    lens = wrong.matrix, np.array(wrong.distortion)
    poses = TRUE.copy()
    for corners, pose in zip(seen(camera, board), poses, strict=True):
        turn = cv2.Rodrigues(np.ascontiguousarray(pose[:3, :3]))[0]
        turn, shift = cv2.solvePnPRefineLM(
            board.points_m, corners, *lens, turn, pose[:3, 3:].copy()
        )
        pose[:3, :3], pose[:3, 3] = cv2.Rodrigues(turn)[0], shift.ravel()
    moved = fit_pivot(poses).tip_m - TIP_M
    change = [steps.get(name, 0.0) for name in ("fx_px", "fy_px", "cx_px", "cy_px")]
    expected = tip_by_optics(TRUE, TIP_M, board, camera)[:, :4] @ change
    assert np.linalg.norm(expected) > 1e-5
    assert np.linalg.norm(moved - expected) < 0.15 * np.linalg.norm(expected)


def test_calibrated_optics_have_the_covariance_of_the_calibration(sensors, board, color):
    camera = {name: color[name] for name in ("fx_px", "fy_px", "cx_px", "cy_px", "distortion")}
    half = (stated_covariance(camera_from_spec(color)) / 4).tolist()
    calibration = {
        "cameras": {"color": camera | {"covariance": half}, "infrared": camera},
        "color_from_infrared": np.eye(4).tolist(),
    }
    known = with_calibration(sensors["kinect"], calibration)
    assert "covariance" not in known["depth"]
    poses = turned_handle(frames=FRAMES)
    of_file, of_calibration = (
        recorded_pivot(poses, NAMES, board, spec).optics_std_m for spec in (color, known["color"])
    )
    assert of_calibration == pytest.approx(of_file / 2)


def test_optics_that_alone_hide_a_tip_need_a_calibration(board, color):
    bad = color | {"covariance": (16 * stated_covariance(camera_from_spec(color))).tolist()}
    found = recorded_pivot(turned_handle(frames=FRAMES), NAMES, board, bad)
    assert found.optics_std_m > LARGEST_STD_M
    assert found.verdict.endswith("are the optics' alone: calibrate the camera")
