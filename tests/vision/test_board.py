"""Corners of drawn checkerboards, and where their order starts."""

import numpy as np
import pytest
from palpate.vision.board import Board
from palpate.vision.board_pictures import board_in

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
