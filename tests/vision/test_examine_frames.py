"""Frames that show too little, too much or nothing: small pictures of known levels."""

import re

import cv2
import numpy as np
import pandas as pd
import pytest
from palpate.examine import examine_frames, examine_scene

SENSOR = {
    "kind": "depth",
    "range_m": [0.5, 1.5],
    "color": {"encoding": "mono8"},
    "depth": {"encoding": "millimetre"},
}


def folder_of(path, color, depth=None, times=(0.0, 0.1)):
    """Frames of one picture each."""
    rows = [(k, time, f"color/{k}.png", f"depth/{k}.png") for k, time in enumerate(times)]
    depth = np.full((40, 60), 800, np.uint16) if depth is None else depth
    for name, image in (("color", color), ("depth", depth)):
        (path / name).mkdir(parents=True, exist_ok=True)
        for k in range(len(times)):
            cv2.imwrite(str(path / f"{name}/{k}.png"), image)
    table = pd.DataFrame(rows, columns=["frame", "time_s", "color", "depth"])
    table.to_csv(path / "frames.csv", index=False)
    return path


def grey(level=100):
    return np.full((40, 60), level, np.uint8)


def test_gaps_between_frames(tmp_path):
    even = examine_frames(folder_of(tmp_path, grey(), times=[0.0, 0.2, 0.4, 0.7]), SENSOR)
    assert even.found[0] == "4 frames over 0.70 s (5.0 Hz), 60 x 40 px" and not even.doubts
    (line,) = examine_frames(folder_of(tmp_path, grey(), times=[0, 0.2, 0.4, 1.2]), SENSOR).doubts
    assert line.endswith("time_s: expected frames about 0.200 s apart, found a gap of 0.80 s")


@pytest.mark.parametrize(("level", "fine"), [(14, False), (15, True), (240, True), (241, False)])
def test_frames_that_are_dark_or_overexposed(tmp_path, level, fine):
    assert (not examine_frames(folder_of(tmp_path, grey(level)), SENSOR).doubts) == fine


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
    folders = folder_of(tmp_path / "a", picture), folder_of(tmp_path / "b", grey())
    found = examine_scene(*folders, SENSOR)
    if line is None:
        assert not found.doubts and found.found[0].endswith("% of the picture new")
        # Blurred by seven pixels, a third of a step of sixty reaches one column farther.
        assert int(found.found[0].split("%")[0]) == pytest.approx(100 * 21 / 60, abs=2)
    else:
        assert re.search(line, found.doubts[0]) and not found.found


@pytest.mark.parametrize(
    ("rows", "depth_mm", "line"),
    [
        (20, 900, None),
        (7, 900, None),
        (5, 900, "depth: expected readings in 30% of the middle or more, found 25%"),
        (0, 900, "depth: expected readings in the middle, found none"),
        (20, 90, "found 0.09 m in the middle (what does a count stand for?)"),
    ],
)
def test_depths_of_the_middle(tmp_path, rows, depth_mm, line):
    """Of its 20 rows so many have readings."""
    image = np.zeros((40, 60), np.uint16)
    image[: 10 + rows] = depth_mm
    found = examine_frames(folder_of(tmp_path, grey(), image), SENSOR)
    wrong = found.wrong + found.doubts
    assert [one.endswith(line) for one in wrong] == [True] if line else not wrong
    if rows and depth_mm == 900:
        assert found.found[-1] == f"depth in {5 * rows}%, 0.90 m"
