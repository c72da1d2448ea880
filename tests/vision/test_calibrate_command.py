"""Cameras of real pictures by command and by the stage, and of other programs' files."""

import json
import shutil

import cv2
import numpy as np
import pandas as pd
import pytest
import yaml
from boards import LEFT, RIGHT, RIGHT_FROM_LEFT
from palpate.__main__ import main
from palpate.capture.images import write_image
from palpate.config.sensor import ColorSpec, DepthSpec
from palpate.vision.camera import opencv_text
from thesis.chapter4.calibration import equation_4_12, table_4_1

PART = "camera"
BOARD = ("--inner-corners", "9x6", "--square-mm", "30")


@pytest.fixture
def folders(root, tmp_path):
    """Seven real pairs, as two folders of pictures."""
    found = []
    for side in ("left", "right"):
        (tmp_path / side).mkdir()
        for path in sorted((root / "tests/real/boards").glob(f"{side}*.jpg"))[:7]:
            shutil.copy(path, tmp_path / side)
        found.append(tmp_path / side)
    return found


@pytest.fixture
def given(given):
    """What the command prints, as text and as YAML."""

    def printed(*arguments):
        text = given(*arguments)
        return text, yaml.safe_load(text)

    return printed


def fits(blocks):
    """Whether blocks hold what a sensor's file asks for in them."""
    for name, kind in (("color", ColorSpec), ("depth", DepthSpec)):
        if name in blocks:
            assert kind.read(blocks[name]) and set(blocks[name]) == {
                key for key, field in kind.model_fields.items() if field.is_required()
            }


def test_one_camera(folders, given):
    text, blocks = given(folders[0], *BOARD)
    assert blocks["color"]["fx_px"] == pytest.approx(533.0, abs=2.0)
    assert blocks["color"]["encoding"] == "mono8"
    assert "7 of 7 pictures count" in text
    assert "#   focal length: determined, to" in text
    fits(blocks)


def test_a_turned_board_is_the_same_board(folders, given):
    known = given(folders[0], *BOARD)[1]["color"]
    turned = given(folders[0], "--inner-corners", "6x9", "--square-mm", "30")[1]["color"]
    assert turned["fx_px"] == pytest.approx(known["fx_px"], abs=0.1)


def test_colour_and_depth(folders, capsys, tmp_path):
    out = tmp_path / "sensor.yaml"
    arguments = (*folders, *BOARD, "--kind", "depth", "--sensor", "bench", "--output", out)
    assert main(["calibrate", "camera", *map(str, arguments)]) == 0
    assert f"written: {out}" in capsys.readouterr().out
    blocks = yaml.safe_load(out.read_text())
    assert (blocks["sensor"], blocks["kind"]) == ("bench", "depth")
    assert blocks["depth"]["color_from_depth"][0][3] == pytest.approx(0.0998, abs=5e-4)
    assert "baseline 99." in out.read_text()
    fits(blocks)


def test_a_stereo_head_has_the_rectified_camera(folders, given, tmp_path):
    path = tmp_path / "pair.yml"
    text, blocks = given(*folders, *BOARD, "--kind", "stereo", "--opencv", path)
    assert blocks["stereo"]["baseline_m"] == pytest.approx(0.0998, abs=5e-4)
    assert not any(blocks["color"]["distortion"])
    assert "the camera of the rectified pictures" in text
    again = given(path, "--kind", "stereo")[1]
    assert again["stereo"] == blocks["stereo"]
    assert again["color"] == blocks["color"] | {"encoding": "rgb8"}
    fits(blocks)


def test_pairs_by_equal_names(folders, given):
    left, right = folders
    for path in right.iterdir():
        path.rename(right / path.name.replace("right", "left"))
    (left / "left03.jpg").unlink()
    text, _ = given(left, right, *BOARD, "--kind", "depth")
    assert "by 6 pairs" in text


def test_pictures_of_16_bits(folders, given):
    """An infrared camera's, of which few use the whole range."""
    for path in folders[0].iterdir():
        grey = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE).astype(np.uint16) * 12
        cv2.imwrite(str(path.with_suffix(".png")), grey)
        path.unlink()
    _, blocks = given(folders[0], *BOARD)
    assert blocks["color"]["fx_px"] == pytest.approx(533.0, abs=2.0)


def test_another_programs_pair(given, tmp_path):
    path = tmp_path / "pair.yml"
    path.write_text(opencv_text((LEFT, RIGHT), RIGHT_FROM_LEFT))
    _, blocks = given(path, "--kind", "depth")
    assert blocks["depth"]["fx_px"] == RIGHT.fx_px
    back = np.array(blocks["depth"]["color_from_depth"]) @ RIGHT_FROM_LEFT
    assert back == pytest.approx(np.eye(4), abs=1e-7)


DEPTH, STEREO = (*BOARD, "--kind", "depth"), (*BOARD, "--kind", "stereo")


def test_pictures_that_are_rejected(folders, refused):
    left, right = folders
    one, pixels = left / "left04.jpg", cv2.imread(str(left / "left04.jpg"))
    whole = one.read_bytes()
    assert "stereo: expected the left camera first" in refused(right, left, *STEREO)
    one.write_bytes(b"no picture")
    line = "left04.jpg: picture: expected PNG, TIFF or JPEG, found one that can't"
    assert line in refused(left, *BOARD)
    cv2.imwrite(str(one), pixels[:240, :320])
    line = "left04.jpg: picture: expected 640 x 480 pixels as the first, found 320 x"
    assert line in refused(left, *BOARD)
    one.write_bytes(whole)
    shutil.copy(one, left / "left04.png")
    assert "expected one picture of a name, found left04 twice" in refused(left, *BOARD)
    (left / "left04.png").unlink()
    (right / "right04.jpg").unlink()
    assert "right: pictures: expected 7 as in" in refused(left, right, *DEPTH)
    for path in left.iterdir():
        cv2.imwrite(str(path), np.full((480, 640), 90, dtype=np.uint8))
    assert "a board of 9 x 6 inner corners, found none in 7" in refused(left, *BOARD)


def test_options_and_sources_that_are_rejected(folders, refused, tmp_path):
    (tmp_path / "empty").mkdir()
    (tmp_path / "file.yaml").write_text("a: 1\n")
    one = folders[:1]
    for sources, options, line in (
        (one, (), "--inner-corners: expected the board's, found none"),
        (one, BOARD[:2], "--square-mm: expected the board's, found none"),
        (one, ("--inner-corners", "2x6", *BOARD[2:]), "expected 3x3 or more, found 2x6"),
        (one, (*BOARD[:3], "-3"), "--square-mm: expected 1 to 500 millimetres, found -3"),
        (one, (*BOARD[:3], "0.03"), "expected 1 to 500 millimetres, found 0.03 (metres?)"),
        (one, DEPTH, "--kind: expected none for one camera, found depth"),
        (folders, BOARD, "--kind: expected stereo or depth for two cameras, found none"),
        (one, (*BOARD, "--opencv", "x.yml"), "--opencv: expected two cameras and their transform"),
        ([tmp_path / "no"], BOARD, "expected a folder of pictures or a file, found none"),
        ([tmp_path / "empty"], BOARD, "expected PNG, TIFF or JPEG files, found none"),
        ([*folders, *one], BOARD, "expected one or two, found 3"),
        ([*one, tmp_path / "file.yaml"], BOARD, "two folders or two files, found one of each"),
    ):
        assert line in refused(*sources, *options)


SIDES = ("left", "right")


@pytest.fixture
def calibrate(root, stage, tmp_path):
    """Run the stage on eight real pairs; give calibration.json, or the line that it ends with."""

    def calibrated(streams, board="9,6"):
        folder, made = tmp_path / "calibration", tmp_path / "calibration.json"
        files = {
            side: sorted((root / "tests/real/boards").glob(f"{side}*.jpg"))[:8] for side in SIDES
        }
        rows = {"frame": range(8), "time_s": range(8)}
        for stream, side in zip(streams, SIDES, strict=True):
            rows[stream] = [f"{stream}/{path.stem}.png" for path in files[side]]
            for name, path in zip(rows[stream], files[side], strict=True):
                (folder / stream).mkdir(parents=True, exist_ok=True)
                grey = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
                write_image(folder / name, grey, "mono8")
        pd.DataFrame(rows).to_csv(folder / "frames.csv", index=False)
        (folder / "board.csv").write_text(f"columns,rows,square_m\n{board},0.03\n")
        files = {"inputs": {"pairs": folder}, "outputs": {"calibration": made.name}}
        return stage("camera_calibration", **files) or json.loads(made.read_text())

    return calibrated


@pytest.mark.parametrize("streams", [("infrared", "color"), SIDES])
def test_real_pairs(calibrate, root, streams):
    found = calibrate(streams)
    assert set(found["cameras"]) == set(streams)
    shift = np.array(found["{1}_from_{0}".format(*streams)])[:3, 3]
    assert shift[0] < 0 and found["baseline_m"] == pytest.approx(0.0998, abs=3e-4)
    assert np.linalg.norm(shift) == pytest.approx(found["baseline_m"])
    assert max(found["transform_standard_errors"]["translation_m"]) < 1e-3
    assert found["told"]["baseline"]
    assert "focal length: determined" in found["cameras"][streams[1]]["verdict"][0]
    if "color" in streams:
        published = root / "config/published"
        table = table_4_1(found, pd.read_csv(published / "table_4_1.csv"))
        assert table["views"].tolist() == [8, 8]
        assert len(equation_4_12(found, pd.read_csv(published / "equation_4_12.csv"))) == 4


def test_a_board_that_is_not_the_one_seen(calibrate):
    line = calibrate(SIDES, board="11,8")
    expected = "left: pictures: expected a board of 11 x 8 inner corners, found none in 8 pictures"
    assert expected in line
