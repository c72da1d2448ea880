"""Targets with tags: as printed, hidden in part, turned, corrupted, and real ones."""

import cv2
import numpy as np
import pytest
from boards import CAMERA, CORRUPTIONS, exact, hand, noisy, picture
from palpate.vision.corners import off_others
from palpate.vision.marker import CornerFollower, board_of
from palpate.vision.photometric import BoardRefiner
from palpate.vision.probe import board_poses
from scipy.spatial.transform import Rotation

CHARUCO = {"kind": "charuco", "squares": [7, 5], "dictionary": "4X4_50"}
CHARUCO |= {"square_m": 0.020, "tag_m": 0.015}
GRID = {"kind": "aprilgrid", "tags": [4, 3], "dictionary": "APRILTAG_36H11"}
GRID |= {"tag_m": 0.025, "gap_m": 0.0075}
CHECKER = {"inner_corners": [6, 5], "square_m": 0.020}
TAGGED = pytest.mark.parametrize("marker", [CHARUCO, GRID], ids=["charuco", "aprilgrid"])
ANY = pytest.mark.parametrize(
    "marker", [CHARUCO, GRID, CHECKER], ids=["charuco", "aprilgrid", "checkerboard"]
)
# A tip is about so far from its board's middle [m].
TIP_M = np.array([0.03, 0.17, 0.06])


def posed(board, rng, spin=0.0):
    """A board about half a metre away, tilted by up to half a radian."""
    tilt = Rotation.from_rotvec([*rng.uniform(-0.5, 0.5, 2), 0])
    pose = np.eye(4)
    pose[:3, :3] = (Rotation.from_rotvec([0, 0, spin]) * tilt).as_matrix()
    pose[:3, 3] = [*rng.uniform(-0.06, 0.06, 2), rng.uniform(0.45, 0.6)]
    pose[:3, 3] -= pose[:3, :3] @ board.points_m.mean(axis=0)
    return pose


@pytest.mark.parametrize("legacy", [False, True])
def test_what_is_printed_is_opencvs_board(legacy):
    """OpenCV draws a board of an even number of rows in two ways."""
    board = board_of(CHARUCO | {"squares": [5, 4], "white_first": legacy})
    family = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
    known = cv2.aruco.CharucoBoard((5, 4), 0.02, 0.015, family)
    known.setLegacyPattern(legacy)
    drawn = known.generateImage((5 * 40, 4 * 40), marginSize=0)
    v, u = (np.indices(drawn.shape) + 0.5) / 40 - 1
    assert np.array_equal(255 * board.print.at(u, v), drawn)
    corners = np.array(known.getChessboardCorners())
    assert board.points_m == pytest.approx(corners - corners[0], abs=1e-7)


@ANY
def test_corners_are_found_whichever_way_up(marker):
    board, rng = board_of(marker), np.random.default_rng(1)
    for spin in np.deg2rad([0, 90, 180, 270]):
        pose = posed(board, rng, spin)
        off = board.find(noisy(picture(board, pose), rng)) - exact(board, pose)
        assert np.isfinite(off[:, 0]).mean() > 0.9
        assert np.nanmax(np.linalg.norm(off, axis=1)) < 0.4


@TAGGED
def test_a_third_may_be_hidden(marker):
    """What is hidden is absent, what is seen is right, and the tip is known to 0.1 mm."""
    board, rng = board_of(marker), np.random.default_rng(2)
    refine, errors = BoardRefiner(CAMERA, board, encoding="mono8"), []
    for _ in range(4):
        pose = posed(board, rng, rng.uniform(-np.pi, np.pi))
        corners = exact(board, pose)
        image = noisy(hand(picture(board, pose), corners, rng), rng)
        found = board.find(image)
        seen = np.isfinite(found[:, 0])
        assert 0.3 < seen.mean() <= 0.75
        assert np.linalg.norm(found - corners, axis=1)[seen].max() < 1.5
        [known] = board_poses([(found, image)], CAMERA, board, threshold_px=0.45, refine=refine)
        assert known.refined
        apart = (known.camera_from_marker - pose) @ np.append(TIP_M, 1)
        errors.append(np.linalg.norm(apart[:3]))
    assert max(errors) < 1e-4


@pytest.mark.parametrize("corrupt", CORRUPTIONS)
@ANY
@pytest.mark.long
def test_no_corner_of_a_corrupted_picture_is_wrong(marker, corrupt):
    board, rng = board_of(marker), np.random.default_rng(3)
    for _ in range(3):
        pose = posed(board, rng, rng.uniform(-np.pi, np.pi))
        corners = exact(board, pose)
        found = board.find(noisy(CORRUPTIONS[corrupt](picture(board, pose), corners, rng), rng))
        if found is not None:
            assert np.nanmax(np.linalg.norm(found - corners, axis=1)) < 2


def test_turned_tags_are_found():
    board = board_of(GRID | {"tag_turns": 1})
    pose = posed(board, np.random.default_rng(4))
    off = board.find(picture(board, pose)) - exact(board, pose)
    assert np.nanmax(np.abs(off)) < 0.4


EVEN = CHARUCO | {"squares": [8, 6], "square_m": 0.025, "tag_m": 0.019}
OTHER_SQUARES = r"in the other squares \(white_first: true or false\?\)"


@pytest.mark.parametrize(
    ("marker", "stated", "line"),
    [
        (GRID, {"tag_turns": 1}, r"found each turned by 270 degrees \(tag_turns\?\)"),
        # Each tag a square to a side.
        (CHARUCO, {"white_first": True}, r"white_first put them, found \d+ of 17 elsewhere"),
        # Both orders of an even number of squares have as many tags; no homography joins them.
        (EVEN, {"white_first": True}, OTHER_SQUARES),
        (EVEN | {"white_first": True}, {"white_first": False}, OTHER_SQUARES),
    ],
    ids=["turned", "elsewhere", "black first", "white first"],
)
def test_tags_unlike_the_file_are_named(marker, stated, line):
    board, rng = board_of(marker), np.random.default_rng(6)
    image = noisy(picture(board, posed(board, rng)), rng)
    with pytest.raises(ValueError, match=line):
        board_of(marker | stated).find(image)


def test_one_picture_with_misread_tags_stops_no_recording():
    board, wrong = board_of(CHARUCO), board_of(CHARUCO | {"white_first": True})
    follow, rng = CornerFollower(wrong), np.random.default_rng(6)
    pose = posed(board, rng)
    image, other = picture(wrong, pose), picture(board, pose)
    assert [follow(one) is None for one in (image, other, image)] == [False, True, False]
    follow.require_right()
    follow(other), follow(other)
    with pytest.raises(ValueError, match=r"white_first.* \(so in 3 of 5 pictures with tags\)"):
        follow.require_right()


def test_tags_of_another_family_are_no_board():
    board = board_of(CHARUCO)
    image = picture(board, posed(board, np.random.default_rng(5)))
    assert board_of(CHARUCO | {"dictionary": "5X5_50"}).find(image) is None
    assert board.find(np.full((480, 640), 127, np.uint8)) is None


@pytest.mark.long
def test_a_real_board_that_is_never_seen_whole(root):
    """Half lit, a plain chessboard before its middle, a lens that bends: corners agree."""
    folder = root.parent / "shared/real/charuco"
    if not folder.is_dir():
        pytest.skip("the real pictures of a ChArUco board are not here")
    sides = {"squares": [19, 26], "square_m": 0.005, "tag_m": 0.004}
    board = board_of(CHARUCO | sides | {"dictionary": "4X4_250"})
    counts = []
    for path in sorted(folder.glob("*_0[0-2]*.jpg")):
        grey = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
        found = board.find(grey)
        if found is None:
            continue
        counts.append(np.isfinite(found[:, 0]).sum())
        assert np.nanmax(off_others(found, board.points_m, grey.shape)) < 2.0
    assert len(counts) >= 10 and 150 < max(counts) < 0.6 * len(board.points_m)
