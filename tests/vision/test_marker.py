"""Pose of rendered boards with known pose."""

from dataclasses import replace

import cv2
import numpy as np
import printed_boards
import pytest
from palpate.vision.board import Board
from palpate.vision.camera import PinholeCamera, camera_from_spec
from palpate.vision.corners import Region
from palpate.vision.marker import board_of, expected_region, find_corners
from palpate.vision.options import PoseFilter, ProbePose
from palpate.vision.photometric import BoardRefiner
from palpate.vision.pose import candidate_poses, point_covariance, settle
from palpate.vision.probe import TIP, TIP_STD, board_poses, marker_from_tip, track_probe
from scipy.spatial.transform import Rotation

CAMERA = PinholeCamera(1024, 768, 790.0, 790.0, 512.0, 384.0)
BLANK = np.full((768, 1024), 120, np.uint8)
SUPERSAMPLING = 6
LENS_BLUR_PX = 0.5
SENSOR = {
    "color": vars(CAMERA) | {"encoding": "mono8"},
    "marker": {"reprojection_threshold_px": 0.25},
}


def board_image(pose, marker, camera=CAMERA):
    """Draw the board by its homography, supersampled and through a lens, on grey."""
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
    big = cv2.GaussianBlur(big, (0, 0), LENS_BLUR_PX * scale)
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


def pose_in(grey, marker, refine=None):
    """Pose of the board in one image."""
    [(pose, refined)] = board_poses(
        [(find_corners(grey, board_of(marker)), grey)],
        CAMERA,
        board_of(marker),
        threshold_px=0.25,
        refine=refine,
    )
    assert refined == (refine is not None)
    return pose


@pytest.fixture
def board(probe):
    return board_of(probe["marker"])


@pytest.fixture
def refine(board):
    return BoardRefiner(CAMERA, board, encoding="mono8")


@pytest.fixture
def off_m(probe):
    """Vector by which the tip of a found pose is off."""
    tip = marker_from_tip(probe)
    return lambda found, pose: (found.camera_from_marker @ tip - pose @ tip)[:3, 3]


@pytest.mark.parametrize("pose", POSES)
def test_pose_of_a_rendered_board(pose, probe, refine, off_m):
    image = board_image(pose, probe["marker"])
    found = pose_in(image, probe["marker"])
    assert found.inliers >= 10
    assert np.linalg.norm(off_m(found, pose)) < 0.6e-3
    assert np.linalg.norm(off_m(pose_in(image, probe["marker"], refine), pose)) < 0.1e-3


def test_a_mosaics_pixels_are_told_apart(probe, board, off_m):
    """Four kinds of pixels with their own brightness hide nothing."""
    image = board_image(POSES[0], probe["marker"]).astype(float)
    gains = np.array([[1.0, 0.85], [0.9, 0.7]])
    mosaic = np.round(image * np.tile(gains, (384, 512))).astype(np.uint8)
    start = POSES[0].copy()
    start[:3, 3] += [2e-4, -2e-4, 1e-3]
    found = BoardRefiner(CAMERA, board, encoding="bayer_rggb8")(mosaic, start)
    assert np.linalg.norm(off_m(found, POSES[0])) < 0.15e-3


def test_what_hides_a_part_of_the_board_does_not_pull_the_refinement(probe, refine, off_m):
    image = board_image(POSES[0], probe["marker"])
    corner = CAMERA.project(POSES[0][:3, 3][None])[0].round().astype(int)
    image[corner[1] - 12 : corner[1] + 8, corner[0] - 12 : corner[0] + 8] = 150
    assert np.linalg.norm(off_m(refine(image, POSES[0]), POSES[0])) < 0.3e-3


def test_what_does_not_look_like_the_board_is_not_refined(probe, refine):
    image = board_image(POSES[0], probe["marker"])
    hidden, elsewhere = image.copy(), POSES[0].copy()
    x, y = CAMERA.project(POSES[0][:3, 3][None])[0].round().astype(int)
    hidden[y - 40 : y + 150, x - 30 : x + 25] = 150
    for other in (BLANK, hidden, cv2.blur(image, (9, 1))):
        assert refine(other, POSES[0]) is None
    elsewhere[:3, 3] += [0.008, 0, 0]
    assert refine(image, elsewhere) is None
    for beyond in ([1.5, 0, 0.6], [0, 0, -0.6]):
        assert refine(BLANK, pose_of([0.35, 0, 0], beyond)) is None


def test_the_refinements_covariance_covers_its_scatter(probe, refine, off_m):
    rng, tip = np.random.default_rng(4), marker_from_tip(probe)[:3, 3]
    image = board_image(POSES[1], probe["marker"]).astype(float)
    errors, stated = [], []
    for _ in range(25):
        noisy = np.clip(np.round(image + rng.normal(0, 2, image.shape)), 0, 255).astype(np.uint8)
        found = refine(noisy, POSES[1])
        errors.append(off_m(found, POSES[1]))
        covariance = point_covariance(found.camera_from_marker, found.covariance, tip)
        stated.append(np.diag(covariance))
    ratio = np.sqrt(np.mean(np.square(errors), axis=0) / np.mean(stated, axis=0))
    assert ratio.max() < 1.5
    assert ratio.min() > 0.1


def test_the_covariance_is_that_of_the_scatter(probe, board, off_m):
    exact = CAMERA.project(board.points_m @ POSES[1][:3, :3].T + POSES[1][:3, 3])
    rng, tip = np.random.default_rng(3), marker_from_tip(probe)[:3, 3]
    errors, stated = [], []
    for _ in range(400):
        corners = exact + rng.normal(0, 0.05, exact.shape)
        found = candidate_poses(corners, CAMERA, board, threshold_px=0.45)[0]
        errors.append(off_m(found, POSES[1]))
        covariance = point_covariance(found.camera_from_marker, found.covariance, tip)
        stated.append(np.diag(covariance))
    ratio = np.std(errors, axis=0) / np.sqrt(np.mean(stated, axis=0))
    assert ratio == pytest.approx(1, abs=0.15)


@pytest.mark.long
def test_no_flipped_pose_in_ten_thousand_frames(board, sensors):
    """Boards at the far end of the Kinect's workspace, corners as noisy as its pictures'."""
    camera = camera_from_spec(sensors["kinect"]["color"])
    points, rng = board.points_m, np.random.default_rng(8)
    worst, alone, lost = 0.0, 0, 0
    for _ in range(100):
        swing = rng.uniform(-0.5, 0.5, 3) + 0.15 * np.cumsum(rng.normal(0, 0.15, (100, 3)), axis=0)
        place = [*rng.uniform(-0.15, 0.15, 2), rng.uniform(0.6, 1.05)]
        poses = [pose_of(turn * [1, 1, 0.3], place) for turn in swing]
        candidates = []
        for pose in poses:
            exact = camera.project(points @ pose[:3, :3].T + pose[:3, 3])
            corners = exact + rng.normal(0, 0.08, exact.shape)
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


def test_the_expected_region_gives_the_same_corners(probe, board):
    images = [
        board_image(pose_of([0.35, 0.1, 0.0], [-0.05 + 0.01 * k, -0.1, 0.6]), probe["marker"])
        for k in range(3)
    ]
    before, last, whole = (find_corners(image, board) for image in images)
    region = expected_region(last, before, BLANK.shape)
    assert (region.x1 - region.x0) * (region.y1 - region.y0) < 0.15 * BLANK.size
    assert np.abs(find_corners(images[2], board, region) - whole).max() < 2e-3
    assert np.array_equal(find_corners(images[2], board, Region(0, 0, 60, 60)), whole)
    assert expected_region(last + 5000, None, BLANK.shape) is None


def test_a_lens_that_bends_costs_no_corner_in_a_region():
    """Near the picture's corner, where the region's middle is not the lens's."""
    camera = replace(CAMERA, distortion=(-0.3, 0.08, 0, 0, 0))
    board, pose = Board(9, 6, 0.015), pose_of([0.2, 0.3, 0.1], [0.08, 0.06, 0.45])
    straight = printed_boards.picture(board, pose, CAMERA)
    grid = camera.pixel_grid()
    back = CAMERA.project(camera.rays(grid)).astype(np.float32).reshape(768, 1024, 2)
    image = cv2.remap(straight, back[..., 0], back[..., 1], cv2.INTER_CUBIC)
    exact = printed_boards.exact(board, pose, camera)
    region = expected_region(exact, None, image.shape)
    for corners in (find_corners(image, board), board.find(image, region)):
        assert np.abs(corners - exact).max() < 0.2


@pytest.mark.parametrize("inner_corners", [[4, 3], [5, 4]])
def test_corners_come_in_the_boards_order_whichever_way_up(inner_corners):
    """Black corner squares at the upper edge, or at the left of a board that begins with odd."""
    marker = {"inner_corners": inner_corners, "square_m": 0.02}
    for turn in (0.0, 0.5 * np.pi, np.pi):
        pose = pose_of([0, 0, turn], [0.0, 0.0, 0.6])
        corners = find_corners(board_image(pose, marker), board_of(marker))
        points = board_of(marker).points_m @ pose[:3, :3].T + pose[:3, 3]
        assert np.abs(corners - CAMERA.project(points)).max() < 0.15


def tracked(images, probe, largest_gap_frames, refinement="corners"):
    options = ProbePose(
        refinement=refinement,
        largest_gap_frames=largest_gap_frames,
        filter=PoseFilter(method="none"),
    )
    return track_probe(images, np.arange(float(len(images))), SENSOR, probe, options)


def test_a_probe_is_tracked(probe):
    """Between two frames that show it the board moves evenly."""
    moved = POSES[0].copy()
    moved[0, 3] += 0.01
    images = [board_image(pose, probe["marker"]) for pose in (POSES[0], moved)]
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
def test_a_marker_that_is_lost(probe, shown, largest, line):
    seen = board_image(POSES[0], probe["marker"])
    with pytest.raises(ValueError, match=line):
        tracked([seen if each == "1" else BLANK for each in shown], probe, largest)
