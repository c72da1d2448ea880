"""Boards: corners, their order, what of them is wrong or hidden, and sheets to print."""

import re

import cv2
import matplotlib as mpl
import numpy as np
import pytest
import yaml
from boards import exact, noisy, picture
from palpate.__main__ import main
from palpate.commands.board import MARGIN_MM, draw_sheet
from palpate.config.probe import TargetFile
from palpate.vision.board import Board
from palpate.vision.camera import PinholeCamera
from palpate.vision.corners import off_others, without_outliers
from palpate.vision.marker import board_of

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


SHEETS = {
    "charuco": ["--squares", "7x5", "--square-mm", "15"],
    "aprilgrid": ["--tags", "4x3", "--tag-mm", "20", "--gap-mm", "6"],
    "checkerboard": ["--squares", "5x4", "--square-mm", "20"],
}

CHARUCO = ["charuco", "--squares", "7x5"]


def sheet(folder, kind="charuco", name="board.svg"):
    """Write a sheet, and give its path."""
    assert main(["board", kind, *SHEETS[kind], "--output", str(folder / name)]) == 0
    return folder / name


@pytest.mark.parametrize("kind", SHEETS)
def test_the_block_describes_the_sheet(kind, tmp_path, capsys):
    """Rasterised at ten pixels a millimetre, the board that the block describes is found there."""
    sheet(tmp_path, kind)
    content = yaml.safe_load(capsys.readouterr().out.partition("\n")[2])
    assert TargetFile.read(content)
    board = board_of(content["marker"])
    with mpl.rc_context({"savefig.dpi": 254}):
        draw_sheet(board, "a board", tmp_path / "board.png")
    found = board.find(cv2.imread(str(tmp_path / "board.png"), cv2.IMREAD_GRAYSCALE))
    places_mm = (board.points_m[:, :2] - board.outline_m[0]) * 1e3 + MARGIN_MM
    assert np.abs(found - (10 * places_mm - 0.5)).max() < 0.02


@pytest.mark.parametrize("form", ["pdf", "svg"])
def test_the_same_sheet_has_the_same_bytes(form, tmp_path):
    first, second = (sheet(tmp_path, name=f"{name}.{form}").read_bytes() for name in "ab")
    assert first == second


def test_a_sheet_is_as_large_as_what_is_on_it(tmp_path):
    width, height = re.findall(r'(?:width|height)="([0-9.]+)pt"', sheet(tmp_path).read_text())[:2]
    assert float(width) / 72 * 25.4 == pytest.approx(7 * 15 + 20, abs=0.01)
    assert float(height) / 72 * 25.4 == pytest.approx(5 * 15 + 36, abs=0.01)


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        (["charuco"], "--squares: expected two counts, found none"),
        (CHARUCO, "board: marker.square_m: expected a value, found nothing"),
        ([*CHARUCO, "--square-mm", "15", "--tag-mm", "16"], "in square_m (0.015), found 0.016"),
        (
            [*CHARUCO, "--square-mm", "15", "--gap-mm", "3"],
            "gap_m: expected none with kind charuco",
        ),
        ([*CHARUCO, "--square-mm", "15", "--dictionary", "9X9"], "dictionary: expected one"),
        (["charuco", "--square-mm", "5", "--squares", "20x20"], "200 tags or more, found 50"),
        (["checkerboard", "--square-mm", "9", "--squares", "5x5"], "one odd and one even"),
        (["aprilgrid", "--tags", "4x3", "--tag-mm", "9"], "marker.gap_m: expected a value"),
        (["charuco", *SHEETS["charuco"]], "--output: expected a file that ends with .pdf or .svg"),
    ],
)
def test_boards_that_cannot_be_printed(arguments, line, tmp_path, capsys):
    path = tmp_path / ("board.png" if "--output" in line else "board.pdf")
    assert main(["board", *arguments, "--output", str(path)]) == 1
    assert line in capsys.readouterr().err
    assert not path.exists()
