"""Corners compared with all others, and with what is printed about them."""

import numpy as np
import pytest
from palpate.vision.board import Board
from palpate.vision.camera import PinholeCamera
from palpate.vision.corners import off_others, without_outliers
from palpate.vision.marker import board_of
from printed_boards import exact, noisy, picture

BOARD = Board(9, 6, 0.03)
BENT = PinholeCamera(640, 480, 530.0, 530.0, 330.0, 235.0, (-0.28, 0.07, 0, 0, 0))
SHAPE = 480, 640
POSE = np.eye(4)
POSE[:3, 3] = [-0.15, -0.08, 0.4]


def test_a_lens_is_no_error():
    corners = exact(BOARD, POSE, BENT)
    assert off_others(corners, BOARD.points_m, SHAPE).max() < 0.3
    noise = np.random.default_rng(0).normal(0, 0.1, corners.shape)
    assert np.isfinite(without_outliers(corners + noise, BOARD.points_m, SHAPE)).all()


@pytest.mark.parametrize("size_px", [2.0, 5.0, 13.0])
@pytest.mark.parametrize("wrong", [[0], [8, 17, 26], [3, 22, 40, 50]], ids=["one", "edge", "four"])
def test_wrong_corners_go_and_no_others(wrong, size_px):
    rng = np.random.default_rng(1)
    corners = exact(BOARD, POSE, BENT) + rng.normal(0, 0.1, (54, 2))
    angles = rng.uniform(0, 2 * np.pi, len(wrong))
    corners[wrong] += size_px * np.column_stack([np.cos(angles), np.sin(angles)])
    kept = without_outliers(corners, BOARD.points_m, SHAPE)
    assert np.flatnonzero(np.isnan(kept[:, 0])).tolist() == wrong


def test_too_few_corners_contradict_nothing():
    corners = np.full((54, 2), np.nan)
    corners[:5] = np.random.default_rng(0).uniform(0, 400, (5, 2))
    assert without_outliers(corners, BOARD.points_m, SHAPE) == pytest.approx(corners, nan_ok=True)


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
