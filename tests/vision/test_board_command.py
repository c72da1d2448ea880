"""``palpate board``: sheets to scale, and the block for the probe's file."""

import re

import cv2
import matplotlib as mpl
import numpy as np
import pytest
import yaml
from palpate.__main__ import main
from palpate.commands.board import MARGIN_MM, draw_sheet
from palpate.config.probe import TargetFile
from palpate.vision.marker import board_of

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
