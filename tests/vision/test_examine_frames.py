"""Frames that show too little, too much or nothing: small pictures of known levels."""

import re

import cv2
import numpy as np
import pandas as pd
import pytest
from palpate.vision.examine_frames import (
    _light,
    _timing,
    examine_frames,
    examine_scene,
)

SENSOR = {
    "kind": "depth",
    "range_m": [0.5, 1.5],
    "color": {"encoding": "mono8"},
    "depth": {"encoding": "millimetre"},
}


def folder_of(path, color, depth=None):
    """Two frames of one picture each."""
    for name in ("color", "depth"):
        (path / name).mkdir(parents=True, exist_ok=True)
    rows = []
    for k in range(2):
        cv2.imwrite(str(path / f"color/{k}.png"), color)
        cv2.imwrite(str(path / f"depth/{k}.png"), np.full((40, 60), 800, np.uint16))
        if depth is not None:
            cv2.imwrite(str(path / f"depth/{k}.png"), depth)
        rows.append((k, k / 10, f"color/{k}.png", f"depth/{k}.png"))
    table = pd.DataFrame(rows, columns=["frame", "time_s", "color", "depth"])
    table.to_csv(path / "frames.csv", index=False)
    return path


def grey(level=100):
    return np.full((40, 60), level, np.uint8)


def test_gaps_between_frames(tmp_path):
    def told(times):
        return _timing(tmp_path, pd.DataFrame({"time_s": times}), (480, 640))

    even = told([0.0, 0.2, 0.4, 0.7])
    assert even.found == ("4 frames over 0.70 s (5.0 Hz), 640 x 480 px",) and not even.doubts
    (line,) = told([0.0, 0.2, 0.4, 1.2]).doubts
    assert line.endswith("time_s: expected frames about 0.200 s apart, found a gap of 0.80 s")


@pytest.mark.parametrize(("level", "fine"), [(14, False), (15, True), (240, True), (241, False)])
def test_frames_that_are_dark_or_overexposed(tmp_path, level, fine):
    assert (not _light(tmp_path, grey(level)).doubts) == fine


@pytest.mark.parametrize(
    ("pixels", "line"),
    [
        (0, "object and probe, which the background must not hold, found 0.00% of the picture"),
        (20, None),
        (33, "the background's scene .same place, same light., found [67].% of the picture"),
    ],
)
def test_a_scene_against_its_background(tmp_path, pixels, line):
    """Of sixty columns so many have changed by sixty grey levels."""
    picture = grey()
    picture[:, : pixels + 5 * (pixels > 30)] += 60
    found = examine_scene(
        folder_of(tmp_path / "a", picture), folder_of(tmp_path / "b", grey()), SENSOR
    )
    if line is None:
        assert not found.doubts and found.found[0].endswith("% of the picture new")
        # Blurred by seven pixels, a third of a step of sixty reaches one column farther.
        assert int(found.found[0].split("%")[0]) == pytest.approx(100 * 21 / 60, abs=2)
    else:
        assert re.search(line, found.doubts[0]) and not found.found


def test_depths_that_are_mostly_missing(tmp_path):
    """Of 20 rows in the middle seven have readings, then five."""
    for rows, doubted in ((7, False), (5, True)):
        image = np.full((40, 60), 0, np.uint16)
        image[10 : 10 + rows] = 900
        image[:10] = 900
        found = examine_frames(folder_of(tmp_path / str(rows), grey(), image), SENSOR)
        assert bool(found.doubts) == doubted
        assert found.found[-1] == f"depth in {5 * rows}%, 0.90 m"
