"""Whether depth, or the other image of a stereo head, is of the colour's moments."""

import re
import shutil
from itertools import product

import cv2
import numpy as np
import pytest
import yaml
from palpate.capture.capture import open_capture
from palpate.examine import examine_object
from palpate.vision.follow import FEWEST_FRAMES, disagreement, followed, require_agreement
from palpate.vision.options import ProbePose
from palpate.vision.probe import MARKER

FRAMES = 24
TIME = np.linspace(0, 1, FRAMES)
# Rest, press and hold [mm].
PRESS_MM = 8 * np.clip((TIME - 0.3) / 0.4, 0, 1)
ORDERS = {
    "shuffled": np.random.default_rng(5).permutation(FRAMES),
    "reversed": np.arange(FRAMES)[::-1],
    "halves exchanged": np.roll(np.arange(FRAMES), FRAMES // 2),
}


def noisy(values, level, seed=0):
    return values + np.random.default_rng(seed).normal(scale=level, size=len(values))


@pytest.mark.parametrize("name", ORDERS)
def test_a_motion_in_another_order(name):
    given, resorted = disagreement(noisy(PRESS_MM, 0.1), noisy(PRESS_MM, 0.4, 1)[ORDERS[name]] + 30)
    assert given > 3 and resorted < 0.5


REST, FEW = noisy(0 * PRESS_MM, 0.1), PRESS_MM[::4]
NO_ORDER = {
    **{f"noise of {s} mm": (PRESS_MM, PRESS_MM, s) for s in (0.1, 0.5, 1, 2, 4, 8, 16)},
    "still": (PRESS_MM, 0 * PRESS_MM, 0.3),
    "another scale": (PRESS_MM, 0.2 * PRESS_MM, 0.3),
    "too large": (PRESS_MM, 5 * PRESS_MM, 0.3),
    "late": (PRESS_MM, np.roll(PRESS_MM, 2), 0.3),
    "off the board at the end": (PRESS_MM, PRESS_MM + 90 * (TIME > 0.9), 0.3),
    "at rest": (REST, REST[ORDERS["shuffled"]], 0.5),
    "few": (FEW, FEW[::-1], 0.0),
    **{
        f"{k} far off": (8 * TIME, 8 * TIME + 12 * (np.arange(FRAMES) == k), 0.3) for k in range(24)
    },
}


@pytest.mark.parametrize("what", NO_ORDER)
def test_what_is_wrong_in_other_ways_is_no_order(what):
    one, other, level = NO_ORDER[what]
    for seed in range(200 if "noise" in what else 1):
        assert disagreement(one, noisy(other, level, seed)) is None


PLACES = {
    "sample": ("tests/sample/raw/foam_block", "tests/sample/sensors", "config/probes"),
    "own": ("tests/own_object/raw/toy_cow", "tests/own_object/sensors", "tests/own_object/probes"),
}
CORNERS = ProbePose(refinement="corners")


@pytest.fixture
def opened(root, tmp_path):
    def of(capture, place="sample", *, copied=False):
        objects, sensors, probes = (root / part for part in PLACES[place])
        if copied:
            objects = shutil.copytree(objects, tmp_path / objects.name)
        return open_capture(objects / capture, sensors=sensors, probes=probes)

    return of


def follow(one, **marker):
    """The probe through a capture, with other numbers of its board."""
    probe = one.probe | {"marker": one.probe["marker"] | marker}
    return followed(one.folder, one.sensor, probe, CORNERS)


@pytest.mark.parametrize(
    ("place", "capture", "stream", "line"),
    [
        ("sample", "kinect/08", "depth", "depth: expected the board where color shows it"),
        ("own", "bench_cam/back", "depth", "depth: expected the board where color shows it"),
        ("sample", "bumblebee/08", "right", "right: expected the board where left shows it"),
    ],
)
def test_a_capture_whose_second_images_are_permuted(opened, place, capture, stream, line):
    one = opened(capture, place, copied=True)
    poses, table, path = follow(one), one.frames, one.folder / "frames.csv"
    table[stream] = np.random.default_rng(5).permutation(table[stream].to_numpy())
    table.to_csv(path, index=False)
    with pytest.raises(ValueError, match=f"^{path}: {line}, frame by frame, found it "):
        require_agreement(one.folder, one.sensor, one.probe["marker"], poses)


# A sheet printed at 97 % too: a stereo head knows distances to parts of a per cent.
@pytest.mark.parametrize(
    ("capture", "square_m"),
    [*product(("kinect/08", "bumblebee/08"), (0.9, 1.1)), ("bumblebee/08", 1 / 0.97)],
)
def test_squares_of_another_size(opened, capture, square_m):
    one = opened(capture)
    with pytest.raises(ValueError, match=r"marker.square_m: .*\(squares of 0.0\d+ m for") as found:
        follow(one, square_m=square_m * one.probe["marker"]["square_m"])
    by_stream, by_corners = map(float, re.findall(r"([0-9.]+) m(?: away| by)", str(found.value)))
    assert by_corners / by_stream == pytest.approx(square_m, abs=0.02)


def test_a_pair_that_is_not_rectified(opened):
    """The right picture four rows lower."""
    one = opened("bumblebee/08", copied=True)
    for path in sorted((one.folder / "right").glob("*.png")):
        image = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
        cv2.imwrite(str(path), np.roll(image, 4, axis=0))
    with pytest.raises(ValueError, match=r"right: expected a rectified pair, .* \+4\.0 px"):
        follow(one)


@pytest.mark.parametrize("left_out", ["frames", "range"])
def test_too_little_to_compare_is_said(opened, caplog, left_out):
    """A board at another distance is not told by a few frames, nor by readings out of range."""
    caplog.set_level("INFO")
    one = opened("kinect/08")
    poses = follow(one)
    assert "not compared" not in caplog.text
    poses[MARKER] *= 0.9
    marker, sensor = one.probe["marker"], one.sensor
    with pytest.raises(ValueError, match="marker.square_m: expected the board "):
        require_agreement(one.folder, sensor, marker, poses)
    if left_out == "frames":
        poses = poses.iloc[: FEWEST_FRAMES - 1]
    else:
        sensor = sensor | {"range_m": [2.0, 4.0]}
    require_agreement(one.folder, sensor, marker, poses)
    assert "depth: the board is not compared with that of color" in caplog.text


def test_an_image_that_can_not_be_decoded_is_one_line(root, opened):
    sensor = opened("bench_cam/back", "own", copied=True).folder.parent
    spoilt = [sensor / name for name in ("back/color/000004.png", "background/color/000000.png")]
    for path in spoilt:
        content = bytearray(path.read_bytes())
        content[len(content) // 2] ^= 255
        path.write_bytes(content)
    devices = (
        {path.stem: yaml.safe_load(path.read_text()) for path in (root / part).glob("*.yaml")}
        for part in PLACES["own"][1:]
    )
    found = examine_object(sensor.parent, *devices)
    expected = [f"{path}: image: expected a whole PNG" for path in spoilt]
    assert sorted(line.partition(", found")[0] for line in found.wrong) == sorted(expected)
    assert any("bench_cam/back-a02: 12 frames" in line for line in found.found)
