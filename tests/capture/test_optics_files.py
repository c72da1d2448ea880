"""Optics as Kalibr, OpenCV and ROS write them."""

from pathlib import Path

import cv2
import numpy as np
import pytest
from palpate.capture.importing.optics_files import read_optics

KALIBR = """\
cam0:
  camera_model: pinhole
  intrinsics: [461.6, 460.3, 363.0, 248.1]
  distortion_model: radtan
  distortion_coeffs: [-0.27, 0.06, 0.0008, 0.0003]
  resolution: [752, 480]
cam1:
  camera_model: pinhole
  intrinsics: [460.2, 459.0, 379.4, 255.2]
  distortion_model: radtan
  distortion_coeffs: [-0.26, 0.05, 0.0008, 0.0002]
  resolution: [752, 480]
  T_cn_cnm1:
  - [1.0, 0.0, 0.0, -0.11]
  - [0.0, 1.0, 0.0, 0.0004]
  - [0.0, 0.0, 1.0, -0.0008]
  - [0.0, 0.0, 0.0, 1.0]
"""
ROS = """\
image_width: 640
image_height: 480
camera_name: left
camera_matrix: {{rows: 3, cols: 3, data: [520.0, 0.0, 315.0, 0.0, 522.0, 236.0, 0.0, 0.0, 1.0]}}
distortion_model: plumb_bob
distortion_coefficients: {{rows: 1, cols: 5, data: [-0.25, 0.08, 0.0, 0.0, 0.0]}}
rectification_matrix: {{rows: 3, cols: 3, data: [1, 0, 0, 0, 1, 0, 0, 0, 1]}}
projection_matrix: {{rows: 3, cols: 4, data: [510.0, 0, 320.0, {}, 0, 510.0, 240.0, 0, 0, 0, 1, 0]}}
"""
MATRIX = "{}: !!opencv-matrix\n   rows: {}\n   cols: {}\n   dt: d\n   data: {}\n"
K = [520.0, 0.0, 315.0, 0.0, 522.0, 236.0, 0.0, 0.0, 1.0]
SIZE = (640, 480)


def opencv(**matrices):
    rows = (MATRIX.format(name, *matrix) for name, matrix in matrices.items())
    return "%YAML:1.0\n---\n" + "".join(rows)


PAIR = {
    "M1": (3, 3, K),
    "D1": (1, 5, [-0.25, 0.08, 0.0, 0.0, 0.0]),
    "M2": (3, 3, K),
    "D2": (1, 14, [0.1, *[0.0] * 13]),
    "R": (3, 3, [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]),
    "T": (3, 1, [-0.1, 0.0, 0.0]),
}


@pytest.fixture
def written(tmp_path):
    def write(*texts):
        paths = [tmp_path / f"{k}.yaml" for k in range(len(texts))]
        for path, text in zip(paths, texts, strict=True):
            path.write_text(text)
        return paths

    return write


def test_a_pair_of_kalibr(written):
    found = read_optics(written(KALIBR))
    assert [camera["fx_px"] for camera in found.cameras] == [461.6, 460.2]
    assert found.cameras[1]["distortion"] == [-0.26, 0.05, 0.0008, 0.0002, 0.0]
    assert found.second_from_first[:3, 3].tolist() == [-0.11, 0.0004, -0.0008]


ECHO = """\
header: {frame_id: camera}
height: 720
width: 1280
distortion_model: MODEL
d: COEFFICIENTS
k: [909.1, 0.0, 642.8, 0.0, 908.5, 365.9, 0.0, 0.0, 1.0]
p: [909.1, 0.0, 642.8, 0.0, 0.0, 908.5, 365.9, 0.0, 0.0, 0.0, 1.0, 0.0]
---
"""


def echo(model, lens):
    return ECHO.replace("MODEL", model).replace("COEFFICIENTS", str(lens))


SIDES = "image_width: 640\nimage_height: 480\n"
CAMELS = opencv(cameraMatrix=PAIR["M1"], distCoeffs=PAIR["D1"]) + SIDES
SHORT = [-0.25, 0.08, 0.0, 0.0, 0.0]
SINGLE = {
    "Kalibr": (KALIBR.split("cam1")[0], 752, 460.3, [-0.27, 0.06, 0.0008, 0.0003, 0.0]),
    "ROS": (ROS.format("0"), 640, 522.0, SHORT),
    "echoed": (echo("plumb_bob", [0.1, 0.2, 0, 0, 0.3]), 1280, 908.5, [0.1, 0.2, 0, 0, 0.3]),
    "echoed with eight": (echo("rational_polynomial", [0.1] * 8), 1280, 908.5, [0.1] * 8),
    "OpenCV's camels": (CAMELS, 640, 522.0, SHORT),
}


@pytest.mark.parametrize("kind", SINGLE)
def test_one_camera(written, kind):
    text, *expected = SINGLE[kind]
    found = read_optics(written(text))
    (camera,) = found.cameras
    assert [camera[name] for name in ("width_px", "fy_px", "distortion")] == expected
    assert found.second_from_first is None


def test_a_pair_of_ros_says_how_it_is_rectified(written):
    camera, baseline_m = read_optics(written(ROS.format("0"), ROS.format("-51.0"))).rectified
    assert baseline_m == pytest.approx(0.1)
    assert (camera["fx_px"], camera["cx_px"], any(camera["distortion"])) == (510.0, 320.0, False)


def test_a_pair_of_opencv_over_two_files(written):
    lenses = {name: PAIR[name] for name in ("M1", "D1", "M2", "D2")}
    place = {name: PAIR[name] for name in ("R", "T")}
    found = read_optics(written(opencv(**lenses), opencv(**place)), SIZE)
    assert found.cameras[1]["distortion"] == [0.1, 0.0, 0.0, 0.0, 0.0]
    assert np.array_equal(found.second_from_first[:3, 3], [-0.1, 0.0, 0.0])


BROKEN = "%YAML:1.0\n---\nM1: !!opencv-matrix\n   rows: [\n"
SIX = opencv(**PAIR | {"D1": (1, 6, [0.1] * 6)})
FISHEYE = ROS.format("0").replace("plumb_bob", "equidistant")
# What a file of Kalibr says instead, and what it should.
KALIBRS = [
    ("radtan", "equidistant", "cam0: distortion_model: expected radtan, found"),
    ("pinhole", "omni", "cam0: camera_model: expected pinhole, found omni"),
    ("-0.11]", "-110.0]", r"cam1: T_cn_cnm1: .*found a shift of 110 m \(metres\?\)"),
    ("[1.0, 0.0, 0.0, -", "[2.0, 0.0, 0.0, -", "T_cn_cnm1: expected a rotation and a shift, found"),
    ("intrinsics", "focal", "cam0: intrinsics: expected a value, found none"),
    ("[461.6, ", "[", "cam0: intrinsics: expected 4 finite numbers, found"),
    ("461.6", ".nan", "cam0: intrinsics: expected 4 finite numbers, found .nan"),
    ("461.6", "-461.6", "cam0: fx_px: expected a number >= 10, found -461.6"),
    ("T_cn_cnm1", "T_imu", "cam1: T_cn_cnm1: expected a value, found none"),
]


def without(name):
    return opencv(**{one: matrix for one, matrix in PAIR.items() if one != name})


@pytest.mark.parametrize(
    ("texts", "line", "size"),
    [
        *(([KALIBR.replace(old, new)], line, None) for old, new, line in KALIBRS),
        ([FISHEYE], "found equidistant with 5", None),
        ([f"binning_x: 2\n{ECHO}"], "0.yaml: roi, binning_x, binning_y: exp", None),
        (["a: 1\n"], "expected cam0 .Kalibr., camera_matrix", None),
        (["[1, 2]\n"], "expected cam0 .Kalibr., camera_matrix", None),
        ([opencv(**PAIR)], "image_width, image_height: expected the pictures' size", None),
        ([SIX], "D1: distortion: expected 4, 5, 8, 12 or 14 numbers, found 6", SIZE),
        ([without("T")], "T: expected a value, found none", SIZE),
        ([without("D2")], "D2: expected a value, found none", SIZE),
        ([opencv(Q=PAIR["M1"])], "expected camera_matrix or M1, found Q", SIZE),
        ([opencv(**PAIR)] * 2, "D1: expected in one file, found in both", SIZE),
        ([BROKEN], "0.yaml: file: expected plain YAML, found none .*copy or write it again", SIZE),
        ([opencv(**PAIR | {"M1": (3, 4, K)})], "M1: data: expected 3 x 4 numbers, found 9", SIZE),
        ([ROS.format("-51.0"), ROS.format("0")], "expected the right camera of a pair", SIZE),
        ([KALIBR, KALIBR], "expected one camchain.yaml, found another file", SIZE),
        ([CAMELS, KALIBR], "1.yaml: file: expected one of OpenCV", None),
    ],
)
def test_files_that_no_sensors_file_can_follow(written, texts, line, size):
    with pytest.raises(ValueError, match=line):
        read_optics(written(*texts), size)


@pytest.mark.parametrize("end", ["yml", "xml", "json"])
def test_what_opencv_itself_writes_whole_and_damaged(tmp_path, end):
    path = tmp_path / f"camera.{end}"
    storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_WRITE)
    for name, value in zip(("image_width", "image_height"), SIZE, strict=True):
        storage.write(name, value)
    storage.write("camera_matrix", np.reshape(K, (3, 3)))
    storage.write("distortion_coefficients", np.array(SHORT))
    storage.release()
    (camera,) = read_optics([path]).cameras
    assert (camera["width_px"], camera["fy_px"], camera["distortion"]) == (640, 522.0, SHORT)
    whole = path.read_bytes()
    damaged = [whole[:count] for count in range(0, whole.rindex(b"0"), 10)]
    damaged += [whole.replace(b"matrix", other) for other in (b"\0", b"\xff", b"<", b"]")]
    damaged += [whole.replace(b"522", b"5x2"), b'<a type_id="opencv-matrix">' * 50_000]
    for content in damaged:
        path.write_bytes(content)
        with pytest.raises(ValueError, match=r"camera\.\w+: \w+: .*expected .+, found ") as caught:
            read_optics([path])
        assert "\n" not in str(caught.value)


@pytest.mark.parametrize("end", ["yml", "xml", "json"])
@pytest.mark.parametrize(
    ("comment", "points", "line"),
    [
        (
            "caf\N{LATIN SMALL LETTER E WITH ACUTE}".encode("latin-1"),
            K,
            r"file: expected UTF-8, found other bytes \(save it",
        ),
        (b"", np.zeros((9, 1, 2)), r"camera_matrix: dt: expected .* one channel, found .* 2.*\("),
        (
            b" " * 1_000_000,
            K,
            r"file: expected {} of at most 1000000 bytes, found 1000\d+ \(leave out",
        ),
    ],
)
def test_files_that_opencv_alone_reads(tmp_path, end, comment, points, line):
    path = tmp_path / f"camera.{end}"
    storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_WRITE)
    storage.write("camera_matrix", np.array(points))
    storage.write("note", "here")
    storage.release()
    path.write_bytes(path.read_bytes().replace(b"here", b"here" + comment))
    named = line.format("XML" if end == "xml" else "YAML")
    with pytest.raises(ValueError, match=rf"camera\.{end}: {named}"):
        read_optics([path], SIZE)


def test_a_file_that_is_not_there():
    with pytest.raises(ValueError, match="nowhere.yaml: file: expected a file, found none"):
        read_optics([Path("nowhere.yaml")])
