"""Pose of rendered boards with known pose."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from boards import CAMERA, exact, noisy, picture
from palpate.vision.board import Board
from palpate.vision.camera import camera_from_spec
from palpate.vision.corners import Region
from palpate.vision.marker import board_of, expected_region
from palpate.vision.options import ProbePose
from palpate.vision.photometric import BoardRefiner
from palpate.vision.pose import candidate_poses, corner_cofactor, point_covariance, settle
from palpate.vision.probe import TIP, TIP_STD, board_poses, marker_from_tip, track_probe
from scipy.spatial.transform import Rotation

SENSOR = {"color": vars(CAMERA) | {"encoding": "mono8"}}
SENSOR["marker"] = {"reprojection_threshold_px": 0.25}
STEP, MARGIN, SUPERSAMPLING, LENS_BLUR_PX = 100, 80, 6, 0.5
BLANK = np.full((CAMERA.height_px, CAMERA.width_px), 120, np.uint8)


def fine(board, pose):
    """A checkerboard whose edges are as exact as the poses that are asked of them."""
    white = np.kron(board.print.white, np.ones((STEP, STEP)))
    texture = 25.0 + 205.0 * np.pad(white, MARGIN, constant_values=1)
    square, scale = board.unit_m / STEP, SUPERSAMPLING
    offset = (MARGIN + STEP - 0.5) * square
    to_board = np.array([[square, 0, -offset], [0, square, -offset], [0, 0, 1]])
    finer = np.array([[scale, 0, (scale - 1) / 2], [0, scale, (scale - 1) / 2], [0, 0, 1]])
    size = (CAMERA.width_px * scale, CAMERA.height_px * scale)
    whole = finer @ (CAMERA.matrix @ pose[:3, [0, 1, 3]]) @ to_board
    border = {"borderMode": cv2.BORDER_CONSTANT, "borderValue": 110}
    big = cv2.warpPerspective(texture, whole, size, **border)
    big = cv2.GaussianBlur(big, (0, 0), LENS_BLUR_PX * scale)
    small = cv2.resize(big, (CAMERA.width_px, CAMERA.height_px), interpolation=cv2.INTER_AREA)
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


@pytest.fixture(scope="module")
def board(probe):
    return board_of(probe["marker"])


@pytest.fixture(scope="module")
def image(board):
    """The board in the first pose."""
    return fine(board, POSES[0])


@pytest.fixture(scope="module")
def refine(board):
    return BoardRefiner(CAMERA, board, encoding="mono8")


@pytest.fixture(scope="module")
def tip_off_m(probe):
    """How far a pose puts the tip from where another has it."""

    def off(found, pose):
        return np.linalg.norm(((found - pose) @ marker_from_tip(probe))[:3, 3])

    return off


def pose_in(grey, board, refine=None):
    """Pose of the board in one image."""
    seen = [(board.find(grey), grey)]
    [pose] = board_poses(seen, CAMERA, board, threshold_px=0.25, refine=refine)
    assert pose.refined == (refine is not None)
    return pose


@pytest.mark.parametrize("pose", POSES)
def test_pose_of_a_rendered_board(pose, board, refine, tip_off_m):
    image = fine(board, pose)
    found = pose_in(image, board)
    assert found.inliers >= 10
    assert tip_off_m(found.camera_from_marker, pose) < 0.6e-3
    assert tip_off_m(pose_in(image, board, refine).camera_from_marker, pose) < 0.1e-3


def test_a_mosaics_pixels_are_told_apart(board, image, tip_off_m):
    """Four kinds of pixels with their own brightness hide nothing."""
    gains = np.array([[1.0, 0.85], [0.9, 0.7]])
    mosaic = np.round(image * np.tile(gains, (384, 512))).astype(np.uint8)
    start = POSES[0].copy()
    start[:3, 3] += [2e-4, -2e-4, 1e-3]
    found = BoardRefiner(CAMERA, board, encoding="bayer_rggb8")(mosaic, start)
    assert tip_off_m(found.camera_from_marker, POSES[0]) < 0.15e-3


def test_what_hides_a_part_of_the_board_does_not_pull_the_refinement(image, refine, tip_off_m):
    hidden = image.copy()
    x, y = CAMERA.project(POSES[0][:3, 3][None])[0].round().astype(int)
    hidden[y - 12 : y + 8, x - 12 : x + 8] = 150
    assert tip_off_m(refine(hidden, POSES[0]).camera_from_marker, POSES[0]) < 0.3e-3


def test_what_does_not_look_like_the_board_is_not_refined(image, refine):
    assert refine(BLANK, POSES[0]) is None
    hidden = image.copy()
    x, y = CAMERA.project(POSES[0][:3, 3][None])[0].round().astype(int)
    hidden[y - 40 : y + 150, x - 30 : x + 25] = 150
    assert refine(hidden, POSES[0]) is None
    assert refine(cv2.blur(image, (9, 1)), POSES[0]) is None
    elsewhere = POSES[0].copy()
    elsewhere[:3, 3] += [0.008, 0, 0]
    assert refine(image, elsewhere) is None
    for beyond in ([1.5, 0, 0.6], [0, 0, -0.6]):
        assert refine(BLANK, pose_of([0.35, 0, 0], beyond)) is None


def test_the_refinements_covariance_covers_its_scatter(probe, board, refine):
    rng, tip = np.random.default_rng(4), marker_from_tip(probe)[:3, 3]
    image = fine(board, POSES[1])
    errors, stated = [], []
    for _ in range(25):
        found = refine(noisy(image, rng), POSES[1])
        transform = found.camera_from_marker
        errors.append(((transform - POSES[1]) @ np.append(tip, 1))[:3])
        stated.append(np.diag(point_covariance(transform, found.covariance, tip)))
    ratio = np.sqrt(np.mean(np.square(errors), axis=0) / np.mean(stated, axis=0))
    assert ratio.max() < 1.5
    assert ratio.min() > 0.1


@pytest.mark.parametrize(("encoding", "off_px"), [("mono8", 0.015), ("rgb8", 0.04)])
def test_a_picture_without_noise_knows_the_pose_as_corners_of_a_stated_error(
    board, image, encoding, off_px
):
    """Lenses, prints and filled in colours are not ideal: 0.015 px, or 0.04."""
    found = BoardRefiner(CAMERA, board, encoding=encoding)(image, POSES[0])
    corners = corner_cofactor(board.points_m, found.camera_from_marker, CAMERA)
    assert np.diag(found.covariance) == pytest.approx(off_px**2 * np.diag(corners), rel=0.1)


def test_the_covariance_is_that_of_the_scatter(probe, board):
    corners = exact(board, POSES[1])
    rng, tip = np.random.default_rng(3), marker_from_tip(probe)[:3, 3]
    tips, stated = [], []
    for _ in range(400):
        seen = corners + rng.normal(0, 0.05, corners.shape)
        found = candidate_poses(seen, CAMERA, board, threshold_px=0.45)[0]
        transform = found.camera_from_marker
        tips.append(transform[:3, :3] @ tip + transform[:3, 3])
        stated.append(np.diag(point_covariance(transform, found.covariance, tip)))
    ratio = np.std(tips, axis=0) / np.sqrt(np.mean(stated, axis=0))
    assert ratio == pytest.approx(1, abs=0.15)


@pytest.mark.long
def test_no_flipped_pose_in_ten_thousand_frames(board, sensors):
    """Boards at the far end of the Kinect's workspace, corners as noisy as its pictures'."""
    camera = camera_from_spec(sensors["kinect"]["color"])
    rng, worst, alone, lost = np.random.default_rng(8), 0.0, 0, 0
    for _ in range(100):
        swing = rng.uniform(-0.5, 0.5, 3) + 0.15 * np.cumsum(rng.normal(0, 0.15, (100, 3)), axis=0)
        place = [*rng.uniform(-0.15, 0.15, 2), rng.uniform(0.6, 1.05)]
        poses = [pose_of(turn * [1, 1, 0.3], place) for turn in swing]
        candidates = []
        for pose in poses:
            corners = exact(board, pose, camera)
            corners = corners + rng.normal(0, 0.08, corners.shape)
            candidates.append(candidate_poses(corners, camera, board, threshold_px=0.45))
        for true, found, options in zip(poses, settle(candidates), candidates, strict=True):
            if found is None:
                lost += 1
                continue
            worst = max(worst, tilt_between(true, found.camera_from_marker))
            alone += tilt_between(true, options[0].camera_from_marker) > np.deg2rad(10)
    assert alone > 10, "frames that the best fit alone would flip: else the test shows nothing"
    assert worst < np.deg2rad(10)
    assert lost < 100


def tilt_between(a, b):
    """Angle between two boards' normals [rad]."""
    return np.arccos(np.clip(a[:3, 2] @ b[:3, 2], -1, 1))


def test_the_expected_region_gives_the_same_corners(board):
    first, second, third = (
        fine(board, pose_of([0.35, 0.1, 0.0], [-0.05 + 0.01 * k, -0.1, 0.6])) for k in range(3)
    )
    last, whole = board.find(second), board.find(third)
    region = expected_region(last, board.find(first), third.shape)
    assert (region.x1 - region.x0) * (region.y1 - region.y0) < 0.15 * third.size
    # It goes on as the board moved.
    assert region.x0 > expected_region(last, None, third.shape).x0 + 5
    assert np.abs(board.find(third, region) - whole).max() < 2e-3
    assert board.find(third, Region(0, 0, 60, 60)) is None
    assert expected_region(last + 5000, None, third.shape) is None


def test_a_lens_that_bends_costs_no_corner_in_a_region():
    """Near the picture's corner, where the region's middle is not the lens's."""
    camera = replace(CAMERA, distortion=(-0.3, 0.08, 0, 0, 0))
    board, pose = Board(9, 6, 0.015), pose_of([0.2, 0.3, 0.1], [0.08, 0.06, 0.45])
    back = CAMERA.project(camera.rays(camera.pixel_grid())).astype(np.float32)
    x, y = np.moveaxis(back.reshape(768, 1024, 2), 2, 0)
    image = cv2.remap(picture(board, pose), x, y, cv2.INTER_CUBIC)
    corners = exact(board, pose, camera)
    for region in (None, expected_region(corners, None, image.shape)):
        assert np.abs(board.find(image, region) - corners).max() < 0.2


def tracked(images, probe, largest_gap_frames, refinement="corners"):
    options = ProbePose(refinement=refinement, largest_gap_frames=largest_gap_frames)
    return track_probe(images, np.arange(float(len(images))), SENSOR, probe, options)


def test_a_probe_is_tracked(probe, board):
    """Between two frames that show it the board moves evenly."""
    moved = POSES[0].copy()
    moved[0, 3] += 0.01
    images = [fine(board, pose) for pose in (POSES[0], moved)]
    table = tracked([images[0], BLANK, images[1]], probe, 1)
    assert table["detected"].tolist() == [1, 0, 1]
    tips = np.stack([(pose @ marker_from_tip(probe))[:3, 3] for pose in (POSES[0], moved)])
    expected = [tips[0], tips.mean(axis=0), tips[1]]
    assert table[TIP].to_numpy() == pytest.approx(np.array(expected), abs=0.6e-3)
    assert not table["refined"].any()
    assert np.isnan(table[TIP_STD].to_numpy()).any(axis=1).tolist() == [False, True, False]
    assert tracked(images[:1], probe, 0, "photometric")["refined"].tolist() == [1]


@pytest.mark.parametrize(
    ("shown", "largest", "line"),
    [
        ("101", 0, "at most 0 frames at a time, found it lost in frames 1 to 1"),
        ("10001", 2, "at most 2 frames at a time, found it lost in frames 1 to 3"),
        ("00", 5, "within 0.25 px, found in none of 2 frames"),
        ("0101", 2, "first and last frame, found it lost in frame 0"),
        ("1010", 2, "first and last frame, found it lost in frame 3"),
    ],
)
def test_a_marker_that_is_lost(probe, image, shown, largest, line):
    with pytest.raises(ValueError, match=line):
        tracked([image if each == "1" else BLANK for each in shown], probe, largest)
