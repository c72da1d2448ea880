"""A press over time, as a page tells it."""

import numpy as np
import pandas as pd
import pytest
from palpate.report.held import Held, press_of

# Down for 2 s at 2 mm/s, held for 1 s, and up; the camera takes five frames a second.
TIME = np.arange(0, 5.01, 0.2)
DEPTH = np.interp(TIME, [0, 1, 3, 4, 5], [-2e-3, 0, 4e-3, 4e-3, 0])
# The board is off, and goes on while the probe gives way.
BOARD_DEPTH = DEPTH - 1e-3 + 500 * np.maximum(DEPTH, 0) / 20e3


def held(**changes):
    fit = {
        "samples": {"force_n": (500 * np.maximum(DEPTH, 0)).tolist(), "depth_m": BOARD_DEPTH},
        "range": {"first_frame": 6, "last_frame": 15},
        "radius_m": 5e-3,
    }
    direct = {
        "frames": [15],
        "residuals": [{"cells": 80}],
    }
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


def test_what_a_capture_held():
    row = press_of(held())
    assert row["greatest force (N)"] == "2.00"
    assert row["greatest depth (mm)"] == "4.0"
    assert row["depth over radius of the tip"] == "0.80"
    assert row["frames"] == "26" and row["of them compared"] == "15"
    assert row["to the deepest (s)"] == "2.0" and row["held there (s)"] == "1.0"
