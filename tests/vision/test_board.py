"""Corners of drawn boards, where their order starts, and what of them is wrong or hidden."""

import numpy as np
import pytest
from palpate.vision.board import Board
from palpate.vision.board_pictures import board_in
from palpate.vision.camera import PinholeCamera
from palpate.vision.corners import off_others, without_outliers
from palpate.vision.marker import MARGIN as REGION_MARGIN
from palpate.vision.marker import board_of, expected_region
from printed_boards import exact, noisy, picture

SQUARE_PX, MARGIN_PX = 20, 25
BOARD = Board(6, 5, 0.02)


def drawn(board):
    """A board with a black square beside its first corner, on white."""
    squares = np.kron(255 * board.print.white, np.ones((SQUARE_PX, SQUARE_PX)))
    return np.pad(squares, MARGIN_PX, constant_values=255).astype(np.uint8)


def corners_of(board):
    """Where they are drawn [px]: between two pixels."""
    return board.points_m[:, :2] / board.unit_m * SQUARE_PX + MARGIN_PX + SQUARE_PX - 0.5


@pytest.mark.parametrize("size", [(6, 5), (5, 4), (5, 6)])
def test_the_order_starts_beside_a_black_square(size):
    board = Board(*size, 0.02)
    image, corners = drawn(board), corners_of(board)
    assert np.abs(board.find(image) - corners).max() < 0.1
    height, width = image.shape
    found = board.find(np.ascontiguousarray(image[::-1, ::-1]))
    assert np.abs(found - ([width - 1, height - 1] - corners)).max() < 0.1


def test_a_stain_does_not_turn_the_order():
    image, first = drawn(BOARD), MARGIN_PX + SQUARE_PX
    image[first : first + SQUARE_PX, first : first + SQUARE_PX] = 150
    assert np.abs(BOARD.find(image) - corners_of(BOARD)).max() < 0.5


@pytest.mark.parametrize("size", [(6, 6), (7, 5), (5, 5)])
@pytest.mark.parametrize("turns", range(4))
@pytest.mark.parametrize("inverse", [False, True])
def test_boards_of_any_colouring_are_found(size, turns, inverse):
    board = Board(*size, 0.02)
    image = np.rot90(255 - drawn(board) if inverse else drawn(board), turns)
    image = np.pad(image[2:-2, 2:-2], 20, constant_values=255) if not inverse else image
    assert np.isfinite(board.find(np.ascontiguousarray(image))).all()


def test_a_board_of_two_orders_has_its_corners():
    board = Board(5, 5, 0.02)
    found = board.find(drawn(board))
    apart = [np.abs(order - corners_of(board)).max() for order in (found, found[::-1])]
    assert board.ambiguous and min(apart) < 0.1


def test_pictures_without_the_board_are_named():
    empty = np.full((150, 150), 255, np.uint8)
    found = board_in("left", {"01": drawn(BOARD), "02": empty}, BOARD)
    assert list(found.corners) == ["01"] and list(found.missing) == ["02"]


WIDE = Board(9, 6, 0.03)
BENT = PinholeCamera(640, 480, 530.0, 530.0, 330.0, 235.0, (-0.28, 0.07, 0, 0, 0))
SHAPE = 480, 640
POSE = np.eye(4)
POSE[:3, 3] = [-0.15, -0.08, 0.4]


def test_a_lens_is_no_error():
    corners = exact(WIDE, POSE, BENT)
    assert off_others(corners, WIDE.points_m, SHAPE).max() < 0.3
    noise = np.random.default_rng(0).normal(0, 0.1, corners.shape)
    assert np.isfinite(without_outliers(corners + noise, WIDE.points_m, SHAPE)).all()


@pytest.mark.parametrize("size_px", [2.0, 5.0, 13.0])
@pytest.mark.parametrize("wrong", [[0], [8, 17, 26], [3, 22, 40, 50]], ids=["one", "edge", "four"])
def test_wrong_corners_go_and_no_others(wrong, size_px):
    rng = np.random.default_rng(1)
    corners = exact(WIDE, POSE, BENT) + rng.normal(0, 0.1, (54, 2))
    angles = rng.uniform(0, 2 * np.pi, len(wrong))
    corners[wrong] += size_px * np.column_stack([np.cos(angles), np.sin(angles)])
    kept = without_outliers(corners, WIDE.points_m, SHAPE)
    assert np.flatnonzero(np.isnan(kept[:, 0])).tolist() == wrong


def test_too_few_corners_contradict_nothing():
    corners = np.full((54, 2), np.nan)
    corners[:5] = np.random.default_rng(0).uniform(0, 400, (5, 2))
    assert without_outliers(corners, WIDE.points_m, SHAPE) == pytest.approx(corners, nan_ok=True)


def test_a_corner_that_is_covered_is_none():
    board = board_of({"kind": "charuco", "squares": [7, 5], "dictionary": "4X4_50",
                      "square_m": 0.02, "tag_m": 0.015})  # fmt: skip
    corners = exact(board, POSE)
    image = noisy(picture(board, POSE), np.random.default_rng(2))
    assert np.isfinite(board.find(image)).all()
    x, y = corners[8].round().astype(int)
    image[y - 12 : y + 12, x - 12 : x + 12] = 90
    found = board.find(image)
    assert np.isnan(found[8]).all() and np.isfinite(found[:, 0]).sum() >= 20


def corners_at(x, y):
    return [x, y] + 20.0 * np.indices((4, 3)).reshape(2, -1).T


def test_where_the_board_should_be_next():
    """Moving on as it did, with a margin of a part of its longer side of 60 pixels."""
    margin = REGION_MARGIN * 60
    still = expected_region(corners_at(200, 100), None, (400, 600))
    assert (still.x0, still.y0) == (int(200 - margin), int(100 - margin))
    assert (still.x1, still.y1) == (int(np.ceil(260 + margin)), int(np.ceil(140 + margin)))
    moved = expected_region(corners_at(210, 95), corners_at(200, 100), (400, 600))
    assert (moved.x0 - still.x0, moved.y1 - still.y1) == (20, -10)
    cut = expected_region(corners_at(5, 380), None, (400, 600))
    assert (cut.x0, cut.y1) == (0, 400)
    assert expected_region(corners_at(700, 100), None, (400, 600)) is None
    assert expected_region(corners_at(200, -200), None, (400, 600)) is None
