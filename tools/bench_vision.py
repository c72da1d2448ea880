"""Figures of speed and memory of what sees: marker, background, stereo."""

import tracemalloc
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import yaml
from palpate.capture.streams import Stream, all_streams
from palpate.vision.background import build_model
from palpate.vision.camera import camera_from_spec
from palpate.vision.depth import stereo_disparity
from palpate.vision.foreground import Classifier
from palpate.vision.marker import board_of, expected_region, find_corners
from palpate.vision.photometric import BoardRefiner
from palpate.vision.pose import candidate_poses

ROOT = Path(__file__).resolve().parents[1]
SAMPLE = ROOT / "tests/sample/raw/foam_block/bumblebee"
# The sample is smaller than the study's stereo head; pictures are brought to its size.
SIZE = (1024, 768)


def vision_rows(ratio: Callable) -> list[tuple]:
    """Rows of the bench; ``ratio`` measures two functions in turn."""
    cv2.setNumThreads(1)
    sensor, probe, options = (
        yaml.safe_load((ROOT / path).read_text(encoding="utf-8"))
        for path in (
            "tests/sample/sensors/bumblebee.yaml",
            "config/probes/nano25_sphere.yaml",
            "config/config.yaml",
        )
    )
    rows = marker_rows(ratio, sensor, probe)
    rows += background_rows(ratio, sensor, dict(options["background"]))
    return rows + stereo_rows(ratio, sensor)


def marker_rows(ratio: Callable, sensor: dict, probe: dict) -> list[tuple]:
    """Pose of the marker, followed, against the detection in whole frames."""
    board = board_of(probe["marker"])
    greys = [
        cv2.resize(cv2.cvtColor(image, cv2.COLOR_RGB2GRAY), SIZE, interpolation=cv2.INTER_CUBIC)
        for image in Stream(SAMPLE / "08", sensor)
    ]
    scale = SIZE[0] / sensor["color"]["width_px"]
    spec = {key: sensor["color"][key] * scale for key in ("fx_px", "fy_px", "cx_px", "cy_px")}
    camera = camera_from_spec(spec | {"width_px": SIZE[0], "height_px": SIZE[1]})
    refine = BoardRefiner(camera, board, encoding="mono8")
    corners = [find_corners(grey, board) for grey in greys]
    threshold_px = sensor["marker"]["reprojection_threshold_px"]

    def detect():
        for grey in greys:
            find_corners(grey, board)

    def follow(refined=False):
        for grey, last in zip(greys, [corners[0], *corners[:-1]], strict=True):
            found = find_corners(grey, board, expected_region(last, None, grey.shape))
            poses = candidate_poses(found, camera, board, threshold_px=threshold_px)
            if refined:
                refine(grey, poses[0].camera_from_marker)

    against = "detection in whole frames of 1024 x 768"
    return [
        ("marker pose, followed", ratio(follow, detect), "times the frames/s", against),
        (
            "marker pose, followed and refined on the picture",
            ratio(lambda: follow(refined=True), detect),
            "times the frames/s",
            against,
        ),
    ]


def background_rows(ratio: Callable, sensor: dict, options: dict) -> list[tuple]:
    """Classification against MOG2, and memory against the number of frames."""
    rate = options.pop("false_positive_rate")
    options.pop("largest_shift_px")
    empty = [cv2.resize(image, SIZE) for image in Stream(SAMPLE / "background", sensor)]
    image = cv2.resize(Stream(SAMPLE / "08", sensor)[0], SIZE)
    classify = Classifier(build_model(empty, false_positive_rate=rate), **options)
    mog = cv2.createBackgroundSubtractorMOG2(history=len(empty))
    for frame in empty:
        mog.apply(frame)

    def theirs():
        mog.apply(image, learningRate=0)

    few, many = (
        traced(lambda n=n: build_model(Many(empty, n), false_positive_rate=rate)) for n in (8, 80)
    )
    return [
        (
            "background, classification of pixels",
            ratio(lambda: classify.pixels(image), theirs),
            "times the megapixels/s",
            "OpenCV's MOG2",
        ),
        (
            "background, with morphology and blobs",
            ratio(lambda: classify(image), theirs),
            "times the megapixels/s",
            "OpenCV's MOG2 without any",
        ),
        ("background, memory of 80 frames", many / few, "times", "memory of 8 frames"),
    ]


def stereo_rows(ratio: Callable, sensor: dict) -> list[tuple]:
    """A stereo cloud against plain semi-global matching."""
    images = next(all_streams(SAMPLE / "08", sensor))
    left, right = (cv2.resize(images[side], SIZE) for side in ("left", "right"))
    scale = SIZE[0] / sensor["color"]["width_px"]
    sensor = sensor | {"color": sensor["color"] | {"fx_px": sensor["color"]["fx_px"] * scale}}
    product = sensor["color"]["fx_px"] * sensor["stereo"]["baseline_m"]
    first, last = (product / distance for distance in reversed(sensor["range_m"]))
    count = int(np.ceil((last - int(first)) / 16)) * 16
    window = sensor["stereo"]["window_px"]
    plain = cv2.StereoSGBM.create(
        int(first), count, 5, 8 * 25, 32 * 25, mode=cv2.STEREO_SGBM_MODE_SGBM_3WAY
    )
    greys = [cv2.cvtColor(image, cv2.COLOR_RGB2GRAY) for image in (left, right)]
    study = sensor | {"stereo": sensor["stereo"] | {"method": "block", "subpixel": "matcher"}}

    def theirs():
        plain.compute(*greys)

    return [
        (
            f"stereo disparity, least squares in {window} x {window}",
            1 / ratio(lambda: stereo_disparity(left, right, sensor), theirs),
            "times the seconds",
            "plain StereoSGBM",
        ),
        (
            "stereo disparity, block matching as the study's",
            1 / ratio(lambda: stereo_disparity(left, right, study), theirs),
            "times the seconds",
            "plain StereoSGBM",
        ),
        (
            "stereo disparity of the sample, 640 x 480",
            seconds(lambda: stereo_disparity(images["left"], images["right"], sensor)),
            "s",
            "",
        ),
    ]


class Many:
    """A few frames as if they were many."""

    def __init__(self, frames: list, count: int) -> None:
        self.frames, self.count = frames, count

    def __len__(self) -> int:
        return self.count

    def __getitem__(self, k: int) -> np.ndarray:
        return self.frames[k % len(self.frames)]


def traced(function: Callable) -> float:
    """Largest memory that a function takes [bytes]."""
    tracemalloc.start()
    function()
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    return float(peak)


def seconds(function: Callable) -> float:
    """Median time of a function [s]."""
    times = []
    for _ in range(5):
        start = cv2.getTickCount()
        function()
        times.append((cv2.getTickCount() - start) / cv2.getTickFrequency())
    return float(np.median(times))
