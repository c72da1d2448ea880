"""Corners held to all others, and to what is printed about them."""

import numpy as np
import pytest
from palpate.vision.board import Board
from palpate.vision.camera import PinholeCamera
from palpate.vision.corners import in_sight, likeness, off_others, refined, without_outliers
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
    spoilt = corners.copy()
    angles = rng.uniform(0, 2 * np.pi, len(wrong))
    spoilt[wrong] += size_px * np.column_stack([np.cos(angles), np.sin(angles)])
    kept = without_outliers(spoilt, BOARD.points_m, SHAPE)
    gone = np.flatnonzero(np.isnan(kept[:, 0]))
    assert gone.tolist() == wrong


def test_too_few_corners_contradict_nothing():
    corners = np.full((54, 2), np.nan)
    corners[:5] = np.random.default_rng(0).uniform(0, 400, (5, 2))
    assert np.isnan(off_others(corners, BOARD.points_m, SHAPE)).all()
    assert without_outliers(corners, BOARD.points_m, SHAPE) == pytest.approx(corners, nan_ok=True)


def test_a_corner_looks_like_what_is_printed():
    board = Board(6, 5, 0.02)
    pose = np.eye(4)
    pose[:3, 3] = [-0.05, -0.04, 0.5]
    corners, rng = exact(board, pose), np.random.default_rng(2)
    image = noisy(picture(board, pose), rng)
    alike = likeness(image, corners, board.points_m, board.unit_m, board.print)
    assert alike.min() > 0.9
    # Turned by half a turn its black is white.
    alike = likeness(image, corners[::-1], board.points_m, board.unit_m, board.print)
    assert alike.max() < -0.9
    covered = image.copy()
    x, y = corners[7].round().astype(int)
    covered[y - 12 : y + 12, x - 12 : x + 12] = 90
    seen = np.isfinite(in_sight(covered, corners, board)[:, 0])
    assert not seen[7] and seen.sum() >= 25


def test_refined_unless_that_is_worse():
    """Corners a little off go to the edges; exact ones in a picture without edges stay."""
    board = Board(6, 5, 0.02)
    pose = np.eye(4)
    pose[:3, 3] = [-0.05, -0.04, 0.5]
    corners, rng = exact(board, pose), np.random.default_rng(3)
    start = corners + rng.normal(0, 0.5, corners.shape)
    image = noisy(picture(board, pose), rng)
    assert np.abs(refined(image, start, board.points_m) - corners).max() < 0.15
    noise = rng.integers(0, 255, image.shape, dtype=np.uint8)
    assert np.array_equal(refined(noise, corners, board.points_m), corners)
