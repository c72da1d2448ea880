"""The stage that calibrates two cameras, on real pairs of pictures."""

import json

import cv2
import numpy as np
import pandas as pd
import pytest
from palpate.capture.images import write_image
from thesis.chapter4.calibration import equation_4_12, table_4_1

SIDES = ("left", "right")
BOARD = "columns,rows,square_m\n{},0.03\n"


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
        (folder / "board.csv").write_text(BOARD.format(board))
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
