"""What an object's results follow from: files by their checksums, captures over time."""

import hashlib

import numpy as np
import pandas as pd
import pytest
from palpate.report.held import Held
from palpate.report.settings_words import checksums


def test_checksums_are_those_of_files_and_follow_names_and_content(tmp_path):
    file, folder = tmp_path / "a.csv", tmp_path / "capture"
    file.write_text("x\n")
    (folder / "color").mkdir(parents=True)
    (folder / "color/0.png").write_bytes(b"0")
    (folder / ".hidden").write_text("of an editor")
    named = {"a": str(file), "capture": str(folder)}

    def found():
        return {row["file"]: row["SHA-256"] for row in checksums(named)}

    before = found()
    assert before["a"] == hashlib.sha256(b"x\n").hexdigest()
    (folder / ".hidden").unlink()
    assert found() == before
    (folder / "color/0.png").rename(folder / "color/1.png")
    renamed = found()
    (folder / "color/1.png").write_bytes(b"1")
    assert len({before["capture"], renamed["capture"], found()["capture"]}) == 3


# Down for 2 s at 2 mm/s, held for 1 s, and up; the camera takes five frames a second.
TIME = np.arange(0, 5.01, 0.2)
DEPTH = np.interp(TIME, [0, 1, 3, 4, 5], [-2e-3, 0, 4e-3, 4e-3, 0])
# The target has an offset, and goes on while the probe bends.
BOARD_DEPTH = DEPTH - 1e-3 + 500 * np.maximum(DEPTH, 0) / 20e3


def held(**changes):
    fit = {
        "samples": {"force_n": (500 * np.maximum(DEPTH, 0)).tolist(), "depth_m": BOARD_DEPTH},
        "range": {"first_frame": 6, "last_frame": 15},
        "radius_m": 5e-3,
    }
    direct = {"frames": [15], "residuals": [{"cells": 80}]}
    tips = {"tip_x_m": 0.0, "tip_y_m": 0.3, "tip_z_m": 0.4, "raw_tip_std_along_m": 5e-5}
    poses = pd.DataFrame({"time_s": 10 + TIME} | tips)
    return Held(
        {"sensor": "cam", "capture": "1"} | changes, fit, direct, poses, DEPTH, np.arange(6, 21)
    )


def test_times_of_a_press_are_those_of_its_depths():
    one = held()
    assert one.seconds_to(1e-3) == pytest.approx(0.5)
    assert one.seconds_to(3.3e-3) == pytest.approx(1.65)
    # What the press did not reach is its deepest.
    assert one.seconds_to(1.0) == one.seconds_to(np.inf) == pytest.approx(2.0)
    assert one.hold_s == pytest.approx(1.0)
    # The last frame that was compared is at 4 s, the touch at 1 s.
    assert one.compared_s == pytest.approx(3.0)
    assert one.rate_hz == pytest.approx(5.0)
    assert one.distance_m == pytest.approx(0.5)
